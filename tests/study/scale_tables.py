# SPDX-License-Identifier: GPL-3.0-or-later
"""How bakes grow with their scenes: a table, exponents and a plot.

python scale_tables.py FOLDER

FOLDER holds `bakes/*.json` of scale_bake.py. It gets `table.md`, `scale.json` and `scale.png`.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.study.growth import COSTS, MB, Grown, exponent, exponents, table


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
