# SPDX-License-Identifier: GPL-3.0-or-later
"""The one bake that may be running while Blender goes on: read by a timer, then a solver thread that the timer watches.

The scene is read in slices, which undo, redo and saving put off. While the solver works nothing of Blender is held
between two ticks, and undo, deleting objects and closing windows are harmless; loading a file or disabling the add-on
cancels the bake and waits for its thread. Meshes are made in slices, put off likewise, and put into the scene in one
undo step, by an operator, once the user is in Object Mode and holds nothing in hand.
"""

from __future__ import annotations

import gc
import traceback
from dataclasses import dataclass, field

import bpy
from bpy.app.handlers import persistent

from ..core.bake import Bake, Progress
from ..core.errors import BakeError
from ..core.live import LivePiece, live_pieces
from ..core.pieces import Pieces, for_a_moment
from ..core.report import sentence
from .outcome import note_outcome, show_popup
from .redraw import redraw, redraw_viewports
from .slow_reading import PAUSE_S, SLICE_S, Slices, SlowReading
from .surroundings import windows
from .view_properties import view_of

# Ten times a second is smooth for the eye and costs a fraction of a percent of one core.
_TICK_S = 0.1

# Somebody who asked for the end waits for it.
_ENDING_TICK_S = 0.01

# Operators of Blender that hold on to objects between two events.
_HOLDING_OPERATORS = ("TRANSFORM_OT_", "OBJECT_OT_", "MESH_OT_", "VIEW3D_OT_", "OUTLINER_OT_", "SCREEN_OT_")


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
    reading: SlowReading
    waiting_for: str = ""
    pieces: Pieces[None] | None = None
    """Of the meshes that are being made, once there is light."""
    slices: Slices = field(default_factory=Slices)
    prepared: bool = False
    stage: Pieces[list[LivePiece]] | None = None
    """Of the bake, on its way to the viewport."""
    live: list[LivePiece] | None = None
    """The latest stage, for the viewport."""
    ending: bool = False
    """Whether the user asked for the end."""

    @property
    def is_read(self) -> bool:
        return self.reading.is_over


_running: _Running | None = None
_given_up: list[Bake] = []
"""Cancelled bakes whose solvers have not noticed yet, which takes them up to some tenths of a second."""


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
    running = _Running(bake, scene.session_uid, SlowReading(bake))
    if bpy.app.background:
        running.reading.all_at_once()
    else:
        running.reading.first_piece()
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
    gc.unfreeze()
    _put_off(running)
    redraw_viewports()
    return running


def abandon() -> None:
    """Cancel the running bake, if any, and wait for its thread and for those that were given up."""
    if _running is not None:
        _given_up.append(_release(_running).bake)
    while _given_up:
        _given_up.pop().abandon()


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
            return PAUSE_S
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
            running.reading.slice()
            # A collection would look through all that was read, and keep the window waiting for 60 ms in a large scene.
            gc.freeze()
        except BakeError as error:
            _refuse(sentence(str(error)))
            return None
    if not running.is_read:
        return PAUSE_S
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
    show_popup(message)


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
    running.reading.put_off()
    if running.pieces is not None:
        running.pieces.close()
    running.pieces = None


def _watch(running: _Running) -> float:
    """Show how far the solver is."""
    if _bring_stage(running):
        return PAUSE_S
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
    if not for_a_moment(running.stage, SLICE_S):
        return True
    running.stage = None
    redraw_viewports()
    return False


def _taken_up(running: _Running, pieces: Pieces[list[LivePiece]]) -> Pieces[list[LivePiece]]:
    running.live = yield from pieces
    return running.live


def _prepare_slice(running: _Running) -> bool:
    """Make meshes for a moment; returns whether all are made. In no scene yet, they need not wait for the user."""
    if running.prepared:
        return True
    if running.pieces is None:
        running.pieces = running.bake.prepare()
    try:
        running.prepared = running.slices.do_one(running.pieces)
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
            show_popup(str(error).removeprefix("Error: ").strip())
    return True


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
