# SPDX-License-Identifier: GPL-3.0-or-later
"""Every light and every option of it, against Cycles in the same process, at the vertices of a floor under a cube.

Nothing reflects and nothing is refined, so that each vertex has the light of its own point: what differs is the light
model, or Cycles' noise. With ANTUMBRA_LONG=1 (`cargo xtask test --long`) there are 4,096 samples a vertex, and the rows
of the table in the README are printed.
"""

import math
import os

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from scenes import (
    add_cube,
    add_grid,
    add_material,
    add_mesh,
    add_plane,
    bake,
    baked_of,
    corner_vertices,
    link,
    positions,
    radiance,
)

LONG = os.environ.get("ANTUMBRA_LONG") == "1"
SAMPLES = 4096 if LONG else 256
# Of the mean over the floor, and of the differences at its vertices, relative to that.
MEAN_WITHIN, RMS_WITHIN = (0.003, 0.01) if LONG else (0.01, 0.04)

SINCE_4_5 = bpy.app.version >= (4, 5, 0)
ABOVE = Matrix.Translation((0.31, -0.22, 2.3)) @ Matrix.Rotation(0.2, 4, "X")
TILTED = Matrix.Rotation(0.5, 4, "X") @ Matrix.Rotation(0.3, 4, "Y")


def scaled(x, y, z):
    return ABOVE @ Matrix.Diagonal((x, y, z, 1))


CASES = {
    "point, radius 0": ("POINT", ABOVE, {"shadow_soft_size": 0}),
    "point, radius 0.3": ("POINT", ABOVE, {"shadow_soft_size": 0.3}),
    "point, radius 0.3, scaled": ("POINT", scaled(2, 3, 4), {"shadow_soft_size": 0.3}),
    "point, radius 0.3, no soft falloff": ("POINT", ABOVE, {"shadow_soft_size": 0.3, "use_soft_falloff": False}),
    "point, no shadow": ("POINT", ABOVE, {"shadow_soft_size": 0, "use_shadow": False}),
    "point, negative": ("POINT", ABOVE, {"shadow_soft_size": 0.1, "energy": -50.0}),
    "spot, radius 0, blend 0.3": ("SPOT", ABOVE, {"shadow_soft_size": 0, "spot_size": 1.3, "spot_blend": 0.3}),
    "spot, radius 0, blend 0": ("SPOT", ABOVE, {"shadow_soft_size": 0, "spot_size": 1.3, "spot_blend": 0.0}),
    "spot, radius 0.3, blend 1": ("SPOT", ABOVE, {"shadow_soft_size": 0.3, "spot_size": 1.3, "spot_blend": 1.0}),
    "spot, radius 0.3, no soft falloff": (
        "SPOT",
        ABOVE,
        {"shadow_soft_size": 0.3, "spot_size": 1.3, "spot_blend": 0.3, "use_soft_falloff": False},
    ),
    "spot, elliptical": ("SPOT", scaled(2, 1, 1.5), {"shadow_soft_size": 0, "spot_size": 1.0, "spot_blend": 0.5}),
    "sun, angle 0": ("SUN", TILTED, {"angle": 0, "energy": 3.0}),
    "sun, angle 10 degrees": ("SUN", TILTED, {"angle": math.radians(10), "energy": 3.0}),
    "sun, angle 90 degrees": ("SUN", TILTED, {"angle": math.radians(90), "energy": 3.0}),
    "sun, no shadow": ("SUN", TILTED, {"angle": 0.1, "energy": 3.0, "use_shadow": False}),
    "area, square": ("AREA", ABOVE, {"shape": "SQUARE", "size": 0.8}),
    "area, ellipse, scaled": ("AREA", scaled(2, 0.5, 1), {"shape": "ELLIPSE", "size": 0.8, "size_y": 1.2}),
    "area, spread 100 degrees": ("AREA", ABOVE, {"shape": "SQUARE", "size": 0.8, "spread": math.radians(100)}),
    "area, disk, spread 40 degrees": ("AREA", ABOVE, {"shape": "DISK", "size": 1.5, "spread": math.radians(40)}),
    "area, no shadow": ("AREA", ABOVE, {"shape": "SQUARE", "size": 0.8, "use_shadow": False}),
}
if SINCE_4_5:
    CASES |= {
        "point, radius 0.3, not normalized": ("POINT", ABOVE, {"shadow_soft_size": 0.3, "normalize": False}),
        "point, radius 0, not normalized": ("POINT", ABOVE, {"shadow_soft_size": 0, "normalize": False}),
        "spot, radius 0.2, not normalized": ("SPOT", ABOVE, {"shadow_soft_size": 0.2, "normalize": False}),
        "sun, angle 10 degrees, not normalized": ("SUN", TILTED, {"angle": math.radians(10), "normalize": False}),
        "sun, angle 0, not normalized": ("SUN", TILTED, {"angle": 0, "energy": 3.0, "normalize": False}),
        "area, not normalized": ("AREA", ABOVE, {"shape": "SQUARE", "size": 0.8, "normalize": False}),
        "point, exposure 1.5": ("POINT", ABOVE, {"shadow_soft_size": 0.1, "exposure": 1.5}),
        "sun, temperature 2700 K": (
            "SUN",
            TILTED,
            {"angle": 0.1, "energy": 3.0, "use_temperature": True, "temperature": 2700.0},
        ),
    }


def floor_under_a_cube():
    floor = add_grid("Floor", cells=15, size=4.0)
    floor.data.materials.append(add_material("Paint", Color=(0.5, 0.5, 0.5, 1)))
    cube = add_cube("Blocker")
    cube.data.materials.append(add_material("Black", Color=(0, 0, 0, 1)))
    cube.matrix_world = (
        Matrix.Translation((0.33, 0.21, 0.9)) @ Matrix.Rotation(0.5, 4, (1, 2, 3)) @ Matrix.Diagonal((0.3, 0.4, 0.3, 1))
    )
    return floor


def by_cycles(floor, bounces=0):
    """Colours of the floor's vertices."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = bounces
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_indirect = 0.0
    colours = floor.data.color_attributes.new("Cycles", "FLOAT_COLOR", "POINT")
    floor.data.color_attributes.active_color = colours
    bpy.context.view_layer.objects.active = floor
    floor.select_set(True)
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT", "COLOR"}, target="VERTEX_COLORS")
    values = np.empty(len(floor.data.vertices) * 4, dtype=np.float32)
    floor.data.color_attributes["Cycles"].data.foreach_get("color", values)
    floor.data.color_attributes.remove(floor.data.color_attributes["Cycles"])
    return values.reshape(-1, 4)[:, :3].astype(np.float64)


def by_antumbra(floor, **settings):
    """The same; a vertex where light jumps has the mean of its corners."""
    bake(**{"method": "UNIFORM", "element_size": 100.0, "tolerance": 0.005, **settings})
    baked = baked_of(floor.name)
    vertices = corner_vertices(baked.data)
    sums = np.zeros((len(baked.data.vertices), 3))
    np.add.at(sums, vertices, radiance(baked.data))
    means = sums / np.bincount(vertices)[:, None]
    # The vertices of the floor are among those of the baked mesh, to the bit.
    at = {tuple(position): index for index, position in enumerate(positions(baked.data))}
    return means[[at[tuple(position)] for position in positions(floor.data)]]


@pytest.fixture
def compare(capsys):
    """Hold one way of lighting against Cycles; `within`: of the mean and of the rms."""

    def compare(name, cycles, ours, within=(MEAN_WITHIN, RMS_WITHIN)):
        assert abs(cycles.mean()) > 1e-3
        mean = ours.mean() / cycles.mean() - 1.0
        rms = math.sqrt(((ours - cycles) ** 2).mean()) / abs(cycles.mean())
        if LONG:
            with capsys.disabled():
                print(f"\n| {name} | {100 * mean:+.2f} % | {100 * rms:.2f} % |")
        assert abs(mean) <= within[0], f"{name}: mean off by {mean:.2%}"
        assert rms <= within[1], f"{name}: rms {rms:.2%}"

    return compare


@pytest.mark.parametrize("name", CASES)
def test_lights(name, compare):
    kind, matrix, options = CASES[name]
    light = bpy.data.lights.new(name, kind)
    light.energy = 50.0
    light.color = (1.0, 0.8, 0.6)
    for key, value in options.items():
        setattr(light, key, value)
    floor = floor_under_a_cube()
    link(bpy.data.objects.new(name, light)).matrix_world = matrix
    compare(name, by_cycles(floor), by_antumbra(floor))


def link_to(light, which, *members):
    """Give a light a linking collection of (object or collection, state)."""
    collection = bpy.data.collections.new(which)
    for member, state in members:
        is_object = isinstance(member, bpy.types.Object)
        (collection.objects if is_object else collection.children).link(member)
        links = collection.collection_objects if is_object else collection.collection_children
        links[-1].light_linking.link_state = state
    setattr(light.light_linking, f"{which}_collection", collection)


@pytest.mark.parametrize(
    "linked", ["to the floor", "not to the floor", "in a group", "to nothing", "no shadow", "shadow of one"]
)
@pytest.mark.parametrize("name", ["point, radius 0", "sun, angle 10 degrees", "area, square"])
def test_light_linking(name, linked, compare):
    """A linked light beside a dim one that lights everything."""
    floor = floor_under_a_cube()
    cube = bpy.data.objects["Blocker"]
    other = add_cube("Other")
    other.matrix_world = Matrix.Translation((-0.9, -0.6, 0.5)) @ Matrix.Diagonal((0.3, 0.3, 0.3, 1))
    other.data.materials.append(cube.data.materials[0])
    kind, matrix, options = CASES[name]
    lights = []
    for energy in (50.0, 5.0):
        light = bpy.data.lights.new(name, kind)
        light.energy = energy
        for key, value in options.items():
            setattr(light, key, value)
        if energy == 5.0:
            light.energy, light.color = 0.1 * lights[0].data.energy, (0.2, 0.4, 1.0)
        lights.append(link(bpy.data.objects.new(name, light)))
        # Apart: of two area lights one behind the other, or in one place, Cycles' rays meet only one.
        lights[-1].matrix_world = Matrix.Translation((1.3 * len(lights), 0, 0)) @ matrix
    match linked:
        case "to the floor":
            link_to(lights[0], "receiver", (floor, "INCLUDE"))
        case "not to the floor":
            link_to(lights[0], "receiver", (floor, "EXCLUDE"))
        case "in a group":
            group = bpy.data.collections.new("Group")
            group.objects.link(floor)
            link_to(lights[0], "receiver", (group, "INCLUDE"), (cube, "INCLUDE"))
        case "to nothing":
            link_to(lights[0], "receiver")
        case "no shadow":
            link_to(lights[0], "blocker", (cube, "EXCLUDE"), (other, "EXCLUDE"))
        case "shadow of one":
            link_to(lights[0], "blocker", (other, "INCLUDE"))
    compare(f"{name}, linked: {linked}", by_cycles(floor), by_antumbra(floor))


PANES = {
    "half transparent": ("ShaderNodeBsdfPrincipled", {"Alpha": 0.5, "Base_Color": (0, 0, 0, 1)}),
    "tinted transparent": ("ShaderNodeBsdfTransparent", {"Color": (0.9, 0.5, 0.2, 1)}),
}


@pytest.mark.parametrize("pane", PANES)
@pytest.mark.parametrize("name", ["point, radius 0", "sun, angle 10 degrees", "area, square", "world, constant"])
def test_panes_before_lights(name, pane, compare):
    """A pane of two faces, one of them turned, in whose shadow and beside it the cube stands."""
    floor = floor_under_a_cube()
    if name in CASES:
        kind, matrix, options = CASES[name]
        light = bpy.data.lights.new(name, kind)
        light.energy = 50.0
        for key, value in options.items():
            setattr(light, key, value)
        link(bpy.data.objects.new(name, light)).matrix_world = matrix
    else:
        world_with_nodes()
    shader, inputs = PANES[pane]
    corners = [(-1.2, -1, 1.7), (0.2, -1.3, 1.6), (0.6, 0.9, 1.65), (-0.9, 1.1, 1.5), (1.5, 0.2, 0.7)]
    add_mesh("Pane", corners, [(0, 1, 2), (0, 2, 3), (1, 4, 2)]).data.materials.append(
        add_material("Pane", shader, **inputs)
    )
    compare(f"{name}, a {pane} pane before it", by_cycles(floor), by_antumbra(floor))


def world_with_nodes():
    world = bpy.data.worlds.new("Sky")
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    nodes = world.node_tree.nodes
    background = next(node for node in nodes if node.type == "BACKGROUND")
    return world, background


def test_constant_world(compare):
    floor = floor_under_a_cube()
    _, background = world_with_nodes()
    background.inputs["Color"].default_value = (0.5, 0.7, 1.0, 1.0)
    background.inputs["Strength"].default_value = 2.0
    compare("world, constant", by_cycles(floor), by_antumbra(floor))


@pytest.mark.parametrize(
    ("shader", "inputs"),
    [
        ("ShaderNodeBsdfGlass", {"Color": (0.8, 0.5, 0.9, 1)}),
        ("ShaderNodeBsdfRefraction", {"Color": (0.8, 0.5, 0.9, 1)}),
        ("ShaderNodeBsdfPrincipled", {"Base_Color": (0.64, 0.25, 0.81, 1), "Transmission_Weight": 1.0}),
    ],
)
def test_glass_tints(shader, inputs, compare):
    """Glass that does not bend light tints it on both sides of a slab, and once where it is a single face.

    Cycles blurs what it meets after a diffuse surface (Filter Glossy), and loses light by it.
    """
    bpy.context.scene.cycles.blur_glossy = 0.0
    floor = add_grid("Floor", cells=5, size=1.0)
    floor.data.materials.append(add_material("Paint", Color=(0.5, 0.5, 0.5, 1)))
    world_with_nodes()
    for kind, add in (("slab", add_cube), ("face", add_plane)):
        pane = add("Pane")
        pane.data.materials.append(add_material("Glass", shader, Roughness=0.0, IOR=1.0001, **inputs))
        pane.matrix_world = Matrix.Translation((0, 0, 0.3)) @ Matrix.Diagonal((200, 200, 0.02, 1))
        cycles, ours = by_cycles(floor, bounces=8), by_antumbra(floor)
        for channel, colour in enumerate(("red", "green", "blue")):
            name = f"{shader.removeprefix('ShaderNodeBsdf')}, {kind}, {colour}"
            compare(name, cycles[:, channel], ours[:, channel], (0.003, 0.01))
        bpy.ops.antumbra.remove_bake()
        bpy.data.objects.remove(pane)


def test_gradient_world(compare):
    floor = floor_under_a_cube()
    world, background = world_with_nodes()
    nodes, links = world.node_tree.nodes, world.node_tree.links
    coordinates = nodes.new("ShaderNodeTexCoord")
    links.new(coordinates.outputs["Generated"], background.inputs["Color"])
    compare("world, gradient", by_cycles(floor), by_antumbra(floor))


def test_environment_image(compare):
    """A bright patch of 5 degrees on a dim sky, mapped with a turn."""
    width, height = 512, 256
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = (0.2, 0.3, 0.5)
    pixels[height // 2 :, :, :3] *= np.linspace(1, 3, height // 2)[:, None, None]
    pixels[205:212, 100:107, :3] = (400.0, 350.0, 300.0)
    image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    floor = floor_under_a_cube()
    world, background = world_with_nodes()
    nodes, links = world.node_tree.nodes, world.node_tree.links
    coordinates, mapping = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    environment = nodes.new("ShaderNodeTexEnvironment")
    environment.image = image
    mapping.inputs["Rotation"].default_value = (0.1, 0.2, 1.0)
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], environment.inputs["Vector"])
    links.new(environment.outputs["Color"], background.inputs["Color"])
    compare("world, environment image", by_cycles(floor), by_antumbra(floor))


def test_sky_texture(compare):
    floor = floor_under_a_cube()
    world, background = world_with_nodes()
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    # Renamed in 5.0
    sky.sky_type = "NISHITA" if bpy.app.version < (5, 0) else "MULTIPLE_SCATTERING"
    sky.sun_elevation, sky.sun_rotation = math.radians(50), 1.0
    world.node_tree.links.new(sky.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.1
    compare("world, sky texture with its sun", by_cycles(floor), by_antumbra(floor))


def test_a_sunlit_room_with_all_its_bounces(compare):
    """Sun and sky through a window, adaptively baked: what is measured is the whole of the method."""
    floor = add_grid("Floor", cells=12, size=3.0)
    x, y, z = 1.5, 1.5, 2.5
    wall = [(x, -y, 0), (x, y, 0), (x, y, z), (x, -y, z)]
    window = [(x, -0.6, 0.8), (x, 0.6, 0.8), (x, 0.6, 2.0), (x, -0.6, 2.0)]
    back = [(-x, -y, 0), (-x, y, 0), (-x, y, z), (-x, -y, z)]
    sides = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    closed = [(8, 9, 10, 11), (0, 8, 11, 3), (1, 9, 10, 2), (3, 2, 10, 11)]
    room = add_mesh("Room", wall + window + back, sides + closed)
    for obj in (floor, room):
        obj.data.materials.append(add_material(obj.name, Color=(0.6, 0.5, 0.4, 1)))
    _, background = world_with_nodes()
    background.inputs["Color"].default_value = (0.5, 0.7, 1.0, 1.0)
    sun = link(bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN")))
    sun.data.energy, sun.data.angle = 3.0, math.radians(2)
    sun.matrix_world = Matrix.Rotation(math.radians(55), 4, "Y")
    # What Cycles brings to vertices in the walls' planes is chance.
    inside = np.abs(positions(floor.data)[:, :2]).max(axis=1) < 1.4
    cycles = by_cycles(floor, bounces=32)[inside]
    ours = by_antumbra(floor, method="ADM", element_size=0.0, tolerance=0.02)[inside]
    compare("a sunlit room, all bounces, `ADM` at 0.02", cycles, ours, (0.015, 0.03 if LONG else 0.06))
