# SPDX-License-Identifier: GPL-3.0-or-later
"""Look up the colour that an interpolated render of a baked mesh shows at a point of its source's surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FACING = 0.5
"""Least cosine between a triangle's normal and the point's. Flat triangles agree to rounding, so anything between the
angles of real furniture and 1 works; 0.5 also keeps neighbours across a right angle apart."""


@dataclass
class Surface:
    """Triangles of everything that was baked from one source object: (T, 3 corners, 3), in metres and in B/pi."""

    corners: Floats
    colours: Floats

    def __post_init__(self) -> None:
        cross = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        double_area = np.linalg.norm(cross, axis=1)
        # Slivers without an area show nothing.
        solid = double_area > 0.0
        self.corners, self.colours = self.corners[solid], self.colours[solid]
        self.normals = cross[solid] / double_area[solid, None]
        self.low, self.high = self.corners.min(axis=1), self.corners.max(axis=1)

    def at(self, points: Floats, normals: Floats, within_m: float) -> Floats:
        """Colours (N, 3) at the points (N, 3) that face along the normals (N, 3).

        The nearest triangle that faces the same way decides; NaN where there is none within `within_m`.
        """
        found = np.full((len(points), 3), np.nan)
        for index, (point, normal) in enumerate(zip(points, normals, strict=True)):
            near = np.flatnonzero(
                ((self.low <= point + within_m) & (self.high >= point - within_m)).all(axis=1)
                & (self.normals @ normal > FACING)
            )
            if not len(near):
                continue
            weights = barycentric(point, self.corners[near], self.normals[near])
            places = np.einsum("tc,tcx->tx", weights, self.corners[near])
            distances = np.linalg.norm(places - point, axis=1)
            nearest = int(np.argmin(distances))
            if distances[nearest] <= within_m:
                found[index] = weights[nearest] @ self.colours[near[nearest]]
        return found


def barycentric(point: Floats, corners: Floats, normals: Floats) -> Floats:
    """Weights (T, 3) of the place nearest to the point (3) in each triangle (T, 3, 3) with its unit normal (T, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    edges = np.stack([c - b, a - c, b - a], axis=1)
    starts = np.stack([b, c, a], axis=1)
    inside = np.einsum("tex,tx->te", np.cross(edges, point - starts), normals)
    weights = np.asarray(inside / inside.sum(axis=1, keepdims=True))
    outside = (weights < 0.0).any(axis=1)
    if not outside.any():
        return weights

    # From outside, the nearest place lies on an edge.
    best = np.full(outside.sum(), np.inf)
    nearest = np.zeros((len(best), 3))
    for edge in range(3):
        start, along = starts[outside, edge], edges[outside, edge]
        t = np.clip(((point - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        distance = np.linalg.norm(start + t[:, None] * along - point, axis=1)
        closer = distance < best
        on_edge = np.zeros((len(best), 3))
        # Edge number e runs from corner e + 1 to corner e + 2.
        on_edge[:, (edge + 1) % 3], on_edge[:, (edge + 2) % 3] = 1.0 - t, t
        best, nearest = np.where(closer, distance, best), np.where(closer[:, None], on_edge, nearest)
    weights[outside] = nearest
    return weights
