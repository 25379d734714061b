# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties > Render > Antumbra > View and Export: what one does with a bake once it is there."""

from __future__ import annotations

from typing import Any

import bpy

from ..bridge.properties import state_of
from ..bridge.surroundings import scene_of
from ..bridge.view_properties import view_of
from ..operators import ANTUMBRA_OT_make_export_ready


class _AfterBake:
    """Shown where there is a bake."""

    bl_space_type: Any = "PROPERTIES"
    bl_region_type: Any = "WINDOW"
    bl_context = "render"
    bl_parent_id = "ANTUMBRA_PT_bake"
    bl_options: Any = {"DEFAULT_CLOSED"}


class ANTUMBRA_PT_view(_AfterBake, bpy.types.Panel):
    """How bakes are looked at."""

    bl_label = "View"

    def draw(self, context: bpy.types.Context) -> None:
        layout: Any = self.layout
        view = view_of(scene_of(context))
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(view, "live_preview")
        column.prop(view, "overlay")
        column.separator()
        column.prop(view, "mode")
        if view.mode == "EXPOSED":
            column.prop(view, "exposure")
        elif view.mode == "FALSE_COLOURS":
            column.prop(view, "range_end")


class ANTUMBRA_PT_export(_AfterBake, bpy.types.Panel):
    """Bakes for other programs."""

    bl_label = "Export"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return any(state_of(obj).role in ("BAKED", "REPLACED") for obj in scene_of(context).objects)

    def draw(self, _context: bpy.types.Context) -> None:
        layout: Any = self.layout
        layout.operator_context = "EXEC_DEFAULT"
        layout.operator(ANTUMBRA_OT_make_export_ready.bl_idname, icon="EXPORT").encoding = "LINEAR"
        layout.operator(ANTUMBRA_OT_make_export_ready.bl_idname, text="For sRGB Vertex Colours").encoding = "SRGB"
        layout.label(text="Then File > Export > glTF")


CLASSES = (ANTUMBRA_PT_view, ANTUMBRA_PT_export)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
