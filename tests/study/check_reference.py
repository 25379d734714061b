# SPDX-License-Identifier: GPL-3.0-or-later
"""Check the reference against light that can be written down: `cargo xtask study --check-reference`.

... check_reference.py

- a plane under a parallel square light, by the form factor of a point and a rectangle (its corner over the point,
  a = width / distance, b = height / distance):
  F = (a/√(1+a²)·atan(b/√(1+a²)) + b/√(1+b²)·atan(a/√(1+b²))) / 2π;
- the same, turned in space, so that no coordinate is a round one;
- a furnace: in a closed cube whose walls reflect rho and emit E, B = E / (1 - rho) everywhere.

Says how far the mean is off, and the rms deviation with what its own standard error explains. Ends with 1 when more is
left than `ALLOWED`.
"""

import math
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.scenes.building import Shape, add, add_light, matte
from tests.study.reference import draw_points, irradiance_at

Floats = NDArray[np.float64]

ALLOWED = 5e-4
"""Relative error of the mean. Height above the surface and single precision make about 1e-4 of it."""
SAMPLES, SEEDS, POINTS = 4096, 4, 300
EXITANCE, LIGHT_EDGE_M, HEIGHT_M = 20.0, 1.0, 2.0
RHO, EMISSION = 0.5, 1.0


def corner_form_factor(a: Floats, b: Floats) -> Floats:
    """F from a point to a parallel rectangle with one corner over it; odd in both, so that rectangles can be added."""
    p, q = np.sqrt(1.0 + a * a), np.sqrt(1.0 + b * b)
    return np.asarray((a / p * np.arctan(b / p) + b / q * np.arctan(a / q)) / (2.0 * math.pi))


def under_a_square(turn: Matrix) -> tuple[Floats, Floats, Floats]:
    """Expected irradiance, what the reference says, and its standard error, (N) each."""
    corners = [(-1.5, -1.5, 0.0), (1.5, -1.5, 0.0), (1.5, 1.5, 0.0), (-1.5, 1.5, 0.0)]
    add("plane", Shape().polygon(*corners).moved(turn), matte("grey", (0.5, 0.5, 0.5)))
    lamp = add_light("lamp", (EXITANCE, EXITANCE, EXITANCE), (0.0, 0.0, 0.0), (LIGHT_EDGE_M, LIGHT_EDGE_M))
    lamp.matrix_world = turn @ Matrix.Translation((0.0, 0.0, HEIGHT_M))
    bpy.context.view_layer.update()
    places = draw_points(POINTS, seed=1)
    flat = np.array([(turn.inverted() @ Vector(point))[:] for point in places.points])
    half = LIGHT_EDGE_M / 2.0
    low, high = (-half - flat[:, :2]) / HEIGHT_M, (half - flat[:, :2]) / HEIGHT_M
    factor = (
        corner_form_factor(high[:, 0], high[:, 1])
        - corner_form_factor(low[:, 0], high[:, 1])
        - corner_form_factor(high[:, 0], low[:, 1])
        + corner_form_factor(low[:, 0], low[:, 1])
    )
    found, stderr = irradiance_at(places, SAMPLES, SEEDS)
    return EXITANCE * factor, found[:, 0], stderr[:, 0]


def furnace() -> tuple[Floats, Floats, Floats]:
    """Expected radiosity, what the reference says, and its standard error, (N) each."""
    box = Shape().box((0.0, 0.0, 0.0), (2.0, 2.0, 2.0))
    box.faces = [face[::-1] for face in box.faces]
    material = matte("glowing", (RHO, RHO, RHO))
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Emission Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    shader.inputs["Emission Strength"].default_value = EMISSION / math.pi
    add("walls", box, material)
    bpy.context.view_layer.update()
    places = draw_points(POINTS, seed=1)
    irradiance, stderr = irradiance_at(places, SAMPLES, SEEDS)
    found = (places.emission + places.reflectance * irradiance)[:, 0]
    return np.full(POINTS, EMISSION / (1.0 - RHO)), found, (places.reflectance * stderr)[:, 0]


def main() -> None:
    tilt = Matrix.Translation((3.3, -2.7, 1.9)) @ Matrix.Rotation(0.7, 4, "X") @ Matrix.Rotation(0.4, 4, "Y")
    cases = {
        "under a square light": lambda: under_a_square(Matrix.Identity(4)),
        "the same, turned": lambda: under_a_square(tilt),
        "furnace": furnace,
    }
    worst = 0.0
    for name, case in cases.items():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        expected, found, stderr = case()
        mean = expected.mean()
        bias = float((found - expected).mean() / mean)
        rms = float(np.sqrt(((found - expected) ** 2).mean()) / mean)
        noise = float(np.sqrt((stderr**2).mean()) / mean)
        print(
            f"{name:<22} mean off by {100 * bias:+.4f} %, rms {100 * rms:.4f} %, standard error {100 * noise:.4f} %",
            file=sys.stderr,
        )
        worst = max(worst, abs(bias))
    if worst > ALLOWED:
        sys.exit(f"the reference is off by {100 * worst:.3f} %")


if __name__ == "__main__":
    main()
