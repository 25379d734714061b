# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the installed extension, inside Blender or the bpy module."""

import bpy
import pytest

EXTENSION = "bl_ext.user_default.antumbra"


@pytest.fixture(scope="session", autouse=True)
def _extension():
    """What is tested is the zip that was installed, never the source tree."""
    if EXTENSION not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=EXTENSION)


@pytest.fixture(autouse=True)
def scene():
    """An empty file for every test."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy.context.scene
