# SPDX-License-Identifier: GPL-3.0-or-later
"""How the last bake of this session ended, for whoever shows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as translated

from ..core.report import error_text, sentence, told_together
from .redraw import redraw


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the panel says of it."""

    icon: str
    said: list[str]
    """In English."""
    report: dict[str, Any] | None = None
    """Of a bake that is in the scene, which says more than what was `said`."""

    @property
    def lines(self) -> list[str]:
        """In the language that the interface speaks now, but for warnings."""
        if self.report is None:
            return [translated(text) for text in self.said]
        return [sentence(line) for line in lines_of(self.report)]


last_outcome: Outcome | None = None
last_report: dict[str, Any] | None = None


def note_outcome(icon: str, said: list[str]) -> None:
    """Remember how a bake ended, for the panel."""
    _note(Outcome(icon, said))


def note_report(report: dict[str, Any]) -> None:
    """Remember a bake that is in the scene."""
    global last_report
    last_report = report
    _note(Outcome("ERROR" if report["warnings"] else "CHECKMARK", [], report))


def _note(outcome: Outcome) -> None:
    global last_outcome
    last_outcome = outcome
    redraw()


def lines_of(report: dict[str, Any]) -> list[str]:
    """What a finished bake made in which time, how far it is off, and its warnings."""
    result, timings, warnings = report["result"], report["timings"], report["warnings"]
    seconds = timings["read_s"] + timings["solve_s"] + timings["write_s"]
    error = error_text(report, translated)
    done = translated("{} triangles in {} s").format(f"{result['triangles']:,}", f"{seconds:.1f}")
    return [done, *([error] if error else []), *told_together(warnings)]


def show_popup(message: str) -> None:
    """Say it where the user looks."""

    def draw(menu: Any, _context: bpy.types.Context) -> None:
        menu.layout.label(text=message)

    manager: Any = bpy.context.window_manager
    manager.popup_menu(draw, title="Bake Radiosity", icon="ERROR")
