# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of a bake against the time that it took, from the timeline of its report."""

from __future__ import annotations

from typing import Any

from .plots import Axis, Line

TIME = Axis("seconds", lambda x: f"{x:g}")
ERROR = Axis("error, share of the mean light", lambda y: f"{100.0 * y:g} %")

VERIFIED, ESTIMATED = "verified error", "the solver's own estimate"


def error_lines(timeline: list[dict[str, Any]]) -> list[Line]:
    """The verified error with its 95 % interval, and the solver's own estimate; each where there is any."""
    lines = []
    told = [step for step in timeline if step["error"] is not None]
    if told:
        errors = [step["error"] for step in told]
        band = [(low, high) for _, low, high in errors]
        lines.append(Line(VERIFIED, [step["time_s"] for step in told], [error for error, _, _ in errors], band))
    guessed = [step for step in timeline if step["estimated"] is not None]
    if guessed:
        lines.append(Line(ESTIMATED, [step["time_s"] for step in guessed], [step["estimated"] for step in guessed]))
    return lines
