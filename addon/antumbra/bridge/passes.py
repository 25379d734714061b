# SPDX-License-Identifier: GPL-3.0-or-later
"""What any node tree makes of a surface, face by face, from Cycles' own passes at one sample.

Faces whose material cannot be read from its nodes are sampled by small triangles on copies of their objects, in a scene
of their own that is gone afterwards: the user's objects, meshes and materials are not touched. Two passes are baked
into these triangles' colours: the diffuse colour with its opacity, of materials without gloss, and the emission. Their
means over the faces become materials of the solver, as many as there are distinct colours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.face_samples import (
    Samples,
    cut,
    distinct_rows,
    means_of_faces,
    place_samples,
    rounded,
    sampling_levels,
    triangle_areas,
)
from ..core.lights import Floats
from ..core.pieces import GO_ON, TURN, Pieces, rows_of
from ..core.record import IntArray, Material, SceneRecord, name_list
from .materials import MaterialReader
from .neutral_material import PLACED, NeutralMaterials, coordinates_of, has_glass, has_metal
from .studio import Colours, Sitter, Studio, slots_of_faces

# Samples over all surfaces of a scene, besides the three of every triangle: about a second of Cycles.
SAMPLES = 300_000

# Benches in one studio. Cycles is told all of them anew each time it looks, so more take time in square, and fewer take
# more of what each studio costs.
_BATCH = 64

# Samples that Cycles looks at in one go, and benches: each takes one to two hundredths of a second, which is what
# somebody at the window may be kept waiting. Half as many take a third more time in all, and more save hardly any.
_SAMPLES_AT_A_TIME = 6_000
_BENCHES_AT_A_TIME = 4

# Some milliseconds of them.
_MATERIALS_AT_A_TIME = 1_000

# A face varies when its colours deviate by more than this from their mean: a step of 8-bit colour in the light ones.
_VARIES = 0.005


def read_passes(scene: SceneRecord, reader: MaterialReader, quantity: str) -> Pieces[None]:
    """Give the faces of unreadable materials what Cycles sees on them, or their materials what has to do instead."""
    materials = {material.session_uid: material for material in bpy.data.materials}
    try:
        sitters = yield from _sitters(scene, reader, materials)
    except KeyError:
        raise ReferenceError("a material was deleted while the scene was read") from None
    if not sitters:
        return
    if not hasattr(bpy.types.Scene, "cycles"):
        _do_without(sitters, reader)
        return
    neutral = NeutralMaterials(reader.metals_are_matte)
    varying: list[str] = []

    def keep(sitter: Sitter, samples: Samples, colours: Colours) -> Pieces[None]:
        face_materials, varies = yield from _face_materials(scene, sitter, samples, colours, varying)
        for index in sitter.records:
            scene.objects[index] = replace(
                scene.objects[index], face_materials=face_materials, varying_faces=varies if varies.any() else None
            )

    try:
        seats = yield from _seats(sitters)
        yield from look_at(seats, neutral, keep)
    except RuntimeError as error:
        # Blender's own refusal: another render is running, or Cycles cannot start.
        scene.warnings.append(f"Cycles could not look at the materials ({str(error).strip()})")
        _do_without(sitters, reader)
    finally:
        neutral.remove()
    for material in {m.session_uid: m for sitter in sitters for m in sitter.materials if m is not None}.values():
        if has_metal(material):
            reader.warn_of_metal(material)
        if has_glass(material):
            reader.warn_of_glass(material)
    if varying and quantity == "RADIOSITY":
        scene.warnings.append(
            f"colours vary within faces and are shown as fine as the baked triangles: {name_list(sorted(set(varying)))}"
            " (a smaller Element Size shows more, Light Only leaves them to the texture)"
        )


def _sitters(scene: SceneRecord, reader: MaterialReader, materials: dict[int, Any]) -> Pieces[list[Sitter]]:
    """What has to be looked at; instances of one mesh once, unless their place or object shows in their colours."""
    by_key: dict[tuple[object, ...], Sitter] = {}
    coordinates: dict[int | None, set[str]] = {None: set()}
    for index, record in enumerate(scene.objects):
        surface = record.surface
        wanted = np.array([reader.wants_passes(slot, bool(surface.active_uv)) for slot in record.slot_materials])
        if not wanted.any():
            continue
        used = np.unique(slots_of_faces(surface, len(record.slot_materials)))
        uids = [record.slot_uids[slot] for slot in used if wanted[slot]]
        if not uids:
            continue
        for uid in uids:
            if uid not in coordinates:
                coordinates[uid] = coordinates_of(materials[uid])
        depends_on = set().union(*(coordinates[uid] for uid in uids))
        key = (id(surface), record.slot_uids, index if PLACED in depends_on else -1)
        if key not in by_key:
            own = [
                materials[uid] if looked_at and uid is not None else None
                for uid, looked_at in zip(record.slot_uids, wanted, strict=False)
            ]
            by_key[key] = Sitter(
                surface, record.world_from_object, own, record.slot_materials, wanted, depends_on, len(by_key)
            )
        by_key[key].records.append(index)
        yield GO_ON
    return list(by_key.values())


def _do_without(sitters: list[Sitter], reader: MaterialReader) -> None:
    for sitter in sitters:
        for slot in np.flatnonzero(sitter.wanted):
            reader.do_without_passes(sitter.slot_materials[slot])


Seat = tuple[Sitter, Samples]
Keep = Callable[[Sitter, Samples, Colours], Pieces[None]]


def look_at(seats: list[Seat], neutral: NeutralMaterials, keep: Keep) -> Pieces[None]:
    """Hand over what the passes show at the samples of each sitter, whose numbers are their places in the list."""
    benches = _benches([sitter for sitter, _ in seats])
    found: dict[int, Colours] = {}
    for first in range(0, len(benches), _BATCH):
        studio = Studio(neutral)
        try:
            in_it = benches[first : first + _BATCH]
            for members in in_it:
                studio.furnish([seats[index][0] for index in members])
            yield TURN
            for parts in _in_turn([[seats[index] for index in members] for members in in_it]):
                looked = studio.look([(part.bench, part.seated) for part in parts])
                colours = yield from looked
                for part, seen in zip(parts, colours, strict=True):
                    yield GO_ON
                    yield from _gather(part, seen, found, keep)
                yield GO_ON
        finally:
            studio.remove()
        yield TURN


@dataclass(frozen=True, slots=True)
class _Part:
    """A few samples of some who sit on one bench."""

    bench: int
    seated: list[Seat]
    whole: list[Samples]
    """All samples of each of them."""


def _in_turn(benches: list[list[Seat]]) -> Iterator[list[_Part]]:
    """All samples on all benches, as many at a time as may be looked at in one go."""
    turn: list[_Part] = []
    room = _SAMPLES_AT_A_TIME
    for number, members in enumerate(benches):
        seated: list[Seat] = []
        whole: list[Samples] = []
        for sitter, samples in members:
            for part in cut(samples, _SAMPLES_AT_A_TIME // 3):
                seated.append((sitter, part))
                whole.append(samples)
                room -= len(part.positions)
                if room <= 0:
                    yield [*turn, _Part(number, seated, whole)]
                    turn, seated, whole, room = [], [], [], _SAMPLES_AT_A_TIME
        if seated:
            turn.append(_Part(number, seated, whole))
        if len(turn) >= _BENCHES_AT_A_TIME:
            yield turn
            turn, room = [], _SAMPLES_AT_A_TIME
    if turn:
        yield turn


def _gather(part: _Part, seen: list[Colours], found: dict[int, Colours], keep: Keep) -> Pieces[None]:
    """Add what was seen to what is known of each sitter, and hand over what is complete."""
    for (sitter, _), whole, colours in zip(part.seated, part.whole, seen, strict=True):
        known = found.get(sitter.number)
        together = colours if known is None else np.concatenate([known, colours])
        if len(together) == len(whole.positions):
            found.pop(sitter.number, None)
            yield from keep(sitter, whole, together)
            yield GO_ON
        else:
            found[sitter.number] = together


def _seats(sitters: list[Sitter]) -> Pieces[list[Seat]]:
    areas = []
    for sitter in sitters:
        area = yield from _sampled_area(sitter)
        areas.append(area)
    scale = [area_scale(sitter.world_from_object) for sitter in sitters]
    yield GO_ON
    whole = sum(float(np.maximum(area, 0.0).sum()) * factor for area, factor in zip(areas, scale, strict=True))
    density = SAMPLES / whole if whole > 0.0 else 0.0
    seats = []
    for sitter, area, factor in zip(sitters, areas, scale, strict=True):
        levels = np.where(area >= 0.0, sampling_levels(np.maximum(area, 0.0), density * factor), 0)
        samples = yield from place_samples(sitter.surface, levels)
        seats.append((sitter, samples))
        yield GO_ON
    return seats


def _benches(sitters: list[Sitter]) -> list[list[int]]:
    """Sitters that can be looked at as one."""
    open_benches: dict[object, list[int]] = {}
    benches = []
    for index, sitter in enumerate(sitters):
        key = sitter.bench
        members = open_benches.get(key)
        if members is None or len(members) == sitter.neighbours:
            members = open_benches[key] = []
            benches.append(members)
        members.append(index)
    return benches


def _sampled_area(sitter: Sitter) -> Pieces[Floats]:
    """(T,) object-space areas, less than none for triangles that nobody looks at."""
    areas = yield from triangle_areas(sitter.surface)
    slots = sitter.slots()[sitter.surface.triangle_faces]
    return np.where(sitter.wanted[slots], areas, -0.5)


def area_scale(world_from_object: Floats) -> float:
    """About how many times larger areas are in the world."""
    return float(abs(np.linalg.det(world_from_object[:3, :3])) ** (2.0 / 3.0))


def _face_materials(
    scene: SceneRecord,
    sitter: Sitter,
    samples: Samples,
    colours: Colours,
    varying: list[str],
) -> Pieces[tuple[IntArray, NDArray[np.bool_]]]:
    """(F,) material of each face, new ones added to the scene, and whether its colours vary."""
    surface = sitter.surface
    slots = sitter.slots()
    shown = any(scene.objects[index].receives for index in sitter.records)
    by_slot = np.asarray(sitter.slot_materials, dtype=np.int32)
    face_materials = by_slot[slots]
    found = yield from means_of_faces(surface, samples, colours)
    faces = np.flatnonzero(sitter.wanted[slots] & np.isfinite(found.mean[:, 0]))
    varies = np.zeros(len(face_materials), dtype=np.bool_)
    if len(faces) == 0:
        return face_materials, varies
    varies[faces] = np.delete(found.deviation[faces], 3, axis=1).max(axis=1) > _VARIES

    # Name what is lost
    yield GO_ON
    at = by_slot[slots[faces]]
    opacity = np.clip(found.mean[faces, 3], 0.0, 1.0)
    for material in np.unique(at):
        of_material = at == material
        name = scene.materials[material].name
        if shown and varies[faces[of_material]].any():
            varying.append(name)
    if found.mean[faces, :3].max() > 1.0 + 1e-3:
        bright = sorted({scene.materials[m].name for m in at[found.mean[faces, :3].max(axis=1) > 1.0 + 1e-3]})
        scene.warnings.append(f"materials that reflect more than arrives reflect all of it: {name_list(bright)}")

    # One material for each distinct colour of each slot
    yield GO_ON
    reflectance, exitance = rounded(
        np.clip(found.mean[faces, :3], 0.0, 1.0), math.pi * np.maximum(found.mean[faces, 4:7], 0.0)
    )
    yield GO_ON
    through, _ = rounded(1.0 - opacity[:, None], exitance)
    rows = np.concatenate([at[:, None], through, reflectance, exitance], axis=1)
    distinct, which = yield from distinct_rows(rows)
    first = len(scene.materials)
    face_materials[faces] = first + which
    for part in rows_of(len(distinct), _MATERIALS_AT_A_TIME):
        for row in distinct[part].tolist():
            name = scene.materials[int(row[0])].name
            scene.materials.append(Material(name, tuple(row[2:5]), tuple(row[5:8]), (row[1],) * 3))
        yield GO_ON
    return face_materials, varies
