# SPDX-License-Identifier: GPL-3.0-or-later
"""REPORT.json, format version 1: settings, scene, timings, timeline, result and warnings of one bake."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .record import name_list
from .settings import Settings

REPORT_VERSION = 1


@dataclass(frozen=True, slots=True)
class Timings:
    """Seconds; cpu_s sums over all threads of the process."""

    read_s: float
    solve_s: float
    write_s: float
    cpu_s: float


Translated = Callable[[str], str]
"""What a text is in the user's language, by what it is in English."""


def verified_error(report: dict[str, Any], translated: Translated = str) -> str | None:
    """The error of a bake in words, where it was verified, as in: verified error 0.9 % (0.7 to 1.1)."""
    verification = report["result"]["verification"]
    if verification is None:
        return None
    # No more places than the interval's end is worth
    most = verification["error"][2]
    places = 0 if most >= 0.1 else 1 if most >= 0.002 else 2
    error, low, high = (f"{100.0 * share:.{places}f}" for share in verification["error"])
    if not float(error):
        return translated("verified error below {} %").format(high)
    return translated("verified error {} % ({} to {})").format(error, low, high)


def error_text(report: dict[str, Any], translated: Translated = str) -> str | None:
    """The verified error with the solver's own estimate beside it, as far as there are such; for people."""
    verified, estimated = verified_error(report, translated), report["result"]["estimated_error"]
    if estimated is None:
        return verified
    estimate = f"{100.0 * estimated:.2g}"
    if verified:
        return translated("{}, estimated {} %").format(verified, estimate)
    return translated("estimated error {} %").format(estimate)


def assemble(settings: Settings, solver_report: str, timings: Timings, warnings: list[str]) -> dict[str, Any]:
    """Join what the solver reports (JSON) with what was measured and noticed around it."""
    solver = json.loads(solver_report)
    return {
        "version": REPORT_VERSION,
        "settings": settings.as_dict(),
        "scene": solver["scene"],
        "timings": {
            **solver.get("timings", {}),
            "read_s": timings.read_s,
            "solve_s": timings.solve_s,
            "write_s": timings.write_s,
            "cpu_s": timings.cpu_s,
        },
        "memory": solver["memory"],
        "timeline": solver["timeline"],
        "result": solver["result"],
        "warnings": warnings + list(solver["warnings"]),
    }


# A share of the work from which the rest can be told, and the time that takes; before, it is a guess about nothing.
_KNOWN_SHARE, _KNOWN_S = 0.05, 2.0


def remaining_text(fraction: float, elapsed_s: float, translated: Translated = str) -> str:
    """How long the rest takes if it goes on like this, for people; empty while that cannot be told."""
    if fraction < _KNOWN_SHARE or elapsed_s < _KNOWN_S or fraction >= 1.0:
        return ""
    seconds = elapsed_s * (1.0 - fraction) / fraction
    if seconds < 90.0:
        return translated("{} s left").format(max(5 * round(seconds / 5.0), 5))
    return translated("{} min left").format(round(seconds / 60.0))


_OF_ONE = re.compile("(?P<before>[^“]*)“(?P<name>[^”]*)”(?P<after>[^“]*)")


def told_together(warnings: list[str]) -> list[str]:
    """For people: what is said of several things, each in a sentence of its own, is said once, with their names."""
    names: dict[tuple[str, str], list[str]] = {}
    for warning in warnings:
        found = _OF_ONE.fullmatch(warning)
        if found is None:
            names[warning, ""] = []
        else:
            names.setdefault((found["before"], found["after"]), []).append(found["name"])
    told = []
    for (before, after), named in names.items():
        others = f"; the same goes for {name_list(named[1:])}" if len(named) > 1 else ""
        told.append(f"{before}“{named[0]}”{after}{others}" if named else before)
    return told


def sentence(text: str) -> str:
    """A message as a sentence stands: with a capital first."""
    return text[:1].upper() + text[1:]
