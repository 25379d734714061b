# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that only Cycles can read, as the reflectance and exitance of each face."""

import math

import bpy
import numpy as np
import pytest
from extension import read_scene
from fingerprint import fingerprint
from node_trees import add_uv_map, link, shader_of, unreadable_grey, with_node
from scenes import (
    add_grid,
    add_instances_by_nodes,
    add_material,
    add_plane,
)

STEP = 1 / 1024
PRINCIPLED = "ShaderNodeBsdfPrincipled"


def of_faces(what, name=None, **settings):
    """(F, 3) reflectance or exitance of an object's faces."""
    scene = read_scene(**settings)
    (record,) = (record for record in scene.objects if name in (None, record.name))
    by_face = np.zeros((len(record.surface.face_materials), 3))
    for face, material in zip(record.surface.triangle_faces, record.triangle_materials(), strict=True):
        by_face[face] = getattr(scene.materials[material], what)
    return by_face


def test_a_checker_reflects_its_mean():
    plane, made = add_plane(), add_material("Checker")
    add_uv_map(plane)
    checker = with_node(made, "ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = 10.0
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = (1, 0.5, 0, 1), (0, 0.5, 0.5, 1)
    link(made, made.node_tree.nodes.new("ShaderNodeUVMap"), 0, checker, "Vector")
    plane.data.materials.append(made)
    assert of_faces("reflectance_rgb") == pytest.approx(np.array([[0.5, 0.5, 0.25]]), abs=2e-3)


def test_colour_attributes_by_face():
    grid, made = add_grid(cells=2), add_material("Painted")
    with_node(made, "ShaderNodeVertexColor").layer_name = "Paint"
    paint = grid.data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    greys = np.float32([0.1, 0.3, 0.5, 0.9])
    paint.data.foreach_set("color", np.repeat(np.stack([greys] * 4, axis=1), 4, axis=0).reshape(-1))
    grid.data.materials.append(made)
    assert of_faces("reflectance_rgb") == pytest.approx(np.stack([greys] * 3, axis=1), abs=0.51 * STEP)


def test_a_linear_attribute_has_its_exact_mean():
    plane, made = add_plane(), add_material("Ramp")
    with_node(made, "ShaderNodeVertexColor").layer_name = "Paint"
    paint = plane.data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    for item, value in zip(paint.data, (0, 1, 1, 0), strict=True):
        item.color = (value, value, value, 1)
    plane.data.materials.append(made)
    assert of_faces("reflectance_rgb") == pytest.approx(np.full((1, 3), 0.5), abs=0.51 * STEP)


@pytest.mark.parametrize("mapped", [False, True])
def test_an_image_by_the_part_that_a_face_shows(mapped):
    """Left half of the image black, right half red; the two faces' UVs lie on one half each."""
    grid, made = add_grid(cells=2), add_material("Photo")
    image = bpy.data.images.new("Photo", 8, 8, float_buffer=True)
    pixels = np.zeros((8, 8, 4), dtype=np.float32)
    pixels[:, 4:, 0], pixels[..., 3] = 0.75, 1.0
    image.pixels.foreach_set(pixels.reshape(-1))
    texture = with_node(made, "ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    if mapped:
        mapping = made.node_tree.nodes.new("ShaderNodeMapping")
        mapping.inputs["Location"].default_value = (0.5, 0, 0)
        link(made, made.node_tree.nodes.new("ShaderNodeUVMap"), 0, mapping, "Vector")
        link(made, mapping, 0, texture, "Vector")
    layer = grid.data.uv_layers.new(name="UV")
    uv = np.array([(vertex.co.x / 2 + 0.5, vertex.co.y / 2 + 0.5) for vertex in grid.data.vertices], dtype=np.float32)
    corners = [vertex for face in grid.data.polygons for vertex in face.vertices]
    layer.uv.foreach_set("vector", uv[corners].reshape(-1))
    grid.data.materials.append(made)
    left, right = (0.75, 0) if mapped else (0, 0.75)
    assert of_faces("reflectance_rgb")[:, 0] == pytest.approx([left, right, left, right], abs=0.51 * STEP)
    assert (of_faces("reflectance_rgb")[:, 1:] == 0).all()


def test_generated_coordinates_run_over_the_whole_object():
    grid, made = add_grid(cells=2), add_material("Fade")
    gradient = with_node(made, "ShaderNodeTexGradient")
    link(made, made.node_tree.nodes.new("ShaderNodeTexCoord"), "Generated", gradient, "Vector")
    grid.data.materials.append(made)
    assert of_faces("reflectance_rgb")[:, 0] == pytest.approx([0.25, 0.75, 0.25, 0.75], abs=0.51 * STEP)


def test_emission_by_texture():
    grid, made = add_grid(cells=2), add_material("Glow", "EMISSION", Strength=8.0)
    gradient = with_node(made, "ShaderNodeTexGradient")
    link(made, made.node_tree.nodes.new("ShaderNodeTexCoord"), "Generated", gradient, "Vector")
    grid.data.materials.append(made)
    glow = math.pi * 8.0 * np.array([0.25, 0.75, 0.25, 0.75])
    assert of_faces("exitance_rgb")[:, 0] == pytest.approx(glow, rel=STEP)
    assert (of_faces("reflectance_rgb") == 0.0).all()


def in_a_group(material, shader, **inputs):
    """Put the material's shader into a node group of this one; returns the group's tree and shader."""
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    node, output = tree.nodes.new(shader), tree.nodes.new("NodeGroupOutput")
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], output.inputs[0])
    material.node_tree.nodes.clear()
    group, out = (material.node_tree.nodes.new(n) for n in ("ShaderNodeGroup", "ShaderNodeOutputMaterial"))
    group.node_tree = tree
    material.node_tree.links.new(group.outputs[0], out.inputs["Surface"])
    return tree, node


def test_principled_in_a_group_reflects_its_base_colour_below_its_gloss():
    plane, made = add_plane(), add_material("Lacquer")
    in_a_group(made, PRINCIPLED, Base_Color=(0.8, 0.4, 0.2, 1), Coat_Weight=1.0, Emission_Strength=2.0)
    plane.data.materials.append(made)
    assert of_faces("reflectance_rgb") == pytest.approx(np.array([[0.8, 0.4, 0.2]]), abs=0.51 * STEP)
    # Below the coat.
    assert 0.9 * 2 * math.pi < of_faces("exitance_rgb")[0, 0] < 2 * math.pi


@pytest.mark.parametrize(("metals", "expected"), [("MATTE", 0.5), ("BLACK", 0.0)])
@pytest.mark.parametrize("shader", [PRINCIPLED, "ShaderNodeBsdfAnisotropic"])
def test_metals_in_a_group(metals, expected, shader):
    plane, made = add_plane(), add_material("Brass")
    metallic = (
        {"Metallic": 1.0, "Base_Color": (0.5, 0.5, 0.5, 1)} if shader == PRINCIPLED else {"Color": (0.5,) * 3 + (1,)}
    )
    in_a_group(made, shader, **metallic)
    plane.data.materials.append(made)
    assert of_faces("reflectance_rgb", metals=metals) == pytest.approx(np.full((1, 3), expected), abs=0.51 * STEP)
    assert sum("“Brass”: its metal" in text for text in read_scene(metals=metals).warnings) == 1


@pytest.mark.parametrize("glass", [{"Alpha": 0.25}, {"Transmission_Weight": 0.75}])
@pytest.mark.parametrize("hidden", [False, True])
def test_what_lets_light_through_does_so_in_a_group_too(glass, hidden):
    plane, made = add_plane(), add_material("Pane")
    tree, node = in_a_group(made, PRINCIPLED, Base_Color=(0.8,) * 3 + (1,), **glass)
    if hidden:
        (name,) = (name.replace("_", " ") for name in glass)
        tree.links.new(unreadable_grey(tree, *glass.values()), node.inputs[name])
    plane.data.materials.append(made)
    scene = read_scene()
    (record,) = scene.objects
    (material,) = {scene.materials[index] for index in record.triangle_materials()}
    assert material.reflectance_rgb == pytest.approx((0.2,) * 3, abs=0.51 * STEP)
    assert material.transmittance_rgb == pytest.approx((0.75,) * 3, abs=0.51 * STEP)
    assert any("“Pane”" in text and "its glass" in text for text in scene.warnings) == ("Alpha" not in glass)


def test_what_nodes_and_passes_both_tell_is_said_once():
    """An image is read by passes, the glass beside it by nodes too; a missing image that nothing uses is no loss."""
    plane, made = add_plane(), add_material("Veil", PRINCIPLED, Transmission_Weight=0.25)
    add_uv_map(plane)
    with_node(made, "ShaderNodeTexImage", "Base Color").image = bpy.data.images.new("Black", 4, 4)
    lost = bpy.data.images.new("gone", 1, 1)
    lost.source, lost.filepath = "FILE", "//gone.png"
    made.node_tree.nodes.new("ShaderNodeTexImage").image = lost
    plane.data.materials.append(made)
    (warning,) = read_scene().warnings
    assert "“Veil”: light goes straight through its glass" in warning


def test_reading_leaves_the_file_as_it_was():
    grid, made = add_grid(cells=2), add_material("Marble", PRINCIPLED)
    in_a_group(made, PRINCIPLED, Metallic=1.0, Transmission_Weight=0.5)
    with_noise = add_material("Noise")
    with_node(with_noise, "ShaderNodeTexNoise")
    grid.data.materials.append(made)
    grid.data.materials.append(with_noise)
    grid.data.polygons[0].material_index = 1
    bpy.context.scene.render.engine = "CYCLES"
    before = fingerprint()
    read_scene()
    assert fingerprint() == before
    assert shader_of(made).node_tree.nodes[0].inputs["Metallic"].default_value == 1.0


def test_instances_share_a_look_and_places_tell_them_apart():
    """The ramp over world x, by position, from 0 at x = 0 to 1 at x = 10."""
    vertices = [(x, 0, 0) for x in (2, 4, 8)]
    mesh = bpy.data.meshes.new("Points")
    mesh.from_pydata(vertices, [], [])
    points = bpy.data.objects.new("Points", mesh)
    bpy.context.scene.collection.objects.link(points)
    tile, made = add_plane("Tile", size=1.0), add_material("By place")
    separate, scale = (made.node_tree.nodes.new(n) for n in ("ShaderNodeSeparateXYZ", "ShaderNodeMath"))
    scale.operation, scale.inputs[1].default_value = "MULTIPLY", 0.1
    link(made, made.node_tree.nodes.new("ShaderNodeNewGeometry"), "Position", separate, 0)
    link(made, separate, "X", scale, 0)
    link(made, scale, 0, shader_of(made), "Color")
    tile.data.materials.append(made)
    tile.hide_render = True
    add_instances_by_nodes(points, tile)
    scene = read_scene()
    found = sorted(scene.materials[record.triangle_materials()[0]].reflectance_rgb[0] for record in scene.objects)
    assert found == pytest.approx([0.2, 0.4, 0.8], abs=0.51 * STEP)


def test_meshes_that_are_looked_at_together_keep_their_own_colours():
    """Ramps over the box and over the space of objects of different sizes, places, slots and UV maps."""
    expected = {}
    for index, (output, size) in enumerate([("Generated", 1.0), ("Generated", 3.0), ("Object", 1.0), ("Object", 1.5)]):
        name = f"{output} {size}"
        obj, made = add_grid(name, cells=2, size=size), add_material(name)
        obj.location = (5 * index, 0, 0)
        ramp = with_node(made, "ShaderNodeTexGradient")
        coordinates = made.node_tree.nodes.new("ShaderNodeTexCoord")
        link(made, coordinates, output, ramp, "Vector")
        obj.data.materials.append(add_material(f"Plain {index}", Color=(0, 0, index / 4, 1)))
        obj.data.materials.append(made)
        obj.data.polygons.foreach_set("material_index", [0, 1, 1, 1])
        if index % 2:
            add_uv_map(obj)
        # The ramp is 0 left of the middle of an object, x right of it.
        right = {"Generated": 0.75, "Object": size / 4}[output]
        left = {"Generated": 0.25, "Object": 0.0}[output]
        expected[name] = [(0, 0, index / 4), (right,) * 3, (left,) * 3, (right,) * 3]
    for name, colours in expected.items():
        assert of_faces("reflectance_rgb", name) == pytest.approx(np.array(colours), abs=0.51 * STEP), name


def test_a_material_of_an_unused_slot_is_not_looked_at():
    plane, made = add_plane(), add_material("Noise")
    with_node(made, "ShaderNodeTexNoise")
    plane.data.materials.append(add_material("Plain", Color=(0.25, 0.25, 0.25, 1)))
    plane.data.materials.append(made)
    assert (of_faces("reflectance_rgb") == np.float32(0.25)).all()
    assert read_scene().warnings == []
