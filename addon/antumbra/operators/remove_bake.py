# SPDX-License-Identifier: GPL-3.0-or-later
"""The way back from a bake."""

from __future__ import annotations

from typing import Any

import bpy

from ..bridge import running
from ..bridge.properties import state_of
from ..bridge.scene_read import check_mode
from ..bridge.scene_write import remove_bakes
from ..bridge.surroundings import scene_of
from ..core.errors import InputError


class ANTUMBRA_OT_remove_bake(bpy.types.Operator):
    """Delete the baked objects of this scene and bring the originals back as they were"""

    bl_idname = "antumbra.remove_bake"
    bl_label = "Remove Bake"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if running.is_running():
            cls.poll_message_set("A bake is running")
            return False
        return context.scene is not None

    def execute(self, context: bpy.types.Context) -> set[Any]:
        try:
            check_mode(context)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if all(state_of(obj).role == "NONE" for obj in scene_of(context).objects):
            self.report({"WARNING"}, "This scene holds no bake")
            return {"CANCELLED"}
        remove_bakes(context)
        return {"FINISHED"}
