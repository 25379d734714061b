# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender is showing: context members that only a Blender in the middle of starting or ending lacks."""

from __future__ import annotations

import bpy

from ..core.errors import InputError


def scene_of(context: bpy.types.Context) -> bpy.types.Scene:
    if context.scene is None:
        raise InputError("there is no scene")
    return context.scene


def view_layer_of(context: bpy.types.Context) -> bpy.types.ViewLayer:
    if context.view_layer is None:
        raise InputError("there is no view layer")
    return context.view_layer


def windows() -> list[bpy.types.Window]:
    """Every open window; none in background mode."""
    manager = bpy.context.window_manager
    return [] if manager is None else list(manager.windows)
