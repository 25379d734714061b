# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours that vary over a face, as a bake shows them, and the light of such rooms."""

import bpy
import numpy as np
import pytest
from extension import last_warnings, module
from fingerprint import fingerprint
from node_trees import add_uv_map, link, shader_of, unreadable_grey, with_node
from scenes import (
    add_area_light,
    add_grid,
    add_material,
    add_plane,
    bake,
    baked_of,
    corner_vertices,
    positions,
    radiance,
    radiance_at,
    select,
)


def test_varying_faces_are_named_once_and_only_where_they_are_shown():
    plane, made = add_plane(), add_material("Noise")
    with_node(made, "ShaderNodeTexNoise")
    plane.data.materials.append(made)
    add_area_light()
    bake(quantity="RADIOSITY")
    assert sum("“Noise”" in text and "Light Only" in text for text in last_warnings()) == 1
    bake(quantity="IRRADIANCE")
    assert last_warnings() == []


def checkered(scale=4.0, **colours):
    """A floor of one face with checks in its UV map, under a lamp."""
    plane, made = add_plane(), add_material("Checks")
    add_uv_map(plane)
    checker = with_node(made, "ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = scale
    for name, colour in {"Color1": (0.8, 0.6, 0.4, 1), "Color2": (0.2, 0.1, 0.0, 1), **colours}.items():
        checker.inputs[name].default_value = colour
    link(made, made.node_tree.nodes.new("ShaderNodeUVMap"), 0, checker, "Vector")
    plane.data.materials.append(made)
    add_area_light(location=(0.1, 0.2, 2))
    return plane, made


def checks_and_light(**settings):
    """Radiosity per triangle and corner, irradiance, and the colour of the check that the triangle is in."""
    common = {"method": "UNIFORM", "element_size": 0.25, **settings}
    bake(quantity="IRRADIANCE", **common)
    light = radiance(baked_of("Plane").data).reshape(-1, 3, 3)
    bake(quantity="RADIOSITY", **common)
    mesh = baked_of("Plane").data
    middles = positions(mesh)[corner_vertices(mesh)].reshape(-1, 3, 3).mean(axis=1)
    squares = np.floor((middles[:, :2] + 1.0) / 2.0 * 4.0).sum(axis=1)
    return radiance(mesh).reshape(-1, 3, 3), light, squares % 2 == 1


def test_a_floor_of_one_face_shows_its_checks_as_sharp_as_its_elements():
    """The mesh's edges run along those of the checks, whose colours are then exact to the corner."""
    checkered()
    shown, light, first = checks_and_light()
    assert len(shown) >= 2 * 8**2
    assert light.min() > 0.0
    colours = np.where(first[:, None, None], (0.8, 0.6, 0.4), (0.2, 0.1, 0.0))
    assert shown == pytest.approx(colours * light, abs=2e-3 * float(light.max()))


def test_layers_show_them_too_and_transport_their_mean():
    checkered()
    grey = add_plane("Grey")
    grey.location.z, grey.scale = 1.0, (0.5, 0.5, 0.5)
    shown, light, first = checks_and_light(layers="SEPARATE", receivers="ALL")
    mesh = baked_of("Plane").data
    parts = [radiance(mesh, name).reshape(-1, 3, 3) for name in ("Radiosity Direct", "Radiosity Indirect")]
    assert sum(parts) == pytest.approx(shown, abs=1e-6)
    colours = np.where(first[:, None, None], (0.8, 0.6, 0.4), (0.2, 0.1, 0.0))
    assert parts[1].max() > 0.0
    assert shown == pytest.approx(colours * light, abs=2e-3 * float(light.max()))


def test_screens_shine_as_their_picture_does():
    """Emission of its own per element, while the floor before it gets the light of the mean."""
    plane = add_plane("Screen")
    made = add_material("Picture", "ShaderNodeEmission")
    add_uv_map(plane)
    separate = made.node_tree.nodes.new("ShaderNodeSeparateXYZ")
    link(made, made.node_tree.nodes.new("ShaderNodeUVMap"), 0, separate, "Vector")
    link(made, separate, "X", shader_of(made), "Strength")
    plane.data.materials.append(made)
    bake(method="UNIFORM", element_size=0.5)
    mesh = baked_of("Screen").data
    across = positions(mesh)[corner_vertices(mesh)][:, 0]
    assert radiance(mesh) == pytest.approx(np.repeat((0.5 + 0.5 * across)[:, None], 3, axis=1), abs=1e-3)


def test_showing_textures_leaves_nothing_behind():
    checkered()
    bake(method="UNIFORM", element_size=0.5)
    assert bpy.ops.antumbra.remove_bake() == {"FINISHED"}
    before = fingerprint()
    bake(method="UNIFORM", element_size=0.5)
    assert bpy.ops.antumbra.remove_bake() == {"FINISHED"}
    assert fingerprint() == before


def test_without_its_material_a_texture_is_its_mean_and_says_so():
    plane, made = checkered()
    settings = module("core.settings").Settings(receivers="ALL", method="UNIFORM", element_size=0.5)
    job = module("bridge.host").new_bake(settings)
    job.begin()
    bpy.data.materials.remove(made)
    warnings = job.finish()["warnings"]
    assert any("“Plane”" in text and "deleted" in text for text in warnings)
    shown = radiance(baked_of("Plane").data)
    assert shown[:, 0] == pytest.approx(shown[:, 1] * 0.5 / 0.35, rel=5e-3)


def test_a_bake_shows_each_faces_colour():
    """Half of the light of a white face comes from one that is grey by a node that only Cycles can read."""
    plane = add_plane()
    add_area_light(location=(0, 0, 2))
    light = {}
    for name in ("White", "Grey"):
        made = add_material(name, Color=(1, 1, 1, 1))
        if name == "Grey":
            made.node_tree.links.new(unreadable_grey(made.node_tree), shader_of(made).inputs["Color"])
        plane.data.materials.clear()
        plane.data.materials.append(made)
        bake(method="UNIFORM", element_size=1.0)
        light[name] = radiance(baked_of("Plane").data)
    assert light["White"].min() > 0.0
    assert light["Grey"] == pytest.approx(0.5 * light["White"], rel=1e-6)


def light_by_cycles(obj, samples):
    """(V, 3) irradiance over pi at the vertices, by Cycles' own bake into a colour attribute."""
    scene, mesh = bpy.context.scene, obj.data
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", samples, False, False
    cycles.max_bounces = cycles.diffuse_bounces = 32
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    mesh.color_attributes.new("Cycles", "FLOAT_COLOR", "CORNER")
    mesh.color_attributes.active_color_name = "Cycles"
    with bpy.context.temp_override(active_object=obj, object=obj, selected_objects=[obj]):
        bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, target="VERTEX_COLORS", use_clear=False)
    values = np.empty(len(mesh.loops) * 4, dtype=np.float32)
    mesh.attributes["Cycles"].data.foreach_get("color", values)
    total, count = np.zeros((len(mesh.vertices), 3)), np.zeros((len(mesh.vertices), 1))
    np.add.at(total, corner_vertices(mesh), values.reshape(-1, 4)[:, :3])
    np.add.at(count, corner_vertices(mesh), 1.0)
    return total / count


def test_a_room_of_textures_has_the_light_that_cycles_finds_there():
    """Walls by a fine checker, a ceiling by a colour attribute, a wall that glows by a ramp, a lamp behind a screen."""
    floor = add_grid("Floor", cells=4, size=2.0)
    floor.data.materials.append(add_material("Plain", Color=(0.5, 0.5, 0.5, 1)))
    made = add_material("Checker")
    checker = with_node(made, "ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = 40.0
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = (1, 0.6, 0.2, 1), (0.4, 0.2, 0, 1)
    for name, x, y, angle in (("Left", -2, 0, (0, 1.5708, 0)), ("Back", 0, 2, (1.5708, 0, 0))):
        wall = add_plane(name, size=4.0)
        wall.location, wall.rotation_euler = (x, y, 1.9), angle
        wall.data.materials.append(made)
    ceiling, painted = add_grid("Ceiling", cells=2, size=4.0), add_material("Painted")
    ceiling.location = (0, 0, 3)
    with_node(painted, "ShaderNodeVertexColor").layer_name = "Paint"
    paint = ceiling.data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    greys = np.repeat([0.1, 0.9, 0.3, 0.7], 4)
    paint.data.foreach_set("color", np.stack([greys] * 4, axis=1).astype(np.float32).reshape(-1))
    ceiling.data.materials.append(painted)
    glow, glowing = add_grid("Glow", cells=8, size=4.0), add_material("Glow", "EMISSION", Strength=3.0)
    glow.location, glow.rotation_euler = (2, 0, 1.9), (0, 1.5708, 0)
    gradient = with_node(glowing, "ShaderNodeTexGradient")
    link(glowing, glowing.node_tree.nodes.new("ShaderNodeTexCoord"), "Generated", gradient, "Vector")
    glow.data.materials.append(glowing)
    screen = add_plane("Screen", size=0.7)
    screen.location = (0.3, 0.2, 1.0)
    screen.data.materials.append(add_material("Dark", Color=(0.2, 0.2, 0.2, 1)))
    add_area_light(location=(0, 0, 2.5), size=0.5, energy=60.0)

    expected = light_by_cycles(floor, 4096)
    select(floor)
    bake(receivers="SELECTED", quantity="IRRADIANCE", tolerance=0.005)
    baked = baked_of("Floor")
    found = np.array([radiance_at(baked, vertex.co).mean(axis=0) for vertex in floor.data.vertices])
    assert (expected.max(axis=0) > 1.2 * expected.min(axis=0)).all()
    assert (found / expected).mean(axis=0) == pytest.approx(np.ones(3), abs=0.005)
    assert np.sqrt(((found - expected) ** 2).mean()) < 0.01 * expected.mean()
