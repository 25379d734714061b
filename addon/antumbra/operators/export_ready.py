# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes made ready for other programs."""
# mypy: disable-error-code="valid-type"

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import EnumProperty

from ..bridge import running
from ..bridge.gltf import make_export_ready
from ..bridge.scene_read import check_mode
from ..bridge.surroundings import scene_of
from ..core.errors import InputError


class ANTUMBRA_OT_make_export_ready(bpy.types.Operator):
    """Give every bake an unlit material that shows its light from 0 to 1, which glTF exports right"""

    bl_idname = "antumbra.make_export_ready"
    bl_label = "Make Export-Ready"
    bl_options = {"REGISTER", "UNDO"}

    encoding: EnumProperty(
        name="Encoding",
        items=[
            ("LINEAR", "Linear", "As glTF wants vertex colours: three.js, Unity, Godot's Forward+ and most others"),
            ("SRGB", "sRGB", "For programs that show vertex colours as they are stored, as Godot's Compatibility does"),
        ],
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        kind = {"LINEAR": "linear, as glTF wants them", "SRGB": "encoded as sRGB"}[properties.encoding]
        return (
            f"Give every bake an unlit material with its light as vertex colours from 0 to 1, {kind}. The number that "
            "all light was divided by is kept as antumbra_scale, and light without limit as the attribute _RADIOSITY. "
            "The window of File > Export > glTF is set to write these, of visible objects. "
            "Remove Bake or Ctrl Z takes it back"
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene is not None and not running.is_running()

    def execute(self, context: bpy.types.Context) -> set[Any]:
        try:
            check_mode(context)
            scale = make_export_ready(scene_of(context), self.encoding)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"Ready for export: light was divided by {scale:.4g}")
        return {"FINISHED"}
