# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of the last bake in the browser."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy

from ..bridge import outcome
from ..core.report_page import page


class ANTUMBRA_OT_show_report(bpy.types.Operator):
    """Show how the last bake went, and how far it is off, in the web browser"""

    bl_idname = "antumbra.show_report"
    bl_label = "Show Report"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        if outcome.last_report is None:
            cls.poll_message_set("Nothing was baked since Blender was started")
            return False
        return True

    def execute(self, _context: bpy.types.Context) -> set[Any]:
        if outcome.last_report is None:
            return {"CANCELLED"}
        # Of this Blender alone, and removed with all that it leaves there
        path = Path(bpy.app.tempdir or tempfile.gettempdir(), "antumbra-report.html")
        try:
            path.write_text(page(outcome.last_report), encoding="utf-8")
        except OSError as error:
            self.report({"ERROR"}, f"The report could not be written: {error}")
            return {"CANCELLED"}
        bpy.ops.wm.url_open(url=path.as_uri())
        return {"FINISHED"}
