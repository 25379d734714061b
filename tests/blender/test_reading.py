# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that is read in pieces, and what happens to the file between two of them."""

import bpy
import numpy as np
import pytest
from extension import module, read_scene
from fingerprint import fingerprint
from scenes import add_area_light, add_cube, add_material, add_plane, link

NEEDS_CYCLES = pytest.mark.skipif(not hasattr(bpy.types.Scene, "cycles"), reason="this Blender is built without Cycles")


@pytest.fixture
def textured_scene():
    """Cubes whose colours only Cycles can tell, three with meshes of their own and two that share one, and a lamp."""
    material = add_material("Noise")
    shader = material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(noise.outputs["Color"], shader.inputs["Color"])
    for index in range(3):
        cube = add_cube(f"Cube {index}")
        cube.location.x = 3.0 * index
        cube.data.materials.append(material)
    link(bpy.data.objects.new("Twin", bpy.data.objects["Cube 2"].data)).location.y = 4.0
    add_plane(size=20.0)
    add_area_light(location=(0, 0, 6))
    bpy.context.view_layer.update()
    return fingerprint()


def pieces():
    settings = module("core.settings").Settings(receivers="ALL")
    return module("bridge.scene_read").reading(bpy.context, settings)


def go_on(reading, count):
    """Do so many pieces; returns what came of all when that was the end."""
    for _ in range(count):
        try:
            next(reading)
        except StopIteration as end:
            return end.value
    return None


def arrays(scene):
    return [
        (record.name, record.surface.positions, record.triangle_materials(), record.world_from_object)
        for record in scene.objects
    ]


def test_pieces_come_to_the_same_as_all_at_once(textured_scene):
    whole = read_scene()
    in_pieces = go_on(pieces(), 100_000)
    assert in_pieces.materials == whole.materials
    assert len(in_pieces.lights) == len(whole.lights) == 1
    for ours, theirs in zip(arrays(in_pieces), arrays(whole), strict=True):
        assert ours[0] == theirs[0]
        assert all(np.array_equal(a, b) for a, b in zip(ours[1:], theirs[1:], strict=True))
    assert fingerprint() == textured_scene


def test_what_is_read_at_once_in_a_file_of_very_many_objects_is_the_same(textured_scene, monkeypatch):
    in_pieces = read_scene()
    monkeypatch.setattr(module("bridge.scene_read"), "_MOST_OBJECTS", 0)
    at_once = read_scene()
    assert at_once.materials == in_pieces.materials
    for ours, theirs in zip(at_once.objects, in_pieces.objects, strict=True):
        assert np.array_equal(ours.surface.positions, theirs.surface.positions)
        assert [a.name for a in ours.surface.attributes] == [a.name for a in theirs.surface.attributes]
    assert fingerprint() == textured_scene


@NEEDS_CYCLES
def test_looking_a_few_samples_at_a_time_sees_the_same(textured_scene, monkeypatch):
    whole = read_scene()
    passes = module("bridge.passes")
    monkeypatch.setattr(passes, "SAMPLES", 3_000)
    coarse = read_scene()
    monkeypatch.setattr(passes, "_SAMPLES_AT_A_TIME", 30)
    monkeypatch.setattr(passes, "_BENCHES_AT_A_TIME", 1)
    assert read_scene().materials == coarse.materials
    assert len(whole.materials) == len(coarse.materials)


def test_reading_may_be_left_off_after_any_piece(textured_scene):
    done = 0
    while True:
        reading = pieces()
        ended = go_on(reading, done)
        reading.close()
        assert fingerprint() == textured_scene, f"after {done} pieces"
        if ended is not None:
            break
        # No step of all that is done comes again and again
        done += 7
    assert done > 20


def test_an_object_that_is_moved_or_deleted_meanwhile_is_read_as_it_was(textured_scene):
    def is_evaluated():
        return any("antumbra_temporary" in mesh.keys() and len(mesh.polygons) == 6 for mesh in bpy.data.meshes)

    reading = pieces()
    while not is_evaluated():
        next(reading)
    bpy.data.objects["Cube 0"].location.x = -50.0
    bpy.data.objects.remove(bpy.data.objects["Cube 1"])
    scene = go_on(reading, 100_000)
    by_name = {record.name: record for record in scene.objects}
    assert by_name["Cube 0"].world_from_object[0, 3] == 0.0
    assert len(by_name["Cube 1"].surface.triangles) == 12


@NEEDS_CYCLES
def test_materials_or_our_own_data_that_are_deleted_meanwhile_are_noticed(textured_scene):
    for doomed in ("materials", "meshes", "scenes"):
        noticed = 0
        for done in range(4, 200, 16):
            reading = pieces()
            if go_on(reading, done) is not None:
                break
            if doomed == "materials":
                bpy.data.materials["Noise"].name = "Gone"
                kept = bpy.data.materials["Gone"].copy()
                bpy.data.materials.remove(bpy.data.materials["Gone"])
                kept.name = "Noise"
            else:
                for each in [each for each in getattr(bpy.data, doomed) if "antumbra_temporary" in each.keys()]:
                    getattr(bpy.data, doomed).remove(each)
            try:
                go_on(reading, 100_000)
            except ReferenceError:
                noticed += 1
            if doomed == "materials":
                for cube in (obj for obj in bpy.data.objects if obj.name.startswith("Cube")):
                    cube.data.materials[0] = bpy.data.materials["Noise"]
            reading.close()
            assert fingerprint()["data"] == textured_scene["data"]
        assert noticed > 0, doomed


def test_what_undo_brings_back_of_ours_is_removed():
    add_plane()
    bpy.ops.ed.undo_push(message="Before")
    reading = pieces()
    go_on(reading, 3)
    ours = [obj.name for obj in bpy.data.objects if "antumbra_temporary" in obj.keys()]
    assert ours
    # Somebody does something in the middle of it
    bpy.data.objects["Plane"].location.x = 1.0
    bpy.ops.ed.undo_push(message="In the middle")
    reading.close()
    bpy.data.objects["Plane"].location.x = 2.0
    bpy.ops.ed.undo_push(message="After")
    bpy.ops.ed.undo()
    assert bpy.data.objects["Plane"].location.x == 1.0
    assert [obj.name for obj in bpy.data.objects] == ["Plane"]
    assert all("antumbra_temporary" not in mesh.keys() for mesh in bpy.data.meshes)
