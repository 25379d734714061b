# SPDX-License-Identifier: GPL-3.0-or-later
"""The study's two tables, in Markdown: sizes of bakes that are equally wrong.

A method's size at an error lies on the line, in logarithms, between its two tolerances around that error. Bakes that a
limit of the study ended count like any other: what they are is measured, not what they were meant to be. Seconds are
the processor's, over all threads: other work on the machine changes them little.
"""

from collections.abc import Iterable, Sequence
from typing import Protocol

from tests.study.statistics_of_error import at_error

METHODS = ("UNIFORM", "AS", "DM", "ADM")
WANTED_ERRORS = (0.02, 0.01, 0.005)
CYCLES_ERRORS = (0.08, 0.04, 0.02, 0.01, 0.005)
NOT_REACHED, NOT_BAKED = "not reached", "–"


class Measured(Protocol):
    """What the tables need to know of one bake."""

    @property
    def scene(self) -> str: ...
    @property
    def method(self) -> str: ...
    @property
    def vertices(self) -> int: ...
    @property
    def triangles(self) -> int: ...
    @property
    def cpu_s(self) -> float: ...
    @property
    def error(self) -> float: ...


class Curve:
    """The bakes of one scene by one method, from coarse to fine."""

    def __init__(self, results: Iterable[Measured], scene: str, method: str) -> None:
        own = [result for result in results if (result.scene, result.method) == (scene, method)]
        own.sort(key=lambda result: result.vertices)
        self.errors = [result.error for result in own]
        self.vertices = [float(result.vertices) for result in own]
        self.triangles = [float(result.triangles) for result in own]
        self.seconds = [result.cpu_s for result in own]

    def at(self, wanted: float, sizes: Sequence[float]) -> float | None:
        """One of the three sizes at the wanted error; None where the method did not come as far or began finer."""
        return at_error(wanted, self.errors, sizes)


def ratio(first: float | None, second: float | None) -> str:
    """First over second, when both are known."""
    return f"{first / second:.2f}" if first is not None and second is not None else NOT_BAKED


def number(curve: Curve, value: float | None, digits: int) -> str:
    """A number for a table's cell."""
    if not curve.errors:
        return NOT_BAKED
    return NOT_REACHED if value is None else f"{value:,.{digits}f}"


def equal_error_table(results: Sequence[Measured], scenes: Sequence[str]) -> list[str]:
    """Vertices and seconds of each method at the wanted errors, and ADM's share of AS and of UNIFORM."""
    methods = [method for method in METHODS if any(result.method == method for result in results)]
    heads = ["scene", "error", *(f"{m} {what}" for m in methods for what in ("vertices", "s"))]
    heads += [f"ADM/{m} {what}" for m in ("AS", "UNIFORM") for what in ("vertices", "s")]
    lines = [f"| {' | '.join(heads)} |", f"| {' | '.join('---' for _ in heads)} |"]
    for scene in scenes:
        for wanted in WANTED_ERRORS:
            curves = {method: Curve(results, scene, method) for method in METHODS}
            at = {m: (curve.at(wanted, curve.vertices), curve.at(wanted, curve.seconds)) for m, curve in curves.items()}
            cells = [scene, f"{100 * wanted:g} %"]
            cells += [number(curves[m], at[m][what], digits) for m in methods for what, digits in enumerate((0, 2))]
            cells += [ratio(at["ADM"][what], at[other][what]) for other in ("AS", "UNIFORM") for what in (0, 1)]
            lines.append(f"| {' | '.join(cells)} |")
    return lines


def cycles_table(results: Sequence[Measured], scenes: Sequence[str]) -> list[str]:
    """ADM against Cycles' vertex bake at whatever subdivision and samples are the cheapest for an error."""
    lines = [
        "| scene | error | Cycles vertices | Cycles s | ADM vertices | ADM s | ADM/Cycles vertices | ADM/Cycles s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for scene in scenes:
        methods = sorted({r.method for r in results if r.scene == scene and r.method.startswith("CYCLES")})
        curves = [Curve(results, scene, method) for method in methods]
        adm = Curve(results, scene, "ADM")
        for wanted in CYCLES_ERRORS if curves else ():
            vertices = [n for n in (curve.at(wanted, curve.vertices) for curve in curves) if n is not None]
            seconds = [s for s in (curve.at(wanted, curve.seconds) for curve in curves) if s is not None]
            best = (min(vertices, default=None), min(seconds, default=None))
            own = (adm.at(wanted, adm.vertices), adm.at(wanted, adm.seconds))
            cells = [scene, f"{100 * wanted:g} %"]
            for count, time in (best, own):
                cells += [
                    NOT_REACHED if count is None else f"{count:,.0f}",
                    NOT_REACHED if time is None else f"{time:.2f}",
                ]
            cells += [ratio(own[0], best[0]), ratio(own[1], best[1])]
            lines.append(f"| {' | '.join(cells)} |")
    return lines if len(lines) > 2 else []


def paper_table(results: Sequence[Measured], scenes: Sequence[str]) -> list[str]:
    """Elements (triangles) and seconds of AS and ADM where both look the same: at the finest error both come to."""
    lines = [
        "| scene | error | AS elements | AS s | ADM elements | ADM s | ADM/AS elements | ADM/AS s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for scene in scenes:
        curves = [Curve(results, scene, method) for method in ("AS", "ADM")]
        reached = [min(curve.errors) for curve in curves if curve.errors]
        if not reached:
            continue
        # A hair above, so that the coarser of the two is not lost to rounding.
        wanted = max(reached) * (1.0 + 1e-9)
        elements = [curve.at(wanted, curve.triangles) for curve in curves]
        seconds = [curve.at(wanted, curve.seconds) for curve in curves]
        cells = [scene, f"{100 * wanted:.2f} %"]
        for curve, count, time in zip(curves, elements, seconds, strict=True):
            cells += [number(curve, count, 0), number(curve, time, 2)]
        cells += [ratio(elements[1], elements[0]), ratio(seconds[1], seconds[0])]
        lines.append(f"| {' | '.join(cells)} |")
    return lines if len(lines) > 2 else []
