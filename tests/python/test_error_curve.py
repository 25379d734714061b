# SPDX-License-Identifier: GPL-3.0-or-later
"""The course of the error as lines, and the axes that they are drawn on."""

import pytest
from antumbra.core.error_curve import ESTIMATED, VERIFIED, error_lines
from antumbra.core.plots import Line, scale_of

STEPS = [
    {"time_s": 0.5, "error": None, "estimated": None},
    {"time_s": 1.0, "error": [0.4, 0.3, 0.5], "estimated": None},
    {"time_s": 4.0, "error": [0.02, 0.0, 0.03], "estimated": 0.05},
]


def test_steps_that_tell_no_error_are_left_out():
    verified, estimated = error_lines(STEPS)
    assert (verified.name, estimated.name) == (VERIFIED, ESTIMATED)
    assert list(verified.xs) == [1.0, 4.0]
    assert list(verified.ys) == [0.4, 0.02]
    assert list(verified.band) == [(0.3, 0.5), (0.0, 0.03)]
    assert (list(estimated.xs), list(estimated.ys)) == ([4.0], [0.05])
    assert error_lines(STEPS[:1]) == []


def test_axes_hold_all_of_it_and_stand_on_zero_where_an_interval_does():
    lines = error_lines(STEPS)
    scale = scale_of(lines)
    places = [scale.place(x, y) for line in lines for x, y in zip(line.xs, line.ys, strict=True)]
    ends = [scale.place(0.0, y)[1] for line in lines for pair in line.band for y in pair]
    assert all(0.0 <= across <= 1.0 and 0.0 <= up <= 1.0 for across, up in places)
    assert min(ends) == 0.0
    assert scale.y_ticks()[0] == (scale.low, 0.0)
    assert all(at == written for at, written in scale.y_ticks()[1:])
    assert max(scale.x_ticks()) <= 4.0
    assert len(scale.x_ticks()) >= 4


def test_each_tenth_is_as_far_below_as_the_last():
    scale = scale_of([Line("falling", [0.0, 1.0, 2.0], [1.0, 0.1, 0.01])])
    heights = [scale.place(0.0, y)[1] for y in (1.0, 0.1, 0.01)]
    assert heights[0] - heights[1] == pytest.approx(heights[1] - heights[2])
    assert all(at == written for at, written in scale.y_ticks())


def test_nothing_has_no_axes():
    assert scale_of([]) is None
    assert scale_of([Line("dark", [1.0], [0.0])]) is None
