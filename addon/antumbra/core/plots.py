# SPDX-License-Identifier: GPL-3.0-or-later
"""Line plots as SVG, with nothing but text: they are part of a page that must open anywhere."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 560, 300
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 16, 28, 44

# Told apart by people who see few colours (Okabe, Ito 2008).
COLOURS = ("#0072b2", "#d55e00", "#009e73")


@dataclass(frozen=True, slots=True)
class Line:
    """A named course of values; `band` holds the ends of an interval for each."""

    name: str
    xs: Sequence[float]
    ys: Sequence[float]
    band: Sequence[tuple[float, float]] = ()


@dataclass(frozen=True, slots=True)
class Axis:
    """What is along an axis, and how a value there is written."""

    title: str
    text: Callable[[float], str]


@dataclass(frozen=True, slots=True)
class Scale:
    """A linear x axis from 0, and a logarithmic y axis whose foot is 0 where something is."""

    right: float
    low: float
    high: float
    has_zero: bool

    def place(self, x: float, y: float) -> tuple[float, float]:
        """From 0 to 1 along both axes."""
        share = (math.log10(max(y, self.low)) - math.log10(self.low)) / (math.log10(self.high) - math.log10(self.low))
        return x / self.right, share

    def x_ticks(self) -> list[float]:
        return _round_steps(self.right)

    def y_ticks(self) -> list[tuple[float, float]]:
        """Where grid lines are, and what is written there."""
        foot = [(self.low, 0.0)] if self.has_zero else []
        return foot + [(value, value) for value in _ticks(self.low, self.high) if not foot or value > 1.5 * self.low]


def scale_of(lines: Sequence[Line]) -> Scale | None:
    """One that holds all lines; None where there is nothing to show."""
    values = [y for line in lines for y in (*line.ys, *(end for ends in line.band for end in ends))]
    shown = [y for y in values if y > 0.0]
    if not shown:
        return None
    low, high = _decades(shown)
    has_zero = any(y <= 0.0 for y in values)
    right = max((x for line in lines for x in line.xs), default=0.0) or 1.0
    return Scale(right, low / 10.0 if has_zero else low, high, has_zero)


def plot(lines: Sequence[Line], x_axis: Axis, y_axis: Axis) -> str:
    """An SVG of lines over a linear x axis from 0 and a logarithmic y axis, whose foot is 0 where something is."""
    scale = scale_of(lines)
    if scale is None:
        return "<p>Nothing to plot.</p>"
    low = scale.low

    def place(x: float, y: float) -> tuple[float, float]:
        across, up = scale.place(x, y)
        return _LEFT + across * (WIDTH - _LEFT - _RIGHT), HEIGHT - _BOTTOM - up * (HEIGHT - _TOP - _BOTTOM)

    parts = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(y_axis.title)}">']
    for value, written_as in scale.y_ticks():
        _, y = place(0.0, value)
        parts.append(f'<line class="grid" x1="{_LEFT}" x2="{WIDTH - _RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>')
        written = y_axis.text(written_as)
        parts.append(f'<text x="{_LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{escape(written)}</text>')
    for value in scale.x_ticks():
        x, _ = place(value, low)
        parts.append(f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{_TOP}" y2="{HEIGHT - _BOTTOM}"/>')
        parts.append(
            f'<text x="{x:.1f}" y="{HEIGHT - _BOTTOM + 16}" text-anchor="middle">{escape(x_axis.text(value))}</text>'
        )
    middle = _LEFT + (WIDTH - _LEFT - _RIGHT) / 2
    parts.append(f'<text x="{middle:.0f}" y="{HEIGHT - 8}" text-anchor="middle">{escape(x_axis.title)}</text>')
    for line, colour in zip(lines, COLOURS, strict=False):
        if line.band:
            ends = [[place(x, ends[k]) for x, ends in zip(line.xs, line.band, strict=True)] for k in (0, 1)]
            around = _points([*ends[0], *reversed(ends[1])])
            parts.append(f'<polygon points="{around}" fill="{colour}" opacity="0.2"/>')
        course = [place(x, y) for x, y in zip(line.xs, line.ys, strict=True)]
        parts.append(f'<polyline points="{_points(course)}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in course]
    # Above the plot, where no line runs
    names = "".join(
        f'<tspan dx="{16 if number else 0}" style="fill:{colour}">{escape(line.name)}</tspan>'
        for number, (line, colour) in enumerate(zip(lines, COLOURS, strict=False))
    )
    parts.append(f'<text x="{WIDTH - _RIGHT}" y="{_TOP - 10}" text-anchor="end">{names}</text>')
    return "\n".join([*parts, "</svg>"])


@dataclass(frozen=True, slots=True)
class Mark:
    """A place with a signed value."""

    x: float
    y: float
    value: float


# Radius of the mark of the largest value, and of the smallest that is drawn: nearly all are small.
_LARGEST, _SMALLEST = 9.0, 0.6


def scatter(marks: Sequence[Mark], x_title: str, y_title: str) -> str:
    """An SVG of marks at their places, both axes alike; areas as the values' sizes, colours by their signs."""
    most = max((abs(mark.value) for mark in marks), default=0.0)
    low_x, high_x = min(mark.x for mark in marks), max(mark.x for mark in marks)
    low_y, high_y = min(mark.y for mark in marks), max(mark.y for mark in marks)
    inner_width, inner_height = WIDTH - _LEFT - _RIGHT, HEIGHT - _TOP - _BOTTOM
    room_x, room_y = inner_width - 2.0 * _LARGEST, inner_height - 2.0 * _LARGEST
    scale = min(room_x / max(high_x - low_x, 1e-9), room_y / max(high_y - low_y, 1e-9))
    parts = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(y_title)}">']
    # Large ones last, over the others
    for mark in sorted(marks, key=lambda mark: abs(mark.value)):
        x = _LEFT + inner_width / 2 + scale * (mark.x - (low_x + high_x) / 2)
        y = HEIGHT - _BOTTOM - inner_height / 2 - scale * (mark.y - (low_y + high_y) / 2)
        radius = max(_SMALLEST, _LARGEST * math.sqrt(abs(mark.value) / most)) if most > 0.0 else _SMALLEST
        colour = COLOURS[1] if mark.value > 0.0 else COLOURS[0]
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{colour}" opacity="0.7"/>')
    # What holds all marks, with its ends in the unit of the titles
    width, height = scale * (high_x - low_x) + 2.0 * _LARGEST, scale * (high_y - low_y) + 2.0 * _LARGEST
    left, top = _LEFT + (inner_width - width) / 2, _TOP + (inner_height - height) / 2
    parts.append(f'<rect class="grid" x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}"/>')
    extent = max(high_x - low_x, high_y - low_y)
    for x, anchor, text in (
        (left, "start", _rounded(low_x, extent)),
        (left + width / 2, "middle", x_title),
        (left + width, "end", _rounded(high_x, extent)),
    ):
        parts.append(f'<text x="{x:.1f}" y="{top + height + 16:.1f}" text-anchor="{anchor}">{escape(text)}</text>')
    for y, text in (
        (top + height, _rounded(low_y, extent)),
        (top + height / 2 + 4, y_title),
        (top + 10, _rounded(high_y, extent)),
    ):
        parts.append(f'<text x="{left - 6:.1f}" y="{y:.1f}" text-anchor="end">{escape(text)}</text>')
    return "\n".join([*parts, "</svg>"])


def _rounded(value: float, extent: float) -> str:
    """A place to about a hundredth of what it is a place in."""
    places = 2 - math.floor(math.log10(extent)) if extent > 0.0 else 2
    return f"{round(value, places) + 0.0:g}"


def _points(places: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in places)


def _decades(values: Sequence[float]) -> tuple[float, float]:
    """Ends of a logarithmic axis, at 1, 2 or 5 times a power of ten, with all values between them."""
    low = max(value for value in _one_two_five(min(values)) if value <= min(values))
    high = min(value for value in _one_two_five(max(values)) if value >= max(values))
    return low, high if high > low else 2.0 * low


def _one_two_five(value: float) -> list[float]:
    exponent = math.floor(math.log10(value))
    return [digit * 10.0**power for power in (exponent - 1, exponent, exponent + 1) for digit in (1.0, 2.0, 5.0)]


def _ticks(low: float, high: float) -> list[float]:
    """1, 2 and 5 times powers of ten, or the powers alone where there are many."""
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    digits = (1.0,) if len(exponents) > 4 else (1.0, 2.0, 5.0)
    rounding = 1e-9
    values = [digit * 10.0**exponent for exponent in exponents for digit in digits]
    return [value for value in values if low * (1.0 - rounding) <= value <= high * (1.0 + rounding)]


def _round_steps(most: float) -> list[float]:
    """From 0 on, about five round values."""
    step = min(value for value in _one_two_five(most / 5.0) if value >= most / 5.0)
    return [step * number for number in range(int(most / step + 1e-9) + 1)]
