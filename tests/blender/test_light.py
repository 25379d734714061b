# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights and materials as light on a surface, against closed forms.

Form factors F of a point that looks at a parallel rectangle or disk are from radiometry: under the corner of a unit
square one unit away F = 0.138531605994893, under the middle of a disk one radius away F = 1/2.
"""

import math

import bpy
import numpy as np
import pytest
from extension import read_scene
from mathutils import Matrix
from scenes import (
    add_area_light,
    add_cube,
    add_instances_by_nodes,
    add_material,
    add_mesh,
    add_plane,
    bake,
    baked_of,
    link,
    radiance_at,
    select,
)

UNDER_A_CORNER = 0.138531605994893
UP = Matrix.Rotation(math.pi, 4, "X")


def receiver(reflectance=0.5):
    """Four faces that meet at the origin, so that the origin is a vertex."""
    plane = add_mesh(
        "Receiver",
        [(x, y, 0) for y in (-1, 0, 1) for x in (-1, 0, 1)],
        [(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7, 6), (4, 5, 8, 7)],
    )
    plane.data.materials.append(add_material("Paint", Color=(reflectance, reflectance, reflectance, 1)))
    return plane


def bake_vertices(**settings):
    """Bake without refinement, so that a vertex has the light of its point and is fitted to nothing around it."""
    bake(method="UNIFORM", **settings)


def radiance_at_origin():
    colours = radiance_at(baked_of("Receiver"), (0, 0, 0))
    assert np.ptp(colours, axis=0) == pytest.approx(0, abs=1e-7)
    return colours[0]


def test_square_light_over_a_corner():
    receiver(reflectance=0.5)
    add_area_light(location=(0.5, 0.5, 1), size=1.0, energy=10.0).data.color = (1.0, 0.5, 0.25)
    bake_vertices()
    # B = rho F P/A, and the attribute holds B/pi.
    expected = 0.5 * UNDER_A_CORNER * 10.0 / math.pi * np.array([1.0, 0.5, 0.25])
    assert radiance_at_origin() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("method", "within"), [("ADM", 0.01), ("DM", 0.01), ("AS", 0.01), ("UNIFORM", 1e-6)])
def test_every_method_lights_a_vertex_alike(method, within):
    """Refined elements are fitted to the light: their vertices may be off by a fraction of the tolerance, 0.1."""
    receiver()
    add_area_light(location=(0.5, 0.5, 1), size=1.0, energy=10.0)
    bake(method=method)
    assert radiance_at_origin() == pytest.approx(np.full(3, 0.5 * UNDER_A_CORNER * 10.0 / math.pi), rel=within)


def test_object_scale_makes_the_light_larger_not_brighter():
    receiver()
    lamp = add_area_light(location=(0.5, 0.5, 1), size=0.5, shape="RECTANGLE", size_y=0.25, energy=10.0)
    lamp.scale = (2, 4, 7)
    bake_vertices()
    assert radiance_at_origin() == pytest.approx(0.5 * UNDER_A_CORNER * 10.0 / math.pi, rel=1e-6)


def test_disk_light_one_radius_away():
    receiver()
    add_area_light(location=(0, 0, 1), size=2.0, shape="DISK", energy=10.0)
    bake_vertices()
    # A 64-gon of the same area is off by 1.3e-7.
    assert radiance_at_origin() == pytest.approx(0.5 * 0.5 * (10.0 / math.pi) / math.pi, rel=1e-6)


def test_ellipse_light_is_a_squeezed_disk():
    receiver()
    lamp = add_area_light(location=(0, 0, 1), size=1.0, size_y=4.0, shape="ELLIPSE", energy=10.0)
    lamp.scale = (2, 0.5, 1)
    bake_vertices()
    assert radiance_at_origin() == pytest.approx(0.5 * 0.5 * (10.0 / math.pi) / math.pi, rel=1e-6)


def test_the_back_of_a_light_is_dark():
    receiver()
    add_plane("Ceiling").location = (0, 0, 3)
    lamp = add_area_light(location=(0, 0, 1), energy=10.0)
    lamp.matrix_world = Matrix.Translation((0, 0, 1)) @ UP
    bpy.data.objects["Ceiling"].data.materials.append(add_material("Black", Color=(0, 0, 0, 1)))
    bake_vertices()
    assert (radiance_at_origin() == 0.0).all()


@pytest.mark.parametrize("strength", [3.0, 0.5])
@pytest.mark.parametrize("face", [(0, 1, 2, 3), (3, 2, 1, 0)])
def test_emission_of_a_mesh_on_both_its_sides(strength, face):
    receiver()
    lamp = add_mesh("Lamp", [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], [face])
    lamp.data.materials.append(add_material("Glow", "EMISSION", Color=(1, 0.5, 0, 1), Strength=strength))
    bake_vertices()
    colour = strength * np.array([1.0, 0.5, 0.0])
    assert radiance_at_origin() == pytest.approx(0.5 * UNDER_A_CORNER * colour, rel=1e-6)
    assert radiance_at(baked_of("Lamp"), (0, 0, 1))[0] == pytest.approx(colour, rel=1e-6)


def test_irradiance_is_what_a_white_surface_would_send():
    receiver(reflectance=0.25)
    add_area_light(location=(0.5, 0.5, 1), size=1.0, energy=10.0)
    bake_vertices(quantity="IRRADIANCE")
    assert radiance_at_origin() == pytest.approx(UNDER_A_CORNER * 10.0 / math.pi, rel=1e-6)


def test_only_hide_render_decides_what_blocks():
    for flag, blocks in (("hide_viewport", True), ("hide_render", False)):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        receiver()
        blocker = add_plane("Blocker", size=3.0)
        blocker.location = (0, 0, 0.5)
        blocker.data.materials.append(add_material("Black", Color=(0, 0, 0, 1)))
        setattr(blocker, flag, True)
        add_area_light(location=(0, 0, 1), energy=10.0)
        select(bpy.data.objects["Receiver"])
        bake_vertices(receivers="SELECTED")
        assert (radiance_at_origin().max() == 0.0) == blocks


def test_modifiers_count_as_they_do_in_a_render():
    cube = add_cube()
    subdivision = cube.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 2
    viewport_only = cube.modifiers.new("Array", "ARRAY")
    viewport_only.show_render = False
    (record,) = read_scene().objects
    assert len(record.surface.face_materials) == 6 * 4**2


def test_a_mirrored_receiver_gets_the_same_light():
    plane = receiver()
    plane.scale = (-1, 1, 1)
    add_area_light(location=(0.5, 0.5, 1), size=1.0, energy=10.0)
    bake_vertices()
    assert radiance_at_origin() == pytest.approx(0.5 * UNDER_A_CORNER * 10.0 / math.pi, rel=1e-6)


@pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="came with Blender 4.5")
def test_exposure_and_normalize_of_a_light():
    lamp = add_area_light(size=2.0, energy=3.0).data
    lamp.exposure = 2.0
    (light,) = read_scene().lights
    assert light.exitance_rgb == pytest.approx((3.0, 3.0, 3.0))
    lamp.normalize = False
    (light,) = read_scene().lights
    assert light.exitance_rgb == pytest.approx((12.0, 12.0, 12.0))


@pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="came with Blender 4.5")
def test_temperature_of_a_light():
    lamp = add_area_light(size=1.0, energy=1.0).data
    lamp.use_temperature, lamp.temperature = True, 2700.0
    (light,) = read_scene().lights
    red, green, blue = light.exitance_rgb
    assert red > green > blue > 0.0
    assert light.exitance_rgb == pytest.approx(tuple(lamp.temperature_color))


def test_nodes_of_a_light_multiply():
    lamp = add_area_light(size=1.0, energy=2.0).data
    if not lamp.use_nodes:
        lamp.use_nodes = True
    emission = next(node for node in lamp.node_tree.nodes if node.type == "EMISSION")
    emission.inputs["Strength"].default_value = 3.0
    emission.inputs["Color"].default_value = (1.0, 0.5, 0.0, 1.0)
    (light,) = read_scene().lights
    assert light.exitance_rgb == pytest.approx((6.0, 3.0, 0.0))


def add_light(kind, **options):
    light = bpy.data.lights.new(kind, kind)
    for key, value in options.items():
        setattr(light, key, value)
    return link(bpy.data.objects.new(kind, light))


def test_a_sun_brings_its_strength_to_what_faces_it():
    receiver(reflectance=1.0)
    sun = add_light("SUN", energy=3.0, angle=0.1, color=(1.0, 0.5, 0.25))
    sun.matrix_world = Matrix.Rotation(0.5, 4, "X")
    bake_vertices()
    expected = 3.0 * math.cos(0.5) / math.pi * np.array([1.0, 0.5, 0.25])
    assert radiance_at_origin() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("radius", [0.0, 0.5])
@pytest.mark.parametrize("soft", [True, False])
def test_a_point_light_falls_with_the_square_of_the_distance(radius, soft):
    receiver(reflectance=1.0)
    lamp = add_light("POINT", energy=10.0, shadow_soft_size=radius, use_soft_falloff=soft)
    lamp.location = (0.0, 1.5, 2.0)
    bake_vertices()
    squared = 2.5**2 + (radius**2 if soft else 0.0)
    assert radiance_at_origin() == pytest.approx(np.full(3, 10.0 * 0.8 / (4 * math.pi * squared) / math.pi), rel=1e-5)


def test_a_spot_light_is_dark_outside_its_cone_and_fades_inside():
    receiver(reflectance=1.0)
    lamp = add_light("SPOT", energy=10.0, shadow_soft_size=0.0, spot_size=1.0, spot_blend=0.6)
    lamp.matrix_world = Matrix.Translation((0, 0, 2)) @ Matrix.Rotation(0.45, 4, "X")
    bake_vertices()
    border = math.cos(0.5)
    t = (math.cos(0.45) - border) / ((1 - border) * 0.6)
    expected = 10.0 / (4 * math.pi * 4.0) * t * t * (3 - 2 * t) / math.pi
    assert radiance_at_origin() == pytest.approx(np.full(3, expected), rel=1e-5)


def test_lights_that_cast_no_shadow_shine_through():
    receiver()
    add_plane("Roof", size=9.0).location = (0, 0, 1)
    lamp = add_light("POINT", energy=10.0, use_shadow=False)
    lamp.location = (0, 0, 2)
    bake_vertices()
    assert radiance_at_origin().min() > 0.0
    lamp.data.use_shadow = True
    bake_vertices()
    assert radiance_at_origin().max() == 0.0


def test_what_brings_nothing_to_matte_surfaces_is_passed_over():
    add_light("POINT").visible_diffuse = False
    add_light("SUN", energy=0.0)
    portal = add_area_light().data
    if hasattr(portal, "cycles"):
        portal.cycles.is_portal = True
    assert len(read_scene().lights) == (0 if hasattr(portal, "cycles") else 1)


def test_a_spot_scaled_to_nothing_is_named():
    lamp = add_light("SPOT")
    lamp.scale = (1, 0, 1)
    scene = read_scene()
    assert scene.lights == []
    assert any("“SPOT”" in text for text in scene.all_warnings())


def test_links_of_lights_hold_for_instances_too():
    """What they make of the light is held against Cycles elsewhere."""
    lamp, floor = add_light("POINT"), add_plane("Floor")
    add_instances_by_nodes(floor, add_plane("Scattered"))
    lamp.light_linking.receiver_collection = collection = bpy.data.collections.new("Some")
    collection.objects.link(floor)
    collection.collection_objects[0].light_linking.link_state = "EXCLUDE"
    scene = read_scene()
    (light,) = scene.lights
    # The floor with its four instances, and the plane that these are made of
    lit = [scene.objects[index].name for index in light.links.lit.among(scene.objects)]
    assert light.links.blocking is None
    assert scene.all_warnings() == []
    assert len(scene.objects) == 6
    assert lit == ["Scattered"]


def test_linking_of_emitting_meshes_is_named():
    floor, screen = add_plane("Floor"), add_plane("Screen")
    for obj in (floor, screen):
        obj.light_linking.receiver_collection = bpy.data.collections.new("Some")
    screen.data.materials.append(add_material("Glow", "ShaderNodeEmission"))
    (warning,) = read_scene().all_warnings()
    assert "“Screen”" in warning
    assert "linking" in warning
    assert "“Floor”" not in warning


def sky_background():
    world = bpy.data.worlds.new("Sky")
    bpy.context.scene.world = world
    world.color = (0, 0, 0)
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    return world, next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")


def test_an_open_plane_under_a_constant_world_gets_pi_times_its_radiance():
    receiver(reflectance=0.5)
    _, background = sky_background()
    background.inputs["Color"].default_value = (0.5, 0.6, 1.0, 1.0)
    background.inputs["Strength"].default_value = 2.0
    bake_vertices()
    assert radiance_at_origin() == pytest.approx(np.array([0.5, 0.6, 1.0]), rel=1e-6)
    background.inputs["Strength"].default_value = 0.0
    assert read_scene().sky is None


def test_a_world_without_nodes_has_its_colour():
    world, _ = sky_background()
    world.color = (0.25, 0.5, 1.0)
    if bpy.app.version < (5, 0):
        world.use_nodes = False
        assert read_scene().sky.exitance_rgb[3, 0, 0] == pytest.approx(math.pi * np.array(world.color))


def test_a_world_of_nodes_is_rendered_as_it_lies_around_and_leaves_no_trace():
    """Its colour is the direction: each cell of the cube must hold its own."""
    world, background = sky_background()
    nodes, links = world.node_tree.nodes, world.node_tree.links
    coordinates = nodes.new("ShaderNodeTexCoord")
    links.new(coordinates.outputs["Generated"], background.inputs["Color"])
    kinds = ("scenes", "objects", "cameras", "images")
    before = {kind: list(getattr(bpy.data, kind).keys()) for kind in kinds}
    sky = read_scene().sky
    assert {kind: list(getattr(bpy.data, kind).keys()) for kind in kinds} == before
    cells = sky.exitance_rgb.shape[1]
    at = (np.arange(cells) + 0.5) * 2 / cells - 1
    row, column = np.meshgrid(at, at, indexing="ij")
    for face in range(6):
        axis, away = divmod(face, 2)
        direction = np.zeros((cells, cells, 3))
        direction[..., axis] = 1 - 2 * away
        direction[..., (axis + 1) % 3] = column
        direction[..., (axis + 2) % 3] = row
        direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
        assert sky.exitance_rgb[face] / math.pi == pytest.approx(direction, abs=0.01)
