# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures on baked meshes: Cycles looks at the elements as it looked at the faces when the scene was read."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from ..core.bake import Solution
from ..core.carry import BakedMesh
from ..core.face_samples import Samples, sampling_levels
from ..core.lights import Floats
from ..core.pieces import GO_ON, Pieces
from ..core.record import ObjectRecord, SceneRecord, name_list
from ..core.settings import Settings
from ..core.textures import ElementSamples, corner_values, element_areas, place_on_elements, show_texture
from .neutral_material import NeutralMaterials, coordinates_of
from .passes import SAMPLES, area_scale, look_at
from .studio import Colours, Sitter

# Elements up to which each is looked at in four parts at least, so that what falls between three points is seen.
_FEW_ELEMENTS = SAMPLES // 12


def show_textures(scene: SceneRecord, solution: Solution, settings: Settings) -> Pieces[list[str]]:
    """Give the elements of faces whose colours vary their own colours; returns warnings."""
    textured = [mesh for mesh in solution.meshes if scene.objects[mesh.object].varying_faces is not None]
    if settings.quantity != "RADIOSITY" or not textured:
        return []
    materials = {material.session_uid: material for material in bpy.data.materials}
    gone = []
    seats: list[tuple[Sitter, Samples]] = []
    meshes: list[tuple[BakedMesh, ElementSamples]] = []
    for mesh, levels in zip(textured, _levels(scene, textured), strict=True):
        record = scene.objects[mesh.object]
        if any(uid is not None and uid not in materials for uid in record.slot_uids):
            gone.append(record.name)
            continue
        placed = place_on_elements(record.surface, mesh, levels)
        seats.append((_sitter(record, materials, len(seats)), placed.samples))
        meshes.append((mesh, placed))
        yield GO_ON
    warnings = []
    if gone:
        warnings.append(
            f"materials were deleted while the light was computed; faces show their mean: {name_list(gone)}"
        )
    neutral = NeutralMaterials(settings.metals == "MATTE")

    seen: dict[int, Floats] = {}

    def keep(sitter: Sitter, _samples: Samples, colours: Colours) -> None:
        seen[sitter.number] = corner_values(meshes[sitter.number][1], colours)

    try:
        yield from look_at(seats, neutral, keep)
        # All in one go: what is left off half-way begins anew, and light would be multiplied twice
        for number, corners in seen.items():
            _show(scene, *meshes[number], corners)
    except RuntimeError as error:
        # Blender's own refusal: another render is running, or Cycles cannot start.
        warnings.append(f"Cycles could not look at the textures, and faces show their mean ({str(error).strip()})")
    finally:
        neutral.remove()
    return warnings


def _levels(scene: SceneRecord, meshes: list[BakedMesh]) -> list[Any]:
    """Per mesh (T,) into how many parts along each edge its elements are cut to be looked at; 0 for even faces."""
    areas, varying = [], []
    for mesh in meshes:
        record = scene.objects[mesh.object]
        assert record.varying_faces is not None
        varying.append(record.varying_faces[record.surface.triangle_faces[mesh.source_triangle]])
        areas.append(element_areas(mesh) * area_scale(record.world_from_object))
    whole = sum(float(area[of].sum()) for area, of in zip(areas, varying, strict=True))
    count = sum(int(of.sum()) for of in varying)
    density = SAMPLES / whole if whole > 0.0 else 0.0
    fewest = 2 if count <= _FEW_ELEMENTS else 1
    return [
        np.where(of, np.maximum(sampling_levels(area, density), fewest), 0)
        for area, of in zip(areas, varying, strict=True)
    ]


def _sitter(record: ObjectRecord, materials: dict[int, Any], number: int) -> Sitter:
    own = [None if uid is None else materials[uid] for uid in record.slot_uids]
    depends_on = set().union(*(coordinates_of(material) for material in own if material is not None))
    wanted = np.ones(len(record.slot_materials), dtype=np.bool_)
    return Sitter(record.surface, record.world_from_object, own, record.slot_materials, wanted, depends_on, number)


def _show(scene: SceneRecord, mesh: BakedMesh, placed: ElementSamples, colours: Any) -> None:
    """colours (N, 3, 7) per corner: reflectance, opacity, radiance."""
    of_triangles = scene.objects[mesh.object].triangle_materials()[mesh.source_triangle[placed.elements]]
    known, which = np.unique(of_triangles, return_inverse=True)
    reflectance = np.array([scene.materials[index].reflectance_rgb for index in known])[which.reshape(-1)]
    exitance = np.array([scene.materials[index].exitance_rgb for index in known])[which.reshape(-1)]
    show_texture(
        mesh,
        placed.elements,
        np.clip(colours[:, :, :3], 0.0, 1.0),
        math.pi * np.maximum(colours[:, :, 4:7], 0.0),
        reflectance,
        exitance,
    )
