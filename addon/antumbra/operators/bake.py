# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake, from a button as a job and from Python as one call."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as translated

from ..bridge import outcome, preflight, running
from ..bridge.host import new_bake
from ..bridge.properties import settings_of
from ..bridge.surroundings import scene_of
from ..core.errors import BakeError
from ..core.report import sentence, told_together

Result = set[Any]


class ANTUMBRA_OT_bake(bpy.types.Operator):
    """Compute the light on the chosen objects, refine their meshes where it changes, and store it as vertex colours"""

    bl_idname = "antumbra.bake"
    bl_label = "Bake Radiosity"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if running.is_running():
            cls.poll_message_set("A bake is running")
            return False
        return context.scene is not None

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event | None) -> Result:
        if bpy.app.background:
            return self.execute(context)
        window = context.window
        if window is not None:
            # Reading a large scene takes as long as a render takes to begin.
            window.cursor_set("WAIT")
        try:
            scene = scene_of(context)
            running.start(new_bake(settings_of(scene)), scene)
        except BakeError as error:
            return _refuse(self, error)
        finally:
            if window is not None:
                window.cursor_set("DEFAULT")
        # Handled, but nothing is done yet: the undo step belongs to the operator that writes the result.
        return {"INTERFACE"}

    def execute(self, context: bpy.types.Context) -> Result:
        try:
            bake = new_bake(settings_of(scene_of(context)))
            bake.begin()
            bake.wait()
            report = bake.finish()
        except BakeError as error:
            return _refuse(self, error)
        return _finish(self, report)


class ANTUMBRA_OT_finish_bake(bpy.types.Operator):
    """Write the light that was computed into the scene"""

    bl_idname = "antumbra.finish_bake"
    bl_label = "Bake Radiosity"
    bl_options = {"UNDO", "INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return running.is_running()

    def execute(self, context: bpy.types.Context) -> Result:
        try:
            report = running.take().finish()
        except BakeError as error:
            return _refuse(self, error)
        return _finish(self, report)


class ANTUMBRA_OT_stop_bake(bpy.types.Operator):
    """Stop refining and keep the light found so far"""

    bl_idname = "antumbra.stop_bake"
    bl_label = "Stop and Keep"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return running.is_running()

    def execute(self, context: bpy.types.Context) -> Result:
        running.request_stop()
        return {"FINISHED"}


class ANTUMBRA_OT_cancel_bake(bpy.types.Operator):
    """Cancel the bake and change nothing"""

    bl_idname = "antumbra.cancel_bake"
    bl_label = "Cancel Bake"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return running.is_running()

    def execute(self, context: bpy.types.Context) -> Result:
        running.request_cancel()
        return {"FINISHED"}


def _refuse(operator: bpy.types.Operator, error: BakeError) -> Result:
    message = sentence(str(error))
    outcome.note_outcome("CANCEL", [message])
    operator.report({"ERROR"}, message)
    return {"CANCELLED"}


def _finish(operator: bpy.types.Operator, report: dict[str, Any]) -> Result:
    for warning in told_together(report["warnings"]):
        operator.report({"WARNING"}, sentence(warning))
    outcome.note_report(report)
    preflight.forget_errors()
    operator.report({"INFO"}, translated("Baked {}").format(outcome.lines_of(report)[0]))
    return {"FINISHED"}
