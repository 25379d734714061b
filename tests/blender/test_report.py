# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel says and shows of the last bake."""

import webbrowser
from pathlib import Path
from urllib.parse import urlparse
from urllib.request import url2pathname

import bpy
import pytest
from extension import module
from scenes import add_area_light, add_cube, add_plane


class _Browser(webbrowser.BaseBrowser):
    """Keeps what it is to show."""

    def __init__(self):
        super().__init__("kept")
        self.shown = []

    def open(self, url, new=0, autoraise=True):
        self.shown.append(url)
        return True


@pytest.fixture
def baked():
    """A scene that was just baked."""
    add_plane(size=6.0)
    add_cube().location = (0, 0, 1.5)
    add_area_light(location=(0, 0, 4))
    bpy.context.scene.antumbra.receivers = "ALL"
    bpy.context.scene.antumbra.tolerance = 0.1
    assert bpy.ops.antumbra.bake("EXEC_DEFAULT") == {"FINISHED"}


def test_the_report_is_shown_in_the_browser(baked, monkeypatch):
    browser = _Browser()
    monkeypatch.setattr(webbrowser, "_tryorder", ["kept"])
    monkeypatch.setitem(webbrowser._browsers, "kept", [None, browser])
    assert bpy.ops.antumbra.show_report() == {"FINISHED"}
    (url,) = browser.shown
    page = Path(url2pathname(urlparse(url).path)).read_text(encoding="utf-8")
    assert "verified error" in page
    assert "<svg" in page


def test_the_panel_tells_the_verified_error(baked):
    lines = module("bridge.outcome").last_outcome.lines
    assert any(line.startswith("Verified error") for line in lines)


def test_nothing_is_verified_where_that_is_not_wanted():
    add_plane(size=6.0)
    add_area_light(location=(0, 0, 4))
    bpy.context.scene.antumbra.receivers = "ALL"
    bpy.context.scene.antumbra.verify_points = 0
    assert bpy.ops.antumbra.bake("EXEC_DEFAULT") == {"FINISHED"}
    lines = module("bridge.outcome").last_outcome.lines
    assert not any("erified" in line for line in lines)
