# SPDX-License-Identifier: GPL-3.0-or-later
"""The one bake that may be running while Blender goes on: a solver thread, watched by a timer.

Nothing of Blender is held between two ticks, so undo, deleting objects and closing windows are harmless; loading a file
or disabling the add-on cancels the bake and waits for its thread. Meshes are made in slices, and put into the
scene in one undo step, by an operator, once the user is in Object Mode and holds nothing in hand.
"""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..core.bake import Bake, Progress
from ..core.errors import BakeError
from ..core.live import live_triangles as live_triangles_of
from ..core.record import FloatArray
from ..core.report import error_text
from .surroundings import windows
from .view_properties import view_of

# Ten times a second is smooth for the eye and costs a fraction of a percent of one core.
_TICK_S = 0.1

# Somebody who asked for the end waits for it.
_ENDING_TICK_S = 0.01

# Between two slices of writing Blender gets its turn.
_PAUSE_S = 0.001

# Operators of Blender that hold on to objects between two events.
_HOLDING_OPERATORS = ("TRANSFORM_OT_", "OBJECT_OT_", "MESH_OT_", "VIEW3D_OT_", "OUTLINER_OT_", "SCREEN_OT_")


@dataclass(slots=True)
class Outcome:
    """How the last bake of this session ended; shown in the panel."""

    icon: str
    lines: list[str]


@dataclass(slots=True)
class _Running:
    bake: Bake
    scene_uid: int
    waiting_for: str = ""
    pieces: Iterator[None] | None = None
    """Of the meshes that are being made, once there is light."""
    prepared: bool = False
    live: LiveTriangles | None = None
    """The latest stage, for the viewport."""
    ending: bool = False
    """Whether the user asked for the end."""


LiveTriangles = tuple[FloatArray, FloatArray]
"""World positions and screen colours of corners, three to a triangle."""

_running: _Running | None = None
_given_up: list[Bake] = []
"""Cancelled bakes whose solvers have not noticed yet, which takes them up to some tenths of a second."""

last_outcome: Outcome | None = None
last_report: dict[str, Any] | None = None


def is_running() -> bool:
    return _running is not None


def progress() -> Progress | None:
    """The latest snapshot of the running bake."""
    return None if _running is None else _running.bake.job.progress()


def elapsed_s() -> float:
    """Seconds since the running bake's solver started."""
    return 0.0 if _running is None else _running.bake.elapsed_s


def is_ending() -> bool:
    """Whether the user asked for the end."""
    return _running is not None and _running.ending


def waiting_for() -> str:
    """What a finished bake waits for before it is written; empty when nothing."""
    return "" if _running is None else _running.waiting_for


def live_triangles(scene: bpy.types.Scene) -> LiveTriangles | None:
    """The latest stage of a bake of this scene that is running."""
    return _running.live if _running is not None and _running.scene_uid == scene.session_uid else None


def start(bake: Bake, scene: bpy.types.Scene) -> None:
    """Begin the bake and watch it from now on; raises BakeError."""
    global _running
    bake.begin()
    _running = _Running(bake, scene.session_uid)
    # That of a bake that was just given up may still be there.
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=_TICK_S)
    redraw()


def request_cancel() -> None:
    """Give the running bake up: from now on none is running, and its solver ends on its own as soon as it notices."""
    if _running is None:
        return
    bake = take()
    bake.job.cancel()
    _given_up.append(bake)
    if not bpy.app.timers.is_registered(_bury):
        bpy.app.timers.register(_bury, first_interval=_TICK_S)
    note_outcome("INFO", ["Cancelled; nothing was changed"])


def request_stop() -> None:
    """Ask the running bake to finish with what it has."""
    if _running is not None:
        _running.bake.job.stop()
        _look_soon(_running)


def _look_soon(running: _Running) -> None:
    running.ending = True
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
        bpy.app.timers.register(_tick, first_interval=_ENDING_TICK_S)


def take() -> Bake:
    """The bake that is done; from now on none is running."""
    global _running
    if _running is None:
        raise BakeError("no bake is running")
    bake, _running = _running.bake, None
    _redraw_viewports()
    return bake


def abandon() -> None:
    """Cancel the running bake, if any, and wait for its thread and for those that were given up."""
    global _running
    if _running is not None:
        _given_up.append(_running.bake)
        _running = None
    while _given_up:
        _given_up.pop().abandon()


def note_outcome(icon: str, lines: list[str]) -> None:
    """Remember how a bake ended, for the panel."""
    global last_outcome
    last_outcome = Outcome(icon, lines)
    redraw()


def outcome_of(report: dict[str, Any]) -> tuple[str, list[str]]:
    """Icon and lines for a finished bake."""
    result, timings, warnings = report["result"], report["timings"], report["warnings"]
    seconds = timings["read_s"] + timings["solve_s"] + timings["write_s"]
    error = error_text(report)
    lines = [f"{result['triangles']:,} triangles in {seconds:.1f} s", *([error] if error else []), *warnings]
    return ("ERROR" if warnings else "CHECKMARK"), lines


def redraw() -> None:
    """Let the panel and the status bar draw anew."""
    for window in windows():
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()
        # The status bar belongs to no screen; this is what makes it draw.
        window.workspace.status_text_set(None)


def _tick() -> float | None:
    """Timer: seconds until the next call, or None to end. An exception would end the timer without a trace."""
    if _running is None:
        return None
    try:
        if not _running.bake.job.done():
            _look_at_stage(_running)
            redraw()
            return _ENDING_TICK_S if _running.ending else _TICK_S
        if not _prepare_slice(_running):
            return _PAUSE_S
        if not _try_to_finish(_running):
            redraw()
            return _TICK_S
    except Exception:  # noqa: BLE001
        traceback.print_exc()
        abandon()
        note_outcome("CANCEL", ["The bake failed; the system console has the details"])
    return None


def _look_at_stage(running: _Running) -> None:
    """Take the latest stage for the viewports that show it."""
    scene = next((scene for scene in bpy.data.scenes if scene.session_uid == running.scene_uid), None)
    if scene is None or not view_of(scene).live_preview:
        return
    meshes = running.bake.job.preview()
    if meshes is None:
        return
    running.live = live_triangles_of(meshes, running.bake.scene)
    _redraw_viewports()


def _redraw_viewports() -> None:
    for window in windows():
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def _prepare_slice(running: _Running) -> bool:
    """Make meshes for a moment; returns whether all are made. In no scene yet, they need not wait for the user."""
    if running.prepared:
        return True
    if running.pieces is None:
        running.pieces = running.bake.prepare()
    try:
        running.prepared = next(running.pieces, running) is running
    except BakeError:
        # The operator will meet it again, and say so.
        running.prepared = True
    return running.prepared


def _bury() -> float | None:
    """Timer: take leave of the bakes that were given up and have ended."""
    for bake in [bake for bake in _given_up if bake.job.done()]:
        _given_up.remove(bake)
        bake.abandon()
    return _TICK_S if _given_up else None


def _try_to_finish(running: _Running) -> bool:
    """Write the result unless the user has to end something first."""
    if all(scene.session_uid != running.scene_uid for scene in bpy.data.scenes):
        abandon()
        note_outcome("CANCEL", ["The scene was deleted while its light was computed"])
        return True
    showing = [w for w in windows() if w.scene.session_uid == running.scene_uid]
    if not showing:
        running.waiting_for = "Light is ready: switch back to its scene"
        return False
    with bpy.context.temp_override(window=showing[0]):
        running.waiting_for = _obstacle()
        if running.waiting_for:
            return False
        try:
            # True asks for an undo step, which a call from a timer would not get.
            bpy.ops.antumbra.finish_bake("EXEC_DEFAULT", True)  # type: ignore[attr-defined]
        except RuntimeError as error:
            # What the operator reported; it wrote the panel's lines already.
            _show_popup(str(error).removeprefix("Error: ").strip())
    return True


def _show_popup(message: str) -> None:
    def draw(menu: Any, _context: bpy.types.Context) -> None:
        menu.layout.label(text=message)

    manager: Any = bpy.context.window_manager
    manager.popup_menu(draw, title="Bake Radiosity", icon="ERROR")


def _obstacle() -> str:
    """What keeps the result from being written now."""
    if bpy.context.mode != "OBJECT":
        return "Light is ready: switch to Object Mode"
    if bpy.app.is_job_running("RENDER") or bpy.app.is_job_running("OBJECT_BAKE"):
        return "Light is ready: waiting for the render"
    for window in windows():
        if any(operator.bl_idname.startswith(_HOLDING_OPERATORS) for operator in window.modal_operators):
            return "Light is ready: finish the current action"
    return ""


@persistent  # type: ignore[untyped-decorator]
def _before_load(*_args: object) -> None:
    abandon()


def register() -> None:
    bpy.app.handlers.load_pre.append(_before_load)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_before_load)
    for timer in (_tick, _bury):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    abandon()
