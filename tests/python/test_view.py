# SPDX-License-Identifier: GPL-3.0-or-later
"""Light as colours for a screen."""

import math

import numpy as np
import pytest
from antumbra.core.colours import srgb_encoded
from antumbra.core.view import automatic_end, exposed, false_colours, legend, photometric, unit_of


def test_a_watt_of_white_on_a_square_metre_is_683_lux():
    """Blender's white is (1, 1, 1), of luminance 1; a receiver that stores H/pi stores 1/pi there."""
    assert np.allclose(photometric(np.full((1, 3), 1.0 / math.pi), True), 683.0)
    assert np.allclose(photometric(np.ones((1, 3)), False), 683.0)
    assert (unit_of(True), unit_of(False)) == ("lx", "cd/m²")


def test_green_is_brighter_than_red_and_blue_and_all_three_are_white():
    red, green, blue = photometric(np.eye(3), False)
    assert green > red > blue
    assert np.isclose(red + green + blue, 683.0)


def test_brightness_of_false_colours_rises_and_ends():
    values = np.linspace(0.0, 200.0, 100)
    colours = false_colours(values, 100.0)
    luminance = photometric(colours, False)
    assert (np.diff(luminance[:50]) > 0.0).all()
    assert np.allclose(colours[50:], colours[-1])
    assert ((colours >= 0.0) & (colours <= 1.0)).all()
    # The ends of inferno.
    assert np.allclose(srgb_encoded(colours[[0, -1]]), [(0.001, 0.0, 0.014), (0.988, 0.998, 0.645)], atol=1e-3)


def test_a_stop_is_twice_the_light():
    light = np.array([[0.1, 0.2, 0.4]])
    assert np.allclose(exposed(light, 1.0), [[0.2, 0.4, 0.8]])
    assert np.allclose(exposed(light, 2.0), [[0.4, 0.8, 1.0]])
    assert np.allclose(exposed(light, -1.0), [[0.05, 0.1, 0.2]])


@pytest.mark.parametrize(("brightest", "end"), [(0.9, 1.0), (1.0, 1.0), (1.1, 2.0), (340.0, 500.0), (7e-3, 1e-2)])
def test_an_automatic_range_ends_at_a_round_number(brightest, end):
    assert np.isclose(automatic_end([np.full(5, brightest), np.empty(0)]), end)


def test_one_lamp_does_not_darken_the_rest():
    values = np.full(10_000, 80.0)
    values[:5] = 1e6
    assert automatic_end([values]) == 100.0
    assert automatic_end([np.zeros(4)]) == 1.0
    assert automatic_end([]) == 1.0


def test_the_legend_names_the_unit_at_its_end():
    assert legend(500.0, "lx") == [(0.0, "0"), (0.2, "100"), (0.4, "200"), (0.6, "300"), (0.8, "400"), (1.0, "500 lx")]
    assert legend(1e4, "cd/m²")[1:3] == [(0.2, "2,000"), (0.4, "4,000")]
    assert legend(0.05, "lx")[1] == (0.2, "0.01")
