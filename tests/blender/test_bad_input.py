# SPDX-License-Identifier: GPL-3.0-or-later
"""What cannot be baked earns one clear message, and the user's file stays as it was."""

import bpy
import pytest
from fingerprint import fingerprint
from scenes import add_area_light, add_cube, add_material, add_plane, bake, baked_objects, link, select


def refused(message, **settings):
    """Bake, expect a message, and nothing else to have happened."""
    before = fingerprint()
    for name, value in {"receivers": "ALL", **settings}.items():
        setattr(bpy.context.scene.antumbra, name, value)
    before["scene"]["settings"] = fingerprint()["scene"]["settings"]
    with pytest.raises(RuntimeError, match=message) as raised:
        bpy.ops.antumbra.bake()
    assert len(str(raised.value).strip().splitlines()) == 1
    assert fingerprint() == before


def test_empty_scene():
    refused("nothing to bake")


def test_no_light():
    select(add_cube())
    refused("[Nn]othing in the scene sends light", receivers="SELECTED")


def test_only_lights_that_are_left_out():
    add_cube()
    add_area_light("Noon").scale = (0, 1, 1)
    refused("Lights without area are left out.*“Noon”")


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN", "AREA"])
def test_a_light_that_is_not_a_number(kind):
    add_cube()
    light = bpy.data.lights.new("Broken", kind)
    light.energy = float("nan")
    link(bpy.data.objects.new("Broken", light))
    refused("“Broken”.*not finite")


def test_nothing_selected():
    add_cube()
    add_area_light()
    select()
    refused("Nothing is selected", receivers="SELECTED")


def test_no_mesh_selected():
    add_cube()
    select(add_area_light())
    refused("No selected object is a mesh", receivers="SELECTED")


def test_selected_but_hidden_in_renders():
    cube = add_cube()
    cube.hide_render = True
    add_plane()
    add_area_light()
    select(cube)
    refused("No selected object is a mesh", receivers="SELECTED")


def test_vertex_that_is_not_a_number():
    cube = add_cube("Broken")
    cube.data.vertices[3].co.z = float("nan")
    add_area_light()
    refused("“Broken”.*vertex 3")


def test_reflectance_above_one():
    cube = add_cube()
    cube.data.materials.append(add_material("Too bright", Color=(1.5, 0.5, 0.5, 1.0)))
    add_area_light()
    refused("“Too bright”.*reflectance 1.5")


def test_edit_mode():
    cube = add_cube()
    add_area_light()
    select(cube)
    bpy.ops.object.mode_set(mode="EDIT")
    refused("Object Mode", receivers="SELECTED")
    bpy.ops.object.mode_set(mode="OBJECT")


def test_an_object_without_area_is_left_out_by_name():
    flat = add_cube("Flat")
    flat.scale = (0, 0, 0)
    add_plane()
    add_area_light()
    bake()
    assert [obj["antumbra_source"] for obj in baked_objects()] == ["Plane"]
    from extension import last_warnings

    assert any("no area" in line and "“Flat”" in line for line in last_warnings())


def test_an_object_squashed_to_a_plane_is_baked():
    add_plane().scale = (1, 1, 0)
    add_area_light()
    bake()
    assert [obj["antumbra_source"] for obj in baked_objects()] == ["Plane"]


def test_selected_objects_that_are_no_meshes_are_passed_over():
    plane, lamp = add_plane(), add_area_light()
    empty = link(bpy.data.objects.new("Empty", None))
    select(plane, lamp, empty)
    bake(receivers="SELECTED")
    assert [obj["antumbra_source"] for obj in baked_objects()] == ["Plane"]


def test_a_failing_bake_leaves_an_earlier_one():
    add_cube()
    lamp = add_area_light()
    bake()
    bpy.data.objects.remove(lamp)
    refused("[Nn]othing in the scene sends light")
    assert len(baked_objects()) == 1
