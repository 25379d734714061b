# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes carried to a refined mesh: exact at source vertices, linear in between, never invented."""

import numpy as np
import pytest
from antumbra.core.carry import (
    carry_attribute,
    carry_edge_attribute,
    carry_normals,
    source_edge_of_corner,
)
from antumbra.core.pieces import rows_of
from antumbra.core.record import Attribute
from meshes import quad_surface, split_in_four


@pytest.fixture
def surface():
    return quad_surface()


@pytest.fixture
def baked(surface):
    return split_in_four(surface)


def attribute(domain, values, blends=True, dtype=np.float32, data_type="FLOAT"):
    return Attribute("it", domain, data_type, np.asarray(values, dtype=dtype).reshape(len(values), -1), blends)


def test_a_uv_map_that_is_linear_stays_that_linear_map(surface, baked):
    # u, v as any linear function of x, y; exact because all coefficients are powers of two.
    def linear(points):
        return np.stack([0.25 + 0.5 * points[:, 0], 2.0 * points[:, 1] - points[:, 0]], axis=1)

    uv = attribute("CORNER", linear(surface.positions))
    carried = carry_attribute(uv, surface, baked)
    assert np.array_equal(carried.values, linear(baked.positions)[baked.triangles.reshape(-1)])
    assert carried.values.dtype == np.float32


def test_points_keep_their_values_and_middles_get_the_mean(surface, baked):
    values = [0.1, 0.7, 1e-20, 1e20]
    carried = carry_attribute(attribute("POINT", values), surface, baked).values[:, 0]
    assert np.array_equal(carried[:4], np.float32(values))
    middle_of_01 = np.flatnonzero((baked.positions == (0.5, 0, 0)).all(axis=1))
    assert carried[middle_of_01] == pytest.approx([0.4])


def test_values_that_do_not_blend_come_from_a_source_corner(surface, baked):
    carried = carry_attribute(attribute("CORNER", [7, 8, 9, 11], blends=False, dtype=np.int32), surface, baked)
    assert set(carried.values[:, 0]) <= {7, 8, 9, 11}
    at_sources = carried.values[:, 0][baked.corner_barycentric.reshape(-1, 3).max(axis=1) == 1.0]
    assert sorted(at_sources) == [7, 7, 8, 9, 9, 11]


def test_text_is_carried(surface, baked):
    words = np.array([["a"], ["b"], ["c"], ["d"]], dtype=object)
    carried = carry_attribute(Attribute("it", "POINT", "STRING", words, False), surface, baked)
    assert [word for (word,) in carried.values[:4]] == ["a", "b", "c", "d"]


def test_every_piece_has_its_faces_value(surface, baked):
    carried = carry_attribute(attribute("FACE", [5], blends=False, dtype=np.int32), surface, baked)
    assert carried.values.tolist() == [[5]] * 8


def test_edge_values_stay_on_the_pieces_of_their_edge(surface, baked):
    # Number the baked edges ourselves, as Blender would.
    starts, ends = baked.triangles.reshape(-1), np.roll(baked.triangles, -1, axis=1).reshape(-1)
    pairs = np.sort(np.stack([starts, ends], axis=1), axis=1)
    edges, edge_of_corner = np.unique(pairs, axis=0, return_inverse=True)
    sharp = attribute("EDGE", [True, False, False, True], blends=False, dtype=np.bool_, data_type="BOOLEAN")
    carried = carry_edge_attribute(
        sharp, source_edge_of_corner(surface, baked), edge_of_corner.reshape(-1), len(edges)
    ).values[:, 0]

    ends_of_edges = baked.positions[edges]
    on_bottom = (ends_of_edges[:, :, 1] == 0).all(axis=1)
    on_left = (ends_of_edges[:, :, 0] == 0).all(axis=1)
    assert np.array_equal(carried, on_bottom | on_left)
    assert carried.sum() == 4


def test_an_edge_attribute_has_no_place_at_corners(surface, baked):
    with pytest.raises(ValueError, match="EDGE"):
        carry_attribute(attribute("EDGE", [1, 2, 3, 4]), surface, baked)


def test_flat_surfaces_need_no_normals(surface, baked):
    assert carry_normals(surface, baked) is None


def test_refined_smooth_surfaces_keep_their_shading(baked):
    lean = np.float32([[-1, -1, 2], [1, -1, 2], [1, 1, 2], [-1, 1, 2]]) / np.float32(np.sqrt(6))
    surface = quad_surface(corner_normals=lean)
    normals = carry_normals(surface, baked)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    # In the middle of the edge from 0 to 1 the lean in x cancels.
    middle = baked.triangles.reshape(-1) == np.flatnonzero((baked.positions == (0.5, 0, 0)).all(axis=1))[0]
    assert normals[middle] == pytest.approx(np.tile(np.float32([0, -1, 2]) / np.sqrt(5), (middle.sum(), 1)), abs=1e-6)


@pytest.mark.parametrize("domain", ["POINT", "CORNER", "FACE"])
def test_what_is_carried_in_pieces_is_the_same(surface, baked, domain, monkeypatch):
    count = {"POINT": len(surface.positions), "CORNER": 4, "FACE": 1}[domain]
    values = attribute(domain, np.random.default_rng(3).random((count, 2)))
    whole = carry_attribute(values, surface, baked).values
    normals = np.random.default_rng(4).random((4, 3)).astype(np.float32)
    surface.corner_normals = normals
    whole_normals = carry_normals(surface, baked)
    monkeypatch.setattr("antumbra.core.carry.rows_of", lambda size: rows_of(size, 3))
    assert np.array_equal(carry_attribute(values, surface, baked).values, whole)
    assert np.array_equal(carry_normals(surface, baked), whole_normals)


def test_rows_come_once_each_and_in_order():
    for count in (0, 1, 6, 7):
        rows = [list(range(count))[part] for part in rows_of(count, 3)]
        assert [row for part in rows for row in part] == list(range(count))
        assert all(0 < len(part) <= 3 for part in rows)
