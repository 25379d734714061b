# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects by where they come from and where they stand: instances, scenes, libraries, users of one mesh, any matrix."""

import bpy
import numpy as np
import pytest
from extension import last_warnings, read_scene
from fingerprint import fingerprint
from mathutils import Matrix
from scenes import (
    add_cube,
    add_grid,
    add_instances_by_nodes,
    add_material,
    add_plane,
    assert_lit_from_above,
    bake_below_a_lamp,
    baked_objects,
    baked_of,
    corner_vertices,
    face_areas,
    link,
    middle_of,
    radiance,
    sheared,
    sources,
    world_positions,
)

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
