# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures on the elements of a refined mesh."""

import math

import numpy as np
import pytest
from antumbra.core.face_samples import triangle_areas
from antumbra.core.pieces import at_once
from antumbra.core.textures import corner_values, place_on_elements, show_texture
from meshes import quad_surface, split_in_four


def placed(levels):
    baked = split_in_four(quad_surface())
    return baked, at_once(place_on_elements(quad_surface(), baked, np.array(levels, dtype=np.int32)))


@pytest.mark.parametrize("level", [1, 2, 5])
def test_linear_textures_come_out_exactly(level):
    baked, on = placed([level] * len(split_in_four(quad_surface()).triangles))
    x, y = on.samples.positions[:, 0], on.samples.positions[:, 1]
    found = at_once(corner_values(on, np.stack([x, 2.0 - x - 0.5 * y], axis=1)))
    corners = baked.positions[baked.triangles]
    expected = np.stack([corners[:, :, 0], 2.0 - corners[:, :, 0] - 0.5 * corners[:, :, 1]], axis=2)
    assert found == pytest.approx(expected, abs=1e-12)


def test_elements_are_fitted_alike_in_any_number_of_pieces(monkeypatch):
    _, on = placed([2, 5, 1, 3] * 2)
    values = np.random.default_rng(5).random((3 * len(on.element), 7)).astype(np.float32)
    whole = at_once(corner_values(on, values))
    monkeypatch.setattr("antumbra.core.textures.ROWS", 12)
    in_pieces = corner_values(on, values)
    for _ in range(3):
        next(in_pieces)
    assert np.array_equal(at_once(in_pieces), whole)


def test_an_edge_of_a_texture_along_edges_of_the_mesh_is_as_sharp():
    """The quad's elements on either side of x = 1/2 keep their colours to the last corner."""
    baked, on = placed([3] * len(split_in_four(quad_surface()).triangles))
    right = on.samples.positions[:, 0] > 0.5
    found = at_once(corner_values(on, right[:, None].astype(np.float32)))[:, :, 0]
    across = baked.positions[baked.triangles][:, :, 0]
    for side, value in ((across.max(axis=1) <= 0.5, 0.0), (across.min(axis=1) >= 0.5, 1.0)):
        assert side.sum() >= 2
        assert found[side] == pytest.approx(value, abs=1e-12)
    # One that the edge crosses overshoots a step by little.
    assert found.min() > -0.15
    assert found.max() < 1.15


def test_elements_that_nobody_looks_at_have_no_samples():
    baked, on = placed([0, 2] + [0] * (len(split_in_four(quad_surface()).triangles) - 2))
    assert on.elements.tolist() == [1]
    assert len(on.samples.triangles) == 2**2
    assert (on.samples.source_triangle == baked.source_triangle[1]).all()
    assert at_once(triangle_areas(baked)).sum() == pytest.approx(1.0)


def test_colours_go_into_all_layers_and_leave_the_light_as_it_was():
    """B = E + rho·H before and after, per channel, with direct and indirect light apart."""
    baked = split_in_four(quad_surface())
    count = len(baked.triangles)
    rng = np.random.default_rng(1)
    direct, indirect = rng.random((2, count, 3, 3))
    known, glow = np.array([[0.5, 0.25, 0.0]]), np.array([[1.0, 0.0, 2.0]])
    baked.corner_direct = ((glow + known * direct) / math.pi).astype(np.float32)
    baked.corner_indirect = (known * indirect / math.pi).astype(np.float32)
    baked.corner_radiance = baked.corner_direct + baked.corner_indirect
    before = baked.corner_radiance.copy()
    elements = np.array([1, 2], dtype=np.int32)
    reflectance, exitance = rng.random((2, 2, 3, 3))
    reflectance[:, :, 2] = 0.0
    at_once(show_texture(baked, elements, reflectance, exitance, known.repeat(2, 0), glow.repeat(2, 0)))
    expected_direct = (exitance + reflectance * direct[elements]) / math.pi
    expected_indirect = reflectance * indirect[elements] / math.pi
    assert baked.corner_direct[elements] == pytest.approx(expected_direct, abs=1e-6)
    assert baked.corner_indirect[elements] == pytest.approx(expected_indirect, abs=1e-6)
    assert baked.corner_radiance[elements] == pytest.approx(expected_direct + expected_indirect, abs=1e-6)
    others = np.setdiff1d(np.arange(count), elements)
    assert (baked.corner_radiance[others] == before[others]).all()
