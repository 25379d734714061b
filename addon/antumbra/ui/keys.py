# SPDX-License-Identifier: GPL-3.0-or-later
"""Esc cancels a running bake, as it cancels a render.

It belongs to the window's keymap, which comes last: what is being dragged, typed or chosen gets its Esc first. While no
bake runs the operator does not answer, and the key means what it always does. Users may change it in the preferences.
"""

from __future__ import annotations

from typing import Any

import bpy

from ..operators import ANTUMBRA_OT_cancel_bake

_items: list[tuple[Any, Any]] = []


def register() -> None:
    manager: Any = bpy.context.window_manager
    # In background mode there are no keys.
    keyconfig = manager.keyconfigs.addon if manager is not None else None
    if keyconfig is None:
        return
    keymap = keyconfig.keymaps.new(name="Window", space_type="EMPTY")
    _items.append((keymap, keymap.keymap_items.new(ANTUMBRA_OT_cancel_bake.bl_idname, "ESC", "PRESS")))


def unregister() -> None:
    while _items:
        keymap, item = _items.pop()
        keymap.keymap_items.remove(item)
