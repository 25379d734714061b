# SPDX-License-Identifier: GPL-3.0-or-later
"""An evaluated mesh to arrays, by foreach_get into buffers of Blender's own types.

Attributes come as one block of memory, a thousand times as fast as the same numbers through loops and polygons.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.carry import ERROR, LINE
from ..core.colours import LIGHT
from ..core.pieces import GO_ON, Pieces
from ..core.record import Attribute, FloatArray, IntArray, Surface
from .attribute_types import STRUCTURE, read_attribute


def read_surface(mesh: bpy.types.Mesh) -> Pieces[Surface | None]:
    """The mesh as triangles; None when it has no faces. Loose vertices and edges take no part in a bake."""
    mesh.calc_loop_triangles()
    if len(mesh.loop_triangles) == 0:
        return None
    triangle_count, corner_count, face_count = len(mesh.loop_triangles), len(mesh.loops), len(mesh.polygons)

    yield GO_ON
    triangle_corners = _ints(mesh.loop_triangles, "loops", triangle_count * 3).reshape(-1, 3)
    corner_edges = attribute_ints(mesh, ".corner_edge", mesh.loops, "edge_index")
    corner_vertices = attribute_ints(mesh, ".corner_vert", mesh.loops, "vertex_index")
    face_starts = _ints(mesh.polygons, "loop_start", face_count)
    triangle_faces = _ints(mesh.loop_triangle_polygons, "value", triangle_count)
    yield GO_ON
    corner_normals = None if mesh.normals_domain == "FACE" else _vectors(mesh.corner_normals, "vector", corner_count)
    yield GO_ON
    triangle_edges = _triangle_edges(triangle_corners, corner_edges, face_starts)
    yield GO_ON
    position: Any = mesh.attributes["position"]
    return Surface(
        positions=_vectors(position.data, "vector", len(mesh.vertices)),
        triangles=corner_vertices[triangle_corners],
        triangle_corners=triangle_corners,
        triangle_faces=triangle_faces,
        triangle_edges=triangle_edges,
        face_materials=_material_slots(mesh),
        corner_normals=corner_normals,
        has_custom_normals=mesh.has_custom_normals,
        active_uv=mesh.uv_layers.active.name if mesh.uv_layers.active else "",
        active_render_uv=next((layer.name for layer in mesh.uv_layers if layer.active_render), ""),
        active_render_colour=_name_at(mesh.color_attributes, mesh.color_attributes.render_color_index),
        texture_space=(tuple(mesh.texspace_location[:]), tuple(mesh.texspace_size[:])),
    )


def read_attributes(mesh: bpy.types.Mesh) -> tuple[list[Attribute], list[str]]:
    """What a refined mesh has to carry on, and the names of what it cannot."""
    sizes = {
        "POINT": len(mesh.vertices),
        "EDGE": len(mesh.edges),
        "FACE": len(mesh.polygons),
        "CORNER": len(mesh.loops),
    }
    carried, lost = [], []
    for attribute in mesh.attributes:
        # Names with a dot are Blender's own and hidden: selection, visibility, pins. Seams were one of them before 4.4.
        hidden = attribute.is_internal or attribute.name.startswith(".")
        if (
            attribute.name in STRUCTURE
            or attribute.name in (*LIGHT, LINE, ERROR)
            or (hidden and attribute.name != ".uv_seam")
        ):
            continue
        copy = read_attribute(attribute, sizes[attribute.domain])
        if copy is None:
            lost.append(attribute.name)
        else:
            carried.append(copy)
    return carried, lost


def _triangle_edges(triangle_corners: IntArray, corner_edges: IntArray, face_starts: IntArray) -> IntArray:
    """(T, 3) mesh edges from corner k to k+1; -1 for the diagonals that triangulation drew."""
    # The corner that follows each corner around its face.
    following = np.arange(1, len(corner_edges) + 1, dtype=np.int32)
    face_ends = np.append(face_starts[1:], len(corner_edges))
    following[face_ends - 1] = face_starts
    on_edge = following[triangle_corners] == np.roll(triangle_corners, -1, axis=1)
    return np.asarray(np.where(on_edge, corner_edges[triangle_corners], -1), dtype=np.int32)


def _material_slots(mesh: bpy.types.Mesh) -> IntArray:
    """(F,) slots; Blender stores none where all faces have the first."""
    attribute: Any = mesh.attributes.get("material_index")
    if attribute is None:
        return np.zeros(len(mesh.polygons), dtype=np.int32)
    if attribute.domain != "FACE" or attribute.data_type != "INT":
        return _ints(mesh.polygons, "material_index", len(mesh.polygons))
    return _ints(attribute.data, "value", len(mesh.polygons))


def attribute_ints(mesh: bpy.types.Mesh, name: str, collection: Any, prop: str) -> IntArray:
    """One number per item of the collection: from the attribute that holds it, or the slower public way.

    The attribute's name is internal to Blender.
    """
    attribute: Any = mesh.attributes.get(name)
    if attribute is None or attribute.data_type != "INT" or len(attribute.data) != len(collection):
        return _ints(collection, prop, len(collection))
    return _ints(attribute.data, "value", len(collection))


def _name_at(layers: Any, index: int) -> str:
    return layers[index].name if 0 <= index < len(layers) else ""


def _ints(collection: Any, prop: str, size: int) -> IntArray:
    values: NDArray[np.int32] = np.empty(size, dtype=np.int32)
    collection.foreach_get(prop, values)
    return values


def _vectors(collection: Any, prop: str, size: int) -> FloatArray:
    values: NDArray[np.float32] = np.empty(size * 3, dtype=np.float32)
    collection.foreach_get(prop, values)
    return values.reshape(-1, 3)
