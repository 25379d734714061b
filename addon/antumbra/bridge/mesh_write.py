# SPDX-License-Identifier: GPL-3.0-or-later
"""A refined mesh to Blender, by foreach_set of whole buffers: a million triangles in under a second, in pieces."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.carry import (
    BakedMesh,
    carry_edge_attribute,
    carrying_attribute,
    carrying_normals,
    error_attribute,
    line_attribute,
    source_edge_of_corner,
)
from ..core.colours import RADIOSITY, light_attributes
from ..core.lights import Floats
from ..core.pieces import GO_ON, Pieces
from ..core.record import Attribute, FloatArray, IntArray, Surface
from ..core.settings import Settings
from .attribute_types import write_attribute
from .mesh_read import attribute_ints
from .temporary import remove


def writing_mesh(
    name: str,
    surface: Surface,
    baked: BakedMesh,
    materials: list[bpy.types.Material | None],
    settings: Settings,
    world_from_object: Floats | None = None,
) -> Pieces[bpy.types.Mesh]:
    """A new mesh with the baked faces, their light and all that the source mesh carried.

    With world_from_object the mesh is written in world space. Whoever leaves off half-way leaves no mesh behind;
    ReferenceError says that it, or one of its materials, was deleted between two pieces.
    """
    mesh = bpy.data.meshes.new(name)
    try:
        for material in materials:
            mesh.materials.append(material)
        normals = yield from _write_shape(mesh, surface, baked, world_from_object)
        yield from _write_carried(mesh, surface, baked)
        yield from _write_light(mesh, baked, settings)
        if normals is not None:
            write_normals(mesh, normals)
            yield GO_ON
        mesh.update()
    except BaseException:
        remove([mesh])
        raise
    return mesh


def _write_shape(
    mesh: bpy.types.Mesh, surface: Surface, baked: BakedMesh, world_from_object: Floats | None
) -> Pieces[FloatArray | None]:
    """Vertices, corners and faces, of which Blender finds the edges; returns the normals, to be written last."""
    positions = baked.positions
    normals = yield from carrying_normals(surface, baked)
    if world_from_object is not None:
        positions = positions @ world_from_object[:3, :3].T + world_from_object[:3, 3]
        if normals is not None:
            normals = _transformed_normals(normals, world_from_object)
        yield GO_ON
    write_faces(mesh, positions, baked.triangles)
    yield GO_ON
    return normals


def _write_carried(mesh: bpy.types.Mesh, surface: Surface, baked: BakedMesh) -> Pieces[None]:
    """Attributes by domain; those on edges need the edges' new numbers."""
    attributes = surface.attributes or []
    for attribute in attributes:
        if attribute.domain != "EDGE":
            carried = yield from carrying_attribute(attribute, surface, baked)
            write_attribute(mesh, carried)
            yield GO_ON
    on_edges = [attribute for attribute in attributes if attribute.domain == "EDGE"]
    if on_edges:
        source_edge, baked_edge = source_edge_of_corner(surface, baked), _edge_of_corner(mesh)
        for attribute in on_edges:
            yield GO_ON
            write_attribute(mesh, carry_edge_attribute(attribute, source_edge, baked_edge, len(mesh.edges)))
    activate_uv_maps(mesh, surface)
    yield GO_ON


def _write_light(mesh: bpy.types.Mesh, baked: BakedMesh, settings: Settings) -> Pieces[None]:
    """Light, the lines that it has, and its error."""
    if baked.edge_line.any():
        lines = line_attribute(baked, _edge_of_corner(mesh), len(mesh.edges))
        if lines is not None:
            write_attribute(mesh, lines)
        yield GO_ON
    errors = error_attribute(baked)
    if errors is not None:
        write_attribute(mesh, errors)
        yield GO_ON
    layers = yield from light_attributes(baked, settings)
    for layer in layers:
        write_attribute(mesh, layer)
        yield GO_ON
    mesh.color_attributes.active_color_name = RADIOSITY
    mesh.color_attributes.render_color_index = mesh.color_attributes.find(RADIOSITY)


def write_faces(mesh: bpy.types.Mesh, positions: Floats, triangles: IntArray) -> None:
    corner_count = len(triangles) * 3
    mesh.vertices.add(len(positions))
    mesh.loops.add(corner_count)
    mesh.polygons.add(len(triangles))
    position: Any = mesh.attributes["position"]
    position.data.foreach_set("vector", np.ascontiguousarray(positions, dtype=np.float32).reshape(-1))
    corners = np.ascontiguousarray(triangles, dtype=np.int32).reshape(-1)
    corner_vertex: Any = mesh.attributes.get(".corner_vert")
    if corner_vertex is not None:
        corner_vertex.data.foreach_set("value", corners)
    else:
        # The name is internal to Blender; this is the slower public way.
        mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.foreach_set("loop_start", np.arange(0, corner_count, 3, dtype=np.int32))
    mesh.update(calc_edges=True)


def _edge_of_corner(mesh: bpy.types.Mesh) -> IntArray:
    """(3T,)"""
    return attribute_ints(mesh, ".corner_edge", mesh.loops, "edge_index")


def activate_uv_maps(mesh: bpy.types.Mesh, surface: Surface) -> None:
    if surface.active_uv:
        mesh.uv_layers.active = mesh.uv_layers[surface.active_uv]
    if surface.active_render_uv:
        mesh.uv_layers[surface.active_render_uv].active_render = True


def write_normals(mesh: bpy.types.Mesh, normals: FloatArray) -> None:
    # From 4.5 on, normals can be stored as they are; before, Blender turns them into its corners' own frames.
    if bpy.app.version >= (4, 5, 0):
        write_attribute(mesh, Attribute("custom_normal", "CORNER", "FLOAT_VECTOR", normals, blends=True))
    else:
        mesh.normals_split_custom_set(normals)  # type: ignore[arg-type]


def _transformed_normals(normals: FloatArray, world_from_object: Floats) -> FloatArray:
    # Normals go by the inverse transpose; the cofactor matrix is that times the determinant, and never divides by 0.
    x, y, z = world_from_object[:3, 0], world_from_object[:3, 1], world_from_object[:3, 2]
    cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=1)
    turned = normals @ cofactors.T
    lengths = np.linalg.norm(turned, axis=1, keepdims=True)
    return np.asarray(turned / np.maximum(lengths, np.finfo(np.float64).tiny), dtype=np.float32)
