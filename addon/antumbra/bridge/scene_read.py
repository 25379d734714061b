# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as a render would see it, as a SceneRecord.

Every mesh that renders blocks and reflects; those of the receiving objects are baked, their instances included. Objects
made by an earlier bake are passed over, and their hidden originals are read in their place.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.errors import InputError
from ..core.lights import Floats
from ..core.record import Links, ObjectRecord, SceneRecord, Surface, name_list
from ..core.settings import Settings
from .depsgraph import with_render_depsgraph
from .lights import read_light, read_links
from .materials import MaterialReader
from .mesh_read import read_attributes, read_surface
from .originals import originals_shown
from .parts import LEFT_OUT, has_hair, read_part
from .passes import read_passes
from .properties import state_of
from .surroundings import scene_of, view_layer_of
from .world import read_world


def read_scene(context: bpy.types.Context, settings: Settings) -> SceneRecord:
    """Read everything a bake needs; raises InputError and leaves the file as it was."""
    reader = read_geometry(context, settings)
    read_world(scene_of(context).world, reader.scene)
    if settings.receivers != "ALL" and not any(record.receives for record in reader.scene.objects):
        raise InputError("no selected object is a mesh with faces that is visible in renders")
    read_passes(reader.scene, reader.materials, settings.quantity)
    return reader.scene


def read_geometry(context: bpy.types.Context, settings: Settings) -> SceneReader:
    """Read objects, lamps, and materials as far as their nodes tell; nothing is rendered."""
    check_mode(context)
    selected = None if settings.receivers == "ALL" else selected_uids(context)
    if selected is not None and not selected:
        raise InputError("nothing is selected: select the objects to bake, or set the receivers to all objects")
    with originals_shown(scene_of(context)):
        reader = SceneReader(selected, settings, view_layer_of(context))
        with_render_depsgraph(context, reader.visit)
    return reader


def check_mode(context: bpy.types.Context) -> None:
    """Raise InputError outside Object Mode, where meshes are held back by their editor."""
    if context.mode != "OBJECT":
        mode = context.mode.replace("_", " ").title()
        raise InputError(f"Antumbra bakes in Object Mode only, and this is {mode} mode")


def selected_uids(context: bpy.types.Context) -> set[int]:
    """session_uids of the selected objects, baked ones standing for their sources."""
    uids = set()
    for obj in view_layer_of(context).objects.selected:
        state = state_of(obj)
        source = state.source if state.role == "BAKED" and state.source is not None else obj
        uids.add(source.session_uid)
    return uids


class SceneReader:
    """Visits one depsgraph."""

    def __init__(self, selected: set[int] | None, settings: Settings, view_layer: bpy.types.ViewLayer) -> None:
        self.scene = SceneRecord()
        self._selected = selected
        self._view_layer = view_layer
        self.materials = MaterialReader(self.scene, settings.metals == "MATTE")
        # Instances of one mesh share its arrays; Blender keeps the meshes alive during the visit.
        self._surfaces: dict[int, Surface | None] = {}
        self._has_area_of_its_own: dict[int, bool] = {}
        self._without_area: list[str] = []
        self._left_out: dict[str, dict[str, None]] = {}
        self._linked_meshes: dict[str, None] = {}

    def visit(self, depsgraph: bpy.types.Depsgraph, probe_uid: int) -> None:
        each: Any = depsgraph.object_instances
        for instance in each:
            original: Any = instance.object.original
            if original.session_uid == probe_uid or not instance.show_self:
                continue
            # The matrix is gone with the loop's next step.
            world_from_object = np.array(instance.matrix_world, dtype=np.float64)
            if instance.object.type == "LIGHT":
                read_light(instance.object, original.name, world_from_object, self.scene)
            # Texts and curves come once more as meshes.
            elif instance.object.type == "MESH" and state_of(original).role != "BAKED":
                self._read_object(instance, world_from_object)
            elif instance.object.type in LEFT_OUT:
                self._leave_out(LEFT_OUT[instance.object.type], original.name)
        if self._without_area:
            self.scene.warnings.append(
                f"objects whose faces have no area are left out: {name_list(self._without_area)}"
            )
        if self._linked_meshes:
            self.scene.warnings.append(
                "light linking of emitting meshes is not modelled, their emission lights everything: "
                f"{name_list(list(self._linked_meshes))}"
            )
        for kind, names in self._left_out.items():
            self.scene.warnings.append(
                f"{kind} cannot be baked and neither block nor reflect: {name_list(list(names))}"
            )

    def _read_object(self, instance: Any, world_from_object: Floats) -> None:
        obj: Any = instance.object
        name = obj.original.name
        owner: Any = instance.parent.original if instance.is_instance and instance.parent else obj.original
        part = read_part(obj.original, owner, self._view_layer)
        if part is None:
            return
        receives = part.receives and (self._selected is None or owner.session_uid in self._selected)
        if has_hair(obj):
            self._leave_out("hair", name)
        surface = self._surface(obj.data)
        if surface is None:
            return
        if not self._has_area(surface, world_from_object):
            self._without_area.append(name)
            return
        slots = _slot_materials(obj)
        slot_materials = tuple(self.materials.index(material) for material in slots or [None])
        if read_links(owner) != Links() and any(map(self.materials.may_emit, slot_materials)):
            self._linked_meshes[owner.name] = None
        if receives or any(self.materials.wants_passes(m, bool(surface.active_uv)) for m in slot_materials):
            self._read_attributes(surface, obj.data, name)
        self.scene.objects.append(
            ObjectRecord(
                name=name,
                owner_uid=owner.session_uid,
                is_instance=instance.is_instance,
                surface=surface,
                world_from_object=world_from_object,
                slot_materials=slot_materials,
                slot_uids=tuple(None if material is None else material.original.session_uid for material in slots),
                receives=receives,
                blocks=part.blocks,
                sends=part.sends,
            )
        )

    def _has_area(self, surface: Surface, world_from_object: Floats) -> bool:
        """Whether any face has an area in the world; what is not finite is left for the solver to name."""
        key = id(surface)
        if key not in self._has_area_of_its_own:
            self._has_area_of_its_own[key] = _has_area(surface, np.eye(4))
        # No matrix that can be turned back takes an area away, and instances by the thousands need not be looked at.
        if self._has_area_of_its_own[key] and abs(np.linalg.det(world_from_object[:3, :3])) > 0.0:
            return True
        return _has_area(surface, world_from_object)

    def _leave_out(self, kind: str, name: str) -> None:
        self._left_out.setdefault(kind, {})[name] = None

    def _surface(self, mesh: Any) -> Surface | None:
        key = mesh.as_pointer()
        if key not in self._surfaces:
            self._surfaces[key] = read_surface(mesh)
        return self._surfaces[key]

    def _read_attributes(self, surface: Surface, mesh: Any, name: str) -> None:
        if surface.attributes is None:
            surface.attributes, lost = read_attributes(mesh)
            if lost:
                self.scene.warnings.append(f"object “{name}”: attributes of unknown types are lost: {name_list(lost)}")


def _slot_materials(obj: Any) -> list[Any]:
    """Materials by slot: the object's own where the slot says so, else those of its evaluated mesh."""
    materials = list(obj.data.materials)
    for index, slot in enumerate(obj.material_slots):
        if slot.link == "OBJECT":
            materials.extend([None] * (index + 1 - len(materials)))
            materials[index] = slot.material
    return materials


def _has_area(surface: Surface, world_from_object: Floats) -> bool:
    """Whether any face has an area in the world; what is not finite is left for the solver to name."""
    edges = surface.positions[surface.triangles] @ world_from_object[:3, :3].T
    doubled = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    return bool(np.any(doubled != 0.0))
