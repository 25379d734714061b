# SPDX-License-Identifier: GPL-3.0-or-later
"""How costs grow with a scene: exponents, and a table. An exponent is the slope of the straight line that fits best, in
least squares, through the logarithms of a cost over those of the triangles.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

MB = 1e6


@dataclass(frozen=True)
class Grown:
    """One bake. Times in seconds, memory in bytes, errors relative to the mean light."""

    triangles: int
    objects: int
    lights: int
    baked_triangles: int
    transport: str
    ended_by: str
    read_s: float
    solve_s: float
    write_s: float
    cpu_s: float
    most_bytes: int | None
    """Of the whole process, Blender and the opened file included."""
    bake_bytes: int | None
    """Beyond what the process held before the bake."""
    error: tuple[float, float, float] | None
    """As the bake verified it, with its 95 % interval."""

    @classmethod
    def of(cls, report: dict[str, Any]) -> "Grown":
        """From what scale_bake.py wrote."""
        scene, result, timings, memory = (report[key] for key in ("scene", "result", "timings", "memory_bytes"))
        held = [memory[stage] for stage in ("read", "solve", "write") if memory[stage] is not None]
        verified = result["verification"]
        return cls(
            triangles=scene["triangles"],
            objects=scene["objects"],
            lights=scene["lights"],
            baked_triangles=result["triangles"],
            transport=result["transport"]["mode"],
            ended_by=result["ended_by"],
            read_s=timings["read_s"],
            solve_s=timings["solve_s"],
            write_s=timings["write_s"],
            cpu_s=timings["cpu_s"],
            most_bytes=memory["most"],
            bake_bytes=max(held, default=None),
            error=tuple(verified["error"]) if verified else None,
        )


def exponent(triangles: Sequence[float], cost: Sequence[float | None]) -> float | None:
    """The power of the triangles by which a cost grows; none of fewer than two that are known and not zero."""
    known = [(n, c) for n, c in zip(triangles, cost, strict=True) if c]
    if len({n for n, _ in known}) < 2:
        return None
    x, y = np.log(np.array(known)).T
    return float(np.polyfit(x, y, 1)[0])


COSTS = {
    "cpu_s": "processor time, s",
    "solve_s": "time to solve, s",
    "most_bytes": "most memory, MB",
    "bake_bytes": "memory of the bake, MB",
}


def exponents(bakes: Sequence[Grown]) -> dict[str, float | None]:
    """Per cost."""
    triangles = [bake.triangles for bake in bakes]
    return {cost: exponent(triangles, [getattr(bake, cost) for bake in bakes]) for cost in COSTS}


def table(bakes: Sequence[Grown]) -> str:
    """As Markdown, the exponents in the last line."""
    head = "| triangles | objects, lights | baked | transport | processor time | clock | read, write |"
    lines = [head + " memory, of the bake | verified error |", "|" + " --- |" * 9]
    for bake in bakes:
        memory = (
            "-"
            if bake.most_bytes is None or bake.bake_bytes is None
            else (f"{bake.most_bytes / MB:,.0f} MB, {bake.bake_bytes / MB:,.0f} MB")
        )
        error = "-" if bake.error is None else "{:.1f} % ({:.1f} to {:.1f})".format(*(100.0 * e for e in bake.error))
        ended = "" if bake.ended_by == "converged" else f" ({bake.ended_by})"
        lines.append(
            f"| {bake.triangles:,} | {bake.objects:,}, {bake.lights:,} | {bake.baked_triangles:,}{ended} | "
            f"`{bake.transport}` | {bake.cpu_s:,.0f} s | {bake.solve_s:,.0f} s | {bake.read_s:.2f} s, "
            f"{bake.write_s:.2f} s | {memory} | {error} |"
        )
    grow = {cost: "-" if power is None else f"{power:.2f}" for cost, power in exponents(bakes).items()}
    lines.append(
        f"| exponent | | | | {grow['cpu_s']} | {grow['solve_s']} | | {grow['most_bytes']}, {grow['bake_bytes']} | |"
    )
    return "\n".join(lines) + "\n"
