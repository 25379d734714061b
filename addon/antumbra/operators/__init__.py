# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: they gather, start and report."""

from __future__ import annotations

import bpy

from .bake import ANTUMBRA_OT_bake, ANTUMBRA_OT_cancel_bake, ANTUMBRA_OT_finish_bake, ANTUMBRA_OT_stop_bake
from .export_ready import ANTUMBRA_OT_make_export_ready
from .preflight import ANTUMBRA_OT_check_scene, ANTUMBRA_OT_select_finding
from .preset import ANTUMBRA_OT_preset
from .remove_bake import ANTUMBRA_OT_remove_bake
from .show_light import ANTUMBRA_OT_show_light
from .show_report import ANTUMBRA_OT_show_report

__all__ = [
    "ANTUMBRA_OT_bake",
    "ANTUMBRA_OT_cancel_bake",
    "ANTUMBRA_OT_check_scene",
    "ANTUMBRA_OT_finish_bake",
    "ANTUMBRA_OT_make_export_ready",
    "ANTUMBRA_OT_preset",
    "ANTUMBRA_OT_remove_bake",
    "ANTUMBRA_OT_select_finding",
    "ANTUMBRA_OT_show_light",
    "ANTUMBRA_OT_show_report",
    "ANTUMBRA_OT_stop_bake",
]

CLASSES = (
    ANTUMBRA_OT_bake,
    ANTUMBRA_OT_finish_bake,
    ANTUMBRA_OT_stop_bake,
    ANTUMBRA_OT_cancel_bake,
    ANTUMBRA_OT_remove_bake,
    ANTUMBRA_OT_preset,
    ANTUMBRA_OT_check_scene,
    ANTUMBRA_OT_select_finding,
    ANTUMBRA_OT_show_light,
    ANTUMBRA_OT_make_export_ready,
    ANTUMBRA_OT_show_report,
)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
