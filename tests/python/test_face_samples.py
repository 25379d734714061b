# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples on faces, and means over them."""

import numpy as np
import pytest
from antumbra.core.carry import carry_attribute
from antumbra.core.face_samples import distinct_rows, means_of_faces, place_samples, rounded, sampling_levels
from antumbra.core.pieces import at_once
from antumbra.core.record import Attribute
from meshes import quad_surface


def sampled(levels, surface=None):
    surface = surface or quad_surface()
    return surface, at_once(place_samples(surface, np.array(levels, dtype=np.int32)))


@pytest.mark.parametrize("level", [1, 2, 5])
def test_means_of_quadratic_functions_are_exact(level):
    """Over the unit square: x -> 1/2, x² -> 1/3, xy -> 1/4."""
    surface, samples = sampled([level, level])
    x, y = samples.positions[:, 0], samples.positions[:, 1]
    found = at_once(means_of_faces(surface, samples, np.stack([x, x * x, x * y], axis=1)))
    assert found.mean[0] == pytest.approx([1 / 2, 1 / 3, 1 / 4], abs=1e-12)


def test_all_samples_lie_inside_and_stand_for_the_same_area():
    _, samples = sampled([4, 4])
    assert len(samples.positions) == 2 * 3 * 4**2
    assert samples.corner_barycentric.min() > 0.0
    assert samples.corner_barycentric.sum(axis=2) == pytest.approx(1.0)
    corners = samples.positions[samples.triangles]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    # Half as long as what they stand for, and facing the same way.
    assert areas == pytest.approx(np.full(len(areas), 1 / 4**2 / 4))


def test_a_triangle_counts_by_its_area_however_often_it_is_looked_at():
    surface, samples = sampled([1, 7])
    on_second = (samples.vertex_source_triangle == 1).astype(float)
    found = at_once(means_of_faces(surface, samples, on_second[:, None]))
    assert found.mean[0, 0] == pytest.approx(0.5)
    assert found.deviation[0, 0] == pytest.approx(0.5)


def test_faces_that_nobody_looks_at_have_no_mean():
    surface, samples = sampled([0, 0])
    assert len(samples.triangles) == 0
    assert np.isnan(at_once(means_of_faces(surface, samples, np.empty((0, 1)))).mean).all()


def test_a_face_without_area_shows_what_is_found_there():
    surface = quad_surface()
    surface.positions[:] = 0.0
    surface, samples = sampled([1, 1], surface)
    found = at_once(means_of_faces(surface, samples, np.full((6, 1), 0.25)))
    assert found.mean[0, 0] == 0.25


def test_attributes_go_to_the_samples():
    surface, samples = sampled([3, 2])
    uv = Attribute("uv", "CORNER", "FLOAT2", surface.positions[:, :2].copy(), blends=True)
    carried = carry_attribute(uv, surface, samples)
    assert carried.values == pytest.approx(samples.positions[:, :2], abs=1e-7)


def test_levels_follow_the_area_between_one_and_a_limit():
    levels = sampling_levels(np.array([0.0, 1.0, 4.0, 1e9]), 48.0)
    assert levels.tolist() == [1, 4, 8, 64]


def test_rounding_is_finer_than_anyone_asks_for():
    rng = np.random.default_rng(1)
    reflectance, exitance = rng.uniform(size=(100, 3)), 10.0 ** rng.uniform(-6, 6, size=(100, 3))
    as_reflectance, as_exitance = rounded(reflectance, exitance)
    assert np.abs(as_reflectance - reflectance).max() <= 0.5 / 1024
    off = np.abs(as_exitance - exitance).max(axis=1) / exitance.max(axis=1)
    assert off.max() <= 1 / 1024
    assert (rounded(np.zeros((1, 3)), np.zeros((1, 3)))[1] == 0.0).all()


@pytest.mark.parametrize(("count", "values"), [(1, 1), (400, 1), (400, 2), (400, 1000)])
def test_distinct_rows_are_those_that_numpy_finds(count, values):
    rows = np.random.default_rng(count + values).integers(values, size=(count, 8)) / 1024.0
    distinct, which = at_once(distinct_rows(rows))
    expected, expected_which = np.unique(rows, axis=0, return_inverse=True)
    assert np.array_equal(distinct, expected)
    assert np.array_equal(which, expected_which.reshape(-1))
