# SPDX-License-Identifier: GPL-3.0-or-later
"""Small meshes as arrays, and their refinement by hand."""

from dataclasses import dataclass

import numpy as np
from antumbra.core.record import ObjectRecord, SceneRecord, Surface

UNIT = np.eye(3)
MIDDLES = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]])


def quad_surface(corner_normals=None):
    """A unit square of one face with corners 0 1 2 3, as two triangles that share the diagonal 0-2."""
    return Surface(
        positions=np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float32),
        triangles=np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
        triangle_corners=np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
        triangle_faces=np.zeros(2, dtype=np.int32),
        triangle_edges=np.array([[0, 1, -1], [-1, 2, 3]], dtype=np.int32),
        face_materials=np.zeros(1, dtype=np.int32),
        corner_normals=corner_normals,
        has_custom_normals=False,
    )


def record(surface, world_from_object=None, material=0, name="Quad", receives=True):
    return ObjectRecord(
        name=name,
        owner_uid=1,
        is_instance=False,
        surface=surface,
        world_from_object=np.eye(4) if world_from_object is None else world_from_object,
        slot_materials=(material,),
        slot_uids=(),
        receives=receives,
    )


def scene(*objects, materials, lights=()):
    return SceneRecord(objects=list(objects), materials=list(materials), lights=list(lights))


@dataclass
class Refined:
    """What a solver returns for one object."""

    object: int
    positions: np.ndarray
    vertex_source_triangle: np.ndarray
    vertex_barycentric: np.ndarray
    triangles: np.ndarray
    source_triangle: np.ndarray
    corner_barycentric: np.ndarray
    source_edge: np.ndarray
    edge_line: np.ndarray
    corner_radiance: np.ndarray
    corner_error: np.ndarray | None = None
    corner_direct: np.ndarray | None = None
    corner_indirect: np.ndarray | None = None


def split_in_four(surface):
    """Every triangle cut at the middles of its edges, which neighbours share."""
    positions = surface.positions.astype(float).tolist()
    count = len(positions)
    vertex_triangle, vertex_barycentric = [0] * count, [None] * count
    middles, triangles, sources, barycentrics, edges = {}, [], [], [], []
    for index, triangle in enumerate(surface.triangles.tolist()):
        middle = []
        for k in range(3):
            vertex_triangle[triangle[k]], vertex_barycentric[triangle[k]] = index, UNIT[k]
            key = tuple(sorted((triangle[k], triangle[(k + 1) % 3])))
            if key not in middles:
                middles[key] = len(positions)
                positions.append((np.array(positions[key[0]]) + np.array(positions[key[1]])) / 2)
                vertex_triangle.append(index)
                vertex_barycentric.append(MIDDLES[k])
            middle.append(middles[key])
        (a, b, c), (ab, bc, ca) = triangle, middle
        triangles += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        barycentrics += [
            (UNIT[0], MIDDLES[0], MIDDLES[2]),
            (MIDDLES[0], UNIT[1], MIDDLES[1]),
            (MIDDLES[2], MIDDLES[1], UNIT[2]),
            MIDDLES,
        ]
        edges += [(0, -1, 2), (0, 1, -1), (-1, 1, 2), (-1, -1, -1)]
        sources += [index] * 4
    return Refined(
        object=0,
        positions=np.array([np.asarray(p) for p in positions]),
        vertex_source_triangle=np.array(vertex_triangle, dtype=np.int32),
        vertex_barycentric=np.array(vertex_barycentric),
        triangles=np.array(triangles, dtype=np.int32),
        source_triangle=np.array(sources, dtype=np.int32),
        corner_barycentric=np.array(barycentrics),
        source_edge=np.array(edges, dtype=np.int8),
        edge_line=np.zeros((len(triangles), 3), dtype=np.int8),
        corner_radiance=np.zeros((len(triangles), 3, 3), dtype=np.float32),
    )
