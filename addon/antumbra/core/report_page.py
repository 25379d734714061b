# SPDX-License-Identifier: GPL-3.0-or-later
"""A report for people: one HTML page that needs nothing else, and its course as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from html import escape
from typing import Any

from .error_curve import ERROR, TIME, error_lines
from .plots import Axis, Line, Mark, plot, scatter
from .report import error_text

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
table { border-collapse: collapse; } td, th { padding: .2em 1em .2em 0; text-align: left; vertical-align: top; }
figure { display: inline-block; vertical-align: top; margin: 0 1em 1em 0; width: 28em; max-width: 100%; }
svg { width: 100%; } svg text { font-size: 12px; fill: #444; } .grid { stroke: #ddd; fill: none; }
figcaption { font-size: .9em; color: #555; } .short { white-space: nowrap; }
"""

_ENDINGS = {
    "converged": "nothing worth doing was left",
    "time_limit": "the time was up",
    "stopped": "it was stopped",
    "triangle_budget": "the mesh reached Max Triangles",
    "refinement_limit": "the mesh reached the automatic limit",
}


_ERRORS = ("error", "error_low", "error_high", "estimated")


def curve_csv(report: dict[str, Any]) -> str:
    """The course of a bake: a line for each iteration, its error empty where it was not told."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_s", "shots", "elements", "vertices", "unshot", *_ERRORS])
    for step in report["timeline"]:
        counts = [step[name] for name in ("time_s", "shots", "elements", "vertices", "unshot")]
        estimated = "" if step["estimated"] is None else step["estimated"]
        writer.writerow([*counts, *(step["error"] or ["", "", ""]), estimated])
    return text.getvalue()


def page(report: dict[str, Any]) -> str:
    """The page as HTML; `report` is that of REPORT.json."""
    title = "Antumbra: report of a bake"
    sections = [
        f"<h1>{title}</h1>",
        _table(_outcome(report)),
        "<h2>How it went</h2>",
        *_plots(report["timeline"]),
        "<h2>What was left out</h2>",
        _left_out(report["result"]),
        "<h2>Error</h2>",
        _table(_error(report)),
        *_places(report),
        *_warnings(report["warnings"]),
        "<h2>Settings</h2>",
        _table((name, str(value)) for name, value in report["settings"].items()),
    ]
    head = f'<meta charset="utf-8"><title>{title}</title><style>{_STYLE}</style>'
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>\n' + "\n".join(sections) + "\n</body></html>\n"


def _outcome(report: dict[str, Any]) -> Iterable[tuple[str, str]]:
    scene, result, timings = report["scene"], report["result"], report["timings"]
    yield "scene", f"{scene['objects']:,} objects, {scene['triangles']:,} triangles, lights: {scene['lights']:,}"
    yield "mesh", f"{result['triangles']:,} triangles, {result['vertices']:,} vertices"
    yield "error", error_text(report) or "not verified"
    yield "ended because", _ENDINGS.get(result["ended_by"], result["ended_by"])
    spent = ", ".join(f"{timings[f'{part}_s']:.2f} s to {part}" for part in ("read", "solve", "write"))
    yield "time", f"{spent}; {timings['cpu_s']:.2f} s of processor time"
    peak = report["memory"]["peak_bytes"]
    if peak is not None:
        yield "memory", f"{peak / 1e6:,.0f} MB at most, to solve"


def _plots(timeline: list[dict[str, Any]]) -> Iterable[str]:
    errors = error_lines(timeline)
    if errors:
        yield _figure(
            plot(errors, TIME, ERROR),
            "Error of what was there, with its 95 % interval where it was verified, against time",
        )
    times = [step["time_s"] for step in timeline]
    counts = [Line(name, times, [float(step[name]) for step in timeline]) for name in ("elements", "vertices")]
    yield _figure(plot(counts, TIME, Axis("count", lambda y: f"{y:,.0f}")), "Size of the mesh against time")
    unshot = Line("unshot light", times, [step["unshot"] for step in timeline])
    drawing = plot([unshot], TIME, Axis("share of all light", lambda y: f"{100.0 * y:g} %"))
    yield _figure(drawing, "Share of all light that had not arrived yet, against time")


def _left_out(result: dict[str, Any]) -> str:
    skips = result.get("plan", [])
    if not skips:
        return "<p>Nothing: the scene needed everything.</p>"
    rows = "".join(
        f"<tr><td>{escape(skip['what'])}</td><td>{escape(skip['reason'])}</td>"
        f'<td class="short">{escape(_kind(skip))}</td>'
        f"<td>{escape(skip['saved'])}</td></tr>"
        for skip in skips
    )
    return f"<table><tr><th>left out</th><th>because</th><th>result</th><th>saved</th></tr>{rows}</table>"


def _kind(skip: dict[str, Any]) -> str:
    """What leaving something out does to the result."""
    return "the same" if skip["kind"] == "exact" else f"off by at most {skip['bound']:.2g} tolerances more"


def _error(report: dict[str, Any]) -> Iterable[tuple[str, str]]:
    verification = report["result"]["verification"]
    if verification is None:
        yield "not verified", "it was switched off, or there was no light to be relative to"
        return

    def interval(values: list[float]) -> str:
        value, low, high = (100.0 * share for share in values)
        return f"{value:.2f} % ({low:.2f} to {high:.2f})"

    yield "rms error, 95 % interval", interval(verification["error"])
    estimated = report["result"]["estimated_error"]
    if estimated is not None:
        yield "rms error as the solver estimates it, of its elements alone", f"{100.0 * estimated:.2g} %"
    yield "mean error", interval(verification["bias"])
    yield "99 of 100 points err less than", f"{100.0 * verification['p99']:.2f} %, noise included"
    yield "arriving power too high by", f"{100.0 * verification['energy_defect']:.2f} %"
    yield "noise of the estimates", f"{100.0 * verification['noise']:.2f} %"
    solve_s = report["timings"]["solve_s"]
    share = 100.0 * verification["time_s"] / solve_s if solve_s > 0.0 else 0.0
    yield (
        "verified at",
        f"{verification['points']:,} points by 2 × {verification['paths']:,} paths each: "
        f"{verification['rays']:,} rays, {verification['time_s']:.2f} s, {share:.0f} % of the time to solve",
    )


_AXES = ("x", "y", "z")


def _places(report: dict[str, Any]) -> Iterable[str]:
    """Where the error sits: the verified points from three sides."""
    verification = report["result"]["verification"]
    if verification is None:
        return
    largest = 100.0 * max(abs(error) for *_, error in verification["places"])
    yield "<h2>Where the error sits</h2>"
    yield (
        "<p>Each dot is a point that was verified, as large as what is shown there differs from the light: orange too "
        f"bright, blue too dark. The largest is {largest:.2g} % of the mean. The noise of the "
        "estimates is in it.</p>"
    )
    for title, across, up in (("from above", 0, 1), ("from the front", 0, 2), ("from the right", 1, 2)):
        marks = [Mark(place[across], place[up], place[3]) for place in verification["places"]]
        yield _figure(scatter(marks, f"{_AXES[across]}, m", f"{_AXES[up]}, m"), f"The error {title}")


def _warnings(warnings: list[str]) -> Iterable[str]:
    if warnings:
        yield "<h2>Warnings</h2>"
        yield "<ul>" + "".join(f"<li>{escape(warning)}</li>" for warning in warnings) + "</ul>"


def _table(rows: Iterable[tuple[str, str]]) -> str:
    return "<table>" + "".join(f"<tr><th>{escape(k)}</th><td>{escape(v)}</td></tr>" for k, v in rows) + "</table>"


def _figure(drawing: str, caption: str) -> str:
    return f"<figure>{drawing}<figcaption>{escape(caption)}</figcaption></figure>"
