# SPDX-License-Identifier: GPL-3.0-or-later
"""What one would want to know before a bake begins: what will look wrong, and what it will take.

Only numbers that were read already are looked at; nothing is solved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .record import ObjectRecord, SceneRecord, Surface, name_list
from .settings import Settings

# A surface that reflects less than this in every channel shows no light that one could tell from black.
_BLACK = 0.005

# Triangles up to which links carry the light, as in the solver (MOST_LINKED in solve.rs).
_MOST_LINKED = 2_000

# Triangles that refinement may make when the user sets no budget: Settings::triangle_limit in the solver.
_FREE_TRIANGLES, _FREE_SHARE = 100_000, 1.5

# Bytes for each triangle that is made: about 250 in the solver's result (positions, barycentric coordinates, colours),
# and 150 in Blender with its edges, vertices and one UV map.
_BYTES_PER_TRIANGLE = 400

# The same for each triangle that is read: its arrays, its world-space twin, patches and tree.
_BYTES_PER_SOURCE_TRIANGLE = 600

# Form factors that transport keeps.
_BYTES_KEPT = 200_000_000


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing about the scene."""

    level: str
    """ERROR: nothing can be baked. WARNING: something will look wrong. INFO: good to know."""
    text: str
    objects: tuple[int, ...] = ()
    """session_uids of the objects it is about."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """What a bake takes, from the least to the most that is likely."""

    triangles: tuple[int, int]
    seconds: tuple[float, float]
    bytes: tuple[int, int]
    """Of memory, while it runs."""


def find(scene: SceneRecord) -> list[Finding]:
    """What is worth knowing about a scene that was read, the worst first."""
    receivers = [record for record in scene.objects if record.receives]
    blockers = [record for record in scene.objects if record.blocks]
    findings = [
        *_no_light(scene),
        *_about(
            _per_object(receivers, lambda record: _is_black(record, scene)), "WARNING", "reflects no light: stays black"
        ),
        *_about(_per_object(receivers, _turns_over), "WARNING", "faces turned against their neighbours"),
        *_about(_per_object(blockers, _branches), "WARNING", "edges with more than two faces"),
        *_about(_per_object(blockers, _has_holes), "INFO", "nearly closed, with holes that let light through"),
        *_about(_per_object(receivers, _faces_inwards), "INFO", "closed and faces inwards: right for a room"),
        *_shared(receivers),
    ]
    return sorted(findings, key=lambda finding: ("ERROR", "WARNING", "INFO").index(finding.level))


def estimate(scene: SceneRecord, settings: Settings, cores: int) -> Estimate:
    """Triangles from the source's own to the budget; time from measured bakes.

    Known to a factor of three, below 2,000 triangles of ten towards less: an open scene has little to exchange (the
    paper's, 14 triangles at 0.01, takes 0.5 s), a closed one much. Measured on two cores: interiors of 262,663
    triangles at a tolerance of 0.05 in 93 s and of 143,163 at 0.03 in 54 s; the Cornell box, 36 triangles at 0.01, in
    8 s.
    """
    read = sum(len(record.surface.triangles) for record in scene.objects)
    baked = sum(len(record.surface.triangles) for record in scene.objects if record.receives)
    most = settings.triangle_budget or int(_FREE_TRIANGLES + (1.0 + _FREE_SHARE) * baked)
    most = max(most, baked)
    finer = 0.01 / settings.tolerance
    if read <= _MOST_LINKED:
        seconds, uncertain = 8.0 * math.sqrt(read / 36.0) * finer**0.7, 10.0
    else:
        seconds, uncertain = 5.0 + 0.37e-3 * read * (5.0 * finer) ** 0.3, 3.0
    seconds *= 2.0 / cores
    low, high = seconds / uncertain, 3.0 * seconds
    if settings.time_limit > 0.0:
        low, high = min(low, settings.time_limit), min(high, settings.time_limit)
    source_bytes = _BYTES_PER_SOURCE_TRIANGLE * read
    return Estimate(
        triangles=(baked, most),
        seconds=(low, high),
        bytes=(source_bytes + _BYTES_PER_TRIANGLE * baked, source_bytes + _BYTES_PER_TRIANGLE * most + _BYTES_KEPT),
    )


def estimate_texts(estimated: Estimate) -> tuple[str, str, str]:
    """Triangles, time and memory for people."""
    fewest, most = estimated.triangles
    triangles = f"{fewest:,} triangles" if fewest == most else f"{fewest:,} to {most:,} triangles"
    low, high = (_time_text(seconds) for seconds in estimated.seconds)
    time = low if low == high else f"{low} to {high}"
    return triangles, time, f"Up to {_bytes_text(estimated.bytes[1])} of memory"


def _no_light(scene: SceneRecord) -> list[Finding]:
    glowing = {index for index, material in enumerate(scene.materials) if any(material.exitance_rgb)}
    if scene.lights or scene.sky is not None:
        return []
    if any(record.sends and not glowing.isdisjoint(record.triangle_materials().tolist()) for record in scene.objects):
        return []
    return [Finding("ERROR", "no light: add a lamp, a world background or a material with emission")]


def _per_object(records: list[ObjectRecord], holds: Callable[[ObjectRecord], bool]) -> list[ObjectRecord]:
    """Those for which it holds; instances of one surface are asked once."""
    known: dict[tuple[object, ...], bool] = {}
    found = []
    for record in records:
        key = (id(record.surface), record.slot_materials, _is_mirrored(record))
        if key not in known:
            known[key] = holds(record)
        if known[key]:
            found.append(record)
    return found


def _about(records: list[ObjectRecord], level: str, text: str) -> list[Finding]:
    if not records:
        return []
    names = list(dict.fromkeys(record.name for record in records))
    uids = tuple(dict.fromkeys(record.owner_uid for record in records))
    return [Finding(level, f"{name_list(names, most=2)}: {text}", uids)]


def _shared(receivers: list[ObjectRecord]) -> list[Finding]:
    by_surface: dict[int, list[ObjectRecord]] = {}
    for record in receivers:
        by_surface.setdefault(id(record.surface), []).append(record)
    shared = [records for records in by_surface.values() if len(records) > 1]
    if not shared:
        return []
    records = [record for group in shared for record in group]
    uids = tuple(dict.fromkeys(record.owner_uid for record in records))
    return [
        Finding("INFO", f"{len(records):,} objects share {len(shared):,} meshes: each gets a mesh of its own", uids)
    ]


def _is_black(record: ObjectRecord, scene: SceneRecord) -> bool:
    used = np.unique(record.triangle_materials())
    return all(
        max(scene.materials[index].reflectance_rgb) < _BLACK and not any(scene.materials[index].exitance_rgb)
        for index in used
    )


def _is_mirrored(record: ObjectRecord) -> bool:
    return bool(np.linalg.det(record.world_from_object[:3, :3]) < 0.0)


def _directed_edges(surface: Surface) -> tuple[NDArray[Any], NDArray[Any]]:
    """The edges of all triangles: a number for each pair of vertices, and whether it runs from the smaller one."""
    start = surface.triangles.astype(np.int64)
    end = np.roll(start, -1, axis=1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    return (low * len(surface.positions) + high).reshape(-1), (start < end).reshape(-1)


def _uses(surface: Surface) -> tuple[NDArray[Any], NDArray[Any]]:
    """How often each edge is used, and how much more often one way than the other."""
    keys, forward = _directed_edges(surface)
    _, which = np.unique(keys, return_inverse=True)
    return np.bincount(which), np.abs(np.bincount(which, weights=np.where(forward, 1.0, -1.0)))


def _turns_over(record: ObjectRecord) -> bool:
    count, turned = _uses(record.surface)
    return bool(np.any((count == 2) & (turned == 2.0)))


def _branches(record: ObjectRecord) -> bool:
    count, _ = _uses(record.surface)
    return bool(np.any(count > 2))


def _has_holes(record: ObjectRecord) -> bool:
    """A few open edges on what is closed elsewhere; sheets have many for their size."""
    count, _ = _uses(record.surface)
    opened = int(np.sum(count == 1))
    return 0 < opened < 0.05 * len(count)


def _faces_inwards(record: ObjectRecord) -> bool:
    count, turned = _uses(record.surface)
    if np.any(count != 2) or np.any(turned != 0.0):
        return False
    corners = record.surface.positions.astype(np.float64)[record.surface.triangles]
    corners -= corners.reshape(-1, 3).mean(axis=0)
    volume = np.einsum("tx,tx->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    # The solver turns the faces of mirrored objects as Blender does.
    return bool(volume < 0.0)


def _time_text(seconds: float) -> str:
    if seconds < 1.0:
        return "1 s"
    if seconds < 90.0:
        return f"{_two_digits(seconds):.0f} s"
    return f"{_two_digits(seconds / 60.0):.0f} min" if seconds < 5_400.0 else f"{_two_digits(seconds / 3_600.0):.0f} h"


def _bytes_text(count: int) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e9 else f"{_two_digits(count / 1e6):.0f} MB"


def _two_digits(value: float) -> float:
    """More would pretend to know."""
    return float(f"{max(value, 1.0):.2g}")
