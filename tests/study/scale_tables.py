# SPDX-License-Identifier: GPL-3.0-or-later
"""How bakes grow with their scenes: a table, exponents and a plot.

python scale_tables.py FOLDER

FOLDER holds `bakes/*.json` of scale_bake.py. It gets `table.md`, `scale.json` and `scale.png`. An exponent is the slope
of the straight line that fits best, in least squares, through the logarithms of a cost over those of the triangles.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot

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


def plot(bakes: Sequence[Grown], path: Path) -> None:
    """Each cost over the triangles, with the line that fits."""
    figure, axes = pyplot.subplots(1, 2, figsize=(10.0, 4.2), layout="constrained")
    panels = (("cpu_s", "solve_s"), ("most_bytes", "bake_bytes"))
    for axis, costs, label in zip(axes, panels, ("s", "MB"), strict=True):
        for cost, colour in zip(costs, ("#1b9e77", "#d95f02"), strict=True):
            known = [(bake.triangles, getattr(bake, cost)) for bake in bakes if getattr(bake, cost)]
            power = exponent(*zip(*known, strict=True)) if known else None
            if power is None:
                continue
            x, y = np.array(known, dtype=float).T
            y = y / MB if label == "MB" else y
            fit = np.exp(np.log(y).mean() + power * (np.log(x) - np.log(x).mean()))
            axis.loglog(x, fit, color=colour, linewidth=0.8)
            axis.loglog(x, y, "o", color=colour, label=f"{COSTS[cost].rpartition(',')[0]}: exponent {power:.2f}")
        axis.set_xlabel("triangles")
        axis.set_ylabel(label)
        axis.grid(visible=True, which="both", color="#e5e5e5", linewidth=0.6)
        axis.set_axisbelow(True)
        axis.legend()
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


def main() -> None:
    folder = Path(sys.argv[1])
    reports = [json.loads(path.read_text(encoding="utf-8")) for path in folder.glob("bakes/*.json")]
    bakes = sorted((Grown.of(report) for report in reports), key=lambda bake: bake.triangles)
    if not bakes:
        sys.exit(f"there are no bakes in {folder}")
    text = table(bakes)
    (folder / "table.md").write_text(text, encoding="utf-8")
    measured = {"bakes": [asdict(bake) for bake in bakes], "exponents": exponents(bakes)}
    (folder / "scale.json").write_text(json.dumps(measured, indent=1) + "\n", encoding="utf-8")
    plot(bakes, folder / "scale.png")
    print(text)
    print(f"table.md, scale.json and scale.png are in {folder}")


if __name__ == "__main__":
    main()
