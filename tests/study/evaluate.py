# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the bakes of a study against their references, and write results, plots and tables.

python evaluate.py STUDY_FOLDER

STUDY_FOLDER holds `references/SCENE….npz`, named in `study.json`, and `bakes/SCENE/METHOD-TOLERANCE.{json,npz}`, or of
Cycles `CYCLESsamples-SIZE`, SIZE being the longest edge over the scene's diagonal. It
gets `results.csv`, `results.json`, `tables.md` and for each scene `SCENE.png`.
"""

import csv
import json
import math
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.study.lookup import Surface
from tests.study.plots import plot_scene
from tests.study.statistics_of_error import RelativeError, relative_error
from tests.study.tables import cycles_table, equal_error_table, paper_table

FOUND_WITHIN = 1e-4
"""How far a baked surface may be from a reference point, of the extent of the points: single precision moves vertices
by 1e-7 of it, and the next surface that faces the same way is a centimetre off."""


@dataclass(frozen=True)
class Result:
    """One bake: what it cost, and how far it is from the reference. Errors are relative to the mean of the light."""

    scene: str
    method: str
    tolerance: float
    vertices: int
    triangles: int
    solve_s: float
    cpu_s: float
    peak_bytes: int | None
    ended_by: str
    error: float
    error_low: float
    error_high: float
    verified: float | None
    """What the bake said itself of its error, and the interval."""
    verified_low: float | None
    verified_high: float | None
    missing: int
    """Points where nothing was baked; they count as black."""

    @property
    def reached(self) -> bool:
        """Whether the bake came to its own end, and not to a limit of the study."""
        return self.ended_by == "converged"


def measure(reference: Path, bake: Path, quantity: str) -> tuple[RelativeError, int]:
    """Error of a bake (.npz) against a reference (.npz), and the number of points without a baked surface."""
    wanted, baked = np.load(reference), np.load(bake)
    source_names = list(baked["source_names"])
    values = np.full(wanted["points"].shape, np.nan)
    within_m = FOUND_WITHIN * float(np.linalg.norm(np.ptp(wanted["points"], axis=0)))
    for index, name in enumerate(wanted["object_names"]):
        here = wanted["objects"] == index
        if name not in source_names or not here.any():
            continue
        own = baked["sources"] == source_names.index(name)
        surface = Surface(baked["corners"][own].astype(float), baked["colours"][own].astype(float))
        values[here] = math.pi * surface.at(wanted["points"][here], wanted["normals"][here], within_m)
    missing = int(np.isnan(values).any(axis=1).sum())
    name = quantity.lower()
    return relative_error(np.nan_to_num(values), wanted[name], wanted[f"{name}_stderr"]), missing


def collect(folder: Path, study: dict[str, Any]) -> tuple[list[Result], list[str]]:
    """Results of all bakes that are there, and a line for each one that is not."""
    results, left_out = [], []
    for scene in study["scenes"]:
        reports = sorted((folder / "bakes" / scene["name"]).glob("*.json"))
        for path in reports:
            method, _, tolerance = path.stem.partition("-")
            report = json.loads(path.read_text(encoding="utf-8"))
            said = report.get("refused") or report.get("failed")
            if said:
                left_out.append(f"{scene['name']}, {method} at {tolerance}: {said}")
                continue
            error, missing = measure(folder / scene["reference"], path.with_suffix(".npz"), scene["quantity"])
            result, timings = report["result"], report["timings"]
            verification = result.get("verification")
            verified, verified_low, verified_high = verification["error"] if verification else (None, None, None)
            results.append(
                Result(
                    scene=scene["name"],
                    method=method,
                    tolerance=float(tolerance),
                    vertices=result["vertices"],
                    triangles=result["triangles"],
                    solve_s=timings["solve_s"],
                    cpu_s=timings["cpu_s"],
                    peak_bytes=report.get("memory", {}).get("peak_bytes"),
                    ended_by=result["ended_by"],
                    error=error.value,
                    error_low=error.low,
                    error_high=error.high,
                    verified=verified,
                    verified_low=verified_low,
                    verified_high=verified_high,
                    missing=missing,
                )
            )
    order = {scene["name"]: number for number, scene in enumerate(study["scenes"])}
    return sorted(results, key=lambda r: (order[r.scene], r.method, -r.tolerance)), left_out


def result_lines(results: Iterable[Result]) -> list[str]:
    """A Markdown table of every bake."""
    lines = [
        "| scene | method | tolerance | vertices | solve s | CPU s | MB | error (95 %) | verified by the bake | |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for r in results:
        notes = [] if r.reached else [f"not reached ({r.ended_by.replace('_', ' ')})"]
        said = "–"
        if r.verified is not None and r.verified_low is not None and r.verified_high is not None:
            said = f"{100 * r.verified:.2f} % ({100 * r.verified_low:.2f}–{100 * r.verified_high:.2f})"
        memory = "–" if r.peak_bytes is None else f"{r.peak_bytes / 1e6:.0f}"
        notes += [f"{r.missing} points not found"] if r.missing else []
        lines.append(
            f"| {r.scene} | {r.method} | {r.tolerance:g} | {r.vertices:,} | {r.solve_s:.2f} | {r.cpu_s:.2f} | {memory} "
            f"| {100 * r.error:.2f} % ({100 * r.error_low:.2f}–{100 * r.error_high:.2f}) | {said} "
            f"| {', '.join(notes)} |"
        )
    return lines


def reference_lines(folder: Path, scenes: Iterable[dict[str, Any]]) -> list[str]:
    """A Markdown table of how good each reference is."""
    lines = ["| scene | quantity | points | standard error of a point, rms |", "| --- | --- | --- | --- |"]
    for scene in scenes:
        reference = np.load(folder / scene["reference"])
        name = scene["quantity"].lower()
        noise = float(np.sqrt((reference[f"{name}_stderr"] ** 2).mean()) / reference[name].mean())
        lines.append(f"| {scene['name']} | {name} | {len(reference['points']):,} | {100 * noise:.2f} % of the mean |")
    return lines


def main() -> None:
    folder = Path(sys.argv[1])
    study = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    results, left_out = collect(folder, study)

    # Numbers for machines
    rows = [asdict(result) for result in results]
    (folder / "results.json").write_text(json.dumps({"results": rows, "left_out": left_out}, indent=1) + "\n")
    with (folder / "results.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(Result.__dataclass_fields__))
        writer.writeheader()
        writer.writerows(rows)

    # Plots and tables for people
    for scene in study["scenes"]:
        of_scene = [result for result in results if result.scene == scene["name"]]
        if of_scene:
            plot_scene(of_scene, scene["name"], folder / f"{scene['name']}.png")
    compared = [scene["name"] for scene in study["scenes"] if not scene["direct"]]
    counted = [scene["name"] for scene in study["scenes"] if scene["direct"]]
    sections = {
        "References": reference_lines(folder, study["scenes"]),
        "All bakes": result_lines(results),
        "Elements and processor time at equal measured error, direct light only (the paper's tables)": paper_table(
            results, counted
        ),
        "Vertices and processor time at equal measured error": equal_error_table(results, compared),
        "Against Cycles' vertex bake at equal measured error": cycles_table(results, compared),
    }
    if left_out:
        sections["Left out"] = [f"- {line}" for line in left_out]
    text = "\n\n".join(f"## {title}\n\n" + "\n".join(lines) for title, lines in sections.items() if lines)
    (folder / "tables.md").write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
