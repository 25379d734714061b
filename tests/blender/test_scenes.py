# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes that bakes and studies are made of: whole, as large as promised, and with their lamps."""

import sys
from collections import Counter
from pathlib import Path

import bpy
import numpy as np
import pytest
from scenes import face_areas

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.scenes import cornell, hard, interior, paper, scale
from tests.scenes.building import only_direct_light, patch_count

# Number of lamps, and which objects are sheets; every other object is a closed solid.
SCENES = {
    "paper": (paper.build, 2, {"plane"}),
    "cornell": (cornell.build, 1, {"floor", "ceiling", "back", "left", "right", "short", "tall"}),
    "interior": (
        interior.build,
        4,
        {"walls", "panes", "floor", "ceiling", "shade0", "shade1", "lamp shade0", "lamp shade1"},
    ),
    **{name: (case, 2 if name == "stairs" else 1, {"floor"}) for name, case in hard.CASES.items()},
}
SCENES["blinds"][2].add("wall")
SCENES["tree"][2].add("leaves")
SCENES["shelf"] = (hard.shelf, 1, {"room", "card"})


def edge_uses(mesh):
    """Number of edges by how many faces they have."""
    return Counter(Counter(edge for face in mesh.polygons for edge in face.edge_keys).values())


def signed_volume(mesh):
    positions = np.array([vertex.co[:] for vertex in mesh.vertices])
    fans = [
        (face.vertices[0], face.vertices[i], face.vertices[i + 1])
        for face in mesh.polygons
        for i in range(1, len(face.vertices) - 1)
    ]
    a, b, c = positions[np.array(fans)].transpose(1, 0, 2)
    return float((a * np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_is_whole(name):
    build, lamps, sheets = SCENES[name]
    build()
    assert sum(o.type == "LIGHT" for o in bpy.context.scene.objects) == lamps
    assert bpy.context.scene.camera is not None
    meshes = [o for o in bpy.context.scene.objects if o.type == "MESH"]
    assert sheets <= {o.name for o in meshes}
    for item in meshes:
        positions = np.array([vertex.co[:] for vertex in item.data.vertices])
        assert np.isfinite(positions).all(), item.name
        assert face_areas(item.data).min() > 1e-9, item.name
        assert not item.data.validate(), item.name
        assert positions[:, 2].min() >= 0.0, f"{item.name} reaches below the floor"
        assert len(item.data.materials) == 1, item.name
        if item.name not in sheets:
            assert set(edge_uses(item.data)) == {2}, f"{item.name} is not closed"
            assert signed_volume(item.data) > 0.0, f"{item.name} is inside out"


def test_the_interior_has_as_many_patches_as_the_papers():
    interior.build()
    assert patch_count() == 4738


def test_a_larger_interior_comes_from_the_same_script():
    interior.build(interior.Interior(tables=3, shelves=5, books=600))
    assert patch_count() > 6000


def test_the_interiors_shell_leaves_no_gap():
    interior.build()
    shell = [bpy.data.objects[name].data for name in ("walls", "panes", "floor", "ceiling")]
    # Directed areas of a closed shell cancel.
    total = sum((np.array(face.normal) * face.area for mesh in shell for face in mesh.polygons), np.zeros(3))
    assert total == pytest.approx(0.0, abs=1e-4)


def test_furniture_stands_exactly_on_what_bears_it():
    interior.build()
    for item in bpy.context.scene.objects:
        if item.name.startswith(("chair", "table", "shelf", "lamp", "sofa", "sideboard")) and item.type == "MESH":
            if item.name.startswith("lamp shade"):
                continue
            assert min(vertex.co.z for vertex in item.data.vertices) == 0.0, item.name


def test_direct_light_alone_keeps_the_strongest_lamps_and_no_reflection():
    paper.build()
    only_direct_light(1)
    assert [o.name for o in bpy.context.scene.objects if o.type == "LIGHT"] == ["light0"]
    for material in bpy.data.materials:
        assert tuple(material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value)[:3] == (0, 0, 0)


def triangle_count():
    return sum(
        len(face.vertices) - 2 for o in bpy.context.scene.objects if o.type == "MESH" for face in o.data.polygons
    )


@pytest.mark.parametrize("asked", [1_000, 10_000])
def test_a_flat_has_as_many_triangles_as_asked_for(asked):
    scale.build(str(asked))
    assert asked - scale.BOOK_TRIANGLES < triangle_count() <= asked
    flat = scale.plan(asked)
    assert sum(o.type == "LIGHT" for o in bpy.context.scene.objects) == 2 * flat.rooms
    for item in bpy.context.scene.objects:
        if item.type == "MESH":
            assert not item.data.validate(), item.name
            assert face_areas(item.data).min() > 1e-9, item.name
            if not item.name.startswith("shell"):
                assert set(edge_uses(item.data)) == {2}, f"{item.name} is not closed"
                assert signed_volume(item.data) > 0.0, f"{item.name} is inside out"


def test_rooms_and_what_stands_in_them_grow_together():
    small, large = scale.plan(10_000), scale.plan(1_000_000)
    assert large.rooms == pytest.approx(10.0 * small.rooms, rel=0.1)
    assert all(fine > coarse for fine, coarse in zip(large.cuts, small.cuts, strict=True))


def test_the_shells_of_a_flat_leave_no_gap():
    scale.build("10000")
    total = np.zeros(3)
    for item in bpy.context.scene.objects:
        if item.name.startswith("shell"):
            total += sum((np.array(face.normal) * face.area for face in item.data.polygons), np.zeros(3))
    # Directed areas of a closed shell cancel.
    assert total == pytest.approx(0.0, abs=1e-4)
