# SPDX-License-Identifier: GPL-3.0-or-later
"""How the light is stored: layers, types and domains."""

import bpy
import numpy as np
import pytest
from extension import last_warnings
from scenes import add_area_light, add_cube, add_material, add_plane, bake, baked_of, corner_vertices

NAMES = ("Radiosity", "Radiosity Direct", "Radiosity Indirect")


def cube_on_a_plane(energy=100.0):
    plane, cube = add_plane(size=6.0), add_cube()
    cube.location = (0, 0, 1)
    add_area_light(location=(1, 1, 5), energy=energy)
    return plane, cube


def colours(mesh, name="Radiosity"):
    data = mesh.color_attributes[name].data
    values = np.empty(len(data) * 4, dtype=np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


@pytest.mark.parametrize("output", ["NEW", "REPLACE"])
def test_direct_and_indirect_light_add_up(output):
    plane, _ = cube_on_a_plane()
    bake(layers="SEPARATE", output=output)
    mesh = plane.data if output == "REPLACE" else baked_of("Plane").data
    assert set(NAMES) <= {layer.name for layer in mesh.color_attributes}
    whole, direct, indirect = (colours(mesh, name) for name in NAMES)
    assert np.allclose(whole, direct + indirect, atol=1e-6)
    assert direct.max() > indirect.max() > 0.0
    assert mesh.color_attributes.active_color.name == "Radiosity"
    assert mesh.color_attributes[mesh.color_attributes.render_color_index].name == "Radiosity"


def test_a_second_bake_of_layers_carries_none_of_the_first():
    plane, _ = cube_on_a_plane()
    bake(layers="SEPARATE", output="REPLACE")
    bake(layers="TOTAL", output="REPLACE")
    assert [layer.name for layer in plane.data.color_attributes] == ["Radiosity"]


@pytest.mark.parametrize("data_type", ["FLOAT_COLOR", "BYTE_COLOR"])
@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_every_type_on_every_domain(data_type, domain):
    cube_on_a_plane(energy=20.0)
    bake(data_type=data_type, domain=domain)
    mesh = baked_of("Plane").data
    light = mesh.color_attributes["Radiosity"]
    assert (light.data_type, light.domain) == (data_type, domain)
    assert len(light.data) == len(mesh.loops if domain == "CORNER" else mesh.vertices)
    stored = colours(mesh)
    if domain == "POINT":
        stored = stored[corner_vertices(mesh)]
    bake(data_type="FLOAT_COLOR", domain="CORNER")
    exact = baked_of("Plane").data
    assert len(exact.loops) == len(stored)
    # Where light does not jump, a vertex has what its corners have; bytes err by half a step of sRGB.
    off = np.abs(stored - colours(exact)).max(axis=1)
    step = 0.006 if data_type == "BYTE_COLOR" else 1e-6
    assert np.median(off) < step
    assert (off.max() < step) == (domain == "CORNER")


def test_vertices_say_at_how_many_light_is_averaged():
    cube_on_a_plane()
    bake(domain="POINT")
    assert any("omain POINT:" in text and "vertices the light differs" in text for text in last_warnings())
    bake(domain="CORNER")
    assert not any("omain POINT:" in text for text in last_warnings())


def test_bytes_clip_and_say_so():
    plane, _ = cube_on_a_plane()
    glow = add_material("Glow", "EMISSION", Strength=3.0)
    plane.data.materials.append(glow)
    bake(data_type="BYTE_COLOR")
    assert colours(baked_of("Plane").data).max() == 1.0
    assert any("BYTE_COLOR" in text and "clipped" in text for text in last_warnings())


def test_gltf_of_colours_at_vertices(tmp_path):
    from extension import module

    cube_on_a_plane()
    bake(domain="POINT", data_type="BYTE_COLOR")
    module("bridge.gltf").export_glb(bpy.context.scene, tmp_path / "out.glb")
    assert (tmp_path / "out.glb").stat().st_size > 1000
