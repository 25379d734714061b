# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh had before a bake, its refined mesh has too."""

import bpy
import numpy as np
import pytest
from scenes import (
    add_area_light,
    add_cube,
    add_grid,
    add_material,
    add_mesh,
    add_plane,
    bake,
    baked_of,
    corner_vertices,
    face_areas,
    faces_per_edge,
    positions,
    radiance,
)

POINT_TYPES = {
    "FLOAT": 0.5,
    "INT": 7,
    "INT8": -3,
    "BOOLEAN": True,
    "FLOAT_VECTOR": (1, 2, 3),
    "FLOAT2": (0.25, 4),
    "FLOAT_COLOR": (8, 0.5, 0, 1),
    "BYTE_COLOR": (1, 0, 1, 1),
    "INT32_2D": (5, -6),
    "QUATERNION": (0, 1, 0, 0),
    "STRING": b"word",
}
# Blender stores custom normals of a source as two 16-bit angles, and before 4.5 those of a bake too.
NORMAL_ERROR = 1e-4 if bpy.app.version >= (4, 5, 0) else 1e-2
PROPERTY = {"FLOAT_VECTOR": "vector", "FLOAT2": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}


@pytest.mark.parametrize("data_type", POINT_TYPES)
@pytest.mark.parametrize("domain", ["POINT", "FACE", "CORNER", "EDGE"])
def test_attributes_of_every_type_on_every_domain(data_type, domain):
    plane = add_plane()
    expected = POINT_TYPES[data_type]
    prop = PROPERTY.get(data_type, "value")
    for item in plane.data.attributes.new("mine", data_type, domain).data:
        setattr(item, prop, expected)
    add_area_light()
    bake()
    mesh = baked_of("Plane").data
    carried = mesh.attributes["mine"]
    assert (carried.data_type, carried.domain) == (data_type, domain)
    outline = np.flatnonzero(faces_per_edge(mesh) == 1) if domain == "EDGE" else range(len(carried.data))
    assert len(outline) > 0
    for index in outline:
        value = getattr(carried.data[index], prop)
        if isinstance(expected, tuple):
            assert tuple(value) == pytest.approx(expected)
        else:
            assert value == expected


def test_the_mesh_is_refined_and_covers_the_same_faces():
    cube = add_cube()
    bpy.context.view_layer.update()
    cube.data.materials.append(add_material("a"))
    cube.data.materials.append(None)
    cube.data.materials.append(add_material("c"))
    cube.data.polygons.foreach_set("material_index", [0, 1, 2, 0, 1, 2])
    add_area_light(location=(0.7, 0, 2), size=0.5)
    bake(tolerance=0.02, max_level=3)
    mesh = baked_of("Cube").data
    assert len(mesh.polygons) > 12
    assert [getattr(m, "name", None) for m in mesh.materials] == ["a", None, "c"]
    slots = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    assert np.bincount(slots, weights=face_areas(mesh)) == pytest.approx([8, 8, 8], rel=1e-6)


def test_uv_maps_are_the_same_linear_map_everywhere():
    # Values with few binary digits, so that every bit of the interpolation shows.
    grid = add_grid(cells=2, size=2.0)
    mesh = grid.data
    for name, scale in (("first", (0.5, 0.25)), ("second", (2.0, -1.0)), ("third", (0.125, 1.0))):
        layer = mesh.uv_layers.new(name=name)
        layer.uv.foreach_set("vector", (positions(mesh)[corner_vertices(mesh)][:, :2] * scale).reshape(-1))
    mesh.uv_layers["third"].active_render = True
    mesh.uv_layers.active = mesh.uv_layers["second"]
    add_area_light(size=0.3, location=(0.2, 0.1, 1))
    bake(tolerance=0.03, max_level=3)

    baked = baked_of("Grid").data
    assert [layer.name for layer in baked.uv_layers] == ["first", "second", "third"]
    assert baked.uv_layers.active.name == "second"
    assert [layer.active_render for layer in baked.uv_layers] == [False, False, True]
    at_corners = positions(baked)[corner_vertices(baked)][:, :2]
    for name, scale in (("first", (0.5, 0.25)), ("second", (2.0, -1.0)), ("third", (0.125, 1.0))):
        uv = np.empty(len(baked.loops) * 2, dtype=np.float32)
        baked.uv_layers[name].uv.foreach_get("vector", uv)
        assert np.array_equal(uv.reshape(-1, 2), at_corners * np.float32(scale))


def test_source_vertices_keep_their_bits():
    grid = add_grid(cells=3, size=1.7)
    before = {tuple(p) for p in positions(grid.data).tolist()}
    add_area_light()
    bake()
    assert before <= {tuple(p) for p in positions(baked_of("Grid").data).tolist()}


def test_watertight_stays_watertight():
    add_cube()
    add_area_light(location=(2, 1, 2), size=0.5)
    bake(tolerance=0.02, max_level=3)
    mesh = baked_of("Cube").data
    assert (faces_per_edge(mesh) == 2).all()
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.polygons) == 2
    assert face_areas(mesh).min() > 0


def test_edges_keep_sharpness_crease_and_seam_on_their_pieces():
    cube = add_cube(smooth=True)
    mesh = cube.data
    chosen = [0, 3, 5]
    for name, data_type in (("sharp_edge", "BOOLEAN"), ("crease_edge", "FLOAT")):
        values = mesh.attributes.new(name, data_type, "EDGE").data
        for index in chosen:
            values[index].value = 1
    for index in chosen:
        mesh.edges[index].use_seam = True
    segments = [tuple(tuple(mesh.vertices[v].co) for v in mesh.edges[index].vertices) for index in chosen]
    add_area_light(location=(2, 1, 2), size=0.5)
    bake(tolerance=0.02, max_level=3)

    baked = baked_of("Cube").data
    sharp = [edge for edge in baked.edges if edge.use_edge_sharp]
    for edge in sharp:
        ends = np.array([baked.vertices[v].co for v in edge.vertices])
        assert any(_on_segment(ends, np.array(segment)) for segment in segments)
    lengths = [np.linalg.norm(np.subtract(*(baked.vertices[v].co for v in edge.vertices))) for edge in sharp]
    assert sum(lengths) == pytest.approx(6.0, rel=1e-6)
    assert [edge.use_seam for edge in baked.edges] == [edge.use_edge_sharp for edge in baked.edges]
    crease = baked.attributes["crease_edge"].data
    assert [item.value == 1.0 for item in crease] == [edge.use_edge_sharp for edge in baked.edges]


def _on_segment(points, segment):
    start, direction = segment[0], segment[1] - segment[0]
    along = (points - start) @ direction / (direction @ direction)
    off = points - start - along[:, None] * direction
    return np.abs(off).max() < 1e-6 and along.min() > -1e-6 and along.max() < 1 + 1e-6


def test_flat_faces_stay_flat_and_smooth_ones_stay_smooth():
    cube = add_cube()
    cube.data.polygons[0].use_smooth = True
    add_area_light(location=(2, 1, 2), size=0.5)
    bake()
    mesh = baked_of("Cube").data
    areas = face_areas(mesh)
    smooth = np.array([polygon.use_smooth for polygon in mesh.polygons])
    assert areas[smooth].sum() == pytest.approx(4.0, rel=1e-6)


def test_refined_smooth_surfaces_are_shaded_as_before():
    # An octahedron's smooth normals point away from its centre; its refined faces are flat and would not.
    octahedron = add_mesh(
        "Ball",
        [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)],
        [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)],
        smooth=True,
    )
    assert octahedron.data.normals_domain != "FACE"
    add_area_light(location=(2, 1, 2), size=0.5)
    bake(tolerance=0.02, max_level=3)
    mesh = baked_of("Ball").data
    assert len(mesh.polygons) > 8
    normals = np.array([item.vector for item in mesh.corner_normals])
    places = positions(mesh)[corner_vertices(mesh)]
    radial = places / np.linalg.norm(places, axis=1, keepdims=True)
    # Interpolated on a face of an octahedron, the normals are the places themselves, normalised.
    assert np.abs(normals - radial).max() < NORMAL_ERROR


def test_custom_normals_are_kept():
    plane = add_plane()
    tilted = np.array([(-0.6, 0, 0.8), (0.6, 0, 0.8), (0.6, 0, 0.8), (-0.6, 0, 0.8)])
    plane.data.normals_split_custom_set(tilted.tolist())
    add_area_light()
    bake()
    mesh = baked_of("Plane").data
    places = positions(mesh)[corner_vertices(mesh)]
    expected = np.stack([0.6 * places[:, 0], np.zeros(len(places)), np.full(len(places), 0.8)], axis=1)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    normals = np.array([item.vector for item in mesh.corner_normals])
    assert np.abs(normals - expected).max() < NORMAL_ERROR


def test_colours_are_there_active_opaque_and_finite():
    plane = add_plane()
    plane.data.color_attributes.new("Painted", "BYTE_COLOR", "CORNER")
    add_area_light()
    bake()
    mesh = baked_of("Plane").data
    layer = mesh.color_attributes["Radiosity"]
    assert (layer.data_type, layer.domain) == ("FLOAT_COLOR", "CORNER")
    assert mesh.color_attributes.active_color.name == "Radiosity"
    assert mesh.color_attributes[mesh.color_attributes.render_color_index].name == "Radiosity"
    assert "Painted" in mesh.color_attributes
    colours = radiance(mesh)
    assert np.isfinite(colours).all()
    assert colours.min() >= 0
    assert colours.max() > 0
    assert all(item.color[3] == 1.0 for item in layer.data)
