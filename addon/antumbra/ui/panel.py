# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties > Render > Antumbra, for every render engine."""

from __future__ import annotations

import textwrap
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as translated

from ..bridge import outcome, preflight, running
from ..bridge.properties import settings_of, state_of
from ..bridge.surroundings import scene_of
from ..bridge.view_properties import view_of
from ..core.preflight import estimate_texts
from ..core.presets import PRESETS, preset_of
from ..core.report import sentence
from ..operators import (
    ANTUMBRA_OT_bake,
    ANTUMBRA_OT_check_scene,
    ANTUMBRA_OT_preset,
    ANTUMBRA_OT_remove_bake,
    ANTUMBRA_OT_select_finding,
    ANTUMBRA_OT_show_light,
    ANTUMBRA_OT_show_report,
)
from .status_bar import draw_progress

# Average width of a letter of Blender's interface font at scale 1, in pixels; a little large, so nothing is cut off.
_LETTER_WIDTH = 6.5

# What is told of a bake in the panel: triangles, error and the first warnings. All of them would push the buttons off
# the screen, and the report has them.
_MOST_LINES = 5


class _RenderPanel:
    """Where all of them are."""

    bl_space_type: Any = "PROPERTIES"
    bl_region_type: Any = "WINDOW"
    bl_context = "render"


class ANTUMBRA_PT_bake(_RenderPanel, bpy.types.Panel):
    """The button, and what one sets each time."""

    bl_label = "Antumbra Radiosity"

    def draw(self, context: bpy.types.Context) -> None:
        layout: Any = self.layout
        settings = _settings(context)
        if running.is_running():
            draw_progress(layout.row(align=True))
            if running.waiting_for():
                # The bar is too narrow for a whole sentence
                _draw_text(layout.column(align=True), context, translated(running.waiting_for()), "INFO")
        else:
            layout.operator(ANTUMBRA_OT_bake.bl_idname, icon="LIGHT_AREA")
            _draw_outcome(layout, context)
            if outcome.last_report is not None:
                row = layout.row(align=True)
                row.operator(ANTUMBRA_OT_show_report.bl_idname, icon="TEXT")
                row.prop(view_of(scene_of(context)), "error_curve", icon="FCURVE", toggle=True)
        if any(state_of(obj).role != "NONE" for obj in scene_of(context).objects):
            # Without it a viewport shows nothing of the light, and a new user believes that nothing happened
            layout.operator(ANTUMBRA_OT_show_light.bl_idname, icon="SHADING_SOLID")
            layout.operator(ANTUMBRA_OT_remove_bake.bl_idname, icon="TRASH")
        column = _property_column(layout)
        column.prop(settings, "receivers")
        preset = preset_of(settings_of(scene_of(context)))
        row = column.split(factor=0.4)
        row.alignment = "RIGHT"
        row.label(text="Preset")
        label = "Custom" if preset is None else PRESETS[preset].label
        row.operator_menu_enum(ANTUMBRA_OT_preset.bl_idname, "preset", text=label)


class ANTUMBRA_PT_check(_RenderPanel, bpy.types.Panel):
    """What would go wrong, and what it would take."""

    bl_label = "Before the Bake"
    bl_parent_id = "ANTUMBRA_PT_bake"

    def draw(self, context: bpy.types.Context) -> None:
        layout: Any = self.layout
        layout.operator(ANTUMBRA_OT_check_scene.bl_idname, icon="VIEWZOOM")
        found = preflight.last_of(scene_of(context))
        if found is None:
            return
        if not found.findings:
            layout.label(text="Nothing stands in the way", icon="CHECKMARK")
        for index, finding in enumerate(found.findings):
            icon = {"ERROR": "CANCEL", "WARNING": "ERROR"}.get(finding.level, "INFO")
            row = layout.row(align=True)
            _draw_text(row.column(align=True), context, sentence(finding.text), icon, margin=5)
            if finding.objects:
                operator = row.operator(
                    ANTUMBRA_OT_select_finding.bl_idname, text="", icon="RESTRICT_SELECT_OFF", emboss=False
                )
                operator.finding = index
        if found.estimate is not None:
            column = layout.column(align=True)
            for text, icon in zip(
                estimate_texts(found.estimate, translated), ("MESH_DATA", "TIME", "MEMORY"), strict=True
            ):
                column.label(text=text, icon=icon, translate=False)


class ANTUMBRA_PT_quality(_RenderPanel, bpy.types.Panel):
    """How exact the light is, and how large the mesh may become."""

    bl_label = "Quality"
    bl_parent_id = "ANTUMBRA_PT_bake"

    def draw(self, context: bpy.types.Context) -> None:
        column = _property_column(self.layout)
        settings = _settings(context)
        column.prop(settings, "tolerance")
        column.prop(settings, "triangle_budget")
        column.prop(settings, "time_limit")


class ANTUMBRA_PT_output(_RenderPanel, bpy.types.Panel):
    """Where the light goes, and how it is stored."""

    bl_label = "Output"
    bl_parent_id = "ANTUMBRA_PT_bake"

    def draw(self, context: bpy.types.Context) -> None:
        column = _property_column(self.layout)
        settings = _settings(context)
        column.prop(settings, "output")
        column.prop(settings, "quantity")
        column.separator()
        column.prop(settings, "layers")
        column.prop(settings, "data_type")
        column.prop(settings, "domain")
        column.prop(settings, "colour_steps")


class ANTUMBRA_PT_advanced(_RenderPanel, bpy.types.Panel):
    """What hardly anybody needs."""

    bl_label = "Advanced"
    bl_parent_id = "ANTUMBRA_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column = _property_column(self.layout)
        settings = _settings(context)
        column.prop(settings, "metals")
        column.prop(settings, "method")
        column.prop(settings, "transport")
        column.separator()
        column.prop(settings, "element_size")
        column.prop(settings, "max_level")
        column.prop(settings, "max_blockers")
        column.prop(settings, "verify_points")


CLASSES = (ANTUMBRA_PT_bake, ANTUMBRA_PT_check, ANTUMBRA_PT_quality, ANTUMBRA_PT_output, ANTUMBRA_PT_advanced)


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
    ended = outcome.last_outcome
    if ended is None:
        return
    column = layout.column(align=True)
    icon = ended.icon
    lines = ended.lines
    for line in lines[:_MOST_LINES]:
        _draw_text(column, context, line, icon)
        icon = "BLANK1"
    if len(lines) > _MOST_LINES:
        more = translated("{} more in the report").format(len(lines) - _MOST_LINES)
        column.label(text=more, icon="BLANK1", translate=False)


def _draw_text(column: Any, context: bpy.types.Context, text: str, icon: str, margin: int = 0) -> None:
    """A sentence in as many lines as the panel's width needs, with this many letters' room left beside it."""
    preferences: Any = context.preferences
    region: Any = context.region
    letters = max(16, int(region.width / (_LETTER_WIDTH * preferences.system.ui_scale)) - 7 - margin)
    for piece in textwrap.wrap(text, letters):
        column.label(text=piece, icon=icon, translate=False)
        icon = "BLANK1"
