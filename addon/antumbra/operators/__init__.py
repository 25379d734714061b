# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: they gather, start and report."""

from __future__ import annotations

import bpy

from .bake import ANTUMBRA_OT_bake, ANTUMBRA_OT_cancel_bake, ANTUMBRA_OT_finish_bake, ANTUMBRA_OT_stop_bake
from .remove_bake import ANTUMBRA_OT_remove_bake
from .show_report import ANTUMBRA_OT_show_report

__all__ = [
    "ANTUMBRA_OT_bake",
    "ANTUMBRA_OT_cancel_bake",
    "ANTUMBRA_OT_finish_bake",
    "ANTUMBRA_OT_remove_bake",
    "ANTUMBRA_OT_show_report",
    "ANTUMBRA_OT_stop_bake",
]

CLASSES = (
    ANTUMBRA_OT_bake,
    ANTUMBRA_OT_finish_bake,
    ANTUMBRA_OT_stop_bake,
    ANTUMBRA_OT_cancel_bake,
    ANTUMBRA_OT_remove_bake,
    ANTUMBRA_OT_show_report,
)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
