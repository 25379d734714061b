# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours that vary over faces: where to look at them, and what they are on average.

Every triangle is cut into n² equal ones, and each of these is looked at in three points, the nodes of the rule of three
points that is exact for quadratic functions (Hammer, Stroud 1956): all of them lie inside, so that no sample falls on a
seam of a texture, and all count alike. A small triangle through these nodes is a mesh that Blender can bake.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .carry import RefinedMesh
from .lights import Floats
from .pieces import GO_ON, Pieces, rows_of
from .record import IntArray, Surface

# A pair of triangles of 64² parts has 24,576 samples, as many as a texture of 157² pixels: means of photographs are
# then known to about a thousandth. More would cost seconds on a scene of walls.
_MOST_PARTS = 64

# Steps of a distinct colour: reflectance in thousandths of all light, exitance relative to its own size. Faces of one
# colour can be one material, and two triangles one quadrilateral; errors of half a step are below anyone's tolerance.
_STEPS = 1024


@dataclass(frozen=True, slots=True)
class Samples:
    """Small triangles whose corners are the samples: S of them, a RefinedMesh of its own."""

    positions: Floats
    vertex_source_triangle: IntArray
    vertex_barycentric: Floats
    triangles: IntArray
    source_triangle: IntArray
    corner_barycentric: Floats
    source_edge: NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class FaceMeans:
    """What was found on each of F faces, or NaN where nobody looked."""

    mean: Floats
    """(F, K)"""
    deviation: Floats
    """(F, K), standard deviation over the face."""


def sampling_levels(areas: Floats, samples_per_area: float) -> IntArray:
    """(T,) how many times each triangle's edges are cut, for about so many samples per area."""
    wanted = np.sqrt(areas * samples_per_area / 3.0)
    return np.asarray(np.clip(np.rint(wanted), 1, _MOST_PARTS), dtype=np.int32)


def place_samples(surface: Surface, levels: IntArray) -> Pieces[Samples]:
    """Samples on the triangles of a surface; levels (T,), 0 for triangles that nobody looks at."""
    source, barycentric = nodes_by_level(levels)
    yield GO_ON
    samples = yield from small_triangles(surface, source, barycentric)
    return samples


def cut(samples: Samples, most: int) -> Iterator[Samples]:
    """The same in their order, at most so many small triangles at a time."""
    for first in range(0, len(samples.triangles), most):
        chosen = slice(first, first + most)
        corners = slice(3 * first, 3 * (first + most))
        count = len(samples.triangles[chosen])
        yield Samples(
            positions=samples.positions[corners],
            vertex_source_triangle=samples.vertex_source_triangle[corners],
            vertex_barycentric=samples.vertex_barycentric[corners],
            triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
            source_triangle=samples.source_triangle[chosen],
            corner_barycentric=samples.corner_barycentric[chosen],
            source_edge=samples.source_edge[chosen],
        )


def nodes_by_level(levels: IntArray) -> tuple[IntArray, Floats]:
    """(S,) and (S, 3, 3): which of T triangles each small triangle is on, and the coordinates of its corners there."""
    which, barycentrics = [], []
    for level in np.unique(levels[levels > 0]):
        chosen = np.flatnonzero(levels == level)
        nodes = nodes_of(int(level))
        which.append(np.repeat(chosen, len(nodes)))
        barycentrics.append(np.tile(nodes, (len(chosen), 1, 1)))
    triangle = np.concatenate(which or [np.empty(0, dtype=np.int64)]).astype(np.int32)
    return triangle, np.concatenate(barycentrics or [np.empty((0, 3, 3))])


def small_triangles(surface: Surface, source: IntArray, barycentric: Floats) -> Pieces[Samples]:
    """Triangles that share no corners, on source triangles (S,) at barycentric coordinates (S, 3, 3)."""
    positions = np.empty((len(source), 3, 3))
    for rows in rows_of(len(source)):
        positions[rows] = barycentric[rows] @ surface.positions[surface.triangles[source[rows]]].astype(np.float64)
        yield GO_ON
    return Samples(
        positions=positions.reshape(-1, 3),
        vertex_source_triangle=np.repeat(source, 3),
        vertex_barycentric=barycentric.reshape(-1, 3),
        triangles=np.arange(3 * len(source), dtype=np.int32).reshape(-1, 3),
        source_triangle=source,
        corner_barycentric=barycentric,
        source_edge=np.full((len(source), 3), -1, dtype=np.int8),
    )


def means_of_faces(surface: Surface, samples: Samples, values: NDArray[Any]) -> Pieces[FaceMeans]:
    """Means over the faces of what was found at the samples, values (3S, K)."""
    areas = yield from triangle_areas(surface)
    faces = surface.triangle_faces[samples.vertex_source_triangle]
    # A triangle's samples share its area.
    per_triangle = np.bincount(samples.vertex_source_triangle, minlength=len(surface.triangles))
    weights = (areas / np.maximum(per_triangle, 1))[samples.vertex_source_triangle]
    count = len(surface.face_materials)
    whole = np.bincount(faces, weights=weights, minlength=count)
    # Faces without area show what was found there all the same.
    yield GO_ON
    flat = (whole == 0.0)[faces]
    if flat.any():
        weights = np.where(flat, 1.0, weights)
        whole = np.bincount(faces, weights=weights, minlength=count)
    mean, deviation = [], []
    for each in values.T:
        yield GO_ON
        column = each.astype(np.float64)
        with np.errstate(invalid="ignore"):
            at_face = np.bincount(faces, weights=weights * column, minlength=count) / whole
            off = column - at_face[faces]
            mean.append(at_face)
            deviation.append(np.sqrt(np.bincount(faces, weights=weights * off * off, minlength=count) / whole))
    return FaceMeans(np.stack(mean, axis=1), np.stack(deviation, axis=1))


def triangle_areas(mesh: Surface | RefinedMesh) -> Pieces[Floats]:
    """(T,) in object space."""
    areas = np.empty(len(mesh.triangles))
    for rows in rows_of(len(areas)):
        corners = mesh.positions[mesh.triangles[rows]].astype(np.float64)
        doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas[rows] = 0.5 * np.linalg.norm(doubled, axis=1)
        yield GO_ON
    return areas


def distinct_rows(rows: Floats) -> Pieces[tuple[Floats, NDArray[np.intp]]]:
    """The distinct rows of an (N, K) array in their order, and which of them each row is.

    Column by column: numpy sorts whole rows in one go that is as long as all of these.
    """
    which = np.zeros(len(rows), dtype=np.intp)
    first = np.zeros(min(len(rows), 1), dtype=np.intp)
    for column in rows.T:
        values, place = np.unique(column, return_inverse=True)
        if len(values) > 1:
            # At most N times N, which is no more than 2^63
            _, first, which = np.unique(which * len(values) + place, return_index=True, return_inverse=True)
        yield GO_ON
    return rows[first], which


def rounded(reflectance: Floats, exitance: Floats) -> tuple[Floats, Floats]:
    """Colours (N, 3) in steps that nobody can tell apart, so that few of them are distinct."""
    brightest = exitance.max(axis=1, initial=0.0, keepdims=True)
    scale = np.exp2(np.ceil(np.log2(np.maximum(brightest, np.finfo(np.float64).tiny))))
    return np.rint(reflectance * _STEPS) / _STEPS, np.rint(exitance / scale * _STEPS) / _STEPS * scale


def nodes_of(level: int) -> Floats:
    """(level², 3, 3) barycentric coordinates of the samples of a triangle."""
    i, j = np.meshgrid(np.arange(level), np.arange(level), indexing="ij")
    upright = i + j < level
    turned = i + j < level - 1
    steps = [np.array([[0, 0], [1, 0], [0, 1]]), np.array([[1, 1], [0, 1], [1, 0]])]
    at = [np.stack([i[chosen], j[chosen]], axis=1) for chosen in (upright, turned)]
    uv = np.concatenate([corner[:, None, :] + step for corner, step in zip(at, steps, strict=True)]) / level
    # Half-way from the middle to the corners lie the nodes.
    uv = 0.5 * (uv + uv.mean(axis=1, keepdims=True))
    return np.asarray(np.concatenate([1.0 - uv.sum(axis=2, keepdims=True), uv], axis=2))
