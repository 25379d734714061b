# SPDX-License-Identifier: GPL-3.0-or-later
"""Every kind of object that Blender has: baked, or named."""

import math

import bmesh
import bpy
import pytest
from extension import last_warnings, read_scene
from fingerprint import fingerprint
from scenes import (
    add_cube,
    add_material,
    add_mesh,
    add_plane,
    assert_lit_from_above,
    bake_below_a_lamp,
    baked_of,
    face_areas,
    faces_per_edge,
    link,
    middle_of,
    select,
    sources,
    world_positions,
)


def height_of(obj):
    heights = world_positions(obj)[:, 2]
    return heights.min(), heights.max()


# Objects that become meshes


def add_curve():
    curve = bpy.data.curves.new("Pipe", "CURVE")
    curve.dimensions, curve.bevel_depth, curve.bevel_resolution = "3D", 0.1, 2
    spline = curve.splines.new("POLY")
    spline.points.add(2)
    for point, x in zip(spline.points, (-1, 0, 1), strict=True):
        point.co = (x, 0, 0.5, 1)
    return link(bpy.data.objects.new("Pipe", curve))


def add_text():
    text = bpy.data.curves.new("Words", "FONT")
    text.body, text.extrude = "Hi", 0.05
    return link(bpy.data.objects.new("Words", text))


def add_metaballs():
    ball = bpy.data.metaballs.new("Drop")
    ball.render_resolution = 0.3
    for x in (-0.4, 0.4):
        ball.elements.new().co = (x, 0, 0)
    return link(bpy.data.objects.new("Drop", ball))


def add_nurbs():
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    bpy.context.object.name = "Round"
    return bpy.context.object


@pytest.mark.parametrize("add", [add_curve, add_text, add_metaballs, add_nurbs])
@pytest.mark.parametrize("output", ["NEW", "REPLACE"])
def test_what_becomes_a_mesh_is_baked_once(add, output):
    name = add().name
    before = fingerprint()
    bake_below_a_lamp(output=output)
    # Only meshes can be replaced.
    assert sources() == {name: 1}
    assert_lit_from_above(baked_of(name))
    bpy.ops.antumbra.remove_bake()
    bpy.data.batch_remove([bpy.data.objects["Lamp"], bpy.data.lights["Lamp"]])
    after = fingerprint()
    for part in ("objects", "meshes", "data"):
        assert after[part] == before[part]


def test_a_family_of_metaballs_is_one_surface():
    add_metaballs()
    other = add_metaballs()
    other.name = "Drop.001"
    other.location = (1.2, 0, 0)
    bake_below_a_lamp()
    assert sources() == {"Drop": 1}
    assert world_positions(baked_of("Drop"))[:, 0].max() > 1.5


# Meshes as they are evaluated


def test_a_mix_of_shape_keys():
    plane = add_plane()
    plane.shape_key_add(name="Basis")
    raised = plane.shape_key_add(name="Raised")
    for point in raised.data:
        point.co.z += 2.0
    raised.value = 0.25
    bake_below_a_lamp()
    assert height_of(baked_of("Plane")) == pytest.approx((0.5, 0.5))


def test_armatures_and_other_modifiers():
    cube = add_cube()
    cube.modifiers.new("Bevel", "BEVEL").width = 0.1
    array = cube.modifiers.new("Array", "ARRAY")
    array.count = 2
    wave = cube.modifiers.new("Displace", "DISPLACE")
    wave.strength = 0.0
    bake_below_a_lamp()
    assert world_positions(baked_of("Cube"))[:, 0].max() == pytest.approx(3.0)
    assert_lit_from_above(baked_of("Cube"))


def test_the_frame_constraints_and_parents_count():
    parent, child = link(bpy.data.objects.new("Parent", None)), add_cube("Child")
    child.parent = parent
    parent.location = (0, 0, 1)
    follow = child.constraints.new("LIMIT_LOCATION")
    follow.use_max_x, follow.max_x = True, -2.0
    child.location = (0, 0, 0)
    child.keyframe_insert("location", frame=1)
    child.location = (0, 0, 1)
    child.keyframe_insert("location", frame=10)
    bpy.context.scene.frame_set(10)
    bake_below_a_lamp()
    assert middle_of(baked_of("Child")) == pytest.approx((-2, 0, 2), abs=1e-5)


# Faces


def test_a_concave_face_with_many_corners():
    """A comb: its light lies on its teeth only, and all of its area is there."""
    outline = [(0, 0)]
    for tooth in range(4):
        outline += [(tooth, 2), (tooth + 0.5, 2), (tooth + 0.5, 0.5), (tooth + 1, 0.5)]
    outline += [(4, 0)]
    vertices = [(x - 2, y - 1, 0) for x, y in outline]
    comb = add_mesh("Comb", vertices, [tuple(range(len(vertices)))[::-1]])
    area = face_areas(comb.data).sum()
    bake_below_a_lamp()
    assert face_areas(baked_of("Comb").data).sum() == pytest.approx(area, rel=1e-5)
    assert_lit_from_above(baked_of("Comb"))


def test_quads_that_are_not_planar_stay_watertight():
    cube = add_cube()
    cube.data.vertices[7].co = (1.5, 1.2, 1.8)
    cube.data.vertices[3].co = (-1.1, 1.4, 0.5)
    bake_below_a_lamp(tolerance=0.02)
    mesh = baked_of("Cube").data
    assert len(mesh.polygons) > 12
    assert (faces_per_edge(mesh) == 2).all()
    assert_lit_from_above(baked_of("Cube"))


def test_loose_parts_and_faces_without_area_beside_good_ones():
    plane = add_mesh(
        "Mixed",
        [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (3, 0, 0), (4, 0, 0), (5, 0, 0), (0, 0, 3)],
        [(0, 1, 2, 3), (4, 5, 6)],
    )
    plane.data.edges.add(1)
    plane.data.edges[-1].vertices = (6, 7)
    bake_below_a_lamp()
    assert face_areas(baked_of("Mixed").data).sum() == pytest.approx(4.0)
    assert_lit_from_above(baked_of("Mixed"))


def test_objects_without_area_are_named():
    add_plane()
    add_cube("Flattened").scale = (0, 1, 0)
    add_mesh("Empty", [], [])
    link(bpy.data.objects.new("Wire", bpy.data.meshes.new("Wire")))
    bake_below_a_lamp()
    assert sources() == {"Plane": 1}
    assert any("no area" in text and "“Flattened”" in text for text in last_warnings())


# What no bake knows


def add_hair_of_particles():
    head = add_plane("Head")
    settings = head.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count = "HAIR", 10
    return "hair", "Head"


def add_hair_curves():
    hair = bpy.data.hair_curves.new("Fur")
    hair.add_curves([3, 3])
    link(bpy.data.objects.new("Fur", hair))
    return "hair", "Fur"


def add_point_cloud():
    cloud = bpy.data.pointclouds.new("Dust")
    link(bpy.data.objects.new("Dust", cloud))
    return "point clouds", "Dust"


def add_volume():
    link(bpy.data.objects.new("Smoke", bpy.data.volumes.new("Smoke")))
    return "volumes", "Smoke"


def add_grease_pencil():
    pencils = getattr(bpy.data, "grease_pencils_v3", bpy.data.grease_pencils)
    link(bpy.data.objects.new("Sketch", pencils.new("Sketch")))
    return "grease pencil", "Sketch"


@pytest.mark.parametrize(
    "add", [add_hair_of_particles, add_hair_curves, add_point_cloud, add_volume, add_grease_pencil]
)
def test_each_unsupported_thing_is_named_once(add):
    add_plane("Ground")
    kind, name = add()
    warnings = [text.lower() for text in read_scene().warnings]
    assert [text for text in warnings if kind in text and f"“{name.lower()}”" in text] == warnings
    assert len(warnings) == 1


def test_a_material_of_volume_only_does_not_block_and_is_named():
    cube, made = add_cube(), add_material("Fog")
    tree = made.node_tree
    output = tree.get_output_node("ALL")
    tree.links.clear()
    tree.links.new(tree.nodes.new("ShaderNodeVolumePrincipled").outputs[0], output.inputs["Volume"])
    cube.data.materials.append(made)
    scene = read_scene()
    assert scene.materials[0].transmittance_rgb == (1, 1, 1)
    assert any("“Fog”" in text and "volume" in text for text in scene.warnings)


def test_a_material_without_a_shader_is_black_and_named():
    cube, made = add_cube(), add_material("Nothing")
    made.node_tree.links.clear()
    cube.data.materials.append(made)
    scene = read_scene()
    assert scene.materials[0].reflectance_rgb == (0, 0, 0)
    assert any("“Nothing”" in text and "black" in text for text in scene.warnings)


def test_edit_mode_of_another_window_is_refused_by_name():
    cube = add_cube("Edited")
    select(cube)
    bpy.ops.object.mode_set(mode="EDIT")
    assert bmesh.from_edit_mesh(cube.data).is_valid
    with pytest.raises(RuntimeError, match="Edit Mesh mode"):
        bpy.ops.antumbra.bake()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert math.isclose(face_areas(cube.data).sum(), 24.0, rel_tol=1e-6)
