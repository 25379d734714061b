# SPDX-License-Identifier: GPL-3.0-or-later
"""The entries in the 3D viewport's Object menu."""

from __future__ import annotations

from typing import Any

import bpy

from ..operators import ANTUMBRA_OT_bake, ANTUMBRA_OT_remove_bake


def _draw(menu: Any, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.operator(ANTUMBRA_OT_bake.bl_idname, icon="LIGHT_AREA")
    menu.layout.operator(ANTUMBRA_OT_remove_bake.bl_idname)


def register() -> None:
    bpy.types.VIEW3D_MT_object.append(_draw)  # type: ignore[arg-type]


def unregister() -> None:
    bpy.types.VIEW3D_MT_object.remove(_draw)  # type: ignore[arg-type]
