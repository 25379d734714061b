# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against vertices, time and memory, one picture per scene."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import matplotlib

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

# One look per method in every plot; told apart by shape too.
LOOKS = {"UNIFORM": ("#888888", "s"), "AS": ("#d95f02", "o"), "DM": ("#7570b3", "^"), "ADM": ("#1b9e77", "D")}

# Cycles' vertex bake with so many samples: the more, the darker.
LOOKS |= {f"CYCLES{n}": (c, "x") for n, c in ((16, "#fdd0a2"), (64, "#c6a5d8"), (256, "#9970ab"), (1024, "#40004b"))}


# What bakes are compared by: a property, its title, and its unit in that of the property.
SIZES = (("vertices", "vertices", 1.0), ("cpu_s", "processor time, s", 1.0), ("peak_bytes", "memory to solve, MB", 1e6))

SMALLEST_SHOWN = 1e-4


def plain_number(value: float, _position: int | None = None) -> str:
    """0.02, 5, 20k."""
    return f"{value / 1000.0:g}k" if value >= 1000.0 else f"{value:g}"


class Measured(Protocol):
    """What a plot needs to know of one bake."""

    @property
    def method(self) -> str: ...
    @property
    def vertices(self) -> int: ...
    @property
    def cpu_s(self) -> float: ...
    @property
    def peak_bytes(self) -> int | None: ...
    @property
    def error(self) -> float: ...
    @property
    def error_low(self) -> float: ...
    @property
    def error_high(self) -> float: ...
    @property
    def reached(self) -> bool: ...


def plot_scene(results: Sequence[Measured], title: str, path: Path) -> None:
    """Draw all plots side by side; an open mark is a bake that a limit ended."""
    figure, axes = pyplot.subplots(1, len(SIZES), figsize=(15.0, 4.2), sharey=True, layout="constrained")
    for axis, (size, label, unit) in zip(axes, SIZES, strict=True):
        for method, (colour, mark) in LOOKS.items():
            # Of Cycles' bakes the memory is not known.
            known = (r for r in results if r.method == method and getattr(r, size) is not None)
            own = sorted(known, key=lambda r: r.vertices)
            if not own:
                continue
            xs, ys = [getattr(r, size) / unit for r in own], [100.0 * r.error for r in own]
            bars = [
                [100.0 * (r.error - r.error_low) for r in own],
                [100.0 * (r.error_high - r.error) for r in own],
            ]
            axis.errorbar(xs, ys, yerr=[[max(0.0, bar) for bar in side] for side in bars], color=colour, capsize=2)
            for x, y, result in zip(xs, ys, own, strict=True):
                filling = colour if result.reached else "white"
                axis.plot(x, y, mark, color=colour, markerfacecolor=filling)
            axis.plot([], [], marker=mark, color=colour, label=method)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel(label)
        axis.grid(visible=True, which="both", color="#e5e5e5", linewidth=0.6)
        axis.set_axisbelow(True)
        for scale in (axis.xaxis, axis.yaxis):
            scale.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            scale.set_major_formatter(FuncFormatter(plain_number))
            scale.set_minor_formatter(NullFormatter())
    # An error that the reference's noise may explain whole has no place on a logarithmic axis.
    shown = [100.0 * bound for r in results for bound in (r.error_low, r.error_high) if bound > SMALLEST_SHOWN]
    if shown:
        axes[0].set_ylim(min(shown) / 1.2, max(shown) * 1.2)
    axes[0].set_ylabel("rms error, % of the mean light")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center", frameon=False)
    figure.suptitle(title)
    figure.savefig(path, dpi=130)
    pyplot.close(figure)
