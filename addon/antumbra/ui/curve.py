# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of the last bake against its time, drawn into the lower right corner of 3D viewports.

A panel cannot hold a drawing with text; a viewport can, and it is where the bake is looked at.
"""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as translated

from ..bridge import outcome
from ..bridge.view_properties import view_of
from ..core.error_curve import ERROR, TIME, error_lines
from ..core.plots import Line, Scale, scale_of
from .drawing import TEXT_SIZE, Places, Rgba, draw_box, draw_line, draw_strip, text_width, write

# In pixels at scale 1: of the plot with its text, and from its borders to its axes.
_WIDTH, _HEIGHT, _MARGIN = 380, 230, 16
_LEFT, _RIGHT, _TOP, _BOTTOM = 58, 16, 44, 40

# Those of the report's page (Okabe, Ito 2008), lighter, since they lie on a dark ground.
_COLOURS: tuple[Rgba, ...] = ((0.35, 0.7, 0.9, 1.0), (1.0, 0.6, 0.15, 1.0))
_GROUND: Rgba = (0.08, 0.08, 0.08, 0.85)
_GRID: Rgba = (0.35, 0.35, 0.35, 1.0)
_PALE: Rgba = (0.75, 0.75, 0.75, 1.0)

_handles: list[Any] = []


def _draw() -> None:
    context = bpy.context
    scene, report = context.scene, outcome.last_report
    space: Any = context.space_data
    if scene is None or report is None or not space.overlay.show_overlays or not view_of(scene).error_curve:
        return
    preferences: Any = context.preferences
    scale_of_ui = preferences.system.ui_scale
    region: Any = context.region
    width, height = _WIDTH * scale_of_ui, _HEIGHT * scale_of_ui
    x = region.width - _covered_at_right(context) - width - _MARGIN * scale_of_ui
    if x < 0.0 or region.height < height:
        # There is no room for it
        return
    _Plot(x, _MARGIN * scale_of_ui, scale_of_ui).draw(error_lines(report["timeline"]))


def _covered_at_right(context: bpy.types.Context) -> float:
    """How much of the viewport lies below its sidebar."""
    area: Any = context.area
    return float(sum(region.width for region in area.regions if region.type == "UI" and region.width > 1))


class _Plot:
    """A plot with its lower left corner at a place of the region."""

    def __init__(self, x: float, y: float, scale: float) -> None:
        self._x, self._y, self._scale = x, y, scale

    def draw(self, lines: list[Line]) -> None:
        scale = self._scale
        draw_box(self._x, self._y, _WIDTH * scale, _HEIGHT * scale, _GROUND)
        axes = scale_of(lines)
        if axes is None:
            text = translated("The last bake told no error")
            write(self._x + _LEFT * scale, self._y + _HEIGHT * scale / 2.0, text, scale, _PALE)
            return
        self._draw_axes(axes)
        for line, colour in zip(lines, _COLOURS, strict=False):
            if line.band:
                ends = [
                    [self._at(axes, x, ends[k]) for x, ends in zip(line.xs, line.band, strict=True)] for k in (0, 1)
                ]
                draw_strip(ends[0], ends[1], (*colour[:3], 0.25))
            course = [self._at(axes, x, y) for x, y in zip(line.xs, line.ys, strict=True)]
            if len(course) > 1:
                draw_line(course, 2.0 * scale, colour)
            self._dot(course, colour)
        self._name(lines)

    def _at(self, axes: Scale, x: float, y: float) -> tuple[float, float]:
        across, up = axes.place(x, y)
        scale = self._scale
        return (
            self._x + (_LEFT + across * (_WIDTH - _LEFT - _RIGHT)) * scale,
            self._y + (_BOTTOM + up * (_HEIGHT - _TOP - _BOTTOM)) * scale,
        )

    def _draw_axes(self, axes: Scale) -> None:
        scale = self._scale
        for value, written_as in axes.y_ticks():
            left, right = self._at(axes, 0.0, value), self._at(axes, axes.right, value)
            draw_line([left, right], 1.0, _GRID)
            text = ERROR.text(written_as)
            write(left[0] - text_width(text, scale) - 6 * scale, left[1] - 4 * scale, text, scale, _PALE)
        for value in axes.x_ticks():
            foot, top = self._at(axes, value, axes.low), self._at(axes, value, axes.high)
            draw_line([foot, top], 1.0, _GRID)
            text = TIME.text(value)
            write(foot[0] - text_width(text, scale) / 2.0, foot[1] - 16 * scale, text, scale, _PALE)
        title = translated(TIME.title)
        middle = self._at(axes, axes.right / 2.0, axes.low)[0]
        write(middle - text_width(title, scale) / 2.0, self._y + 8 * scale, title, scale, _PALE)

    def _dot(self, places: Places, colour: Rgba) -> None:
        side = 5.0 * self._scale
        for x, y in places:
            draw_box(x - side / 2.0, y - side / 2.0, side, side, colour)

    def _name(self, lines: list[Line]) -> None:
        """What each line is, one below the other over the plot."""
        scale = self._scale
        for number, (line, colour) in enumerate(zip(lines, _COLOURS, strict=False)):
            y = self._y + (_HEIGHT - 16 - 1.4 * TEXT_SIZE * number) * scale
            write(self._x + _LEFT * scale, y, translated(line.name), scale, colour)


def register() -> None:
    if bpy.app.background:
        # There is nothing to draw on, and no graphics card to ask for.
        return
    space: Any = bpy.types.SpaceView3D
    _handles.append(space.draw_handler_add(_draw, (), "WINDOW", "POST_PIXEL"))


def unregister() -> None:
    space: Any = bpy.types.SpaceView3D
    while _handles:
        space.draw_handler_remove(_handles.pop(), "WINDOW")
