# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as a render would see it, as a SceneRecord.

Every mesh that renders blocks and reflects; those of the receiving objects are baked, their instances included. Objects
made by an earlier bake are passed over, and their hidden originals are read in their place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..core.errors import InputError
from ..core.lights import Floats
from ..core.pieces import GO_ON, TURN, Pieces, at_once
from ..core.record import Links, ObjectRecord, SceneRecord, Surface, name_list
from ..core.settings import Settings
from .depsgraph import visit_render_depsgraph
from .lights import read_light, read_links
from .materials import MaterialReader
from .mesh_read import read_attributes, read_surface
from .parts import LEFT_OUT, Part, has_hair, read_part
from .passes import read_passes
from .properties import state_of
from .surroundings import scene_of, view_layer_of
from .temporary import marked, remove
from .world import read_world


def read_scene(context: bpy.types.Context, settings: Settings) -> SceneRecord:
    """Read everything a bake needs; raises InputError and leaves the file as it was."""
    return at_once(reading(context, settings))


def read_geometry(context: bpy.types.Context, settings: Settings) -> SceneReader:
    """Read objects, lamps, and materials as far as their nodes tell; nothing is rendered."""
    return at_once(_reading_geometry(context, settings))


def reading(context: bpy.types.Context, settings: Settings) -> Pieces[SceneRecord]:
    """What read_scene() does. ReferenceError says that something was deleted between two pieces."""
    reader = yield from _reading_geometry(context, settings)
    yield from read_world(reader.world, reader.scene)
    if settings.receivers != "ALL" and not any(record.receives for record in reader.scene.objects):
        raise InputError("no selected object is a mesh with faces that is visible in renders")
    yield from read_passes(reader.scene, reader.materials, settings.quantity)
    return reader.scene


def _reading_geometry(context: bpy.types.Context, settings: Settings) -> Pieces[SceneReader]:
    check_mode(context)
    selected = None if settings.receivers == "ALL" else selected_uids(context)
    if selected is not None and not selected:
        raise InputError("nothing is selected: select the objects to bake, or set Bake to All Objects (receivers ALL)")
    yield TURN
    reader = SceneReader(selected, settings, scene_of(context).world)
    try:
        yield from reader.materials.read_images(scene_of(context))
        yield from visit_render_depsgraph(
            context, lambda depsgraph, probe_uid: reader.visit(depsgraph, probe_uid, view_layer_of(context))
        )
        yield from reader.read_objects()
    finally:
        reader.remove_copies()
    yield TURN
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


# Objects in a file up to which meshes are copied while the depsgraph lives, to be read after it. To make and delete a
# copy takes Blender the longer the more there is: 0.03 ms among 775 objects and 1 ms among 10,000, where reading a cube
# at once takes 0.3 ms and the evaluation, which cannot be cut, some seconds anyway.
_MOST_OBJECTS = 2_000


@dataclass(frozen=True, slots=True)
class _Seen:
    """A mesh in the evaluated scene, whose arrays are still to be read."""

    name: str
    owner_uid: int
    owner_name: str
    is_instance: bool
    mesh_key: int
    """The same for objects that share an evaluated mesh."""
    mesh: Any
    """A copy that shares its arrays with the evaluated mesh, which is gone; None where it was read at once."""
    world_from_object: Floats
    slot_materials: tuple[int, ...]
    slot_uids: tuple[int | None, ...]
    part: Part
    receives: bool
    is_linked: bool
    """Whether its light is linked to some objects only."""


class SceneReader:
    """Visits one depsgraph, and reads afterwards what it saw there."""

    def __init__(self, selected: set[int] | None, settings: Settings, world: bpy.types.World | None) -> None:
        self.scene = SceneRecord()
        self.world = world
        self._selected = selected
        self.materials = MaterialReader(self.scene, settings.metals == "MATTE")
        self._seen: list[_Seen] = []
        # By the evaluated meshes' pointers, since instances of one mesh share its arrays; Blender keeps the meshes
        # alive during the visit.
        self._copies: dict[int, Any] = {}
        self._reads_later = len(bpy.data.objects) <= _MOST_OBJECTS
        self._surfaces: dict[int, Surface | None] = {}
        self._has_area_of_its_own: dict[int, bool] = {}
        self._without_area: list[str] = []
        self._left_out: dict[str, dict[str, None]] = {}
        self._linked_meshes: dict[str, None] = {}

    def visit(self, depsgraph: bpy.types.Depsgraph, probe_uid: int, view_layer: bpy.types.ViewLayer) -> None:
        """Take note of everything, and read what ends with the depsgraph: lamps and materials."""
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
                self._see(instance, world_from_object, depsgraph, view_layer)
            elif instance.object.type in LEFT_OUT:
                self._leave_out(LEFT_OUT[instance.object.type], original.name)

    def _see(
        self,
        instance: Any,
        world_from_object: Floats,
        depsgraph: bpy.types.Depsgraph,
        view_layer: bpy.types.ViewLayer,
    ) -> None:
        obj: Any = instance.object
        name = obj.original.name
        owner: Any = instance.parent.original if instance.is_instance and instance.parent else obj.original
        part = read_part(obj.original, owner, view_layer)
        if part is None:
            return
        if has_hair(obj):
            self._leave_out("hair", name)
        if len(obj.data.polygons) == 0:
            return
        slots = _slot_materials(obj)
        slot_materials = tuple(self.materials.index(material) for material in slots or [None])
        receives = part.receives and (self._selected is None or owner.session_uid in self._selected)
        key = obj.data.as_pointer()
        if key not in self._copies and key not in self._surfaces:
            if self._reads_later:
                self._copies[key] = marked(bpy.data.meshes.new_from_object(obj, depsgraph=depsgraph))
            else:
                self._surfaces[key] = at_once(read_surface(obj.data))
        surface = self._surfaces.get(key)
        if surface is not None and self._has_to_carry(surface, slot_materials, receives):
            self._read_attributes(surface, obj.data, name)
        self._seen.append(
            _Seen(
                name=name,
                owner_uid=owner.session_uid,
                owner_name=owner.name,
                is_instance=instance.is_instance,
                mesh_key=key,
                mesh=self._copies.get(key),
                world_from_object=world_from_object,
                slot_materials=slot_materials,
                slot_uids=tuple(None if material is None else material.original.session_uid for material in slots),
                part=part,
                receives=receives,
                is_linked=read_links(owner) != Links(),
            )
        )

    def remove_copies(self) -> None:
        remove(self._copies.values())
        self._copies.clear()
        self._seen.clear()

    def read_objects(self) -> Pieces[None]:
        """Read the arrays of everything that was seen."""
        for seen in self._seen:
            yield from self._read_object(seen)
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

    def _read_object(self, seen: _Seen) -> Pieces[None]:
        surface = yield from self._surface(seen)
        if surface is None:
            return
        if not self._has_area(surface, seen.world_from_object):
            self._without_area.append(seen.name)
            return
        yield GO_ON
        if seen.is_linked and any(map(self.materials.may_emit, seen.slot_materials)):
            self._linked_meshes[seen.owner_name] = None
        if seen.mesh is not None and self._has_to_carry(surface, seen.slot_materials, seen.receives):
            self._read_attributes(surface, seen.mesh, seen.name)
        self.scene.objects.append(
            ObjectRecord(
                name=seen.name,
                owner_uid=seen.owner_uid,
                is_instance=seen.is_instance,
                surface=surface,
                world_from_object=seen.world_from_object,
                slot_materials=seen.slot_materials,
                slot_uids=seen.slot_uids,
                receives=seen.receives,
                blocks=seen.part.blocks,
                sends=seen.part.sends,
            )
        )
        yield GO_ON

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

    def _surface(self, seen: _Seen) -> Pieces[Surface | None]:
        if seen.mesh_key not in self._surfaces:
            self._surfaces[seen.mesh_key] = yield from read_surface(seen.mesh)
        return self._surfaces[seen.mesh_key]

    def _has_to_carry(self, surface: Surface, slot_materials: tuple[int, ...], receives: bool) -> bool:
        """Whether somebody asks for the attributes of a surface."""
        return receives or any(self.materials.wants_passes(m, bool(surface.active_uv)) for m in slot_materials)

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
    # The first thousand triangles nearly always tell
    for triangles in np.split(surface.triangles, [1_000]):
        edges = surface.positions[triangles] @ world_from_object[:3, :3].T
        doubled = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
        if np.any(doubled != 0.0):
            return True
    return False
