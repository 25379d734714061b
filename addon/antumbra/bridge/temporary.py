# SPDX-License-Identifier: GPL-3.0-or-later
"""Datablocks that are there for a moment: marked, so that undo and files cannot bring them back for good.

Whoever makes one removes it. But if the user does something meanwhile, Blender remembers the file with it, and undoing
that, or opening what was saved then, makes it again. Such leftovers are removed.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy
from bpy.app.handlers import persistent

_MARK = "antumbra_temporary"


def marked(datablock: Any) -> Any:
    """The same datablock, to be removed wherever it turns up again."""
    datablock[_MARK] = True
    return datablock


def remove(datablocks: Iterable[Any]) -> None:
    """Delete those that are still there."""
    there = [each for each in datablocks if is_there(each)]
    for scene in [each for each in there if isinstance(each, bpy.types.Scene)]:
        there.remove(scene)
        bpy.data.scenes.remove(scene)
    bpy.data.batch_remove(there)


def is_there(datablock: Any) -> bool:
    """Whether Blender still has it."""
    try:
        return bool(datablock.name_full)
    except ReferenceError:
        return False


@persistent  # type: ignore[untyped-decorator]
def remove_leftovers(*_args: object) -> None:
    """Delete whatever is marked. Only to be called while nobody uses any."""
    data = bpy.data
    kinds = (data.scenes, data.objects, data.meshes, data.cameras, data.materials, data.node_groups)
    for collection in kinds:
        each: Any = collection
        left = [datablock for datablock in each if _MARK in datablock.keys()]
        for datablock in left:
            each.remove(datablock)


_AFTER = ("undo_post", "redo_post", "load_post")


def register() -> None:
    for name in _AFTER:
        getattr(bpy.app.handlers, name).append(remove_leftovers)


def unregister() -> None:
    for name in _AFTER:
        getattr(bpy.app.handlers, name).remove(remove_leftovers)
