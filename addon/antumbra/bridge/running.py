# SPDX-License-Identifier: GPL-3.0-or-later
"""The one bake that may be running while Blender goes on: a solver thread, watched by a timer.

Nothing of Blender is held between two ticks, so undo, deleting objects and closing windows are harmless; loading a file
or disabling the add-on cancels the bake and waits for its thread. The result is written in one undo step, by an
operator, once the user is in Object Mode and holds nothing in hand.
"""

from __future__ import annotations

import traceback
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..core.bake import Bake, Progress
from ..core.errors import BakeError
from ..core.report import verified_error
from .surroundings import windows

# Ten times a second is smooth for the eye and costs a fraction of a percent of one core.
_TICK_S = 0.1

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


_running: _Running | None = None
last_outcome: Outcome | None = None
last_report: dict[str, Any] | None = None


def is_running() -> bool:
    return _running is not None


def progress() -> Progress | None:
    """The latest snapshot of the running bake."""
    return None if _running is None else _running.bake.job.progress()


def waiting_for() -> str:
    """What a finished bake waits for before it is written; empty when nothing."""
    return "" if _running is None else _running.waiting_for


def start(bake: Bake, scene: bpy.types.Scene) -> None:
    """Begin the bake and watch it from now on; raises BakeError."""
    global _running
    bake.begin()
    _running = _Running(bake, scene.session_uid)
    bpy.app.timers.register(_tick, first_interval=_TICK_S)
    redraw()


def request_cancel() -> None:
    """Ask the running bake to give up."""
    if _running is not None:
        _running.bake.job.cancel()


def request_stop() -> None:
    """Ask the running bake to finish with what it has."""
    if _running is not None:
        _running.bake.job.stop()


def take() -> Bake:
    """The bake that is done; from now on none is running."""
    global _running
    if _running is None:
        raise BakeError("no bake is running")
    bake, _running = _running.bake, None
    return bake


def abandon() -> None:
    """Cancel the running bake, if any, and wait for its thread."""
    global _running
    if _running is not None:
        bake, _running = _running.bake, None
        bake.abandon()


def note_outcome(icon: str, lines: list[str]) -> None:
    """Remember how a bake ended, for the panel."""
    global last_outcome
    last_outcome = Outcome(icon, lines)
    redraw()


def outcome_of(report: dict[str, Any]) -> tuple[str, list[str]]:
    """Icon and lines for a finished bake."""
    result, timings, warnings = report["result"], report["timings"], report["warnings"]
    seconds = timings["read_s"] + timings["solve_s"] + timings["write_s"]
    error = verified_error(report)
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
        if not _running.bake.job.done() or not _try_to_finish(_running):
            redraw()
            return _TICK_S
    except Exception:  # noqa: BLE001
        traceback.print_exc()
        abandon()
        note_outcome("CANCEL", ["The bake failed; the system console has the details"])
    return None


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
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    abandon()
