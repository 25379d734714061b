# SPDX-License-Identifier: GPL-3.0-or-later
"""What any node tree makes of a surface, face by face, from Cycles' own passes at one sample.

Faces whose material cannot be read from its nodes are sampled by small triangles on copies of their objects, in a scene
of their own that is gone afterwards: the user's objects, meshes and materials are not touched. Two passes are baked
into these triangles' colours: the diffuse colour with its opacity, of materials without gloss, and the emission. Their
means over the faces become materials of the solver, as many as there are distinct colours.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ..core.carry import carry_attribute, carry_normals
from ..core.face_samples import Samples, means_of_faces, place_samples, rounded, sampling_levels, triangle_areas
from ..core.lights import Floats
from ..core.record import IntArray, Material, SceneRecord, Surface, name_list
from .attribute_types import write_attribute
from .materials import MOST_BLOCKED, MaterialReader, warn_of_light_through
from .mesh_write import activate_uv_maps, write_faces, write_normals
from .neutral_material import NeutralMaterials, depends_on_object, may_emit

_ENGINE = "CYCLES"
_TARGET = "Antumbra Pass"

# Samples over all surfaces of a scene, besides the three of every triangle: about two seconds of Cycles.
_SAMPLES = 600_000

# Objects that Cycles sees at a time. It is told all of them anew for each, so more at a time take time in square, and
# fewer take more of what each scene costs.
_BATCH = 64

# A face varies when its colours deviate by more than this from their mean: what a picture over it makes visible.
_VARIES = 0.02


@dataclass(slots=True)
class _Sitter:
    """A surface with its materials that is looked at once, for one record or for many instances."""

    surface: Surface
    world_from_object: Floats
    slot_uids: tuple[int | None, ...]
    slot_materials: tuple[int, ...]
    wanted: NDArray[np.bool_]
    """Per slot: whether its faces are looked at."""
    records: list[int] = field(default_factory=list)


def read_passes(scene: SceneRecord, reader: MaterialReader, quantity: str) -> None:
    """Give the faces of unreadable materials what Cycles sees on them, or their materials what has to do instead."""
    materials = {material.session_uid: material for material in bpy.data.materials}
    sitters = _sitters(scene, reader, materials)
    if not sitters:
        return
    if not hasattr(bpy.types.Scene, "cycles"):
        _do_without(sitters, reader)
        return
    neutral = NeutralMaterials(reader.metals_are_matte)
    varying: list[str] = []
    through: dict[int, list[float]] = {}
    try:
        for sitter, samples, colour, emitted in _passes(sitters, materials, neutral):
            face_materials = _face_materials(scene, sitter, samples, colour, emitted, varying, through)
            for index in sitter.records:
                scene.objects[index] = replace(scene.objects[index], face_materials=face_materials)
    except RuntimeError as error:
        # Blender's own refusal: another render is running, or Cycles cannot start.
        scene.warnings.append(f"Cycles could not look at the materials ({str(error).strip()})")
        _do_without(sitters, reader)
    finally:
        neutral.remove()
    for material, shares in through.items():
        warn_of_light_through(scene, scene.materials[material].name, float(np.mean(shares)))
    if varying and quantity == "RADIOSITY":
        scene.warnings.append(
            f"colours vary within faces, which show their mean: {name_list(sorted(set(varying)))}; set the quantity to "
            "Light Only and multiply it with the texture to keep both"
        )


def _sitters(scene: SceneRecord, reader: MaterialReader, materials: dict[int, Any]) -> list[_Sitter]:
    """What has to be looked at; instances of one mesh once, unless their place or object shows in their colours."""
    by_key: dict[tuple[object, ...], _Sitter] = {}
    placed: dict[int, bool] = {}
    for index, record in enumerate(scene.objects):
        surface = record.surface
        wanted = np.array([reader.wants_passes(slot, bool(surface.active_uv)) for slot in record.slot_materials])
        used = np.unique(_slots(surface, record.slot_materials))
        uids = [record.slot_uids[slot] for slot in used if wanted[slot]]
        if not uids:
            continue
        for uid in uids:
            if uid is not None and uid not in placed:
                placed[uid] = depends_on_object(materials[uid])
        own = index if any(placed[uid] for uid in uids if uid is not None) else -1
        key = (id(surface), record.slot_uids, own)
        if key not in by_key:
            by_key[key] = _Sitter(surface, record.world_from_object, record.slot_uids, record.slot_materials, wanted)
        by_key[key].records.append(index)
    return list(by_key.values())


def _do_without(sitters: list[_Sitter], reader: MaterialReader) -> None:
    for sitter in sitters:
        for slot in np.flatnonzero(sitter.wanted):
            reader.do_without_passes(sitter.slot_materials[slot])


def _slots(surface: Surface, slot_materials: tuple[int, ...]) -> IntArray:
    """(F,) slot of each face."""
    return np.asarray(np.clip(surface.face_materials, 0, len(slot_materials) - 1), dtype=np.int32)


def _passes(
    sitters: list[_Sitter], materials: dict[int, Any], neutral: NeutralMaterials
) -> Iterator[tuple[_Sitter, Samples, NDArray[np.float32], NDArray[np.float32]]]:
    """Each sitter's samples with their diffuse colour and opacity (N, 4), and their emission (N, 3)."""
    areas = [_sampled_area(sitter) for sitter in sitters]
    scale = [_area_scale(sitter.world_from_object) for sitter in sitters]
    whole = sum(float(area.sum()) * factor for area, factor in zip(areas, scale, strict=True))
    density = _SAMPLES / whole if whole > 0.0 else 0.0
    for first in range(0, len(sitters), _BATCH):
        batch = range(first, min(first + _BATCH, len(sitters)))
        with _Studio() as studio:
            seated = []
            for index in batch:
                sitter, area = sitters[index], areas[index]
                levels = np.where(area >= 0.0, sampling_levels(np.maximum(area, 0.0), density * scale[index]), 0)
                samples = place_samples(sitter.surface, levels)
                own = [None if uid is None else materials.get(uid) for uid in sitter.slot_uids]
                seated.append((sitter, samples, own, studio.seat(sitter, samples)))
            # Diffuse colour, without gloss
            for sitter, _, own, obj in seated:
                for slot in np.flatnonzero(sitter.wanted):
                    obj.data.materials[slot] = neutral.of(own[slot])
            studio.bake([obj for *_, obj in seated], "DIFFUSE", {"COLOR"})
            colours = [studio.colours(obj) for *_, obj in seated]
            # Emission, of the materials as they are
            glowing = []
            for sitter, _, own, obj in seated:
                for slot in np.flatnonzero(sitter.wanted):
                    obj.data.materials[slot] = own[slot]
                if any(may_emit(own[slot]) for slot in np.flatnonzero(sitter.wanted)):
                    glowing.append(obj)
            if glowing:
                studio.bake(glowing, "EMIT", set())
            for (sitter, samples, _, obj), colour in zip(seated, colours, strict=True):
                emitted = studio.colours(obj)[:, :3] if obj in glowing else np.zeros_like(colour[:, :3])
                yield sitter, samples, colour, emitted


def _sampled_area(sitter: _Sitter) -> Floats:
    """(T,) object-space areas, less than none for triangles that nobody looks at."""
    slots = _slots(sitter.surface, sitter.slot_materials)[sitter.surface.triangle_faces]
    return np.where(sitter.wanted[slots], triangle_areas(sitter.surface), -0.5)


def _area_scale(world_from_object: Floats) -> float:
    """About how many times larger areas are in the world."""
    return float(abs(np.linalg.det(world_from_object[:3, :3])) ** (2.0 / 3.0))


class _Studio:
    """A scene with nothing in it but what is looked at; gone with all of it at the end of the block."""

    _scene: Any

    def __enter__(self) -> _Studio:
        self._scene = bpy.data.scenes.new(_TARGET)
        self._objects: list[Any] = []
        # One sample on the processor: a colour has no noise, and a card would take longer to get ready.
        scene = self._scene
        scene.render.engine = _ENGINE
        scene.cycles.samples = 1
        scene.cycles.device = "CPU"
        return self

    def __exit__(self, *_: object) -> None:
        meshes = [obj.data for obj in self._objects]
        bpy.data.scenes.remove(self._scene)
        bpy.data.batch_remove(self._objects)
        bpy.data.batch_remove(meshes)

    def seat(self, sitter: _Sitter, samples: Samples) -> Any:
        """An object of the samples' triangles that looks as the sitter does."""
        surface = sitter.surface
        mesh: Any = bpy.data.meshes.new(_TARGET)
        obj: Any = bpy.data.objects.new(_TARGET, mesh)
        self._objects.append(obj)
        for _uid in sitter.slot_uids:
            mesh.materials.append(None)
        write_faces(mesh, samples.positions, samples.triangles)
        for attribute in surface.attributes or []:
            if attribute.domain != "EDGE" and attribute.data_type != "STRING":
                write_attribute(mesh, carry_attribute(attribute, surface, samples))
        activate_uv_maps(mesh, surface)
        mesh.color_attributes.new(_TARGET, "FLOAT_COLOR", "CORNER")
        mesh.color_attributes.active_color_name = _TARGET
        if surface.active_render_colour in mesh.color_attributes:
            mesh.color_attributes.render_color_index = mesh.color_attributes.find(surface.active_render_colour)
        mesh.use_auto_texspace = False
        mesh.texspace_location, mesh.texspace_size = surface.texture_space
        normals = carry_normals(surface, samples)
        if normals is not None:
            write_normals(mesh, normals)
        mesh.update()
        obj.matrix_world = Matrix(sitter.world_from_object.tolist())
        self._scene.collection.objects.link(obj)
        return obj

    def bake(self, objects: list[Any], kind: str, parts: set[str]) -> None:
        """Let Cycles write one pass into the objects' colours."""
        override: dict[str, Any] = {
            "scene": self._scene,
            "view_layer": self._scene.view_layers[0],
            "active_object": objects[0],
            "object": objects[0],
            "selected_objects": objects,
            "selected_editable_objects": objects,
        }
        with bpy.context.temp_override(**override):
            bpy.ops.object.bake(
                type=kind,  # type: ignore[arg-type]
                pass_filter=parts,  # type: ignore[arg-type]
                target="VERTEX_COLORS",
                use_selected_to_active=False,
                use_clear=False,
                use_cage=False,
                save_mode="INTERNAL",
            )

    @staticmethod
    def colours(obj: Any) -> NDArray[np.float32]:
        """(N, 4) what the last pass wrote."""
        data = obj.data.attributes[_TARGET].data
        values = np.empty(len(data) * 4, dtype=np.float32)
        data.foreach_get("color", values)
        return values.reshape(-1, 4)


def _face_materials(
    scene: SceneRecord,
    sitter: _Sitter,
    samples: Samples,
    colour: NDArray[np.float32],
    emitted: NDArray[np.float32],
    varying: list[str],
    through: dict[int, list[float]],
) -> IntArray:
    """(F,) material of each face, new ones added to the scene."""
    surface = sitter.surface
    slots = _slots(surface, sitter.slot_materials)
    shown = any(scene.objects[index].receives for index in sitter.records)
    by_slot = np.asarray(sitter.slot_materials, dtype=np.int32)
    face_materials = by_slot[slots]
    found = means_of_faces(surface, samples, np.concatenate([colour, emitted], axis=1))
    faces = np.flatnonzero(sitter.wanted[slots] & np.isfinite(found.mean[:, 0]))
    if len(faces) == 0:
        return face_materials

    # Name what is lost
    at = by_slot[slots[faces]]
    opacity = np.clip(found.mean[faces, 3], 0.0, 1.0)
    for material in np.unique(at):
        of_material = at == material
        name = scene.materials[material].name
        if shown and found.deviation[faces[of_material]].max() > _VARIES:
            varying.append(name)
        through.setdefault(int(material), []).append(1.0 - float(opacity[of_material].mean()))
    if found.mean[faces, :3].max() > 1.0 + 1e-3:
        bright = sorted({scene.materials[m].name for m in at[found.mean[faces, :3].max(axis=1) > 1.0 + 1e-3]})
        scene.warnings.append(f"materials that reflect more than arrives reflect all of it: {name_list(bright)}")

    # One material for each distinct colour of each slot
    reflectance, exitance = rounded(
        np.clip(found.mean[faces, :3], 0.0, 1.0), math.pi * np.maximum(found.mean[faces, 4:7], 0.0)
    )
    blocks = 1.0 - opacity <= MOST_BLOCKED
    rows = np.concatenate([at[:, None], blocks[:, None], reflectance, exitance], axis=1)
    distinct, which = np.unique(rows, axis=0, return_inverse=True)
    first = len(scene.materials)
    for row in distinct.tolist():
        name = scene.materials[int(row[0])].name
        scene.materials.append(Material(name, tuple(row[2:5]), tuple(row[5:8]), bool(row[1])))
    face_materials[faces] = first + which.reshape(-1)
    return face_materials
