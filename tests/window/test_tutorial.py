# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tutorial says, done word for word by a new user: from Blender's own first scene to an exported file."""

import json
import struct
import time

import pytest
from blender_window import BlenderWindow, missing
from conftest import FOLDER, PREPARE

# A viewport without a graphics card draws a while after it was told to.
_DRAWN_S = 1.5


@pytest.fixture
def first_scene():
    """Blender as it starts: a cube, a lamp and a camera."""
    lacking = missing()
    if lacking:
        pytest.skip("missing: " + "; ".join(lacking))
    window = BlenderWindow((FOLDER / "tutorial").absolute())
    try:
        window.ask(PREPARE.replace("    bpy.data.objects.remove(obj)\n", "    pass\n"))
        yield window
    finally:
        window.close()


def choose(window, prop, letter, value):
    """Choose from a menu in the panel by the letter that is underlined there."""
    window.press(prop, at=0.7)
    time.sleep(_DRAWN_S)
    window.key(letter)
    window.until(f"bpy.context.scene.antumbra.{prop} == {value!r}")


def test_from_the_first_scene_to_an_exported_file(first_scene, tmp_path):
    window = first_scene
    assert window.ask("sorted(bpy.data.objects.keys())") == ["Camera", "Cube", "Light"]

    # 1. A scene with light
    window.over_viewport()
    window.ask("bpy.ops.mesh.primitive_plane_add()")
    window.key("s", "5", "Return")
    window.until("bpy.data.objects['Plane'].scale.x == 5.0")
    window.key("g", "z", "minus", "1", "Return")
    window.until("bpy.data.objects['Plane'].location.z == -1.0")

    # 2. Ask what would go wrong
    window.scroll_down(20)
    choose(window, "receivers", "a", "ALL")
    window.press("bpy.ops.antumbra.check_scene()")
    window.until("module('bridge.preflight').last_of(bpy.context.scene) is not None")
    time.sleep(_DRAWN_S)
    window.screenshot("1 checked")
    assert window.ask("module('bridge.preflight').last_of(bpy.context.scene).findings") == []

    # 3. Bake
    window.press("bpy.ops.antumbra.bake()")
    window.until("len(baked_objects()) == 2")
    time.sleep(_DRAWN_S)
    window.screenshot("2 baked")

    # 4. Look at it
    window.press("bpy.ops.antumbra.show_light()")
    window.ask("bpy.context.scene.antumbra_view.overlay = 'LINES'")
    time.sleep(_DRAWN_S)
    window.screenshot("3 lines")
    assert window.ask(
        "[s.shading.type for a in bpy.context.screen.areas if a.type == 'VIEW_3D' for s in a.spaces]"
    ) == ["SOLID"]

    # 5. Take it elsewhere
    window.ask("bpy.ops.antumbra.make_export_ready()")
    path = tmp_path / "first.glb"
    as_set = "**bpy.context.scene['glTF2ExportSettings'].to_dict()"
    window.ask(f"bpy.ops.export_scene.gltf(filepath={str(path)!r}, {as_set})")
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    gltf = json.loads(data[20 : 20 + length])
    assert all("COLOR_0" in mesh["primitives"][0]["attributes"] for mesh in gltf["meshes"])
    assert all("KHR_materials_unlit" in material["extensions"] for material in gltf["materials"])
    scales = [node["extras"]["antumbra_scale"] for node in gltf["nodes"] if "mesh" in node]
    assert len(scales) == 2
    assert min(scales) > 0.0
