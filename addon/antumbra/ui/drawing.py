# SPDX-License-Identifier: GPL-3.0-or-later
"""What overlays draw with: batches, boxes, lines and text, in pixels of the region. Only where there is a window.

Every shader is one of Blender's own that 4.2 to 5.2 have under the same name.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import blf
import bpy
import gpu
from gpu_extras.batch import batch_for_shader

Rgba = tuple[float, ...]
Places = Sequence[tuple[float, float]]

TEXT_SIZE = 11
"""At scale 1."""


def batch(shader: Any, kind: Any, **attributes: Any) -> Any:
    # Blender's types know no numpy arrays, which are what it takes fastest.
    return batch_for_shader(shader, kind, attributes)


def draw_box(x: float, y: float, width: float, height: float, colour: Rgba) -> None:
    draw_strip([(x, y), (x, y + height)], [(x + width, y), (x + width, y + height)], colour)


def draw_strip(first: Places, second: Places, colour: Rgba) -> None:
    """What lies between two lines of as many points."""
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    points = [(x, y, 0.0) for pair in zip(first, second, strict=True) for x, y in pair]
    triangles = [(k, k + 1, k + 2) for k in range(len(points) - 2)]
    strip = batch_for_shader(shader, "TRIS", {"pos": points}, indices=triangles)
    shader.uniform_float("color", colour)
    # Text switches it off.
    gpu.state.blend_set("ALPHA")
    strip.draw(shader)
    gpu.state.blend_set("NONE")


def draw_line(places: Places, width: float, colour: Rgba) -> None:
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    region: Any = bpy.context.region
    line = batch(shader, "LINE_STRIP", pos=[(x, y, 0.0) for x, y in places])
    shader.uniform_float("viewportSize", (region.width, region.height))
    shader.uniform_float("lineWidth", width)
    shader.uniform_float("color", colour)
    line.draw(shader)


def text_width(text: str, scale: float) -> float:
    blf.size(0, TEXT_SIZE * scale)
    return float(blf.dimensions(0, text)[0])


def write(x: float, y: float, text: str, scale: float, colour: Rgba = (1.0, 1.0, 1.0, 1.0)) -> None:
    font = 0
    blf.size(font, TEXT_SIZE * scale)
    blf.color(font, *colour)
    blf.enable(font, blf.SHADOW)
    blf.shadow(font, 3, 0.0, 0.0, 0.0, 1.0)
    blf.position(font, x, y, 0.0)
    blf.draw(font, text)
    blf.disable(font, blf.SHADOW)
