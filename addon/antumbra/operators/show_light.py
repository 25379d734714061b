# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewport set so that baked light is seen as it is."""

from __future__ import annotations

from typing import Any

import bpy

from ..bridge.surroundings import windows


class ANTUMBRA_OT_show_light(bpy.types.Operator):
    """Set the 3D viewports of this window to Solid shading with flat attribute colours: baked light as it is"""

    bl_idname = "antumbra.show_light"
    bl_label = "Show in Viewport"
    bl_options = {"REGISTER", "INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[Any]:
        screens = [context.screen] if context.screen is not None else [window.screen for window in windows()]
        for area in (area for screen in screens for area in screen.areas if area.type == "VIEW_3D"):
            space: Any = area.spaces.active
            space.shading.type = "SOLID"
            space.shading.light = "FLAT"
            space.shading.color_type = "VERTEX"
        return {"FINISHED"}
