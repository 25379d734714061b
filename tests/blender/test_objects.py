# SPDX-License-Identifier: GPL-3.0-or-later
"""Every kind of object that Blender has: baked where it is, or named."""

import math
from collections import Counter

import bmesh
import bpy
import numpy as np
import pytest
from extension import last_warnings, read_scene
from fingerprint import fingerprint
from mathutils import Matrix
from scenes import (
    add_area_light,
    add_cube,
    add_grid,
    add_instances_by_nodes,
    add_material,
    add_mesh,
    add_plane,
    bake,
    baked_objects,
    baked_of,
    corner_vertices,
    face_areas,
    faces_per_edge,
    link,
    radiance,
    select,
    sheared,
    world_positions,
)


def sources():
    return Counter(obj["antumbra_source"] for obj in baked_objects())


def bake_below_a_lamp(**settings):
    add_area_light(location=(0, 0, 6), size=2.0, energy=500.0)
    bake(**settings)


def assert_lit_from_above(obj):
    """What faces up has light, and all of it is finite."""
    mesh, light = obj.data, radiance(obj.data)
    assert len(mesh.polygons) > 0
    assert np.isfinite(light).all()
    normals = np.empty(len(mesh.polygons) * 3, dtype=np.float32)
    mesh.polygons.foreach_get("normal", normals)
    turned = normals.reshape(-1, 3) @ np.linalg.inv(np.array(obj.matrix_world)[:3, :3])
    up = np.repeat(turned[:, 2] > 0.5 * np.linalg.norm(turned, axis=1), 3)
    assert up.any()
    assert light[up].max() > 0.0


def height_of(obj):
    heights = world_positions(obj)[:, 2]
    return heights.min(), heights.max()


def middle_of(obj):
    """Of its bounding box."""
    points = world_positions(obj)
    return 0.5 * (points.min(axis=0) + points.max(axis=0))


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


# Instances


def collection_of(name, *objects):
    collection = bpy.data.collections.new(name)
    for obj in objects:
        for user in list(obj.users_collection):
            user.objects.unlink(obj)
        collection.objects.link(obj)
    return collection


def add_instance(name, collection, location=(0, 0, 0)):
    empty = link(bpy.data.objects.new(name, None))
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", collection, location
    return empty


def test_instances_of_collections_of_collections():
    inner = collection_of("Inner", add_cube("Brick"))
    outer = collection_of("Outer", add_instance("Pair a", inner), add_instance("Pair b", inner, (0, 4, 0)))
    add_instance("Wall", outer, (4, 0, 0)).scale = (0.5, 0.5, 0.5)
    bake_below_a_lamp()
    assert sources() == {"Brick": 2}
    middles = sorted(tuple(middle_of(obj).round(3)) for obj in baked_objects())
    assert middles == [(4.0, 0.0, 0.0), (4.0, 2.0, 0.0)]
    for obj in baked_objects():
        assert_lit_from_above(obj)


@pytest.mark.parametrize("realised", [False, True])
def test_instances_by_geometry_nodes(realised):
    points, cube = add_plane("Points", size=6.0), add_cube()
    cube.hide_render = True
    add_instances_by_nodes(points, cube)
    if realised:
        tree = points.modifiers["Instances"].node_group
        output = next(node for node in tree.nodes if node.type == "GROUP_OUTPUT")
        realise = tree.nodes.new("GeometryNodeRealizeInstances")
        tree.links.new(output.inputs[0].links[0].from_socket, realise.inputs[0])
        tree.links.new(realise.outputs[0], output.inputs[0])
    bake_below_a_lamp()
    assert sources() == ({"Points": 1} if realised else {"Points": 1, "Cube": 4})
    total = sum(face_areas(obj.data).sum() for obj in baked_objects())
    assert total == pytest.approx(36.0 + 4 * 24.0, rel=1e-4)
    for obj in baked_objects():
        assert_lit_from_above(obj)


def test_instances_on_vertices_and_of_particles():
    parent, child = add_plane("Parent", size=4.0), add_cube("Child")
    child.scale = (0.1, 0.1, 0.1)
    child.parent = parent
    parent.instance_type = "VERTS"
    ground, stone = add_plane("Ground", size=4.0), add_cube("Stone")
    stone.scale = (0.1, 0.1, 0.1)
    stone.hide_render = True
    ground.location = (0, 0, -1)
    settings = ground.modifiers.new("Stones", "PARTICLE_SYSTEM").particle_system.settings
    settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 7, 0, 0, 100
    settings.physics_type, settings.render_type, settings.instance_object = "NO", "OBJECT", stone
    bpy.context.scene.frame_set(2)
    bake_below_a_lamp()
    found = sources()
    assert found["Child"] == 4
    assert found["Stone"] == 7
    assert last_warnings() == []


# Scenes and view layers


def test_other_scenes_and_excluded_collections_take_no_part():
    kept, left_out, unrendered = (bpy.data.collections.new(name) for name in ("Kept", "Left out", "Unrendered"))
    for collection in (kept, left_out, unrendered):
        bpy.context.scene.collection.children.link(collection)
        add_plane(collection.name, collection=collection)
    shared = bpy.data.objects["Kept"].data
    bpy.context.view_layer.layer_collection.children["Left out"].exclude = True
    unrendered.hide_render = True
    # Another view layer that shows it all, and another scene that has the same mesh, change nothing.
    bpy.context.scene.view_layers.new("Everything")
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(bpy.data.objects.new("Elsewhere", shared))
    other.collection.objects.link(bpy.data.objects["Kept"])
    bake_below_a_lamp()
    assert sources() == {"Kept": 1}
    assert other.objects["Elsewhere"].data == shared


def test_what_the_viewport_hides_is_baked_and_stays_hidden():
    plane, cube = add_plane(size=6.0), add_cube()
    cube.location = (0, 0, 2)
    bpy.context.view_layer.update()
    cube.hide_set(True)
    bake_below_a_lamp()
    assert sources() == {"Plane": 1, "Cube": 1}
    bpy.ops.antumbra.remove_bake()
    assert cube.hide_get()
    assert not plane.hide_get()


# Libraries


@pytest.fixture
def library(tmp_path):
    """A file with a cube of a red material, in a collection."""
    cube = add_cube("Linked")
    cube.data.materials.append(add_material("Red", Color=(1, 0, 0, 1)))
    collection = collection_of("Props", cube)
    path = tmp_path / "library.blend"
    bpy.data.libraries.write(str(path), {collection})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.collections = ["Props"]
    return wanted.collections[0]


def test_a_linked_collection(library):
    bpy.context.scene.collection.children.link(library)
    bake_below_a_lamp()
    assert sources() == {"Linked": 1}
    light = radiance(baked_of("Linked").data)
    assert light[:, 0].max() > 0.0
    assert (light[:, 1:] == 0.0).all()
    assert baked_of("Linked").data.materials[0].name == "Red"
    bpy.ops.antumbra.remove_bake()
    assert not library.objects["Linked"].hide_render


def test_a_linked_material_that_only_cycles_can_read(tmp_path):
    made = add_material("Linked")
    ramp = made.node_tree.nodes.new("ShaderNodeMapRange")
    ramp.inputs["Value"].default_value = 0.25
    made.node_tree.links.new(ramp.outputs[0], made.node_tree.nodes["Diffuse BSDF"].inputs["Color"])
    path = tmp_path / "library.blend"
    bpy.data.libraries.write(str(path), {made})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.materials = ["Linked"]
    add_plane().data.materials.append(wanted.materials[0])
    before = fingerprint()
    scene = read_scene()
    assert fingerprint() == before
    (material,) = {scene.materials[index] for index in scene.objects[0].triangle_materials()}
    assert material.reflectance_rgb == (0.25, 0.25, 0.25)


def test_an_instance_of_a_linked_collection(library):
    add_instance("Placed", library, (2, 0, 0))
    bake_below_a_lamp()
    assert middle_of(baked_of("Linked")) == pytest.approx((2, 0, 0), abs=1e-5)


@pytest.mark.parametrize("output", ["NEW", "REPLACE"])
def test_a_library_override(library, output):
    scene = bpy.context.scene
    scene.collection.children.link(library)
    props = library.override_hierarchy_create(scene, bpy.context.view_layer)
    override = props.objects["Linked"]
    assert override.override_library is not None
    for collection in list(scene.collection.children):
        if collection.library is not None:
            scene.collection.children.unlink(collection)
    override.location = (0, 3, 0)
    bake_below_a_lamp(output=output)
    baked = override if output == "REPLACE" else baked_of("Linked")
    assert "Radiosity" in baked.data.color_attributes
    assert middle_of(baked) == pytest.approx((0, 3, 0), abs=1e-5)
    bpy.ops.antumbra.remove_bake()
    assert override.data.library is not None
    assert not override.hide_render


# Shared and placed meshes


def test_users_of_one_mesh_get_light_of_their_own():
    near, far = add_plane("Near"), add_plane("Far")
    far.data = near.data
    far.location = (9, 0, -20)
    bake_below_a_lamp(output="REPLACE")
    assert near.data != far.data
    assert radiance(near.data).max() > 2 * radiance(far.data).max() > 0.0
    bpy.ops.antumbra.remove_bake()
    assert near.data == far.data


@pytest.mark.parametrize(
    "matrix",
    [
        Matrix.Diagonal((-1, 1, 1, 1)),
        Matrix.Diagonal((-1, -1, -1, 1)),
        Matrix.Diagonal((2, 0.5, 3, 1)),
        sheared(0.7),
        Matrix.Diagonal((1, 1, -1, 1)) @ sheared(0.7) @ Matrix.Rotation(1.0, 4, "X"),
    ],
    ids=["mirrored", "point-mirrored", "stretched", "sheared", "all"],
)
@pytest.mark.parametrize("shading", ["flat", "smooth"])
def test_any_matrix_gives_the_light_of_the_same_mesh_in_place(matrix, shading):
    """The object is compared with one whose mesh has the matrix applied."""
    if shading == "smooth" and not matrix.to_3x3().is_orthogonal:
        pytest.skip("Blender's smooth normals are those of the mesh before it is stretched")
    results = []
    for applied in (False, True):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        cube = add_cube(smooth=shading == "smooth")
        if applied:
            cube.data.transform(matrix)
            if matrix.determinant() < 0:
                cube.data.flip_normals()
        else:
            holder = link(bpy.data.objects.new("Holder", None))
            cube.parent, cube.matrix_parent_inverse = holder, matrix
        bake_below_a_lamp(method="UNIFORM", element_size=1.0)
        obj = baked_of("Cube")
        points, light = world_positions(obj)[corner_vertices(obj.data)], radiance(obj.data)
        results.append({tuple(np.round(p, 3) + 0.0): [] for p in points})
        for point, value in zip(points, light, strict=True):
            results[-1][tuple(np.round(point, 3) + 0.0)].append(value[0])
    placed, in_place = results
    assert placed.keys() == in_place.keys()
    for point, values in placed.items():
        assert sorted(values)[-1] == pytest.approx(sorted(in_place[point])[-1], rel=1e-3, abs=1e-3), point


def test_custom_normals_shade_the_bake():
    grid = add_grid(cells=2, smooth=True)
    lean = np.tile(np.float32([0.6, 0.0, 0.8]), (len(grid.data.loops), 1))
    grid.data.normals_split_custom_set(lean)
    bake_below_a_lamp()
    mesh = baked_of("Grid").data
    normals = np.empty(len(mesh.loops) * 3, dtype=np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    assert normals.reshape(-1, 3) == pytest.approx(np.tile((0.6, 0, 0.8), (len(mesh.loops), 1)), abs=1e-2)
    assert_lit_from_above(baked_of("Grid"))


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
    assert not scene.materials[0].blocks
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
