# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene looked at before a bake: what is found, and a click that selects it."""

import bpy
import pytest
from extension import module
from fingerprint import fingerprint
from scenes import add_area_light, add_cube, add_material, add_mesh, add_plane, bake, baked_objects, select


def look():
    bpy.context.scene.antumbra.receivers = "ALL"
    bpy.context.view_layer.update()
    assert bpy.ops.antumbra.check_scene() == {"FINISHED"}
    return module("bridge.preflight").last_of(bpy.context.scene)


def the_finding(text):
    (index,) = [i for i, finding in enumerate(look().findings) if text in finding.text]
    return index


def test_looking_changes_nothing_and_finds_nothing_in_a_good_scene():
    add_plane(), add_area_light()
    bpy.context.scene.antumbra.receivers = "ALL"
    before = fingerprint()
    found = look()
    assert fingerprint() == before
    assert found.findings == []
    assert found.estimate.triangles[0] == 2


def test_no_light_is_named_unless_the_world_shines():
    add_plane()
    assert look().findings[0].level == "ERROR"
    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    bpy.context.scene.world = world
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1.0
    assert look().findings == []


def test_what_renders_hide_is_named():
    add_plane(), add_area_light()
    add_cube("Ghost").hide_render = True
    finding = look().findings[the_finding("“Ghost”")]
    assert "hidden in renders" in finding.text


def test_a_bow_tie_is_named_and_a_dented_face_is_not():
    add_area_light()
    add_mesh("Knot", [(-1, -1, 0), (1, 1, 0), (1, -1, 0), (-1, 1, 0)], [(0, 1, 2, 3)])
    add_mesh("Arrow", [(0, 0, 1), (2, -1, 1), (1, 0, 1), (2, 1, 1)], [(0, 1, 2, 3)])
    (finding,) = look().findings
    assert "“Knot”: faces that cross themselves" in finding.text


def test_a_click_selects_what_it_is_about():
    add_plane(), add_area_light()
    coal = add_cube("Coal")
    coal.data.materials.append(add_material("Black", Color=(0, 0, 0, 1)))
    index = the_finding("“Coal”")
    select(bpy.data.objects["Plane"])
    assert bpy.ops.antumbra.select_finding(finding=index) == {"FINISHED"}
    assert bpy.context.selected_objects == [coal]
    assert bpy.context.view_layer.objects.active == coal


def test_metals_and_shared_meshes_are_named():
    plane = add_plane()
    add_area_light()
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Twin", plane.data))
    plane.data.materials.append(add_material("Gold", "ShaderNodeBsdfPrincipled", Metallic=1.0))
    gold = look().findings[the_finding("“Gold”")]
    assert "metal" in gold.text
    assert set(gold.objects) == {plane.session_uid, bpy.data.objects["Twin"].session_uid}
    the_finding("share 1 mesh")


def test_originals_behind_a_bake_are_looked_at_and_not_named():
    add_plane(), add_area_light()
    bake()
    assert baked_objects()
    assert look().findings == []


def test_a_bake_that_was_written_takes_back_that_none_is_possible():
    add_plane()
    assert look().findings[0].level == "ERROR"
    add_area_light()
    bake(receivers="ALL")
    assert module("bridge.preflight").last_of(bpy.context.scene) is None


def test_another_file_forgets():
    add_plane()
    look()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert module("bridge.preflight").last_of(bpy.context.scene) is None


@pytest.mark.parametrize("name", ["DRAFT", "GOOD", "BEST", "GAME", "RETRO"])
def test_a_preset_bakes_what_it_says(name):
    add_plane(size=4.0), add_area_light(energy=20.0)
    assert bpy.ops.antumbra.preset(preset=name) == {"FINISHED"}
    settings = bpy.context.scene.antumbra
    bake(tolerance=max(settings.tolerance, 0.01))
    (baked,) = baked_objects()
    light = baked.data.attributes["Radiosity"]
    assert (light.domain, light.data_type) == (settings.domain, settings.data_type)
    if settings.triangle_budget:
        assert len(baked.data.polygons) <= settings.triangle_budget
