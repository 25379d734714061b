# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress in the status bar, with a button to keep what is there and an X to cancel."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as translated

from ..bridge import running
from ..core.bake import Progress
from ..core.report import remaining_text
from ..operators import ANTUMBRA_OT_cancel_bake, ANTUMBRA_OT_stop_bake


def _draw(header: Any, _context: bpy.types.Context) -> None:
    if running.is_running():
        row = header.layout.row(align=True)
        row.label(text="Antumbra")
        draw_progress(row, width_units=13)


def draw_progress(row: Any, width_units: float = 0.0) -> None:
    """A bar, as wide as there is room when width_units is 0, and the buttons that end the bake."""
    progress = running.progress()
    if progress is None:
        return
    waiting = running.waiting_for()
    text = _progress_text(progress)
    if waiting:
        text = translated(waiting) if width_units else translated("Waiting")
    bar = row.row()
    # What a finished bake waits for takes a whole sentence.
    bar.ui_units_x = width_units + 3 if width_units and waiting else width_units
    bar.progress(factor=progress.fraction, text=text)
    if not waiting:
        row.operator(ANTUMBRA_OT_stop_bake.bl_idname, text="", icon="CHECKMARK")
    row.operator(ANTUMBRA_OT_cancel_bake.bl_idname, text="", icon="X")


def _progress_text(progress: Progress) -> str:
    if running.is_ending():
        return translated("Ending")
    left = remaining_text(progress.fraction, running.elapsed_s(), translated)
    return f"{progress.fraction:.0%} {translated(progress.stage)}" + (f", {left}" if left else "")


def register() -> None:
    bpy.types.STATUSBAR_HT_header.append(_draw)  # type: ignore[arg-type]


def unregister() -> None:
    bpy.types.STATUSBAR_HT_header.remove(_draw)  # type: ignore[arg-type]
