# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn over the 3D viewport: a running bake's light, lines of baked meshes, the false colours' legend.

All of it is drawn and nothing is stored, so undo and saved files know nothing of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import gpu
import numpy as np
from bpy.app.translations import pgettext_iface as translated
from mathutils import Matrix
from numpy.typing import NDArray

from ..bridge import running
from ..bridge.properties import state_of
from ..bridge.redraw import redraw_viewports
from ..bridge.view import range_of
from ..bridge.view_properties import view_of
from ..core.carry import LINE
from ..core.colours import srgb_encoded
from ..core.view import false_colours, legend
from .drawing import TEXT_SIZE, batch, draw_box, write

KINDS = (
    ("Elements", (0.55, 0.55, 0.55, 0.6)),
    ("Penumbra", (1.0, 0.85, 0.1, 1.0)),
    ("Sharp shadow", (1.0, 0.35, 0.05, 1.0)),
    ("Contact", (0.1, 0.85, 1.0, 1.0)),
)
"""What an edge lies on, by the numbers in the edge attribute, and its colour."""

# What is drawn lies on surfaces that are drawn already. This share of the depth nearer it wins over their rounding; ten
# times as much shows lines through thin walls.
_NEARER = 2e-5

# Of the legend, in pixels at scale 1.
_BAR_WIDTH, _BAR_HEIGHT, _MARGIN = 220, 12, 24

# Pieces of a stage that are handed to the graphics card in one drawing, with some milliseconds each.
_PIECES_A_DRAWING = 2

_handles: list[Any] = []


@dataclass(slots=True)
class _Batch:
    """Something on the graphics card, and what it was made of."""

    made_of: object
    drawn: Any


_live: list[_Batch] = []
_coming: list[_Batch] = []
"""Batches of the stage that is drawn, and of the next one, which is drawn when it has all of them."""
_lines: dict[tuple[int, str], _Batch] = {}


def _draw_in_space() -> None:
    context = bpy.context
    scene = context.scene
    space: Any = context.space_data
    if scene is None or not space.overlay.show_overlays:
        return
    # Nearer to the viewer
    projection = gpu.matrix.get_projection_matrix()
    nearer = Matrix.Identity(4)
    nearer[2][3] = -_NEARER
    gpu.matrix.push_projection()
    gpu.matrix.load_projection_matrix(nearer @ projection)
    gpu.state.depth_test_set("LESS_EQUAL")
    try:
        if view_of(scene).live_preview:
            _draw_live(scene)
        if view_of(scene).overlay != "NONE":
            _draw_lines(scene, view_of(scene).overlay)
    finally:
        gpu.state.depth_test_set("NONE")
        gpu.matrix.pop_projection()


def _draw_live(scene: bpy.types.Scene) -> None:
    global _live, _coming
    stage = running.live_stage(scene)
    if not stage:
        _live, _coming = [], []
        return
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    if not _live or _live[0].made_of is not stage[0]:
        if _coming and _coming[0].made_of is not stage[0]:
            _coming = []
        for piece in stage[len(_coming) : len(_coming) + _PIECES_A_DRAWING]:
            positions, colours = piece
            _coming.append(_Batch(piece, batch(shader, "TRIS", pos=positions, color=colours)))
        if len(_coming) == len(stage):
            _live, _coming = _coming, []
        elif not bpy.app.timers.is_registered(redraw_viewports):
            # While something is drawn nothing can be asked to be drawn again.
            bpy.app.timers.register(redraw_viewports, first_interval=0.0)
    gpu.state.depth_mask_set(True)
    for each in _live:
        each.drawn.draw(shader)
    gpu.state.depth_mask_set(False)


def _draw_lines(scene: bpy.types.Scene, overlay: str) -> None:
    shader = gpu.shader.from_builtin("POLYLINE_FLAT_COLOR")
    region: Any = bpy.context.region
    shader.uniform_float("viewportSize", (region.width, region.height))
    shader.uniform_float("lineWidth", 1.0 if overlay == "ELEMENTS" else 2.0)
    gpu.state.blend_set("ALPHA")
    seen = set()
    for obj in scene.objects:
        if state_of(obj).role not in ("BAKED", "REPLACED") or obj.mode != "OBJECT" or not obj.visible_get():
            continue
        mesh: Any = obj.data
        key = (mesh.session_uid, overlay)
        made_of = (len(mesh.vertices), len(mesh.edges))
        seen.add(key)
        known = _lines.get(key)
        if known is None or known.made_of != made_of:
            known = _lines[key] = _Batch(made_of, _batch_of_lines(shader, mesh, overlay))
        if known.drawn is not None:
            gpu.matrix.push()
            gpu.matrix.multiply_matrix(obj.matrix_world)
            known.drawn.draw(shader)
            gpu.matrix.pop()
    for key in [key for key in _lines if key not in seen]:
        del _lines[key]
    gpu.state.blend_set("NONE")


def _batch_of_lines(shader: Any, mesh: Any, overlay: str) -> Any:
    kinds: NDArray[np.int32] = np.zeros(len(mesh.edges), dtype=np.int32)
    attribute = mesh.attributes.get(LINE)
    if attribute is not None:
        attribute.data.foreach_get("value", kinds)
    ends: NDArray[np.int32] = np.empty(len(mesh.edges) * 2, dtype=np.int32)
    mesh.edges.foreach_get("vertices", ends)
    positions: NDArray[np.float32] = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.attributes["position"].data.foreach_get("vector", positions)
    # Strong lines last, over the others
    chosen = np.flatnonzero(kinds > 0) if overlay == "LINES" else np.arange(len(kinds))
    if len(chosen) == 0:
        return None
    chosen = chosen[np.argsort(kinds[chosen], kind="stable")]
    colours = np.array([colour for _, colour in KINDS], dtype=np.float32)
    return batch(
        shader,
        "LINES",
        pos=positions.reshape(-1, 3)[ends.reshape(-1, 2)[chosen].reshape(-1)],
        color=np.repeat(colours[kinds[chosen]], 2, axis=0),
    )


def _draw_legends() -> None:
    context = bpy.context
    scene = context.scene
    space: Any = context.space_data
    if scene is None or not space.overlay.show_overlays:
        return
    if not any(state_of(obj).role in ("BAKED", "REPLACED") for obj in scene.objects):
        return
    view = view_of(scene)
    preferences: Any = context.preferences
    scale = preferences.system.ui_scale
    x, y = 70 * scale, _MARGIN * scale
    if view.mode in ("FALSE_COLOURS", "ERROR"):
        end, unit = range_of(scene)
        _draw_scale(x, y, scale, end, unit)
        y += 3.5 * _BAR_HEIGHT * scale
    if view.overlay != "NONE":
        for name, colour in KINDS if view.overlay == "ELEMENTS" else KINDS[1:]:
            draw_box(x, y, 18 * scale, 2 * scale, colour)
            write(x + 26 * scale, y - 4 * scale, translated(name), scale)
            y += 1.6 * TEXT_SIZE * scale


def _draw_scale(x: float, y: float, scale: float, end: float, unit: str) -> None:
    steps = 64
    width, height = _BAR_WIDTH * scale, _BAR_HEIGHT * scale
    top = y + 1.5 * TEXT_SIZE * scale
    colours = srgb_encoded(false_colours(np.linspace(0.0, 1.0, steps), 1.0))
    for step in range(steps):
        draw_box(x + width * step / steps, top, width / steps + 1, height, (*colours[step].tolist(), 1.0))
    for place, text in legend(end, unit):
        write(x + place * width - 4 * scale, y, text, scale)


def register() -> None:
    if bpy.app.background:
        # There is nothing to draw on, and no graphics card to ask for.
        return
    space: Any = bpy.types.SpaceView3D
    _handles.append(space.draw_handler_add(_draw_in_space, (), "WINDOW", "POST_VIEW"))
    _handles.append(space.draw_handler_add(_draw_legends, (), "WINDOW", "POST_PIXEL"))


def unregister() -> None:
    space: Any = bpy.types.SpaceView3D
    while _handles:
        space.draw_handler_remove(_handles.pop(), "WINDOW")
    _live.clear()
    _coming.clear()
    _lines.clear()
