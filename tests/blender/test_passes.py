# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that only Cycles can read, as the reflectance and exitance of each face."""

import math

import bpy
import numpy as np
import pytest
from extension import last_warnings, module, read_scene
from fingerprint import fingerprint
from scenes import (
    add_area_light,
    add_grid,
    add_instances_by_nodes,
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

STEP = 1 / 1024
PRINCIPLED = "ShaderNodeBsdfPrincipled"


def shader_of(material):
    return material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node


def with_node(material, node_type, socket="Color", output="Color"):
    """Link a new node to an input of the material's shader."""
    node = material.node_tree.nodes.new(node_type)
    material.node_tree.links.new(node.outputs[output], shader_of(material).inputs[socket])
    return node


def link(material, from_node, output, to_node, socket):
    material.node_tree.links.new(from_node.outputs[output], to_node.inputs[socket])


def add_uv_map(obj):
    """Each face has the whole texture."""
    layer = obj.data.uv_layers.new(name="UV")
    layer.uv.foreach_set("vector", np.tile(np.float32([0, 0, 1, 0, 1, 1, 0, 1]), len(obj.data.polygons)))


def unreadable_grey(tree, value=0.5):
    """A colour that is constant, but not for who reads nodes only."""
    node = tree.nodes.new("ShaderNodeMapRange")
    node.inputs["Value"].default_value = value
    return node.outputs[0]


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


def test_a_material_of_an_unused_slot_is_not_looked_at():
    plane, made = add_plane(), add_material("Noise")
    with_node(made, "ShaderNodeTexNoise")
    plane.data.materials.append(add_material("Plain", Color=(0.25, 0.25, 0.25, 1)))
    plane.data.materials.append(made)
    assert (of_faces("reflectance_rgb") == np.float32(0.25)).all()
    assert read_scene().warnings == []


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
