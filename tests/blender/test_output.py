# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a bake goes, baking again, and the way back."""

import bpy
import numpy as np
import pytest
from extension import module
from fingerprint import fingerprint
from mathutils import Matrix
from node_trees import with_node
from scenes import (
    add_area_light,
    add_cube,
    add_instances_by_nodes,
    add_material,
    add_plane,
    bake,
    baked_objects,
    baked_of,
    link,
    positions,
    radiance,
    select,
    sheared,
    world_positions,
)


def cube_over_plane():
    plane, cube = add_plane(size=6.0), add_cube()
    cube.location = (0, 0, 1.5)
    cube.scale = (0.5, 0.5, 0.5)
    add_area_light(location=(0.5, 0, 4), size=0.5)
    bpy.context.view_layer.update()
    return plane, cube


def colours_by_source():
    return {obj["antumbra_source"]: radiance(obj.data) for obj in baked_objects()}


def test_new_objects_stand_where_their_sources_are():
    plane, cube = cube_over_plane()
    bake()
    assert {obj["antumbra_source"] for obj in baked_objects()} == {"Plane", "Cube"}
    assert np.allclose(baked_of("Cube").matrix_world, cube.matrix_world, atol=1e-6)
    for source in (plane, cube):
        assert (source.hide_viewport, source.hide_render) == (True, True)
        assert not source.visible_get()
    for baked in baked_objects():
        assert baked.visible_get()
        assert not baked.hide_render


def test_selection_goes_to_the_bakes_and_comes_back():
    plane, cube = cube_over_plane()
    select(cube)
    bake(receivers="SELECTED")
    assert bpy.context.selected_objects == [baked_of("Cube")]
    assert bpy.context.view_layer.objects.active == baked_of("Cube")
    assert not plane.hide_render
    bpy.ops.antumbra.remove_bake()
    assert bpy.context.selected_objects == [cube]
    assert bpy.context.view_layer.objects.active == cube


@pytest.mark.parametrize("output", ["NEW", "REPLACE"])
def test_remove_bake_restores_everything(output):
    plane, cube = cube_over_plane()
    plane["my own"] = 1
    cube.modifiers.new("Smooth", "SUBSURF").show_viewport = False
    cube.modifiers.new("Bevel", "BEVEL").show_render = False
    cube.hide_viewport = True
    for _ in range(3):
        link(bpy.data.objects.new("Twin", plane.data)).hide_render = True
    select(plane)
    bpy.context.scene.antumbra.output = output
    bpy.context.scene.antumbra.receivers = "ALL"
    bpy.context.scene.antumbra.tolerance = 0.1
    before = fingerprint()
    bake(output=output)
    assert fingerprint() != before
    bake(output=output)
    assert bpy.ops.antumbra.remove_bake() == {"FINISHED"}
    assert fingerprint() == before


def test_remove_without_a_bake_says_so():
    add_cube()
    before = fingerprint()
    assert bpy.ops.antumbra.remove_bake() == {"CANCELLED"}
    assert fingerprint() == before


@pytest.mark.parametrize("output", ["NEW", "REPLACE"])
def test_a_second_bake_gives_the_same_light(output):
    """An earlier bake neither blocks nor reflects, and its hidden originals still do."""
    plane, cube = cube_over_plane()

    def colours():
        if output == "NEW":
            return colours_by_source()
        return {obj.name: radiance(obj.data) for obj in (plane, cube)}

    bake(output=output)
    first = colours()
    meshes, objects = len(bpy.data.meshes), len(bpy.data.objects)
    bake(output=output)
    second = colours()
    assert (len(bpy.data.meshes), len(bpy.data.objects)) == (meshes, objects)
    assert first.keys() == second.keys()
    for name, values in first.items():
        assert np.array_equal(values, second[name])


def test_a_selected_bake_is_baked_again_and_others_stay():
    cube_over_plane()
    bake()
    untouched = baked_of("Plane").data.session_uid
    replaced = baked_of("Cube").data.session_uid
    select(baked_of("Cube"))
    bake(receivers="SELECTED")
    assert baked_of("Plane").data.session_uid == untouched
    assert baked_of("Cube").data.session_uid != replaced
    assert len(baked_objects()) == 2


def test_new_after_replace_brings_the_mesh_back_first():
    _, cube = cube_over_plane()
    mesh = cube.data
    bake(output="REPLACE")
    assert cube.data != mesh
    assert "Radiosity" in cube.data.color_attributes
    bake(output="NEW")
    assert cube.data == mesh
    assert "Radiosity" not in mesh.color_attributes
    assert baked_of("Cube") != cube


def test_replace_does_not_apply_modifiers_twice():
    plane, cube = cube_over_plane()
    array = cube.modifiers.new("Array", "ARRAY")
    array.count = 3
    bake(output="REPLACE")
    evaluated = cube.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert len(evaluated.data.polygons) == len(cube.data.polygons)
    assert positions(cube.data)[:, 0].max() == pytest.approx(5.0)
    assert baked_objects() == []


def test_replace_leaves_other_users_of_the_mesh_alone():
    plane, _ = cube_over_plane()
    mesh = plane.data
    other = link(bpy.data.objects.new("Other", mesh))
    other.location = (10, 0, 0)
    select(plane)
    bake(output="REPLACE", receivers="SELECTED")
    assert other.data == mesh
    assert len(mesh.polygons) == 1
    assert plane.data != mesh


def test_users_of_one_mesh_get_a_bake_each():
    plane, _ = cube_over_plane()
    other = link(bpy.data.objects.new("Other", plane.data))
    other.location = (10, 0, 0)
    bake()
    assert not np.array_equal(radiance(baked_of("Plane").data).max(), radiance(baked_of("Other").data).max())


def test_mirrored_objects_lie_where_they_were():
    cube = add_cube("Mirrored")
    cube.matrix_world = Matrix.Translation((1, 2, 3)) @ Matrix.Diagonal((-1, 2, 1, 1))
    add_area_light(location=(0, 0, 8))
    bpy.context.view_layer.update()
    corners = {tuple(p) for p in np.round(world_positions(cube), 5).tolist()}
    bake()
    assert corners <= {tuple(p) for p in np.round(world_positions(baked_of("Mirrored")), 5).tolist()}


def test_sheared_objects_lie_where_they_were():
    cube = add_cube("Sheared")
    parent = link(bpy.data.objects.new("Parent", None))
    cube.parent = parent
    cube.matrix_parent_inverse = sheared(0.7)
    add_area_light(location=(0, 0, 8))
    bpy.context.view_layer.update()
    corners = {tuple(p) for p in np.round(world_positions(cube), 5).tolist()}
    bake()
    assert corners <= {tuple(p) for p in np.round(world_positions(baked_of("Sheared")), 5).tolist()}


def test_instances_of_a_collection():
    collection = bpy.data.collections.new("Furniture")
    add_cube("Chair", collection)
    for index in range(2):
        empty = link(bpy.data.objects.new(f"Room {index}", None))
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        empty.location = (4 * index, 0, 0)
    add_plane(size=20.0).location = (0, 0, -1.5)
    add_area_light(location=(2, 0, 6))
    bake()
    chairs = [obj for obj in baked_objects() if obj["antumbra_source"] == "Chair"]
    assert sorted(round(obj.matrix_world.translation.x) for obj in chairs) == [0, 4]
    assert bpy.data.objects["Room 0"].hide_render
    # Nothing is shown twice: what still renders are the bakes and the lamp.
    rendered = {i.object.name for i in bpy.context.evaluated_depsgraph_get().object_instances}
    assert rendered == {obj.name for obj in baked_objects()} | {"Lamp"}
    bpy.ops.antumbra.remove_bake()
    assert not bpy.data.objects["Room 0"].hide_render


def test_instances_made_by_geometry_nodes():
    pebble = add_cube("Pebble")
    pebble.scale = (0.1, 0.1, 0.1)
    pebble.hide_render = True
    ground = add_plane("Ground", size=4.0)
    add_instances_by_nodes(ground, pebble)
    add_area_light(location=(0, 0, 4))
    select(ground)
    bake(receivers="SELECTED")
    sources = sorted(obj["antumbra_source"] for obj in baked_objects())
    assert sources.count("Ground") == 1
    assert len(sources) == 5
    corners = [obj.matrix_world.translation.xy for obj in baked_objects() if obj["antumbra_source"] == "Pebble"]
    assert {(round(x), round(y)) for x, y in corners} <= {(-2, -2), (2, -2), (2, 2), (-2, 2)}


def test_a_text_is_seen_once():
    text = link(bpy.data.objects.new("Text", bpy.data.curves.new("Text", "FONT")))
    text.data.body = "A"
    add_plane()
    add_area_light()
    bake()
    assert sorted(obj["antumbra_source"] for obj in baked_objects()) == ["Plane", "Text"]


def test_deleting_a_source_leaves_its_bake_removable():
    _, cube = cube_over_plane()
    bake()
    bpy.data.objects.remove(cube)
    bpy.ops.antumbra.remove_bake()
    assert baked_objects() == []
    assert "Antumbra" not in bpy.data.collections


def test_the_way_back_survives_saving(tmp_path):
    plane, cube = cube_over_plane()
    cube.hide_viewport = True
    bake()
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    bpy.ops.antumbra.remove_bake()
    objects = bpy.data.objects
    assert (objects["Plane"].hide_viewport, objects["Plane"].hide_render) == (False, False)
    assert (objects["Cube"].hide_viewport, objects["Cube"].hide_render) == (True, False)
    assert baked_objects() == []


@pytest.mark.parametrize("output", ["NEW", "REPLACE"])
def test_one_undo_takes_a_bake_back(output):
    plane, _ = cube_over_plane()
    select(plane)
    settings = bpy.context.scene.antumbra
    settings.output, settings.receivers, settings.tolerance = output, "ALL", 0.1
    bpy.ops.ed.undo_push(message="Before the bake")
    before = fingerprint()
    # True: with an undo step of its own, as from a button.
    assert bpy.ops.antumbra.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    after = fingerprint()
    assert after != before
    bpy.ops.ed.undo()
    assert fingerprint() == before
    bpy.ops.ed.redo()
    assert fingerprint() == after
    bpy.ops.ed.undo()
    assert fingerprint() == before


@pytest.mark.parametrize("output", ["NEW", "REPLACE"])
@pytest.mark.parametrize("lost", [0, 1, 2])
def test_meshes_that_are_made_ahead_change_nothing_of_what_comes_out(output, lost):
    """Whatever becomes of them in the meantime: undo may take them away."""
    plane, _cube = cube_over_plane()
    plane.matrix_world = sheared(0.3)
    bake(output=output)
    expected = {mesh.name: radiance(mesh).tobytes() for mesh in bpy.data.meshes if "Radiosity" in mesh.attributes}
    bpy.ops.antumbra.remove_bake()
    before = fingerprint()

    ahead = module("bridge.host").new_bake(module("bridge.properties").settings_of(bpy.context.scene))
    ahead.begin()
    ahead.wait()
    module("core.pieces").at_once(ahead.prepare())
    made = [mesh for mesh in bpy.data.meshes if "Radiosity" in mesh.attributes]
    assert len(made) == 2
    assert not any(obj.data in made for obj in bpy.data.objects)
    bpy.data.batch_remove(made[:lost])
    ahead.finish()
    found = {mesh.name: radiance(mesh).tobytes() for mesh in bpy.data.meshes if "Radiosity" in mesh.attributes}
    assert sorted(found.values()) == sorted(expected.values())
    bpy.ops.antumbra.remove_bake()
    assert fingerprint() == before


@pytest.mark.skipif(not hasattr(bpy.types.Scene, "cycles"), reason="this Blender is built without Cycles")
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_meshes_that_are_left_off_anywhere_and_begun_anew_have_the_same_light(share):
    """Light must not be multiplied with a texture twice, and no half-made mesh may stay."""
    for thing in cube_over_plane():
        with_node(made := add_material("Noise"), "ShaderNodeTexNoise")
        thing.data.materials.append(made)
    settings = module("core.settings").Settings(receivers="ALL", tolerance=0.05)

    def solved():
        job = module("bridge.host").new_bake(settings)
        job.begin()
        job.wait()
        return job

    def light():
        return sorted(radiance(mesh).tobytes() for mesh in bpy.data.meshes if "Radiosity" in mesh.attributes)

    at_once = solved()
    count = sum(1 for _ in at_once.prepare())
    expected = light()
    at_once.abandon()
    before = fingerprint()
    begun_anew = solved()
    for times in range(3):
        pieces = begun_anew.prepare()
        for _ in range(int(share * count) - times):
            next(pieces, None)
        pieces.close()
        assert len(light()) <= 2
    module("core.pieces").at_once(begun_anew.prepare())
    assert light() == expected
    begun_anew.abandon()
    assert fingerprint() == before


def test_giving_up_leaves_nothing_that_was_made_ahead():
    cube_over_plane()
    bpy.context.scene.antumbra.receivers = "ALL"
    before = fingerprint()
    ahead = module("bridge.host").new_bake(module("bridge.properties").settings_of(bpy.context.scene))
    ahead.begin()
    ahead.wait()
    next(ahead.prepare())
    ahead.abandon()
    assert fingerprint() == before
