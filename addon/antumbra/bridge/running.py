# SPDX-License-Identifier: GPL-3.0-or-later
"""The one bake that may be running while Blender goes on: read by a timer, then a solver thread that the timer watches.

The scene is read in slices. While that lasts there are datablocks of ours in the file, so undo, redo and saving put it
off: these are removed first, and reading begins anew. So does it where something that is read was deleted. From then on
nothing of Blender is held between two ticks, and undo, deleting objects and closing windows are harmless; loading a
file or disabling the add-on cancels the bake and waits for its thread. Meshes are made in slices, and put into the
scene in one undo step, by an operator, once the user is in Object Mode and holds nothing in hand.
"""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..core.bake import Bake, Progress
from ..core.errors import BakeError
from ..core.live import LivePiece, live_pieces
from ..core.pieces import Pieces, at_once, for_a_moment
from ..core.report import error_text, sentence
from .surroundings import windows
from .view_properties import view_of

# Ten times a second is smooth for the eye and costs a fraction of a percent of one core.
_TICK_S = 0.1

# Somebody who asked for the end waits for it.
_ENDING_TICK_S = 0.01

# Between two slices of reading or writing Blender gets its turn.
_PAUSE_S = 0.001

# How long it waits for a slice: about a frame of a screen, so that nobody sees it stutter.
_SLICE_S = 0.015

# Most slices of reading make Blender draw its viewports anew. Where that takes longer than the slice, as without a
# graphics card, reading goes on for as long: nobody is kept waiting more than twice as long as by drawing, and the
# whole does not take ten times its time.
_LONGEST_SLICE_S = 0.1

# Somebody who deletes things all the time is told so.
_MOST_READINGS = 5

# Operators of Blender that hold on to objects between two events.
_HOLDING_OPERATORS = ("TRANSFORM_OT_", "OBJECT_OT_", "MESH_OT_", "VIEW3D_OT_", "OUTLINER_OT_", "SCREEN_OT_")


@dataclass(slots=True)
class Outcome:
    """How the last bake of this session ended; shown in the panel."""

    icon: str
    lines: list[str]


@dataclass(frozen=True, slots=True)
class _ReadingProgress:
    """What is shown while the scene is read."""

    stage: str = "reading the scene"
    fraction: float = 0.0
    shots: int = 0
    elements: int = 0
    unshot: float = 1.0


@dataclass(slots=True)
class _Running:
    bake: Bake
    scene_uid: int
    reading: Pieces[None] | None = None
    """Of the scene; None when it is to begin anew."""
    is_read: bool = False
    readings: int = 0
    """How often it was begun."""
    slice_end: float = math.inf
    """When the last slice of it was over, by time.perf_counter()."""
    waiting_for: str = ""
    pieces: Generator[None, None, None] | None = None
    """Of the meshes that are being made, once there is light."""
    prepared: bool = False
    stage: Pieces[list[LivePiece]] | None = None
    """Of the bake, on its way to the viewport."""
    live: list[LivePiece] | None = None
    """The latest stage, for the viewport."""
    ending: bool = False
    """Whether the user asked for the end."""


_running: _Running | None = None
_given_up: list[Bake] = []
"""Cancelled bakes whose solvers have not noticed yet, which takes them up to some tenths of a second."""

last_outcome: Outcome | None = None
last_report: dict[str, Any] | None = None


def is_running() -> bool:
    return _running is not None


def progress() -> Progress | None:
    """The latest snapshot of the running bake."""
    if _running is None:
        return None
    return _running.bake.job.progress() if _running.is_read else _ReadingProgress()


def elapsed_s() -> float:
    """Seconds since the running bake's solver started."""
    return 0.0 if _running is None or not _running.is_read else _running.bake.elapsed_s


def is_ending() -> bool:
    """Whether the user asked for the end."""
    return _running is not None and _running.ending


def waiting_for() -> str:
    """What a finished bake waits for before it is written; empty when nothing."""
    return "" if _running is None else _running.waiting_for


def live_stage(scene: bpy.types.Scene) -> list[LivePiece] | None:
    """The latest stage of a bake of this scene that is running, a new list for each."""
    return _running.live if _running is not None and _running.scene_uid == scene.session_uid else None


def start(bake: Bake, scene: bpy.types.Scene) -> None:
    """Begin the bake and watch it from now on; raises BakeError for what is known at once."""
    global _running
    running = _Running(bake, scene.session_uid, bake.beginning(), readings=1)
    assert running.reading is not None
    if bpy.app.background:
        at_once(running.reading)
        running.is_read = True
    else:
        next(running.reading)
    _running = running
    # That of a bake that was just given up may still be there.
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=_TICK_S)
    redraw()


def request_cancel() -> None:
    """Give the running bake up: from now on none is running, and its solver ends on its own as soon as it notices."""
    if _running is None:
        return
    running = _release(_running)
    if running.is_read:
        running.bake.job.cancel()
        _given_up.append(running.bake)
        if not bpy.app.timers.is_registered(_bury):
            bpy.app.timers.register(_bury, first_interval=_TICK_S)
    note_outcome("INFO", ["Cancelled; nothing was changed"])


def request_stop() -> None:
    """Ask the running bake to finish with what it has."""
    if _running is not None:
        if _running.is_read:
            _running.bake.job.stop()
        _look_soon(_running)


def _look_soon(running: _Running) -> None:
    running.ending = True
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
        bpy.app.timers.register(_tick, first_interval=_ENDING_TICK_S)


def take() -> Bake:
    """The bake that is done; from now on none is running."""
    if _running is None:
        raise BakeError("no bake is running")
    if not _running.is_read:
        raise BakeError("the scene is still being read")
    return _release(_running).bake


def _release(running: _Running) -> _Running:
    """From now on none is running, and nothing of what it was at is in the file."""
    global _running
    _running = None
    _put_off(running)
    redraw_viewports()
    return running


def abandon() -> None:
    """Cancel the running bake, if any, and wait for its thread and for those that were given up."""
    if _running is not None:
        _given_up.append(_release(_running).bake)
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
        if not _running.is_read:
            return _read_slice(_running)
        if not _running.bake.job.done():
            return _watch(_running)
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


def _read_slice(running: _Running) -> float | None:
    """Read for a moment; then, if that was all of it, the solver is at work."""
    window = _window_of(running)
    if window is None:
        if _scene_of(running) is not None:
            return _wait(running, "Switch back to the scene to read it")
        _end_without_scene()
        return None
    with bpy.context.temp_override(window=window):
        obstacle = _obstacle()
        if obstacle:
            return _wait(running, f"To read the scene, {obstacle}")
        running.waiting_for = ""
        try:
            if running.reading is None:
                running.reading = running.bake.beginning()
                running.readings += 1
            of_blender = time.perf_counter() - running.slice_end - _PAUSE_S
            is_over = for_a_moment(running.reading, min(max(of_blender, _SLICE_S), _LONGEST_SLICE_S))
            running.slice_end = time.perf_counter()
            if not is_over:
                return _PAUSE_S
        except ReferenceError:
            _put_off(running)
            if running.readings < _MOST_READINGS:
                return _PAUSE_S
            _refuse("Things were deleted again and again while the scene was read; nothing was changed")
            return None
        except BakeError as error:
            _refuse(sentence(str(error)))
            return None
    running.reading, running.is_read = None, True
    if running.ending:
        running.bake.job.stop()
    redraw()
    return _TICK_S


def _wait(running: _Running, message: str) -> float:
    running.waiting_for = message
    redraw()
    return _TICK_S


def _refuse(message: str) -> None:
    """End a bake that cannot begin."""
    abandon()
    note_outcome("CANCEL", [message])
    _show_popup(message)


def _end_without_scene() -> None:
    abandon()
    note_outcome("CANCEL", ["The scene was deleted while its light was computed"])


def _scene_of(running: _Running) -> bpy.types.Scene | None:
    return next((scene for scene in bpy.data.scenes if scene.session_uid == running.scene_uid), None)


def _window_of(running: _Running) -> bpy.types.Window | None:
    """One that shows the scene of the bake."""
    return next((window for window in windows() if window.scene.session_uid == running.scene_uid), None)


def _put_off(running: _Running) -> None:
    """Take our datablocks out of the file; what was not finished begins anew with the next tick."""
    for pieces in (running.reading, running.pieces):
        if pieces is not None:
            pieces.close()
    running.reading = running.pieces = None


def _watch(running: _Running) -> float:
    """Show how far the solver is."""
    if _bring_stage(running):
        return _PAUSE_S
    redraw()
    return _ENDING_TICK_S if running.ending else _TICK_S


def _bring_stage(running: _Running) -> bool:
    """Bring the latest stage a bit nearer to the viewports that show it; returns whether more of it is to come."""
    if running.stage is None:
        scene = _scene_of(running)
        if scene is None or not view_of(scene).live_preview:
            return False
        meshes = running.bake.job.preview()
        if meshes is None:
            return False
        running.stage = _taken_up(running, live_pieces(meshes, running.bake.scene))
    if not for_a_moment(running.stage, _SLICE_S):
        return True
    running.stage = None
    redraw_viewports()
    return False


def _taken_up(running: _Running, pieces: Pieces[list[LivePiece]]) -> Pieces[list[LivePiece]]:
    running.live = yield from pieces
    return running.live


def redraw_viewports() -> None:
    """Let all viewports draw anew."""
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
    except ReferenceError:
        running.pieces = None
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
    if _scene_of(running) is None:
        _end_without_scene()
        return True
    window = _window_of(running)
    if window is None:
        running.waiting_for = "Light is ready: switch back to its scene"
        return False
    with bpy.context.temp_override(window=window):
        obstacle = _obstacle()
        running.waiting_for = f"Light is ready: {obstacle}" if obstacle else ""
        if obstacle:
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
    """What the user has to do before the scene can be read or changed."""
    if bpy.context.mode != "OBJECT":
        return "switch to Object Mode"
    if bpy.app.is_job_running("RENDER") or bpy.app.is_job_running("OBJECT_BAKE"):
        return "wait for the render"
    for window in windows():
        if any(operator.bl_idname.startswith(_HOLDING_OPERATORS) for operator in window.modal_operators):
            return "finish the current action"
    return ""


@persistent  # type: ignore[untyped-decorator]
def _before_load(*_args: object) -> None:
    abandon()


@persistent  # type: ignore[untyped-decorator]
def _before_file_is_kept(*_args: object) -> None:
    if _running is not None:
        _put_off(_running)


_BEFORE = {
    "load_pre": _before_load,
    "undo_pre": _before_file_is_kept,
    "redo_pre": _before_file_is_kept,
    "save_pre": _before_file_is_kept,
}


def register() -> None:
    for name, handler in _BEFORE.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in _BEFORE.items():
        getattr(bpy.app.handlers, name).remove(handler)
    for timer in (_tick, _bury):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    abandon()
