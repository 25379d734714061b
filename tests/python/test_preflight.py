# SPDX-License-Identifier: GPL-3.0-or-later
"""What is found before a bake, on meshes whose faults are known."""

from dataclasses import replace

import numpy as np
import pytest
from antumbra.core.preflight import estimate, estimate_texts, find
from antumbra.core.record import AreaLight, Material
from antumbra.core.settings import Settings
from meshes import quad_surface, record, scene

GREY = Material("grey", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0))
BLACK = Material("black", (0.0, 0.001, 0.0), (0.0, 0.0, 0.0))
LAMP = AreaLight("lamp", np.array([[0.0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]), (4.0, 2.0, 1.0))

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float32)
# Outwards.
TETRAHEDRON = [(0, 1, 2), (0, 4, 1), (0, 2, 4), (1, 4, 2)]


def surface_of(triangles, positions=CORNERS):
    triangles = np.array(triangles, dtype=np.int32)
    return replace(
        quad_surface(),
        positions=positions,
        triangles=triangles,
        triangle_corners=np.arange(triangles.size, dtype=np.int32).reshape(-1, 3),
        triangle_faces=np.arange(len(triangles), dtype=np.int32),
        face_materials=np.zeros(len(triangles), dtype=np.int32),
    )


def found(surface, material=GREY, lights=(LAMP,), **more):
    return find(scene(record(surface, **more), materials=[material], lights=lights))


def texts(findings):
    return [finding.text for finding in findings]


def test_a_good_scene_has_nothing_to_say():
    assert found(quad_surface()) == []
    assert found(surface_of(TETRAHEDRON)) == []


def test_no_light_is_an_error_and_emission_is_light():
    (finding,) = found(quad_surface(), lights=())
    assert finding.level == "ERROR"
    assert "no light" in finding.text
    assert found(quad_surface(), Material("lamp", (0.5, 0.5, 0.5), (1.0, 1.0, 1.0)), lights=()) == []


def test_a_black_surface_is_named_with_its_object():
    (finding,) = found(quad_surface(), BLACK, name="Coal")
    assert (finding.level, finding.objects) == ("WARNING", (1,))
    assert "“Coal”" in finding.text


def test_a_face_that_crosses_itself_is_found():
    corners = np.array([(-1, -1, 0), (1, 1, 0), (1, -1, 0), (-1, 1, 0)], dtype=np.float32)
    bow_tie = surface_of([(0, 1, 2), (0, 2, 3)], corners)
    findings = found(replace(bow_tie, triangle_faces=np.array([0, 0], dtype=np.int32)), name="Knot")
    assert "“Knot”: faces that cross themselves: taken as their triangles" in texts(findings)
    # A square, and a face that is bent at a right angle
    for last in [(0, 2, 0), (-1, -1, 2)]:
        corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), last], dtype=np.float32)
        one_face = replace(surface_of([(0, 1, 2), (0, 2, 3)], corners), triangle_faces=np.array([0, 0], dtype=np.int32))
        assert not any("cross" in text for text in texts(found(one_face)))


def test_one_turned_face_is_found_and_where_it_lies_does_not_matter():
    for turned in range(4):
        triangles = [tuple(reversed(t)) if i == turned else t for i, t in enumerate(TETRAHEDRON)]
        assert any("turned against" in text for text in texts(found(surface_of(triangles))))


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_a_closed_mesh_that_faces_inwards_is_only_mentioned(mirror):
    inside_out = [tuple(reversed(t)) for t in TETRAHEDRON]
    (finding,) = found(surface_of(inside_out), world_from_object=np.diag([mirror, 1.0, 1.0, 1.0]))
    assert finding.level == "INFO"
    assert "inwards" in finding.text


def test_a_third_face_on_an_edge_is_a_blocker_that_is_no_solid():
    assert any("more than two" in text for text in texts(found(surface_of([*TETRAHEDRON, (0, 1, 7)]))))


def test_a_hole_is_told_from_a_sheet():
    """A closed ring of many faces with one missing has a hole; a plane has none."""
    count = 100
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    ring = [(np.cos(a), np.sin(a), 0.0) for a in angles]
    positions = np.array([*ring, (0, 0, 1), (0, 0, -1)], dtype=np.float32)
    sides = [(i, (i + 1) % count, count) for i in range(count)] + [
        ((i + 1) % count, i, count + 1) for i in range(count)
    ]
    assert found(surface_of(sides, positions)) == []
    (finding,) = found(surface_of(sides[1:], positions))
    assert "holes" in finding.text
    assert found(quad_surface()) == []


def test_instances_are_counted_once_for_their_mesh():
    surface = quad_surface()
    twins = [record(surface, name="A"), replace(record(surface, name="B"), owner_uid=2)]
    (finding,) = find(scene(*twins, materials=[GREY], lights=[LAMP]))
    assert finding.text.startswith("2 objects share 1 meshes")
    assert finding.objects == (1, 2)


def test_the_estimate_keeps_to_budget_and_time_limit_and_grows_with_what_is_asked():
    the_scene = scene(record(quad_surface()), materials=[GREY], lights=[LAMP])
    coarse = estimate(the_scene, Settings(tolerance=0.1), cores=2)
    fine = estimate(the_scene, Settings(tolerance=0.001), cores=2)
    assert fine.seconds > coarse.seconds
    assert estimate(the_scene, Settings(tolerance=0.001), cores=16).seconds < fine.seconds
    kept = estimate(the_scene, Settings(tolerance=0.001, triangle_budget=500, time_limit=2.0), cores=2)
    assert kept.triangles == (2, 500)
    assert kept.seconds[1] <= 2.0
    triangles, time, memory = estimate_texts(kept)
    assert triangles == "2 to 500 triangles"
    assert time.endswith("s")
    assert memory.endswith("B of memory")
