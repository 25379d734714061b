# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings by what the bake is for."""
# mypy: disable-error-code="valid-type"

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import EnumProperty

from ..bridge.properties import settings_of
from ..bridge.surroundings import scene_of
from ..core.presets import PRESETS, apply_preset


class ANTUMBRA_OT_preset(bpy.types.Operator):
    """Set tolerance, triangle budget and the way colours are stored"""

    bl_idname = "antumbra.preset"
    bl_label = "Antumbra Preset"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    preset: EnumProperty(
        name="Preset", items=[(name, preset.label, preset.description) for name, preset in PRESETS.items()]
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        return PRESETS[properties.preset].description

    def execute(self, context: bpy.types.Context) -> set[Any]:
        scene: Any = scene_of(context)
        before = settings_of(scene)
        for name, value in apply_preset(before, self.preset).as_dict().items():
            if getattr(before, name) != value:
                setattr(scene.antumbra, name, value)
        return {"FINISHED"}
