# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets Blender draw anew what shows a bake."""

from __future__ import annotations

from .surroundings import windows


def redraw() -> None:
    """Let the panel and the status bar draw anew."""
    for window in windows():
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()
        # The status bar belongs to no screen; this is what makes it draw.
        window.workspace.status_text_set(None)


def redraw_viewports() -> None:
    """Let all viewports draw anew."""
    for window in windows():
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
