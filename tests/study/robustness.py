# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of error against what makes a scene stiff or extreme: reflectance, size, place, and strengths of lights.

    python tests/study/robustness.py FOLDER

Each curve has an answer that is known: of the furnace in closed form, of other scenes that of the same scene in its
plain form.
"""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import antumbra_native
import matplotlib
import numpy as np

matplotlib.use("Agg")

from matplotlib import pyplot

CUBE = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
OUTWARDS = np.array([corners for a, b, c, d in QUADS for corners in ((a, b, c), (a, c, d))], dtype=np.int32)
SQUARE = np.array([(-1.0, -1.0, 0.0), (-1.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0)])
"""Counter-clockwise seen from below, where it shines as a lamp."""

# A difference below it would have no place on a logarithmic axis; colours are known to 6e-8.
SMALLEST_SHOWN = 1e-9

NUMBERS_BESIDE = {"o": (0, -15), "s": (0, -27), "^": (0, 7)}
"""The marks of a plot's series, and where the number of iterations stands, in points from each."""


@dataclass(frozen=True)
class Measured:
    """One point of a curve."""

    curve: str
    series: str
    x: float
    error: float
    iterations: int


def placed(scale: float = 1.0, offset: float = 0.0) -> Any:
    """(4, 4), the same offset along each axis but for its sign."""
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = offset * np.array([1.0, -1.0, 1.0])
    return matrix


def moved(points: Any, matrix: Any) -> Any:
    """World positions."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def bake(scene: antumbra_native.Scene, **settings: Any) -> tuple[Any, dict[str, Any]]:
    """The light of each source triangle, its mean over the triangle and channels, and the report."""
    result = antumbra_native.start(scene, verify_points=0, **settings).result()
    light = []
    for mesh in result.meshes:
        shares = np.abs(np.linalg.det(mesh.corner_barycentric))
        means = mesh.corner_radiance.astype(np.float64).mean(axis=(1, 2))
        sums = np.bincount(mesh.source_triangle, weights=shares * means)
        light.append(sums / np.bincount(mesh.source_triangle, weights=shares))
    return np.concatenate(light), json.loads(result.report)


def furnace(reflectance: float, transport: str) -> Measured:
    """A closed cube that emits 1 W/m² everywhere: B = 1/(1 - rho). The worst corner counts."""
    scene = antumbra_native.Scene()
    scene.add_material("wall", (reflectance,) * 3, (1.0,) * 3)
    scene.add_object("cube", CUBE, OUTWARDS[:, ::-1], np.zeros(12, dtype=np.int32), np.eye(4), None, True)
    result = antumbra_native.start(scene, verify_points=0, transport=transport).result()
    expected = 1.0 / (np.pi * (1.0 - reflectance))
    colours = result.meshes[0].corner_radiance.astype(np.float64)
    iterations = json.loads(result.report)["result"]["transport"]["iterations"]
    worst = float(np.abs(colours / expected - 1.0).max())
    return Measured("stiffness", transport, 1.0 - reflectance, worst, iterations)


def room(matrix: Any, single_precision: bool = False) -> antumbra_native.Scene:
    """A room with a box below a lamp; in single precision, its world coordinates are rounded as a mesh's would be."""
    scene = antumbra_native.Scene()
    scene.add_material("wall", (0.6, 0.5, 0.4), (0.0,) * 3)

    def add(name: str, positions: Any, triangles: Any) -> None:
        materials = np.zeros(len(triangles), dtype=np.int32)
        if single_precision:
            rounded = moved(positions, matrix).astype(np.float32)
            scene.add_object(name, rounded, triangles, materials, np.eye(4), None, True)
        else:
            scene.add_object(name, positions, triangles, materials, matrix, None, True)

    add("room", CUBE * (3.0, 4.0, 2.5), OUTWARDS[:, ::-1])
    add("box", CUBE * (0.7, 0.5, 0.9) + (1.2, 2.1, 0.2), OUTWARDS)
    scene.add_area_light("lamp", moved(0.3 * SQUARE + (1.2, 2.0, 2.3), matrix), (10.0,) * 3)
    return scene


def beside_a_strong_light(reflectance: float, ratio: float | None) -> antumbra_native.Scene:
    """A floor and a wall under a weak lamp; beside them a stronger one in a closed black box."""
    scene = antumbra_native.Scene()
    scene.add_material("grey", (reflectance,) * 3, (0.0,) * 3)
    scene.add_material("black", (0.0,) * 3, (0.0,) * 3)
    two = np.array([(0, 2, 1), (0, 3, 2)], dtype=np.int32)
    grey = np.zeros(2, dtype=np.int32)
    scene.add_object("floor", SQUARE, two, grey, np.eye(4), None, True)
    wall = np.array([(-1.0, -1.0, 0.0), (-1.0, -1.0, 2.0), (-1.0, 1.0, 2.0), (-1.0, 1.0, 0.0)])
    scene.add_object("wall", wall, two, grey, np.eye(4), None, True)
    scene.add_object("safe", CUBE + (3.0, 0.0, 0.0), OUTWARDS, np.ones(12, dtype=np.int32), np.eye(4), None, False)
    scene.add_area_light("weak", 0.2 * SQUARE + (0.0, 0.0, 1.0), (1e-6,) * 3)
    if ratio is not None:
        scene.add_area_light("strong", 0.2 * SQUARE + (3.5, 0.5, 0.8), (1e-6 * ratio,) * 3)
    return scene


def measure() -> Iterator[Measured]:
    """All curves, a point at a time."""
    for power in range(7):
        for transport in ("HIERARCHICAL", "RAYS", "SHOOTING"):
            yield furnace(1.0 - 10.0**-power, transport)

    plain, report = bake(room(placed()))
    iterations = report["result"]["transport"]["iterations"]

    def off(light: Any) -> float:
        return float(np.sqrt(np.mean((light - plain) ** 2)) / plain.mean())

    for power in range(-6, 7):
        light, _ = bake(room(placed(scale=10.0**power)))
        yield Measured("scale", "by powers of ten", 10.0**power, off(light), iterations)
    for power in range(-18, 19, 6):
        light, _ = bake(room(placed(scale=2.0**power)))
        yield Measured("scale", "by powers of two", 2.0**power, off(light), iterations)
    for power in range(8):
        for single in (False, True):
            series = "mesh in single precision" if single else "mesh in double precision"
            light, _ = bake(room(placed(offset=10.0**power), single))
            yield Measured("offset", series, 10.0**power, off(light), iterations)
    for reflectance in (0.0, 0.5):
        alone, _ = bake(beside_a_strong_light(reflectance, None), quantity="IRRADIANCE")
        for power in range(0, 13, 2):
            light, report = bake(beside_a_strong_light(reflectance, 10.0**power), quantity="IRRADIANCE")
            error = float(np.sqrt(np.mean((light - alone) ** 2)) / alone.mean())
            series = f"reflectance {reflectance:g}"
            yield Measured("strength", series, 10.0**power, error, report["result"]["transport"]["iterations"])


AXES = {
    "stiffness": ("1 - reflectance of a closed furnace", "worst error at a corner"),
    "scale": ("size of a room", "rms difference, of the mean"),
    "offset": ("distance of a room of 3 m from the origin, m", "rms difference, of the mean"),
    "strength": ("a hidden light, times as strong", "rms difference, of the mean"),
}


def draw(points: list[Measured], path: Path) -> None:
    """A plot for each curve."""
    figure, plots = pyplot.subplots(2, 2, figsize=(10.0, 7.0), layout="constrained")
    for plot, (curve, (x_label, y_label)) in zip(plots.flat, AXES.items(), strict=True):
        series = dict.fromkeys(point.series for point in points if point.curve == curve)
        for name, mark in zip(series, NUMBERS_BESIDE, strict=False):
            own = [point for point in points if (point.curve, point.series) == (curve, name)]
            errors = [max(point.error, SMALLEST_SHOWN) for point in own]
            (line,) = plot.plot([point.x for point in own], errors, marker=mark, label=name)
            if curve == "stiffness":
                for point, error in zip(own, errors, strict=True):
                    plot.annotate(
                        f"{point.iterations}",
                        (point.x, error),
                        NUMBERS_BESIDE[mark],
                        textcoords="offset points",
                        ha="center",
                        color=line.get_color(),
                    )
        plot.set(xscale="log", yscale="log", xlabel=x_label, ylabel=y_label)
        plot.axhline(0.01, color="#888888", linewidth=0.8, linestyle="--")
        plot.set_ylim(bottom=0.3 * SMALLEST_SHOWN)
        plot.grid(visible=True, color="#e5e5e5", linewidth=0.6)
        plot.legend(frameon=False)
    figure.suptitle(
        "Stiff and extreme scenes at a tolerance of 0.01 (dashed); numbers are iterations or shots,"
        " 1e-9 stands for what is less"
    )
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


def main(folder: Path) -> None:
    """Measure, and write a table, a picture, and a summary in Markdown, which is printed too."""
    points = []
    for point in measure():
        points.append(point)
        print(
            f"{point.curve:9} {point.series:24} {point.x:8.1e}  {point.error:8.1e}  {point.iterations} iterations",
            flush=True,
        )
    with (folder / "robustness.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(("curve", "series", "x", "error", "iterations"))
        rows.writerows((p.curve, p.series, p.x, p.error, p.iterations) for p in points)
    lines = ["| curve | | worst error | most iterations |", "| --- | --- | --- | --- |"]
    for curve, series in dict.fromkeys((point.curve, point.series) for point in points):
        own = [point for point in points if (point.curve, point.series) == (curve, series)]
        worst, most = max(point.error for point in own), max(point.iterations for point in own)
        lines.append(f"| {curve} | {series} | {worst:.1e} | {most} |")
    text = "\n".join(lines) + "\n"
    (folder / "robustness.md").write_text(text, encoding="utf-8")
    print(f"\n{text}")
    draw(points, folder / "robustness.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
