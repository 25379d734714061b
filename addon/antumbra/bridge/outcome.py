# SPDX-License-Identifier: GPL-3.0-or-later
"""How the last bake of this session ended, for whoever shows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ..core.report import error_text
from .redraw import redraw


@dataclass(slots=True)
class Outcome:
    """What the panel says of it."""

    icon: str
    lines: list[str]


last_outcome: Outcome | None = None
last_report: dict[str, Any] | None = None


def note_outcome(icon: str, lines: list[str]) -> None:
    """Remember how a bake ended, for the panel."""
    global last_outcome
    last_outcome = Outcome(icon, lines)
    redraw()


def note_report(report: dict[str, Any]) -> None:
    """Remember the report of a bake that is in the scene."""
    global last_report
    last_report = report


def outcome_of(report: dict[str, Any]) -> tuple[str, list[str]]:
    """Icon and lines for a finished bake."""
    result, timings, warnings = report["result"], report["timings"], report["warnings"]
    seconds = timings["read_s"] + timings["solve_s"] + timings["write_s"]
    error = error_text(report)
    lines = [f"{result['triangles']:,} triangles in {seconds:.1f} s", *([error] if error else []), *warnings]
    return ("ERROR" if warnings else "CHECKMARK"), lines


def show_popup(message: str) -> None:
    """Say it where the user looks."""

    def draw(menu: Any, _context: bpy.types.Context) -> None:
        menu.layout.label(text=message)

    manager: Any = bpy.context.window_manager
    manager.popup_menu(draw, title="Bake Radiosity", icon="ERROR")
