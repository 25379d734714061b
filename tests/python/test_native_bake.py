# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake and BakedMesh: shapes, types, and arrays that agree with each other."""

import json

import antumbra_native
import numpy as np
import pytest
from native_scenes import floor_arrays, lit_floor


@pytest.fixture(scope="module")
def bake() -> antumbra_native.Bake:
    scene = lit_floor(cells=2)
    scene.add_object("Blocker", **{**floor_arrays(), "receives": False})
    return antumbra_native.start(scene, tolerance=0.02).result()


def test_one_mesh_per_receiver(bake: antumbra_native.Bake) -> None:
    assert [mesh.object for mesh in bake.meshes] == [0]


def test_shapes_and_types(bake: antumbra_native.Bake) -> None:
    (mesh,) = bake.meshes
    v, t = len(mesh.positions), len(mesh.triangles)
    wanted = {
        "positions": ((v, 3), np.float64),
        "vertex_source_triangle": ((v,), np.int32),
        "vertex_barycentric": ((v, 3), np.float64),
        "triangles": ((t, 3), np.int32),
        "source_triangle": ((t,), np.int32),
        "corner_barycentric": ((t, 3, 3), np.float64),
        "source_edge": ((t, 3), np.int8),
        "corner_radiance": ((t, 3, 3), np.float32),
        "corner_error": ((t, 3), np.float32),
    }
    assert {name: (getattr(mesh, name).shape, getattr(mesh, name).dtype) for name in wanted} == wanted


def test_arrays_share_the_solvers_memory(bake: antumbra_native.Bake) -> None:
    (mesh,) = bake.meshes
    assert not mesh.positions.flags.owndata
    assert mesh.positions.flags.c_contiguous
    assert mesh.positions.ctypes.data == bake.meshes[0].positions.ctypes.data


def test_arrays_outlive_the_bake() -> None:
    positions = antumbra_native.start(lit_floor(), method="UNIFORM").result().meshes[0].positions
    assert np.isin(floor_arrays()["positions"], positions).all()


@pytest.mark.parametrize("method", ["ADM", "DM", "AS", "UNIFORM"])
def test_every_method_refines_and_lights_the_floor(method: str) -> None:
    bake = antumbra_native.start(lit_floor(), method=method, element_size=0.5).result()
    (mesh,) = bake.meshes
    assert json.loads(bake.report)["result"]["ended_by"] == "converged"
    assert len(mesh.triangles) > len(floor_arrays()["triangles"])
    assert (mesh.corner_radiance > 0).all()


def test_every_vertex_lies_where_its_source_triangle_says(bake: antumbra_native.Bake) -> None:
    (mesh,) = bake.meshes
    source = floor_arrays(cells=2)
    corners = source["positions"][source["triangles"]]
    vertices = np.einsum("vk,vkx->vx", mesh.vertex_barycentric, corners[mesh.vertex_source_triangle])
    np.testing.assert_allclose(vertices, mesh.positions, atol=1e-12)
    at_corners = np.einsum("tck,tkx->tcx", mesh.corner_barycentric, corners[mesh.source_triangle])
    np.testing.assert_allclose(at_corners, mesh.positions[mesh.triangles], atol=1e-12)


def test_report_is_json(bake: antumbra_native.Bake) -> None:
    report = json.loads(bake.report)
    assert set(report) == {"scene", "timings", "memory", "timeline", "result", "warnings"}
    assert report["scene"]["objects"] == 2
    assert report["result"]["triangles"] == len(bake.meshes[0].triangles)
    assert report["result"]["vertices"] == len(bake.meshes[0].positions)


def test_version() -> None:
    assert antumbra_native.__version__.count(".") == 2


def test_layers_come_when_asked_for() -> None:
    whole = antumbra_native.start(lit_floor(), tolerance=0.1).result().meshes[0]
    assert (whole.corner_direct, whole.corner_indirect) == (None, None)
    mesh = antumbra_native.start(lit_floor(), tolerance=0.1, layers="SEPARATE").result().meshes[0]
    assert mesh.corner_direct is not None
    assert mesh.corner_indirect is not None
    assert mesh.corner_direct.dtype == mesh.corner_indirect.dtype == np.float32
    np.testing.assert_array_equal(mesh.corner_radiance, mesh.corner_direct)
    # A lone floor is lit by its lamp only.
    assert (mesh.corner_indirect == 0.0).all()
    with pytest.raises(antumbra_native.InvalidSettingError, match="one of TOTAL, SEPARATE"):
        antumbra_native.start(lit_floor(), layers="ALL")
