# SPDX-License-Identifier: GPL-3.0-or-later
"""What one would want to know before a bake begins: what will look wrong, and what it will take.

Only numbers that were read already are looked at; nothing is solved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .record import ObjectRecord, SceneRecord, Surface, name_list
from .report import Translated
from .settings import Settings

# A surface that reflects less than this in every channel shows no light that one could tell from black.
_BLACK = 0.005

# Open edges of a closed mesh with holes, as a share of all its edges; sheets have more.
_HOLES = 0.05

# Cosine of the angle by which a face turns within itself where it is folded over, 135 degrees. In a flat bow-tie: -1.
_FOLDED = -0.7

# Triangles up to which links carry the light, as in the solver (MOST_LINKED in solve/start.rs).
_MOST_LINKED = 500

# Triangles that refinement may make when the user sets no budget: Settings::triangle_limit in the solver.
_FREE_TRIANGLES, _FREE_SHARE = 100_000, 3.0

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
    # Instances of one surface are looked at once.
    surfaces = {id(record.surface): record.surface for record in scene.objects}
    topology = {key: _topology(surface) for key, surface in surfaces.items()}

    def those(records: list[ObjectRecord], fault: Callable[[_Topology], bool]) -> list[ObjectRecord]:
        return [record for record in records if fault(topology[id(record.surface)])]

    black = [record for record in receivers if _is_black(record, scene)]
    findings = [
        *_no_light(scene),
        *_about(black, "WARNING", "reflects no light: stays black"),
        *_about(those(receivers, lambda t: t.turns_over), "WARNING", "faces turned against their neighbours"),
        *_about(those(blockers, lambda t: t.folds), "WARNING", "faces that cross themselves: taken as their triangles"),
        *_about(those(blockers, lambda t: t.branches), "WARNING", "edges with more than two faces"),
        *_about(those(blockers, lambda t: t.has_holes), "INFO", "nearly closed, with holes that let light through"),
        *_about(those(receivers, lambda t: t.is_inside_out), "INFO", "closed and faces inwards: right for a room"),
        *_shared(receivers),
    ]
    return sorted(findings, key=lambda finding: ("ERROR", "WARNING", "INFO").index(finding.level))


def estimate(scene: SceneRecord, settings: Settings, cores: int) -> Estimate:
    """Triangles from the source's own to the budget; time from measured bakes.

    Known to a factor of three, below 500 triangles of ten towards less: an open scene has little to exchange (the
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


def estimate_texts(estimated: Estimate, translated: Translated = str) -> tuple[str, str, str]:
    """Triangles, time and memory for people."""
    fewest, most = estimated.triangles
    triangles = f"{most:,}" if fewest == most else translated("{} to {}").format(f"{fewest:,}", f"{most:,}")
    low, high = (_time_text(seconds) for seconds in estimated.seconds)
    time = low if low == high else translated("{} to {}").format(low, high)
    memory = translated("Up to {} of memory").format(bytes_text(estimated.bytes[1]))
    return translated("{} triangles").format(triangles), time, memory


def _no_light(scene: SceneRecord) -> list[Finding]:
    glowing = {index for index, material in enumerate(scene.materials) if any(material.exitance_rgb)}
    if scene.lights or scene.sky is not None:
        return []
    if any(record.sends and not glowing.isdisjoint(record.triangle_materials().tolist()) for record in scene.objects):
        return []
    return [Finding("ERROR", "no light: add a lamp, a world background or a material with emission")]


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


@dataclass(frozen=True, slots=True)
class _Topology:
    """What the edges of a surface tell, each pair of vertices being one edge."""

    turns_over: bool
    """Two faces use an edge in the same direction."""
    folds: bool
    """A face is a bow-tie: two of its triangles face away from each other."""
    branches: bool
    """More than two faces use an edge."""
    has_holes: bool
    """A few edges have one face only; sheets have many for their size."""
    is_inside_out: bool
    """It is closed, and its faces look into it."""


def _topology(surface: Surface) -> _Topology:
    start = surface.triangles.astype(np.int64)
    end = np.roll(start, -1, axis=1)
    keys = np.minimum(start, end) * len(surface.positions) + np.maximum(start, end)
    _, which = np.unique(keys.reshape(-1), return_inverse=True)
    count = np.bincount(which.reshape(-1))
    ways = np.bincount(which.reshape(-1), weights=np.where(start < end, 1.0, -1.0).reshape(-1))
    opened = int(np.sum(count == 1))
    is_closed = bool(np.all(count == 2) and not ways.any())
    return _Topology(
        turns_over=bool(np.any((count == 2) & (ways != 0.0))),
        folds=_folds(surface),
        branches=bool(np.any(count > 2)),
        has_holes=0 < opened < _HOLES * len(count),
        is_inside_out=is_closed and _volume(surface) < 0.0,
    )


def _folds(surface: Surface) -> bool:
    corners = surface.positions.astype(np.float64)[surface.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    # Against the largest triangle of the same face
    order = np.lexsort((-lengths, surface.triangle_faces))
    _, first, which = np.unique(surface.triangle_faces[order], return_index=True, return_inverse=True)
    largest = order[first][which.reshape(-1)]
    cosines = np.einsum("tx,tx->t", normals[order], normals[largest])
    return bool(np.any(cosines < _FOLDED * lengths[order] * lengths[largest]))


def _volume(surface: Surface) -> float:
    """Six times the volume, less than 0 where the faces look inwards. Mirrored objects are turned as Blender does."""
    corners = surface.positions.astype(np.float64)[surface.triangles]
    corners -= corners.reshape(-1, 3).mean(axis=0)
    return float(np.einsum("tx,tx->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])))


def _time_text(seconds: float) -> str:
    if seconds < 1.0:
        return "1 s"
    if seconds < 90.0:
        return f"{_two_digits(seconds):.0f} s"
    return f"{_two_digits(seconds / 60.0):.0f} min" if seconds < 5_400.0 else f"{_two_digits(seconds / 3_600.0):.0f} h"


def bytes_text(count: int) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e9 else f"{_two_digits(count / 1e6):.0f} MB"


def _two_digits(value: float) -> float:
    """More would pretend to know."""
    return float(f"{max(value, 1.0):.2g}")
