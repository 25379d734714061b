# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects as they were before earlier bakes: brought back for a reading, or for good."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np

from .properties import state_of

SCALE_PROPERTY = "antumbra_scale"
ENCODING_PROPERTY = "antumbra_encoding"
"""Custom properties of objects whose bake was made ready for export; they go with it."""

Flags = tuple[bool, bool]
"""(hide_viewport, hide_render)"""


@contextmanager
def originals_shown(scene: bpy.types.Scene) -> Iterator[None]:
    """Within this block every source shows its original mesh and hide flags; afterwards all is as before."""
    hidden = [obj for obj in scene.objects if state_of(obj).role == "HIDDEN"]
    replaced = [obj for obj in scene.objects if state_of(obj).role == "REPLACED"]
    flags_before: dict[bpy.types.Object, Flags] = {obj: (obj.hide_viewport, obj.hide_render) for obj in hidden}
    baked_before = [(obj, obj.data, _modifier_flags(obj)) for obj in replaced]
    try:
        set_hide_flags({obj: remembered_flags(obj) for obj in hidden})
        for obj in replaced:
            _show_original_mesh(obj)
        yield
    finally:
        set_hide_flags(flags_before)
        for obj, mesh, modifier_flags in baked_before:
            obj.data = mesh
            _set_modifier_flags(obj, modifier_flags)


def remembered_flags(obj: bpy.types.Object) -> Flags:
    """The hide flags of a source before it was baked."""
    state = state_of(obj)
    return state.hide_viewport, state.hide_render


def hide_source(obj: bpy.types.Object) -> None:
    """Remember that the object gets hidden, and how it was; set_hide_flags() does it, for all objects at once."""
    state = state_of(obj)
    if state.role != "HIDDEN":
        state.hide_viewport, state.hide_render = obj.hide_viewport, obj.hide_render
        state.role = "HIDDEN"


def replace_mesh(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> None:
    """Show a baked mesh in the place of the object's own, whose modifiers are in the bake already."""
    state = state_of(obj)
    if state.role == "REPLACED":
        restore_sources([obj])
    state.original_mesh = obj.data
    state.modifiers.clear()
    for show_viewport, show_render in _modifier_flags(obj):
        remembered = state.modifiers.add()
        remembered.show_viewport, remembered.show_render = show_viewport, show_render
    _set_modifier_flags(obj, [(False, False)] * len(obj.modifiers))
    obj.data = mesh
    state.role = "REPLACED"


def restore_sources(objects: Iterable[bpy.types.Object]) -> None:
    """Give sources back their own mesh, modifiers and hide flags, and forget the bake."""
    flags: dict[bpy.types.Object, Flags] = {}
    baked = []
    for obj in objects:
        role = state_of(obj).role
        if role == "HIDDEN":
            flags[obj] = remembered_flags(obj)
        elif role == "REPLACED":
            baked.append(obj.data)
            _show_original_mesh(obj)
        obj.property_unset("antumbra")
        for name in (SCALE_PROPERTY, ENCODING_PROPERTY):
            if name in obj.keys():
                del obj[name]
    set_hide_flags(flags)
    _remove_unused(baked)


def set_hide_flags(flags: dict[bpy.types.Object, Flags]) -> None:
    """Set hide flags of many objects.

    Setting one flag makes Blender go through all objects of the file, which is quadratic for many; foreach_set does
    not, and one flag set in the ordinary way then brings everything up to date.
    """
    if not flags:
        return
    every_object: Any = bpy.data.objects
    index_by_uid = {obj.session_uid: index for index, obj in enumerate(every_object)}
    for column, name in enumerate(("hide_viewport", "hide_render")):
        values = np.empty(len(every_object), dtype=np.bool_)
        every_object.foreach_get(name, values)
        for obj, pair in flags.items():
            values[index_by_uid[obj.session_uid]] = pair[column]
        every_object.foreach_set(name, values)
    for obj, (hide_viewport, hide_render) in flags.items():
        obj.hide_viewport, obj.hide_render = hide_viewport, hide_render
        break


def remove_baked_objects(objects: Iterable[bpy.types.Object]) -> None:
    """Delete objects that a bake made, with their meshes."""
    doomed = list(objects)
    meshes = {obj.data for obj in doomed if obj.data is not None and obj.data.users == 1}
    # One call for all, four times as fast as one by one. Blender's own time still grows with the square: 0.5 s for
    # 2,500 objects, 13 s for 10,000, also when the objects are in no collection any more, have given up their meshes or
    # point at no source.
    bpy.data.batch_remove(doomed)
    bpy.data.batch_remove(list(meshes))


def _remove_unused(meshes: Iterable[Any]) -> None:
    # All at once: each removal on its own goes through the whole file, which took two minutes for 10,000.
    bpy.data.batch_remove({mesh for mesh in meshes if mesh is not None and mesh.users == 0})


def _show_original_mesh(obj: bpy.types.Object) -> None:
    state = state_of(obj)
    # Somebody may have purged it by hand.
    if state.original_mesh is not None:
        obj.data = state.original_mesh
    _set_modifier_flags(obj, [(item.show_viewport, item.show_render) for item in state.modifiers])


def _modifier_flags(obj: bpy.types.Object) -> list[Flags]:
    return [(modifier.show_viewport, modifier.show_render) for modifier in obj.modifiers]


def _set_modifier_flags(obj: bpy.types.Object, flags: list[Flags]) -> None:
    # A modifier that was added after the bake has no memory and stays as it is.
    for modifier, (show_viewport, show_render) in zip(obj.modifiers, flags, strict=False):
        modifier.show_viewport, modifier.show_render = show_viewport, show_render
