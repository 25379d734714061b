# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes carried from a source mesh to its refined mesh.

Every baked vertex and corner knows its source triangle and its barycentric coordinates there. Values that blend are
interpolated in double precision, so a source vertex keeps its value exactly; others take the value of the nearest
source corner. Values on faces are copied, values on edges go to the pieces of that edge and are zero elsewhere.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .lights import Floats
from .pieces import GO_ON, Pieces, at_once, rows_of
from .record import Attribute, FloatArray, IntArray, Surface

ERROR = "antumbra_error"
"""Name of the corner attribute with the error that the solver estimates there, as a share of the mean light."""

LINE = "antumbra_line"
"""Name of the edge attribute with the lines: 1 where the slope of light changes, 2 where a sharp shadow ends, 3 where
something touches the face, 0 elsewhere."""


class RefinedMesh(Protocol):
    """A mesh of V vertices and T triangles that are parts of a source mesh's."""

    @property
    def positions(self) -> Floats: ...
    @property
    def vertex_source_triangle(self) -> IntArray: ...
    @property
    def vertex_barycentric(self) -> Floats: ...
    @property
    def triangles(self) -> IntArray: ...
    @property
    def source_triangle(self) -> IntArray: ...
    @property
    def corner_barycentric(self) -> Floats: ...
    @property
    def source_edge(self) -> NDArray[np.int8]: ...


class BakedMesh(RefinedMesh, Protocol):
    """The refined mesh as the solver returns it."""

    @property
    def object(self) -> int: ...
    @property
    def edge_line(self) -> NDArray[np.int8]: ...
    @property
    def corner_radiance(self) -> FloatArray: ...
    @property
    def corner_error(self) -> FloatArray | None: ...
    @property
    def corner_direct(self) -> FloatArray | None: ...
    @property
    def corner_indirect(self) -> FloatArray | None: ...


def carry_attribute(attribute: Attribute, surface: Surface, baked: RefinedMesh) -> Attribute:
    """The attribute on the refined mesh, for the domains POINT, FACE and CORNER."""
    return at_once(carrying_attribute(attribute, surface, baked))


def carrying_attribute(attribute: Attribute, surface: Surface, baked: RefinedMesh) -> Pieces[Attribute]:
    """What carry_attribute() does."""
    parts = [attribute.values[:0]]
    match attribute.domain:
        case "POINT":
            for rows in rows_of(len(baked.positions)):
                sources = surface.triangles[baked.vertex_source_triangle[rows]]
                parts.append(_mix(attribute, sources, baked.vertex_barycentric[rows]))
                yield GO_ON
        case "CORNER":
            for rows in rows_of(len(baked.triangles)):
                parts.append(_mix(attribute, *_corners(surface, baked, rows)))
                yield GO_ON
        case "FACE":
            parts.append(attribute.values[surface.triangle_faces[baked.source_triangle]])
        case domain:
            raise ValueError(f"attribute “{attribute.name}” on domain {domain} cannot be carried by corners")
    values = np.concatenate(parts)
    return Attribute(attribute.name, attribute.domain, attribute.data_type, values, attribute.blends)


def source_edge_of_corner(surface: Surface, baked: RefinedMesh) -> IntArray:
    """(3T,) for the edge that starts at each baked corner: the source mesh's edge it is a piece of, or -1."""
    side = baked.source_edge.astype(np.int32)
    edges = surface.triangle_edges[baked.source_triangle[:, None], np.maximum(side, 0)]
    return np.asarray(np.where(side >= 0, edges, -1), dtype=np.int32).reshape(-1)


def carry_edge_attribute(
    attribute: Attribute, source_edge: IntArray, baked_edge_of_corner: IntArray, baked_edges: int
) -> Attribute:
    """The EDGE attribute on the refined mesh, whose edges Blender has numbered by now.

    source_edge as from source_edge_of_corner(); baked_edge_of_corner (3T,) the new mesh's edge that starts there.
    """
    shape = (baked_edges, *attribute.values.shape[1:])
    if attribute.values.dtype == object:
        # The empty text of whichever kind Blender uses.
        values = np.full(shape, type(attribute.values.flat[0])(), dtype=object)
    else:
        values = np.zeros(shape, dtype=attribute.values.dtype)
    on_edge = source_edge >= 0
    values[baked_edge_of_corner[on_edge]] = attribute.values[source_edge[on_edge]]
    return Attribute(attribute.name, "EDGE", attribute.data_type, values, attribute.blends)


def line_attribute(baked: BakedMesh, baked_edge_of_corner: IntArray, baked_edges: int) -> Attribute | None:
    """The lines that the edges lie on, the strongest where the faces beside an edge differ; None without any."""
    lines = baked.edge_line.reshape(-1)
    corners = np.flatnonzero(lines)
    if len(corners) == 0:
        return None
    values = np.zeros((baked_edges, 1), dtype=np.int32)
    # The last one written stays.
    corners = corners[np.argsort(lines[corners], kind="stable")]
    values[baked_edge_of_corner[corners], 0] = lines[corners]
    return Attribute(LINE, "EDGE", "INT8", values, blends=False)


def error_attribute(baked: BakedMesh) -> Attribute | None:
    """The error that the solver estimates around each corner; None without any."""
    if baked.corner_error is None or not baked.corner_error.any():
        return None
    return Attribute(ERROR, "CORNER", "FLOAT", baked.corner_error.reshape(-1, 1), blends=True)


def carry_normals(surface: Surface, baked: RefinedMesh) -> FloatArray | None:
    """What carrying_normals() does, without a stop."""
    return at_once(carrying_normals(surface, baked))


def carrying_normals(surface: Surface, baked: RefinedMesh) -> Pieces[FloatArray | None]:
    """(3T, 3) shading normals to write as custom normals, or None where Blender's own come out right.

    Blender derives smooth normals from the faces, and the pieces of a flat face are all flat: without custom normals a
    refined smooth surface would show its facets.
    """
    if surface.corner_normals is None:
        return None
    refined = len(baked.triangles) != len(surface.triangles)
    if not refined and not surface.has_custom_normals:
        return None
    carried = np.empty((3 * len(baked.triangles), 3), dtype=np.float32)
    for rows in rows_of(len(baked.triangles)):
        normals = _blend(surface.corner_normals, *_corners(surface, baked, rows))
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        carried[3 * rows.start : 3 * rows.stop] = normals / np.maximum(lengths, np.finfo(np.float64).tiny)
        yield GO_ON
    return carried


def _corners(surface: Surface, baked: RefinedMesh, rows: slice) -> tuple[IntArray, Floats]:
    """(3R, 3) of R baked triangles: the three source corners and the coordinates of each baked corner."""
    sources = np.repeat(surface.triangle_corners[baked.source_triangle[rows]], 3, axis=0)
    return sources, baked.corner_barycentric[rows].reshape(-1, 3)


def _mix(attribute: Attribute, sources: IntArray, barycentric: Floats) -> NDArray[Any]:
    if attribute.blends:
        return _blend(attribute.values, sources, barycentric).astype(attribute.values.dtype)
    nearest = np.argmax(barycentric, axis=1)
    return np.asarray(attribute.values[np.take_along_axis(sources, nearest[:, None], axis=1)[:, 0]])


def _blend(values: NDArray[Any], sources: IntArray, barycentric: Floats) -> Floats:
    """sum_k barycentric[:, k] · values[sources[:, k]] without ever holding all three terms."""
    total = barycentric[:, 0, None] * values[sources[:, 0]]
    for k in (1, 2):
        total += barycentric[:, k, None] * values[sources[:, k]]
    return np.asarray(total, dtype=np.float64)
