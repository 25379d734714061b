# SPDX-License-Identifier: GPL-3.0-or-later
"""How the study looks up colours and does its sums, with answers that are known."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.study.growth import exponent
from tests.study.lookup import Surface
from tests.study.statistics_of_error import at_error, relative_error
from tests.study.tables import cycles_table, equal_error_table, paper_table

UP, DOWN = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])


def linear(points):
    """A colour that a linear element holds exactly."""
    return np.stack([1.0 + 2.0 * points[..., 0], 3.0 - points[..., 1], 0.5 + points[..., 0] * 0.25], axis=-1)


def square(z=0.0, cells=3):
    """The unit square as triangles that face up, coloured by `linear`."""
    corners = []
    for i in range(cells):
        for j in range(cells):
            x, y, s = i / cells, j / cells, 1.0 / cells
            corners += [[(x, y, z), (x + s, y, z), (x + s, y + s, z)], [(x, y, z), (x + s, y + s, z), (x, y + s, z)]]
    corners = np.array(corners)
    return Surface(corners, linear(corners))


def test_a_linear_colour_is_looked_up_exactly_inside_and_on_edges():
    chance = np.random.default_rng(1)
    points = np.concatenate([chance.random((50, 3)) * (1, 1, 0), [(1 / 3, 0.2, 0), (0, 0, 0), (1, 1, 0)]])
    found = square().at(points, np.tile(UP, (len(points), 1)), 1e-6)
    assert found == pytest.approx(linear(points), abs=1e-12)


def test_the_side_that_faces_along_the_normal_is_looked_up():
    front, back = square(), square(z=-1e-3)
    corners = np.concatenate([front.corners, back.corners[:, ::-1]])
    both = Surface(corners, np.concatenate([front.colours, np.zeros_like(back.colours)]))
    points, within = np.full((1, 3), (0.4, 0.3, 0.0)), 1e-2
    assert both.at(points, UP[None], within) == pytest.approx(linear(points))
    assert (both.at(points, DOWN[None], within) == 0.0).all()


def test_the_nearest_of_two_layers_is_looked_up():
    low, high = square(), square(z=0.004)
    both = Surface(np.concatenate([low.corners, high.corners]), np.concatenate([low.colours, 0.0 * high.colours]))
    point = np.array([[0.6, 0.3, 0.001]])
    assert both.at(point, UP[None], 1e-2) == pytest.approx(linear(point))


def test_a_point_just_outside_takes_the_nearest_place_of_the_edge():
    point = np.array([[1.0005, 0.25, 0.0]])
    assert square().at(point, UP[None], 1e-3) == pytest.approx(linear(np.array([[1.0, 0.25, 0.0]])))
    assert np.isnan(square().at(point, UP[None], 1e-4)).all()


def test_triangles_without_area_show_nothing():
    corners = np.array([[(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 0, 0), (1, 0, 0), (0, 1, 0)]], dtype=float)
    surface = Surface(corners, np.stack([np.full((3, 3), 9.0), np.ones((3, 3))]))
    assert surface.at(np.array([[0.5, 0.0, 0.0]]), UP[None], 1e-6) == pytest.approx(np.ones((1, 3)))


def test_a_constant_error_is_found_whole():
    reference = np.random.default_rng(2).random((400, 3)) + 0.5
    error = relative_error(reference + 0.1, reference, np.zeros_like(reference))
    assert error.value == pytest.approx(0.1 / reference.mean())
    assert error.low <= error.value <= error.high


def test_the_references_own_noise_is_no_error():
    chance = np.random.default_rng(3)
    truth, noise = np.full((20000, 3), 2.0), 0.06
    reference = truth + noise * chance.standard_normal(truth.shape)
    stderr = np.full_like(truth, noise)
    # Noise of 3 %, errors of none and of 2 %.
    assert relative_error(truth, reference, stderr).value < 0.004
    wrong = truth + 0.04 * chance.choice([-1.0, 1.0], truth.shape)
    assert relative_error(wrong, reference, stderr).value == pytest.approx(0.02, rel=0.03)


def test_the_interval_holds_the_truth_about_95_times_in_100():
    chance, held = np.random.default_rng(4), 0
    for trial in range(60):
        reference = np.ones((200, 3))
        values = reference + 0.05 * chance.standard_normal((200, 1))
        error = relative_error(values, reference, np.zeros_like(reference), seed=trial)
        held += error.low <= 0.05 <= error.high
    assert held >= 50


def test_sizes_between_tolerances_follow_a_power_law():
    # error = 1 / vertices, so 1 % needs 100 of them.
    assert at_error(0.01, [0.04, 0.005], [25.0, 200.0]) == pytest.approx(100.0)
    assert at_error(0.005, [0.04, 0.005], [25.0, 200.0]) == pytest.approx(200.0)


def test_an_error_that_was_not_reached_has_no_size():
    assert at_error(0.001, [0.04, 0.005], [25.0, 200.0]) is None
    assert at_error(0.1, [0.04, 0.005], [25.0, 200.0]) is None
    assert at_error(0.01, [], []) is None


def bake(scene, method, error, vertices, cpu_s):
    return SimpleNamespace(
        scene=scene, method=method, error=error, vertices=vertices, triangles=2 * vertices, cpu_s=cpu_s
    )


RESULTS = [
    bake("room", "AS", 0.04, 1000, 1.0),
    bake("room", "AS", 0.01, 4000, 4.0),
    bake("room", "ADM", 0.04, 500, 2.0),
    bake("room", "ADM", 0.005, 4000, 16.0),
]


def test_cycles_is_given_its_best_subdivision_and_samples():
    cycles = [
        bake("room", "CYCLES16", 0.08, 1000, 1.0),
        bake("room", "CYCLES16", 0.02, 16000, 16.0),
        bake("room", "CYCLES256", 0.04, 1000, 20.0),
        bake("room", "CYCLES256", 0.01, 16000, 320.0),
    ]
    rows = [line.split(" | ") for line in cycles_table([*RESULTS, *cycles], ["room", "elsewhere"])[2:]]
    at_4_percent = next(cells for cells in rows if cells[1] == "4 %")
    # The most samples need the fewest vertices, the fewest the least time.
    assert at_4_percent[2:] == ["1,000", "4.00", "500", "2.00", "0.50", "0.50 |"]
    at_half_a_percent = next(cells for cells in rows if cells[1] == "0.5 %")
    assert at_half_a_percent[2:4] == ["not reached", "not reached"]
    assert cycles_table(RESULTS, ["room"]) == []


def test_the_table_of_equal_errors_compares_methods():
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in equal_error_table(RESULTS, ["room"])]
    heads, at_2, at_half = rows[0], rows[2], rows[4]
    assert at_2[heads.index("AS vertices")] == "2,000"
    assert at_2[heads.index("ADM/AS vertices")] == "0.50"
    assert at_2[heads.index("ADM/UNIFORM s")] == "–"
    assert at_half[heads.index("AS vertices")] == "not reached"


def test_the_papers_table_compares_at_the_finest_error_both_come_to():
    row = [cell.strip() for cell in paper_table(RESULTS, ["room"])[2].strip("|").split("|")]
    assert row == ["room", "1.00 %", "8,000", "4.00", "4,000", "8.00", "0.50", "2.00"]


def test_without_bakes_there_is_no_table():
    assert paper_table([], ["room"]) == []


def test_the_exponent_of_a_power_is_its_power():
    triangles = [1e3, 1e4, 1e5, 1e6]
    assert exponent(triangles, [3.0 * n**1.15 for n in triangles]) == pytest.approx(1.15)
    # What is not known is left out
    assert exponent(triangles, [None, 2e4, None, 2e6]) == pytest.approx(1.0)
    assert exponent(triangles, [1.0, None, None, None]) is None
