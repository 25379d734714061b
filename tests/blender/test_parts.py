# SPDX-License-Identifier: GPL-3.0-or-later
"""What takes part in a bake, and how: the user's flags, ray visibility and holdouts."""

import bpy
import pytest
from extension import last_warnings, read_scene
from fingerprint import fingerprint
from scenes import (
    add_area_light,
    add_cube,
    add_material,
    add_plane,
    bake,
    baked_objects,
    baked_of,
    link,
    radiance_at,
    select,
)

# (receives, blocks, sends) by what is set.
PARTS = {
    "NORMAL": (True, True, True),
    "BLOCKER": (False, True, False),
    "RECEIVER": (True, False, False),
}


def the_part():
    (record,) = read_scene().objects
    return record.receives, record.blocks, record.sends


@pytest.mark.parametrize("kind", PARTS)
def test_parts_of_objects(kind):
    add_cube().antumbra_part.kind = kind
    assert the_part() == PARTS[kind]


def test_an_excluded_object_is_not_there():
    add_plane(size=6.0)
    cube = add_cube()
    cube.antumbra_part.kind = "EXCLUDED"
    assert [record.name for record in read_scene().objects] == ["Plane"]
    add_area_light()
    bake()
    assert [obj["antumbra_source"] for obj in baked_objects()] == ["Plane"]
    assert not cube.hide_render


@pytest.mark.parametrize(
    ("attribute", "value", "expected"),
    [
        ("visible_shadow", False, (True, False, True)),
        ("visible_diffuse", False, (True, True, False)),
        ("is_holdout", True, (True, False, False)),
        ("visible_camera", False, (True, True, True)),
    ],
)
def test_ray_visibility_counts_as_in_cycles(attribute, value, expected):
    setattr(add_cube(), attribute, value)
    assert the_part() == expected


def test_a_holdout_collection_makes_holdouts():
    held = bpy.data.collections.new("Held out")
    bpy.context.scene.collection.children.link(held)
    add_cube(collection=held)
    bpy.context.view_layer.layer_collection.children["Held out"].holdout = True
    assert the_part() == (True, False, False)


def test_flags_of_an_instancer_hold_for_its_instances():
    collection = bpy.data.collections.new("Tiles")
    add_cube(collection=collection)
    instancer = link(bpy.data.objects.new("Instancer", None))
    instancer.instance_type, instancer.instance_collection = "COLLECTION", collection
    instancer.visible_shadow = False
    assert the_part() == (True, False, True)
    instancer.antumbra_part.kind = "RECEIVER"
    assert the_part() == (True, False, False)
    instancer.antumbra_part.kind = "EXCLUDED"
    assert read_scene().objects == []


def lit_middle(**of_screen):
    """Light in the middle of a floor that a screen covers wholly."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    floor, screen = add_plane("Floor", size=1.0), add_plane("Screen", size=20.0)
    screen.location = (0, 0, 1)
    for name, value in of_screen.items():
        if name == "material":
            screen.data.materials.append(value())
        elif name == "kind":
            screen.antumbra_part.kind = value
        else:
            setattr(screen, name, value)
    add_area_light(location=(0, 0, 3))
    select(floor)
    bake(receivers="SELECTED", quantity="IRRADIANCE", method="UNIFORM", element_size=0.5, tolerance=0.001)
    return radiance_at(baked_of("Floor"), (0.5, 0.5, 0.0)).max()


def test_light_goes_through_what_does_not_block():
    open_floor = lit_middle(hide_render=True)
    assert open_floor > 0.1
    assert lit_middle() == 0.0
    assert lit_middle(kind="BLOCKER") == 0.0
    for through in (
        {"visible_shadow": False},
        {"is_holdout": True},
        {"kind": "RECEIVER"},
        {"kind": "EXCLUDED"},
        {"material": lambda: add_material("Glass", "ShaderNodeBsdfGlass", Color=(1, 1, 1, 1))},
        {"material": lambda: add_material("Clear", "ShaderNodeBsdfTransparent", Color=(1, 1, 1, 1))},
    ):
        assert lit_middle(**through) == pytest.approx(open_floor, rel=1e-3), through
    veil = lit_middle(material=lambda: add_material("Veil", "ShaderNodeBsdfPrincipled", Alpha=0.2))
    # And a little that floor and veil send each other
    assert 0.8 * open_floor <= veil <= 0.803 * open_floor


def test_glass_is_named():
    lit_middle(material=lambda: add_material("Window", "ShaderNodeBsdfGlass"))
    assert any("“Window”" in text and "through" in text for text in last_warnings())


def test_a_receiver_only_shows_light_but_sends_none():
    """A white card above a black floor lights it from below only while it sends."""
    light = {}
    for kind in ("NORMAL", "RECEIVER"):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        floor, card = add_plane("Floor", size=1.0), add_plane("Card", size=1.0)
        floor.data.materials.append(add_material("Black", Color=(0, 0, 0, 1)))
        card.data.materials.append(add_material("White", "EMISSION", Strength=1.0))
        card.location = (0, 0, 0.5)
        card.antumbra_part.kind = kind
        add_area_light(location=(0, 3, 0.2), energy=1.0).rotation_euler = (-1.57, 0, 0)
        bake(quantity="IRRADIANCE", method="UNIFORM", element_size=0.5)
        light[kind] = radiance_at(baked_of("Floor"), (0.5, 0.5, 0)).max()
        assert len(baked_objects()) == 2
    assert light["RECEIVER"] < 0.2 * light["NORMAL"]


def test_the_part_survives_bakes_and_their_removal():
    add_plane(size=6.0)
    cube = add_cube()
    cube.antumbra_part.kind = "RECEIVER"
    add_area_light(location=(0, 0, 4))
    bpy.context.scene.antumbra.receivers, bpy.context.scene.antumbra.tolerance = "ALL", 0.1
    before = fingerprint()
    bake()
    bpy.ops.antumbra.remove_bake()
    assert fingerprint() == before
    assert cube.antumbra_part.kind == "RECEIVER"
