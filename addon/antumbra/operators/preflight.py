# SPDX-License-Identifier: GPL-3.0-or-later
"""Look at the scene before a bake, and select what was found."""
# mypy: disable-error-code="valid-type"

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import IntProperty

from ..bridge import preflight, running
from ..bridge.properties import settings_of
from ..bridge.surroundings import scene_of, view_layer_of


class ANTUMBRA_OT_check_scene(bpy.types.Operator):
    """List what would go wrong in a bake, and estimate its triangles, time and memory. Nothing is changed"""

    bl_idname = "antumbra.check_scene"
    bl_label = "Check Scene"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene is not None and not running.is_running()

    def execute(self, context: bpy.types.Context) -> set[Any]:
        found = preflight.look(context, settings_of(scene_of(context)))
        worst = [finding for finding in found.findings if finding.level == "ERROR"]
        if worst:
            self.report({"WARNING"}, worst[0].text)
        return {"FINISHED"}


class ANTUMBRA_OT_select_finding(bpy.types.Operator):
    """Select the objects that this is about"""

    bl_idname = "antumbra.select_finding"
    bl_label = "Select"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    finding: IntProperty(min=0)

    def execute(self, context: bpy.types.Context) -> set[Any]:
        found = preflight.last_of(scene_of(context))
        if found is None or self.finding >= len(found.findings) or context.mode != "OBJECT":
            return {"CANCELLED"}
        uids = found.findings[self.finding].objects
        view_layer = view_layer_of(context)
        there = [obj for obj in view_layer.objects if obj.session_uid in uids and not obj.hide_select]
        shown = [obj for obj in there if obj.visible_get(view_layer=view_layer)]
        if not shown:
            self.report({"WARNING"}, "It is hidden in the viewport" if there else "It is not in this view layer")
            return {"CANCELLED"}
        for obj in list(view_layer.objects.selected):
            obj.select_set(False, view_layer=view_layer)
        for obj in shown:
            obj.select_set(True, view_layer=view_layer)
        view_layer.objects.active = shown[0]
        return {"FINISHED"}
