# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked light as the viewport shows it, and as other programs get it; the stored light is never touched."""

import bpy
import numpy as np
import pytest
from extension import module
from fingerprint import fingerprint
from scenes import add_area_light, add_cube, add_plane, bake, baked_objects, radiance


@pytest.fixture(params=["NEW", "REPLACE"])
def baked(request):
    add_plane(size=6.0), add_area_light(energy=400.0)
    add_cube().location = (0, 0, 1.2)
    bake(output=request.param, tolerance=0.05)
    return module("bridge.view").baked_meshes(bpy.context.scene)


def colours(mesh, name):
    data = mesh.attributes[name].data
    values = np.empty(len(data) * 4, dtype=np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def stored():
    return [radiance(mesh).tobytes() for mesh in module("bridge.view").baked_meshes(bpy.context.scene)]


def test_every_way_to_look_leaves_the_stored_light_and_the_way_back_leaves_nothing(baked):
    view, before = bpy.context.scene.antumbra_view, fingerprint()
    for mode in ("EXPOSED", "FALSE_COLOURS", "ERROR", "STORED"):
        light = stored()
        view.mode = mode
        assert stored() == light
        for mesh in baked:
            assert mesh.color_attributes.active_color_name == ("Radiosity" if mode == "STORED" else "Radiosity View")
            # Renders go on with the light.
            assert mesh.color_attributes[mesh.color_attributes.render_color_index].name == "Radiosity"
    assert fingerprint() == before


def test_exposure_doubles_with_each_stop(baked):
    view = bpy.context.scene.antumbra_view
    view.mode = "EXPOSED"
    view.exposure = -3.0
    for mesh in baked:
        assert np.allclose(colours(mesh, "Radiosity View"), np.minimum(radiance(mesh) / 8.0, 1.0), atol=1e-6)


def test_false_colours_tell_the_brightest_and_follow_the_range(baked):
    view = bpy.context.scene.antumbra_view
    view.mode = "FALSE_COLOURS"
    end, unit = module("bridge.view").range_of(bpy.context.scene)
    assert unit == "cd/m²"
    view.range_end = 2.0 * end
    assert module("bridge.view").range_of(bpy.context.scene)[0] == pytest.approx(2.0 * end)
    plane = max(baked, key=lambda mesh: radiance(mesh).max())
    by_light = np.argsort(radiance(plane)[:, 1])
    shown = colours(plane, "Radiosity View") @ (0.2126, 0.7152, 0.0722)
    assert shown[by_light[-1]] > shown[by_light[0]]


def test_the_error_is_told_in_per_cent_and_is_largest_where_the_light_changes(baked):
    view = bpy.context.scene.antumbra_view
    view.mode = "ERROR"
    end, unit = module("bridge.view").range_of(bpy.context.scene)
    assert unit == "%"
    assert 0.0 < end <= 100.0
    errors = [np.empty(len(mesh.loops), dtype=np.float32) for mesh in baked]
    for mesh, values in zip(baked, errors, strict=True):
        if "antumbra_error" in mesh.attributes:
            mesh.attributes["antumbra_error"].data.foreach_get("value", values)
            darker = colours(mesh, "Radiosity View")[values.argmin()] @ (0.2126, 0.7152, 0.0722)
            brighter = colours(mesh, "Radiosity View")[values.argmax()] @ (0.2126, 0.7152, 0.0722)
            assert brighter > darker
    assert any("antumbra_error" in mesh.attributes for mesh in baked)


def test_light_only_is_shown_in_lux():
    add_plane(), add_area_light()
    bake(quantity="IRRADIANCE")
    assert module("bridge.view").range_of(bpy.context.scene)[1] == "lx"


def test_a_new_bake_is_looked_at_in_the_same_way():
    add_plane(), add_area_light()
    bpy.context.scene.antumbra_view.mode = "FALSE_COLOURS"
    bake()
    (baked,) = baked_objects()
    assert baked.data.color_attributes.active_color_name == "Radiosity View"


@pytest.mark.parametrize("encoding", ["LINEAR", "SRGB"])
def test_export_ready_is_light_from_0_to_1_with_its_scale_and_all_of_it(baked, encoding):
    light = [radiance(mesh) for mesh in baked]
    assert bpy.ops.antumbra.make_export_ready(encoding=encoding) == {"FINISHED"}
    objects = [obj for obj in bpy.context.scene.objects if obj.antumbra.role in ("BAKED", "REPLACED")]
    (scale,) = {obj["antumbra_scale"] for obj in objects}
    for mesh, before in zip(baked, light, strict=True):
        assert np.array_equal(radiance(mesh), before)
        expected = np.clip(before / scale, 0.0, 1.0)
        if encoding == "SRGB":
            expected = module("core.colours").srgb_encoded(expected)
        assert np.allclose(colours(mesh, "Radiosity Export"), expected, atol=1e-6)
        hdr = np.empty(before.size, dtype=np.float32)
        mesh.attributes["_RADIOSITY"].data.foreach_get("vector", hdr)
        assert np.array_equal(hdr, before.reshape(-1))
        (material,) = mesh.materials
        assert sorted(node.type for node in material.node_tree.nodes) == [
            "BACKGROUND",
            "OUTPUT_MATERIAL",
            "VERTEX_COLOR",
        ]


def test_removing_the_bake_takes_export_and_view_back():
    add_plane(), add_area_light()
    bpy.context.scene.antumbra.receivers, bpy.context.scene.antumbra.tolerance = "ALL", 0.1
    before = fingerprint()
    for output in ("NEW", "REPLACE"):
        bake(output=output)
        bpy.ops.antumbra.make_export_ready()
        bpy.context.scene.antumbra_view.mode = "EXPOSED"
        bpy.ops.antumbra.remove_bake()
        bpy.context.scene.antumbra_view.mode = "STORED"
        bpy.context.scene.antumbra.output = "NEW"
        material = bpy.data.materials["Antumbra Unlit"]
        assert material.users == 0
        bpy.data.materials.remove(material)
        assert fingerprint() == before


def test_without_a_bake_export_is_refused():
    add_plane()
    with pytest.raises(RuntimeError, match="no bake to export"):
        bpy.ops.antumbra.make_export_ready()


def test_edges_on_contacts_and_penumbrae_are_marked():
    add_plane(size=6.0), add_area_light()
    add_cube().location = (0, 0, 1)
    bake(tolerance=0.02)
    (floor,) = (obj.data for obj in baked_objects() if obj["antumbra_source"] == "Plane")
    kinds = np.empty(len(floor.edges), dtype=np.int32)
    floor.attributes["antumbra_line"].data.foreach_get("value", kinds)
    assert set(np.unique(kinds)) == {0, 1, 3}
    ends = np.empty(len(floor.edges) * 2, dtype=np.int32)
    floor.edges.foreach_get("vertices", ends)
    from scenes import positions

    contact = np.abs(positions(floor)[ends.reshape(-1, 2)[kinds == 3].reshape(-1)][:, :2]).max(axis=1)
    assert np.allclose(contact, 1.0, atol=1e-5)
