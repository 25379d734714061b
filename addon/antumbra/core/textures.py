# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures on a refined mesh: each element shows its own part of one, where transport knew the mean over the face.

On every element the texture becomes the linear function that is nearest to it in the mean square, within about what was
seen there. Elements are fitted one by one and not joined at their vertices: an edge of the texture that runs along
edges of the mesh stays as sharp as these, and what is smooth hardly jumps, since fits of a smooth function differ with
the square of the elements' size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .carry import BakedMesh, RefinedMesh
from .face_samples import Samples, nodes_by_level, small_triangles
from .lights import Floats
from .record import FloatArray, IntArray, Surface


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


def element_areas(baked: RefinedMesh) -> Floats:
    """(T,) in object space."""
    corners = baked.positions[baked.triangles]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(0.5 * np.linalg.norm(doubled, axis=1))


def place_on_elements(surface: Surface, baked: RefinedMesh, levels: IntArray) -> ElementSamples:
    """Samples on the elements of a baked mesh; levels (T,) as for faces, 0 for elements that nobody looks at."""
    elements = np.flatnonzero(levels > 0)
    element, in_element = nodes_by_level(levels[elements])
    source = baked.source_triangle[elements][element]
    in_source = np.einsum("snk,skx->snx", in_element, baked.corner_barycentric[elements][element])
    samples = small_triangles(surface, source, in_source)
    return ElementSamples(samples, elements.astype(np.int32), element, in_element)


def corner_values(placed: ElementSamples, values: NDArray[Any]) -> Floats:
    """(N, 3, K) at the corners of the elements, of the linear functions nearest to what was found, values (3S, K)."""
    count = len(placed.elements)
    element = np.repeat(placed.element, 3)
    within = placed.within.reshape(-1, 3)
    per_element = np.bincount(element, minlength=count)
    found = values.astype(np.float64)
    fitted = np.empty((count, 3, found.shape[1]))
    for column, at_sample in enumerate(found.T):
        moments = np.stack(
            [np.bincount(element, weights=within[:, k] * at_sample, minlength=count) / per_element for k in range(3)],
            axis=1,
        )
        # The inverse of the mass matrix of linear functions: 12/A (I - 1/4), the moments adding up to the mean.
        fitted[:, :, column] = 12.0 * moments - 3.0 * moments.sum(axis=1, keepdims=True)
    least = np.full((count, found.shape[1]), np.inf)
    most = -least
    np.minimum.at(least, element, found)
    np.maximum.at(most, element, found)
    # A linear function goes on from its outermost sample to the corner, a third of a part away; no more than that, or a
    # step would be overshot by half.
    parts = np.sqrt(per_element / 3.0)[:, None]
    margin = (most - least) * 2.0 / (3.0 * (2.0 * parts - 1.0))
    return np.clip(fitted, (least - margin)[:, None], (most + margin)[:, None])


def show_texture(
    baked: BakedMesh,
    elements: IntArray,
    reflectance: Floats,
    exitance: Floats,
    face_reflectance: Floats,
    face_exitance: Floats,
) -> None:
    """Give elements their own colours instead of their faces', in all layers of the baked mesh.

    reflectance and exitance (N, 3, 3) are per corner, face_reflectance and face_exitance (N, 3) what the solver knew.
    Where a face reflects nothing of a channel on the mean it reflects nothing anywhere.
    """
    known = np.where(face_reflectance > 0.0, face_reflectance, 1.0)[:, None]
    ratio = np.where(face_reflectance[:, None] > 0.0, reflectance / known, 0.0)

    def shown(layer: FloatArray, emits: bool) -> FloatArray:
        own, faces = (exitance, face_exitance[:, None]) if emits else (0.0, 0.0)
        reflected = layer[elements].astype(np.float64) - faces / np.float64(math.pi)
        return np.asarray(own / np.float64(math.pi) + ratio * reflected, dtype=np.float32)

    baked.corner_radiance[elements] = shown(baked.corner_radiance, True)
    if baked.corner_direct is not None and baked.corner_indirect is not None:
        baked.corner_direct[elements] = shown(baked.corner_direct, True)
        baked.corner_indirect[elements] = shown(baked.corner_indirect, False)
