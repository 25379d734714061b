# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials as reflectance and exitance."""

import math

import bpy
import numpy as np
import pytest
from extension import read_scene
from scenes import add_material, add_plane

PRINCIPLED = "ShaderNodeBsdfPrincipled"


def read_material(material):
    """(Material as core knows it, warnings)"""
    plane = add_plane()
    plane.data.materials.append(material)
    scene = read_scene()
    (record,) = scene.objects
    return scene.materials[record.slot_materials[0]], scene.warnings


def shader_of(material):
    return material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node


def link_into(material, node_type, socket):
    node = material.node_tree.nodes.new(node_type)
    material.node_tree.links.new(node.outputs[0], socket)
    return node


def pi_times(*rgb):
    return tuple(math.pi * value for value in rgb)


def test_no_material_is_grey():
    add_plane()
    scene = read_scene()
    assert scene.materials[0].reflectance_rgb == (0.8, 0.8, 0.8)


def test_diffuse():
    material, warnings = read_material(add_material("it", Color=(0.1, 0.2, 0.3, 1)))
    assert material.reflectance_rgb == pytest.approx((0.1, 0.2, 0.3))
    assert material.exitance_rgb == (0, 0, 0)
    assert warnings == []


def test_principled_with_emission():
    made = add_material(
        "it", PRINCIPLED, Base_Color=(0.1, 0.2, 0.3, 1), Emission_Color=(1, 0.5, 0, 1), Emission_Strength=2.0
    )
    material, warnings = read_material(made)
    assert material.reflectance_rgb == pytest.approx((0.1, 0.2, 0.3))
    assert material.exitance_rgb == pytest.approx(pi_times(2, 1, 0))
    assert warnings == []


def test_metal_is_baked_as_matte_and_said_so():
    material, warnings = read_material(add_material("Steel", PRINCIPLED, Metallic=1.0))
    assert material.reflectance_rgb == pytest.approx((0.8, 0.8, 0.8))
    assert any("“Steel”" in text and "metal" in text for text in warnings)


def test_mix_and_add_of_shaders():
    made = add_material("it", "ShaderNodeMixShader", Fac=0.25)
    mix = shader_of(made)
    link_into(made, "ShaderNodeBsdfDiffuse", mix.inputs[1]).inputs["Color"].default_value = (0.8, 0.4, 0, 1)
    add = link_into(made, "ShaderNodeAddShader", mix.inputs[2])
    link_into(made, "ShaderNodeBsdfDiffuse", add.inputs[0]).inputs["Color"].default_value = (0, 0.4, 0.8, 1)
    emission = link_into(made, "ShaderNodeEmission", add.inputs[1])
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1, 0, 1, 1), 4.0
    material, _ = read_material(made)
    assert material.reflectance_rgb == pytest.approx((0.6, 0.4, 0.2))
    assert material.exitance_rgb == pytest.approx(pi_times(1, 0, 1))


def image_of(rgb, name="Image", float_buffer=False, is_data=False):
    """Left half white, right half rgb, as stored."""
    image = bpy.data.images.new(name, 4, 2, float_buffer=float_buffer, is_data=is_data)
    pixels = np.ones((2, 4, 4), dtype=np.float32)
    pixels[:, 2:, :3] = rgb
    image.pixels.foreach_set(pixels.reshape(-1))
    return image


@pytest.mark.parametrize("float_buffer", [True, False])
def test_mean_of_an_image(float_buffer):
    made = add_material("it")
    texture = link_into(made, "ShaderNodeTexImage", shader_of(made).inputs["Color"])
    stored = (188 / 255, 0.0, 0.0)
    texture.image = image_of(stored, float_buffer=float_buffer)
    material, warnings = read_material(made)
    # 188 of 255 is 0.5028 in linear light; float images are linear as they are.
    red = stored[0] if float_buffer else 0.5028864
    assert material.reflectance_rgb == pytest.approx(((1 + red) / 2, 0.5, 0.5), abs=1e-5)
    assert warnings == []


def test_an_image_of_data_is_linear():
    made = add_material("it")
    texture = link_into(made, "ShaderNodeTexImage", shader_of(made).inputs["Color"])
    texture.image = image_of((188 / 255, 0.0, 0.0), is_data=True)
    material, _ = read_material(made)
    assert material.reflectance_rgb[0] == pytest.approx((1 + 188 / 255) / 2, abs=1e-5)


def test_a_missing_image_falls_back_by_name(tmp_path):
    made = add_material("Lost")
    made.diffuse_color = (0.3, 0.2, 0.1, 1)
    texture = link_into(made, "ShaderNodeTexImage", shader_of(made).inputs["Color"])
    texture.image = bpy.data.images.new("gone", 1, 1)
    texture.image.source = "FILE"
    texture.image.filepath = str(tmp_path / "gone.png")
    material, warnings = read_material(made)
    assert material.reflectance_rgb == pytest.approx((0.3, 0.2, 0.1))
    assert any("“Lost”" in text and "viewport colour" in text for text in warnings)


def test_without_cycles_other_nodes_fall_back_by_name():
    made = add_material("Marble")
    made.diffuse_color = (0.3, 0.2, 0.1, 1)
    link_into(made, "ShaderNodeTexNoise", shader_of(made).inputs["Color"])
    bpy.ops.preferences.addon_disable(module="cycles")
    try:
        material, warnings = read_material(made)
    finally:
        bpy.ops.preferences.addon_enable(module="cycles")
    assert material.reflectance_rgb == pytest.approx((0.3, 0.2, 0.1))
    assert any("“Marble”" in text and "viewport colour" in text for text in warnings)


def test_metals_may_be_black():
    made = add_material("Steel", PRINCIPLED, Metallic=0.75, Base_Color=(0.8, 0.4, 0.2, 1))
    made_of_gloss = add_material("Gloss", "ShaderNodeBsdfGlossy", Color=(0.5, 0.5, 0.5, 1))
    for name, material in (("a", made), ("b", made_of_gloss)):
        add_plane(name).data.materials.append(material)
    expected = {"MATTE": ((0.8, 0.4, 0.2), (0.5, 0.5, 0.5)), "BLACK": ((0.2, 0.1, 0.05), (0, 0, 0))}
    for metals, colours in expected.items():
        scene = read_scene(metals=metals)
        for record, colour in zip(scene.objects, colours, strict=True):
            assert scene.materials[record.slot_materials[0]].reflectance_rgb == pytest.approx(colour)
        assert sum("metal" in text for text in scene.warnings) == 2


@pytest.mark.parametrize(
    ("inputs", "reflectance", "through"),
    [
        ({"Alpha": 0.25}, (0.16, 0.2, 0.08), (0.75, 0.75, 0.75)),
        ({"Alpha": 0.75}, (0.48, 0.6, 0.24), (0.25, 0.25, 0.25)),
        ({"Transmission_Weight": 1.0}, (0.0, 0.0, 0.0), (0.8, 0.894427, 0.565685)),
        ({"Transmission_Weight": 0.5, "Alpha": 0.5}, (0.16, 0.2, 0.08), (0.7, 0.723607, 0.641421)),
        ({"Transmission_Weight": 1.0, "Metallic": 1.0}, (0.0, 0.0, 0.0), (0.8, 0.894427, 0.565685)),
    ],
)
def test_the_share_of_light_that_goes_through(inputs, reflectance, through):
    made = add_material("Pane", PRINCIPLED, Base_Color=(0.64, 0.8, 0.32, 1), **inputs)
    material, warnings = read_material(made)
    assert material.reflectance_rgb == pytest.approx(reflectance)
    assert material.transmittance_rgb == pytest.approx(through, abs=1e-6)
    assert any("“Pane”" in text and "its glass" in text for text in warnings) == ("Transmission_Weight" in inputs)


@pytest.mark.parametrize("shader", ["ShaderNodeBsdfTransparent", "ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction"])
def test_glass_and_transparent_shaders_tint_what_goes_through(shader):
    material, _ = read_material(add_material("Pane", shader, Color=(0.9, 0.5, 2.0, 1)))
    assert material.reflectance_rgb == (0, 0, 0)
    assert material.transmittance_rgb == pytest.approx((0.9, 0.5, 1.0))


def test_holdouts_let_everything_through():
    material, _ = read_material(add_material("Hole", "ShaderNodeHoldout"))
    assert (material.reflectance_rgb, material.transmittance_rgb) == ((0, 0, 0), (1, 1, 1))


def test_a_colour_through_a_reroute():
    made = add_material("it")
    reroute = made.node_tree.nodes.new("NodeReroute")
    rgb = made.node_tree.nodes.new("ShaderNodeRGB")
    rgb.outputs[0].default_value = (0.4, 0.5, 0.6, 1)
    made.node_tree.links.new(rgb.outputs[0], reroute.inputs[0])
    made.node_tree.links.new(reroute.outputs[0], shader_of(made).inputs["Color"])
    material, warnings = read_material(made)
    assert material.reflectance_rgb == pytest.approx((0.4, 0.5, 0.6))
    assert warnings == []


def test_the_objects_own_material_goes_before_its_meshs():
    plane = add_plane()
    plane.data.materials.append(add_material("of the mesh", Color=(1, 0, 0, 1)))
    plane.material_slots[0].link = "OBJECT"
    plane.material_slots[0].material = add_material("of the object", Color=(0, 1, 0, 1))
    other = add_plane("Other")
    other.data = plane.data
    scene = read_scene()
    names = {record.name: scene.materials[record.slot_materials[0]].name for record in scene.objects}
    assert names == {"Plane": "of the object", "Other": "of the mesh"}
