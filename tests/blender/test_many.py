# SPDX-License-Identifier: GPL-3.0-or-later
"""Ten thousand objects and a million triangles through the bridge, without the solver: seconds, not minutes.

The bounds are several times what an idle machine takes, and far below what anything quadratic would.
"""

import os
import time
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from extension import module, read_scene
from scenes import CUBE_FACES, CUBE_VERTICES, add_material, link

pytestmark = pytest.mark.skipif(os.environ.get("ANTUMBRA_LONG") != "1", reason="long: run with --long")

MANY = 10_000


def add_cubes(of_their_own):
    mesh = bpy.data.meshes.new("Cube")
    mesh.from_pydata(CUBE_VERTICES, [], CUBE_FACES)
    for index in range(MANY):
        obj = bpy.data.objects.new(f"Cube {index}", mesh.copy() if of_their_own else mesh)
        obj.location = (3 * (index % 100), 3 * (index // 100), 0)
        link(obj)


def add_waves(cells):
    x, y = np.meshgrid(np.linspace(-1, 1, cells + 1), np.linspace(-1, 1, cells + 1))
    vertices = np.stack([x, y, 0.05 * np.sin(9 * x)], axis=2).reshape(-1, 3).astype(np.float32)
    index = np.arange((cells + 1) ** 2, dtype=np.int32).reshape(cells + 1, cells + 1)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=2).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Waves")
    mesh.vertices.add(len(vertices))
    mesh.loops.add(quads.size)
    mesh.polygons.add(len(quads))
    mesh.vertices.foreach_set("co", vertices.reshape(-1))
    mesh.loops.foreach_set("vertex_index", quads.reshape(-1))
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.uv_layers.new(name="UV")
    link(bpy.data.objects.new("Waves", mesh))


def unrefined(scene):
    """What the solver would return if it refined nothing and all light were 1."""
    meshes = []
    for index, record in enumerate(scene.objects):
        surface = record.surface
        count = len(surface.triangles)
        triangle_of = np.zeros(len(surface.positions), dtype=np.int32)
        triangle_of[surface.triangles] = np.arange(count, dtype=np.int32)[:, None]
        at_corner = surface.triangles[triangle_of] == np.arange(len(surface.positions))[:, None]
        meshes.append(
            SimpleNamespace(
                object=index,
                positions=surface.positions.astype(np.float64),
                vertex_source_triangle=triangle_of,
                vertex_barycentric=at_corner.astype(np.float64),
                triangles=surface.triangles,
                source_triangle=np.arange(count, dtype=np.int32),
                corner_barycentric=np.tile(np.eye(3), (count, 1, 1)),
                source_edge=np.tile(np.array([0, 1, 2], dtype=np.int8), (count, 1)),
                corner_radiance=np.ones((count, 3, 3), dtype=np.float32),
                edge_line=np.zeros((count, 3), dtype=np.int8),
                corner_error=None,
                corner_direct=None,
                corner_indirect=None,
            )
        )
    return SimpleNamespace(meshes=meshes)


def read_and_write(what):
    """Seconds of both, and the record."""
    start = time.perf_counter()
    scene = read_scene()
    read_s = time.perf_counter() - start
    solution, settings = unrefined(scene), module("core.settings").Settings(receivers="ALL")
    start = time.perf_counter()
    module("bridge.scene_write").write_solution(bpy.context, scene, solution, settings)
    write_s = time.perf_counter() - start
    print(f"{what}: read in {read_s:.2f} s, written in {write_s:.2f} s")
    return read_s, write_s, scene


@pytest.mark.parametrize("of_their_own", [False, True], ids=["linked", "single"])
def test_ten_thousand_cubes(of_their_own):
    add_cubes(of_their_own)
    read_s, write_s, scene = read_and_write(f"{MANY:,} cubes")
    assert len(scene.objects) == MANY
    assert len({id(record.surface) for record in scene.objects}) == (MANY if of_their_own else 1)
    assert len(bpy.context.scene.collection.children["Antumbra"].objects) == MANY
    assert read_s < 20.0
    assert write_s < 15.0


def test_a_million_triangles():
    add_waves(708)
    read_s, write_s, scene = read_and_write("a million triangles")
    assert len(scene.objects[0].surface.triangles) > 1_000_000
    assert read_s < 8.0
    assert write_s < 8.0


def test_a_thousand_meshes_that_cycles_looks_at():
    made = add_material("Noise")
    noise = made.node_tree.nodes.new("ShaderNodeTexNoise")
    made.node_tree.links.new(noise.outputs["Color"], made.node_tree.nodes["Diffuse BSDF"].inputs["Color"])
    for index in range(1000):
        mesh = bpy.data.meshes.new("Cube")
        mesh.from_pydata(CUBE_VERTICES, [], CUBE_FACES)
        mesh.materials.append(made)
        obj = link(bpy.data.objects.new(f"Cube {index}", mesh))
        obj.location.x = 3 * index
    start = time.perf_counter()
    scene = read_scene()
    read_s = time.perf_counter() - start
    print(f"1,000 meshes by passes: read in {read_s:.2f} s")
    assert all(record.face_materials is not None for record in scene.objects)
    assert read_s < 25.0
