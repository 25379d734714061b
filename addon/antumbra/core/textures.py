# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures on a refined mesh: each element shows its own part of one, where transport knew the mean over the face.

On every element the texture becomes the linear function that is nearest to it in the mean square, within about what was
seen there. Elements are fitted one by one and not joined at their vertices: an edge of the texture that runs along
edges of the mesh stays as sharp as these, and what is smooth hardly jumps, since fits of a smooth function differ with
the square of the elements' size.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .carry import BakedMesh, RefinedMesh
from .face_samples import Samples, nodes_by_level, small_triangles
from .lights import Floats
from .pieces import GO_ON, ROWS, Pieces, rows_of
from .record import IntArray, Surface


@dataclass(frozen=True, slots=True)
class ElementSamples:
    """Samples on N chosen elements of a refined mesh."""

    samples: Samples
    elements: IntArray
    """(N,) the chosen elements."""
    element: IntArray
    """(S,) which of these each small triangle is on."""
    within: Floats
    """(S, 3, 3) barycentric coordinates of its corners there."""


def place_on_elements(surface: Surface, baked: RefinedMesh, levels: IntArray) -> Pieces[ElementSamples]:
    """Samples on the elements of a baked mesh; levels (T,) as for faces, 0 for elements that nobody looks at."""
    elements = np.flatnonzero(levels > 0)
    element, in_element = nodes_by_level(levels[elements])
    yield GO_ON
    source = baked.source_triangle[elements][element]
    in_source = np.empty_like(in_element)
    for rows in rows_of(len(element)):
        in_source[rows] = in_element[rows] @ baked.corner_barycentric[elements[element[rows]]]
        yield GO_ON
    samples = yield from small_triangles(surface, source, in_source)
    return ElementSamples(samples, elements.astype(np.int32), element, in_element)


def corner_values(placed: ElementSamples, values: NDArray[Any]) -> Pieces[Floats]:
    """(N, 3, K) at the corners of the elements, of the linear functions nearest to what was found, values (3S, K)."""
    fitted = np.empty((len(placed.elements), 3, values.shape[1]))
    # The small triangles of an element follow each other.
    firsts = np.flatnonzero(np.diff(placed.element, prepend=-1))
    ends = np.append(firsts, len(placed.element))[1:]
    for runs in _runs_in_pieces(ends):
        first, end = firsts[runs][0], ends[runs][-1]
        counts = 3 * (ends[runs] - firsts[runs])
        fitted[placed.element[firsts[runs]]] = _fitted(
            placed.within[first:end].reshape(-1, 3), values[3 * first : 3 * end].astype(np.float64), counts
        )
        yield GO_ON
    return fitted


def _runs_in_pieces(ends: NDArray[np.intp]) -> Iterator[slice]:
    """Runs that together have about as many rows as a piece."""
    of_piece = ends // (ROWS // 3)
    borders = [0, *(np.flatnonzero(np.diff(of_piece)) + 1).tolist(), len(ends)]
    return (slice(first, end) for first, end in pairwise(borders) if end > first)


def _fitted(within: Floats, found: Floats, counts: NDArray[np.intp]) -> Floats:
    """(R, 3, K) for R elements whose samples follow each other, so many of each."""
    firsts = np.cumsum(counts) - counts
    moments = np.add.reduceat(within[:, :, None] * found[:, None, :], firsts, axis=0) / counts[:, None, None]
    # The inverse of the mass matrix of linear functions: 12/A (I - 1/4), the moments adding up to the mean.
    fitted = 12.0 * moments - 3.0 * moments.sum(axis=1, keepdims=True)
    least, most = np.minimum.reduceat(found, firsts, axis=0), np.maximum.reduceat(found, firsts, axis=0)
    # A linear function goes on from its outermost sample to the corner, a third of a part away; no more than that, or a
    # step would be overshot by half.
    parts = np.sqrt(counts / 3.0)[:, None]
    margin = (most - least) * 2.0 / (3.0 * (2.0 * parts - 1.0))
    return np.asarray(np.clip(fitted, (least - margin)[:, None], (most + margin)[:, None]))


def show_texture(
    baked: BakedMesh,
    elements: IntArray,
    reflectance: Floats,
    exitance: Floats,
    face_reflectance: Floats,
    face_exitance: Floats,
) -> Pieces[None]:
    """Give elements their own colours instead of their faces', in all layers of the baked mesh, with the last piece.

    reflectance and exitance (N, 3, 3) are per corner, face_reflectance and face_exitance (N, 3) what the solver knew.
    Where a face reflects nothing of a channel on the mean it reflects nothing anywhere.
    """
    layers = [(baked.corner_radiance, True)]
    if baked.corner_direct is not None and baked.corner_indirect is not None:
        layers += [(baked.corner_direct, True), (baked.corner_indirect, False)]
    shown = [np.empty((len(elements), 3, 3), dtype=np.float32) for _ in layers]
    for rows in rows_of(len(elements)):
        known = np.where(face_reflectance[rows] > 0.0, face_reflectance[rows], 1.0)[:, None]
        ratio = np.where(face_reflectance[rows, None] > 0.0, reflectance[rows] / known, 0.0)
        for (layer, emits), new in zip(layers, shown, strict=True):
            own, faces = (exitance[rows], face_exitance[rows, None]) if emits else (0.0, 0.0)
            reflected = layer[elements[rows]].astype(np.float64) - faces / np.float64(math.pi)
            new[rows] = own / np.float64(math.pi) + ratio * reflected
        yield GO_ON
    for (layer, _), new in zip(layers, shown, strict=True):
        layer[elements] = new
