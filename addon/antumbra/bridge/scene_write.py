# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked meshes into the scene, as new objects or in the place of the originals, and out of it again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..core.bake import Solution
from ..core.carry import BakedMesh
from ..core.colours import storage_losses
from ..core.errors import InputError
from ..core.pieces import GO_ON, Pieces, at_once
from ..core.record import ObjectRecord, SceneRecord, name_list
from ..core.settings import Settings
from .mesh_write import writing_mesh
from .originals import (
    hide_source,
    remove_baked_objects,
    replace_mesh,
    restore_sources,
    set_hide_flags,
)
from .properties import state_of
from .surroundings import scene_of, view_layer_of
from .view import IRRADIANCE, show

COLLECTION = "Antumbra"
SOURCE_PROPERTY = "antumbra_source"

# A matrix that Blender's location, rotation and scale give back to within this is kept; beyond, it holds a shear,
# which they cannot express. f32 products of rotation and scale are off by about 1e-7; shear smaller than 1e-5 moves
# nothing one could see.
_SHEAR_TOLERANCE = 1e-5


def write_solution(
    context: bpy.types.Context,
    scene_record: SceneRecord,
    solution: Solution,
    settings: Settings,
    prepared: PreparedMeshes | None = None,
) -> list[str]:
    """Write every baked mesh; returns warnings."""
    return _Writer(context, settings, prepared or PreparedMeshes()).write(scene_record, solution)


def remove_bakes(context: bpy.types.Context, owners: set[bpy.types.Object] | None = None) -> int:
    """Take back the bakes of these sources, or of the whole scene; returns how many objects that touched."""
    scene = scene_of(context)
    baked, sources = [], []
    for obj in scene.objects:
        state = state_of(obj)
        if state.role == "BAKED" and (owners is None or state.source in owners):
            baked.append(obj)
        elif state.role in ("HIDDEN", "REPLACED") and (owners is None or obj in owners):
            sources.append(obj)
    # What was selected as a bake goes on as its source
    view_layer = view_layer_of(context)
    active = view_layer.objects.active
    active_source = state_of(active).source if active in baked else None
    select = [state_of(obj).source for obj in baked if obj.select_get(view_layer=view_layer)]

    count = len(baked) + len(sources)
    remove_baked_objects(baked)
    restore_sources(sources)
    _remove_empty_collection(scene)
    in_view = set(view_layer.objects)
    for source in select:
        if source in in_view:
            source.select_set(True, view_layer=view_layer)
    if active_source in in_view:
        view_layer.objects.active = active_source
    return count


class PreparedMeshes:
    """Baked meshes that are not in the scene yet, by the objects' numbers in the record.

    Those that are whole are known by their session_uid alone: undoing something else in the meantime may take them
    away.
    """

    def __init__(self) -> None:
        self._uids: dict[int, int] = {}
        self._half_made: Pieces[bpy.types.Mesh] | None = None

    def make(
        self, context: bpy.types.Context, scene_record: SceneRecord, solution: Solution, settings: Settings
    ) -> Pieces[None]:
        """Make the meshes; those of an earlier try are gone. To be left off before Blender undoes anything.

        ReferenceError says that something was deleted between two pieces.
        """
        self.discard()
        writer = _Writer(context, settings, self)
        for baked in solution.meshes:
            record = scene_record.objects[baked.object]
            owner = writer.owner(record)
            if owner is not None:
                self._half_made = writer.making(record, baked, owner)
                mesh = yield from self._half_made
                self._half_made = None
                self._uids[baked.object] = mesh.session_uid
            yield GO_ON

    def take(self) -> dict[int, bpy.types.Mesh]:
        """Those that are whole and still there; none is left afterwards."""
        if self._half_made is not None:
            self._half_made.close()
            self._half_made = None
        meshes = {mesh.session_uid: mesh for mesh in bpy.data.meshes} if self._uids else {}
        there = {number: meshes[uid] for number, uid in self._uids.items() if uid in meshes}
        self._uids.clear()
        return there

    def discard(self) -> None:
        """Delete them."""
        bpy.data.batch_remove(list(self.take().values()))


@dataclass(frozen=True, slots=True)
class _Made:
    """A baked mesh and where it belongs."""

    source_name: str
    owner: bpy.types.Object
    mesh: bpy.types.Mesh
    world_from_mesh: Matrix
    replaces: bool


class _Writer:
    """Writes one solution."""

    def __init__(self, context: bpy.types.Context, settings: Settings, prepared: PreparedMeshes) -> None:
        self._context = context
        self._settings = settings
        self._prepared = prepared
        self._replaces = settings.output == "REPLACE"
        self._objects = {obj.session_uid: obj for obj in scene_of(context).objects}
        self._materials = {material.session_uid: material for material in bpy.data.materials}

    def owner(self, record: ObjectRecord) -> bpy.types.Object | None:
        """The object that a record belongs to, if it still exists."""
        return self._objects.get(record.owner_uid)

    def write(self, scene_record: SceneRecord, solution: Solution) -> list[str]:
        # Pair each baked mesh with the object it belongs to
        pairs: list[tuple[ObjectRecord, BakedMesh, bpy.types.Object]] = []
        gone: list[str] = []
        for baked in solution.meshes:
            record = scene_record.objects[baked.object]
            owner = self.owner(record)
            if owner is None:
                gone.append(record.name)
            else:
                pairs.append((record, baked, owner))
        if not pairs:
            self._prepared.discard()
            raise InputError("the objects to bake were deleted while the light was computed")
        in_place = {owner for record, _, owner in pairs if self._can_replace(record, owner)}

        # Make all meshes that are not prepared before anything of the scene changes
        meshes = self._prepared.take()
        try:
            for record, baked, owner in pairs:
                if baked.object not in meshes:
                    meshes[baked.object] = at_once(self.making(record, baked, owner))
        except BaseException:
            bpy.data.batch_remove(list(meshes.values()))
            raise
        made = [self._placed(record, owner, meshes.pop(baked.object)) for record, baked, owner in pairs]
        # What is left was prepared for objects that are gone.
        bpy.data.batch_remove(list(meshes.values()))

        # Take the sources' earlier bakes away; what was selected as a bake is now selected as its source
        owners = {owner for _, _, owner in pairs}
        view_layer = view_layer_of(self._context)
        remove_bakes(self._context, owners)
        selected = set(view_layer.objects.selected)
        active = view_layer.objects.active

        # Put the meshes into the scene
        new_objects: dict[bpy.types.Object, bpy.types.Object] = {}
        for item in made:
            if item.replaces:
                replace_mesh(item.owner, item.mesh)
            else:
                new_objects[_new_object(item)] = item.owner
        self._link(list(new_objects))

        # Select the bakes in the place of their sources
        for obj, owner in new_objects.items():
            if owner in selected:
                obj.select_set(True, view_layer=view_layer)
            if owner == active and owner not in in_place:
                view_layer.objects.active = obj
        show(scene_of(self._context))
        _hide({owner for owner in new_objects.values() if owner not in in_place})
        return self._warnings(pairs, gone)

    def making(self, record: ObjectRecord, baked: BakedMesh, owner: bpy.types.Object) -> Pieces[bpy.types.Mesh]:
        """A mesh with a record's light, not in the scene yet."""
        materials = [None if uid is None else self._materials.get(uid) for uid in record.slot_uids]
        stays = self._can_replace(record, owner) or _without_shear(record) is not None
        in_world = None if stays else record.world_from_object
        mesh = yield from writing_mesh(record.name, record.surface, baked, materials, self._settings, in_world)
        if self._settings.quantity == "IRRADIANCE":
            mesh[IRRADIANCE] = True
        return mesh

    def _placed(self, record: ObjectRecord, owner: bpy.types.Object, mesh: bpy.types.Mesh) -> _Made:
        replaces = self._can_replace(record, owner)
        matrix = None if replaces else _without_shear(record)
        return _Made(record.name, owner, mesh, matrix or Matrix(), replaces)

    def _can_replace(self, record: ObjectRecord, owner: bpy.types.Object) -> bool:
        return self._replaces and not record.is_instance and owner.library is None

    def _link(self, objects: list[bpy.types.Object]) -> None:
        if not objects:
            return
        root = scene_of(self._context).collection
        collection = root.children.get(COLLECTION)
        if collection is None:
            collection = bpy.data.collections.new(COLLECTION)
            root.children.link(collection)
        for obj in objects:
            collection.objects.link(obj)

    def _warnings(self, pairs: list[tuple[ObjectRecord, BakedMesh, bpy.types.Object]], gone: list[str]) -> list[str]:
        warnings = []
        if gone:
            warnings.append(f"objects deleted while the light was computed are not baked: {name_list(gone)}")
        linked = sorted({owner.name for _, _, owner in pairs if owner.library is not None})
        if linked:
            warnings.append(f"linked objects stay hidden only until the file is opened again: {name_list(linked)}")
        instancers = sorted({owner.name for record, _, owner in pairs if record.is_instance})
        warnings += storage_losses([baked for _, baked, _ in pairs], self._settings)
        if instancers and self._replaces:
            warnings.append(f"instances cannot be replaced and were written as new objects: {name_list(instancers)}")
        return warnings


def _new_object(made: _Made) -> bpy.types.Object:
    obj = bpy.data.objects.new(f"{made.source_name} Radiosity", made.mesh)
    obj.matrix_world = made.world_from_mesh
    obj[SOURCE_PROPERTY] = made.source_name
    state = state_of(obj)
    state.role, state.source = "BAKED", made.owner
    # Set only where it matters: each setting makes Blender go through all objects.
    if made.owner.hide_viewport:
        obj.hide_viewport = True
    return obj


def _hide(owners: set[bpy.types.Object]) -> None:
    for owner in owners:
        hide_source(owner)
    set_hide_flags(dict.fromkeys(owners, (True, True)))


def _without_shear(record: ObjectRecord) -> Matrix | None:
    """The matrix as an object can have it; None when it is sheared and only world-space vertices are right."""
    matrix = Matrix(record.world_from_object.tolist())
    location, rotation, scale = matrix.decompose()
    rebuilt = np.array(Matrix.LocRotScale(location, rotation, scale), dtype=np.float64)  # type: ignore[arg-type]
    off = np.abs(rebuilt - record.world_from_object)[:3, :3].max()
    size = np.abs(record.world_from_object[:3, :3]).max()
    return matrix if off <= _SHEAR_TOLERANCE * size else None


def _remove_empty_collection(scene: bpy.types.Scene) -> None:
    collection: Any = scene.collection.children.get(COLLECTION)
    if collection is not None and not collection.objects and not collection.children:
        bpy.data.collections.remove(collection)
