# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights in the solver's units against the formulas of radiometry."""

import math

import numpy as np
import pytest
from antumbra.core.lights import (
    DISK_SIDES,
    AreaLamp,
    area_vector,
    cone_from_world,
    exitance_rgb,
    outline_in_world,
    point_intensity_rgb,
    sun_irradiance_rgb,
)

IDENTITY = np.eye(4)


def lamp(shape="RECTANGLE", x=1.0, y=1.0, power=(1.0, 1.0, 1.0), normalize=True):
    return AreaLamp(shape, x, y, power, normalize)


def area(outline):
    return np.linalg.norm(area_vector(outline))


@pytest.mark.parametrize(
    ("shape", "expected"),
    [("SQUARE", 4.0), ("RECTANGLE", 6.0), ("DISK", math.pi), ("ELLIPSE", math.pi / 4 * 2.0 * 3.0)],
)
def test_outline_has_the_lights_area(shape, expected):
    assert area(outline_in_world(lamp(shape, 2.0, 3.0), IDENTITY)) == pytest.approx(expected, rel=1e-14)


def test_square_and_disk_ignore_the_second_size():
    for shape in ("SQUARE", "DISK"):
        assert np.array_equal(
            outline_in_world(lamp(shape, 2.0, 3.0), IDENTITY), outline_in_world(lamp(shape, 2.0, 99.0), IDENTITY)
        )


@pytest.mark.parametrize("shape", ["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"])
@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (1, 1, -1), (-2, -3, -1)])
def test_lit_side_is_minus_z_also_when_mirrored(shape, scale):
    world_from_light = np.diag([*scale, 1.0])
    normal = area_vector(outline_in_world(lamp(shape, 2.0, 3.0), world_from_light))
    assert normal @ -world_from_light[:3, 2] == pytest.approx(np.linalg.norm(normal) * abs(scale[2]))


def test_power_is_kept_when_the_light_is_scaled():
    # A unit square light of P watts, stretched to 2 x 3: exitance P / 6, so exitance x area is still P.
    world_from_light = np.diag([2.0, 3.0, 1.0, 1.0])
    one = lamp(power=(12.0, 6.0, 0.0))
    assert exitance_rgb(one, outline_in_world(one, world_from_light)) == pytest.approx((2.0, 1.0, 0.0))


def test_without_normalize_the_exitance_is_the_strength():
    one = lamp(x=5.0, y=2.0, power=(3.0, 3.0, 3.0), normalize=False)
    assert exitance_rgb(one, outline_in_world(one, IDENTITY)) == (3.0, 3.0, 3.0)


def test_light_without_area_sends_nothing():
    flat = lamp(x=1.0, y=0.0)
    assert exitance_rgb(flat, outline_in_world(flat, IDENTITY)) is None


def test_disk_polygon_is_as_close_as_its_constant_says():
    # Form factor from a point at height h = r under the centre of a disk is 1/2; of the polygon by its contour.
    outline = outline_in_world(lamp("DISK", 2.0), IDENTITY) + (0, 0, 1)
    following = np.roll(outline, -1, axis=0)
    cross = np.cross(outline, following)
    theta = np.arctan2(np.linalg.norm(cross, axis=1), np.einsum("ij,ij->i", outline, following))
    factor = abs((cross[:, 2] / np.linalg.norm(cross, axis=1) * theta).sum()) / (2 * math.pi)
    assert DISK_SIDES == 64
    assert factor == pytest.approx(0.5, rel=2e-7)
    assert factor != pytest.approx(0.5, rel=1e-8)


def test_a_point_sends_its_power_to_all_sides():
    for radius in (0.0, 0.3):
        assert point_intensity_rgb((4.0, 2.0, 0.0), radius, True) == pytest.approx((1 / math.pi, 0.5 / math.pi, 0))


def test_without_normalize_a_points_power_is_pi_times_its_radiance():
    # Of a disc of radius r and the radiance P/pi: pi·r²·P/pi
    assert point_intensity_rgb((4.0, 2.0, 0.0), 0.5, False) == pytest.approx((1.0, 0.5, 0.0))
    assert point_intensity_rgb((math.pi, 0.0, 0.0), 0.0, False) == pytest.approx((1.0, 0.0, 0.0))


def test_a_suns_strength_is_its_irradiance_or_its_radiance():
    assert sun_irradiance_rgb((3.0, 2.0, 1.0), 0.4, True) == (3.0, 2.0, 1.0)
    assert sun_irradiance_rgb((3.0, 2.0, 1.0), 0.0, False) == (3.0, 2.0, 1.0)
    assert sun_irradiance_rgb((3.0, 2.0, 1.0), math.pi, False) == pytest.approx((3 * math.pi, 2 * math.pi, math.pi))


def test_a_spots_cone_points_along_minus_z_and_is_stretched_with_the_light():
    turned = np.array([[0, 0, 1, 5], [0, 1, 0, 6], [-1, 0, 0, 7], [0, 0, 0, 1.0]])
    matrix = cone_from_world(turned)
    assert matrix @ (-1, 0, 0) == pytest.approx((0, 0, 1))
    wide = cone_from_world(np.diag([2.0, 1.0, 1.0, 1.0]))
    assert wide @ (2, 1, -1) == pytest.approx((1, 1, 1))
    assert cone_from_world(np.diag([2.0, 0.0, 1.0, 1.0])) is None
