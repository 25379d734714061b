# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties > Render > Antumbra, for every render engine."""

from __future__ import annotations

import textwrap
from typing import Any

import bpy

from ..bridge import running
from ..bridge.properties import state_of
from ..bridge.surroundings import scene_of
from ..operators import ANTUMBRA_OT_bake, ANTUMBRA_OT_remove_bake, ANTUMBRA_OT_show_report
from .status_bar import draw_progress

# Average width of a letter of Blender's interface font at scale 1, in pixels; a little large, so nothing is cut off.
_LETTER_WIDTH = 6.5


class _RenderPanel:
    """Where all of them are."""

    bl_space_type: Any = "PROPERTIES"
    bl_region_type: Any = "WINDOW"
    bl_context = "render"


class ANTUMBRA_PT_bake(_RenderPanel, bpy.types.Panel):
    """The settings that matter most, and the button."""

    bl_label = "Antumbra Radiosity"

    def draw(self, context: bpy.types.Context) -> None:
        layout: Any = self.layout
        settings = _settings(context)
        if running.is_running():
            draw_progress(layout.row(align=True))
        else:
            layout.operator(ANTUMBRA_OT_bake.bl_idname, icon="LIGHT_AREA")
            _draw_outcome(layout, context)
            if running.last_report is not None:
                layout.operator(ANTUMBRA_OT_show_report.bl_idname, icon="TEXT")
        column = _property_column(layout)
        column.prop(settings, "receivers")
        column.prop(settings, "output")
        column.prop(settings, "quantity")
        column.prop(settings, "metals")
        column.separator()
        column.prop(settings, "method")
        column.prop(settings, "tolerance")
        if any(state_of(obj).role != "NONE" for obj in scene_of(context).objects):
            layout.operator(ANTUMBRA_OT_remove_bake.bl_idname, icon="TRASH")


class ANTUMBRA_PT_mesh(_RenderPanel, bpy.types.Panel):
    """How fine the mesh may become."""

    bl_label = "Mesh"
    bl_parent_id = "ANTUMBRA_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column = _property_column(self.layout)
        settings = _settings(context)
        column.prop(settings, "element_size")
        column.prop(settings, "max_level")
        column.prop(settings, "max_blockers")
        column.prop(settings, "transport")


class ANTUMBRA_PT_attributes(_RenderPanel, bpy.types.Panel):
    """What is stored, and how."""

    bl_label = "Colour Attributes"
    bl_parent_id = "ANTUMBRA_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column = _property_column(self.layout)
        settings = _settings(context)
        column.prop(settings, "layers")
        column.prop(settings, "data_type")
        column.prop(settings, "domain")


class ANTUMBRA_PT_limits(_RenderPanel, bpy.types.Panel):
    """When to stop at the latest."""

    bl_label = "Limits"
    bl_parent_id = "ANTUMBRA_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column = _property_column(self.layout)
        settings = _settings(context)
        column.prop(settings, "time_limit")
        column.prop(settings, "triangle_budget")
        column.prop(settings, "verify_points")


CLASSES = (ANTUMBRA_PT_bake, ANTUMBRA_PT_attributes, ANTUMBRA_PT_mesh, ANTUMBRA_PT_limits)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)


def _settings(context: bpy.types.Context) -> Any:
    scene: Any = scene_of(context)
    return scene.antumbra


def _property_column(layout: Any) -> Any:
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    return column


def _draw_outcome(layout: Any, context: bpy.types.Context) -> None:
    outcome = running.last_outcome
    if outcome is None:
        return
    preferences: Any = context.preferences
    region: Any = context.region
    letters = max(20, int(region.width / (_LETTER_WIDTH * preferences.system.ui_scale)) - 7)
    column = layout.column(align=True)
    icon = outcome.icon
    for line in outcome.lines:
        for piece in textwrap.wrap(line, letters):
            column.label(text=piece, icon=icon)
            icon = "BLANK1"
