# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures on baked meshes: Cycles looks at the elements as it looked at the faces when the scene was read."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from ..core.bake import Solution
from ..core.carry import BakedMesh
from ..core.face_samples import Samples, sampling_levels, triangle_areas
from ..core.lights import Floats
from ..core.pieces import GO_ON, Pieces, rows_of
from ..core.record import ObjectRecord, SceneRecord, name_list
from ..core.settings import Settings
from ..core.textures import ElementSamples, corner_values, place_on_elements, show_texture
from .neutral_material import NeutralMaterials, coordinates_of
from .passes import SAMPLES, area_scale, look_at
from .studio import Colours, Sitter

# Elements up to which each is looked at in four parts at least, so that what falls between three points is seen.
_FEW_ELEMENTS = SAMPLES // 12

# Some milliseconds of them.
_MATERIALS_AT_A_TIME = 4_096


def show_textures(scene: SceneRecord, solution: Solution, settings: Settings, shown: set[int]) -> Pieces[list[str]]:
    """Give the elements of faces whose colours vary their own colours; returns warnings.

    `shown` are the numbers of the objects whose meshes have them, and grows: what is left off and begun anew would
    otherwise multiply light twice.
    """
    textured = [mesh for mesh in solution.meshes if scene.objects[mesh.object].varying_faces is not None]
    if settings.quantity != "RADIOSITY" or not textured:
        return []
    materials = {material.session_uid: material for material in bpy.data.materials}
    gone = []
    seats: list[tuple[Sitter, Samples]] = []
    meshes: list[tuple[BakedMesh, ElementSamples]] = []
    each_level = yield from _levels(scene, textured)
    for mesh, levels in zip(textured, each_level, strict=True):
        record = scene.objects[mesh.object]
        if mesh.object in shown:
            continue
        if any(uid is not None and uid not in materials for uid in record.slot_uids):
            gone.append(record.name)
            continue
        placed = yield from place_on_elements(record.surface, mesh, levels)
        seats.append((_sitter(record, materials, len(seats)), placed.samples))
        meshes.append((mesh, placed))
        yield GO_ON
    warnings = []
    if gone:
        warnings.append(
            f"materials were deleted while the light was computed; faces show their mean: {name_list(gone)}"
        )
    neutral = NeutralMaterials(settings.metals == "MATTE")
    known = yield from _known_colours(scene)

    def keep(sitter: Sitter, _samples: Samples, colours: Colours) -> Pieces[None]:
        mesh, placed = meshes[sitter.number]
        corners = yield from corner_values(placed, colours)
        of_faces = scene.objects[mesh.object].triangle_materials()[mesh.source_triangle[placed.elements]]
        yield from _show(mesh, placed, corners, known[of_faces])
        shown.add(mesh.object)

    try:
        yield from look_at(seats, neutral, keep)
    except RuntimeError as error:
        # Blender's own refusal: another render is running, or Cycles cannot start.
        warnings.append(f"Cycles could not look at the textures, and faces show their mean ({str(error).strip()})")
    finally:
        neutral.remove()
    return warnings


def _levels(scene: SceneRecord, meshes: list[BakedMesh]) -> Pieces[list[Any]]:
    """Per mesh (T,) into how many parts along each edge its elements are cut to be looked at; 0 for even faces."""
    areas, varying = [], []
    for mesh in meshes:
        record = scene.objects[mesh.object]
        assert record.varying_faces is not None
        varying.append(record.varying_faces[record.surface.triangle_faces[mesh.source_triangle]])
        own = yield from triangle_areas(mesh)
        areas.append(own * area_scale(record.world_from_object))
    whole = sum(float(area[of].sum()) for area, of in zip(areas, varying, strict=True))
    count = sum(int(of.sum()) for of in varying)
    density = SAMPLES / whole if whole > 0.0 else 0.0
    fewest = 2 if count <= _FEW_ELEMENTS else 1
    levels = []
    for area, of in zip(areas, varying, strict=True):
        levels.append(np.where(of, np.maximum(sampling_levels(area, density), fewest), 0))
        yield GO_ON
    return levels


def _sitter(record: ObjectRecord, materials: dict[int, Any], number: int) -> Sitter:
    own = [None if uid is None else materials[uid] for uid in record.slot_uids]
    depends_on = set().union(*(coordinates_of(material) for material in own if material is not None))
    wanted = np.ones(len(record.slot_materials), dtype=np.bool_)
    return Sitter(record.surface, record.world_from_object, own, record.slot_materials, wanted, depends_on, number)


def _known_colours(scene: SceneRecord) -> Pieces[Floats]:
    """(M, 6) reflectance and exitance of each material, as the solver knows them."""
    colours = np.empty((len(scene.materials), 6))
    for rows in rows_of(len(colours), _MATERIALS_AT_A_TIME):
        colours[rows] = [(*each.reflectance_rgb, *each.exitance_rgb) for each in scene.materials[rows]]
        yield GO_ON
    return colours


def _show(mesh: BakedMesh, placed: ElementSamples, colours: Floats, known: Floats) -> Pieces[None]:
    """colours (N, 3, 7) per corner: reflectance, opacity, radiance; known (N, 6) of the elements' faces."""
    reflectance = np.clip(colours[:, :, :3], 0.0, 1.0)
    yield GO_ON
    exitance = math.pi * np.maximum(colours[:, :, 4:7], 0.0)
    yield GO_ON
    yield from show_texture(mesh, placed.elements, reflectance, exitance, known[:, :3], known[:, 3:])
