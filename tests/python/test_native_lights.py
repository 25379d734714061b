# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights through the binding: what arrives on a floor, and what is refused by name."""

import math
from typing import Any

import antumbra_native
import numpy as np
import pytest
from native_scenes import LAMP, floor_arrays


def white_floor() -> antumbra_native.Scene:
    scene = antumbra_native.Scene()
    scene.add_material("white", (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    scene.add_object("Floor", **floor_arrays())
    return scene


def irradiance(scene: antumbra_native.Scene) -> Any:
    """(T, 3, 3) at the floor's corners, (±1, ±1, 0)."""
    (mesh,) = antumbra_native.start(scene, method="UNIFORM", element_size=9.0).result().meshes
    return math.pi * mesh.corner_radiance


def test_a_sun() -> None:
    scene = white_floor()
    scene.add_sun("Sun", (0.0, 3.0, 4.0), 0.01, (3.0, 2.0, 1.0))
    assert irradiance(scene) == pytest.approx(np.broadcast_to([2.4, 1.6, 0.8], (2, 3, 3)), rel=1e-6)


@pytest.mark.parametrize("shadows", [True, False])
def test_a_point(shadows: bool) -> None:
    scene = white_floor()
    scene.add_point_light("Point", (0.0, 0.0, 1.0), 0.0, (1.0, 2.0, 0.0), casts_shadows=shadows)
    expected = np.array([1.0, 2.0, 0.0]) / 3.0**1.5
    assert irradiance(scene) == pytest.approx(np.broadcast_to(expected, (2, 3, 3)), rel=1e-5)


def test_a_spot_shines_into_its_cone() -> None:
    down = np.diag([1.0, -1.0, -1.0])
    for angle, lit in ((2.0 * math.atan(1.5), True), (2.0 * math.atan(1.4), False)):
        scene = white_floor()
        # Without any light at all there is nothing to bake.
        scene.set_sky("Sky", np.full((6, 1, 1, 3), 1e-9))
        scene.add_point_light("Spot", (0.0, 0.0, 1.0), 0.0, (1.0, 1.0, 1.0), cone=(down, angle, 0.0))
        assert (irradiance(scene).min() > 1e-6) == lit


def test_a_sky() -> None:
    scene = white_floor()
    scene.set_sky("Sky", np.full((6, 2, 2, 3), 0.75))
    assert irradiance(scene) == pytest.approx(np.full((2, 3, 3), 0.75), rel=1e-6)


def test_a_spread_of_everything_is_none() -> None:
    def lit(**options: Any) -> Any:
        scene = white_floor()
        scene.add_area_light("Lamp", LAMP, (10.0, 10.0, 10.0), **options)
        return irradiance(scene)

    np.testing.assert_array_equal(lit(), lit(spread=math.pi))
    assert lit(spread=1.0).max() == 0.0
    np.testing.assert_allclose(lit(), lit(casts_shadows=False), rtol=1e-6)


def test_what_no_light_can_be_is_refused_by_name() -> None:
    def sun(scene: antumbra_native.Scene, **changed: Any) -> None:
        scene.add_sun("Lamp", **{"direction": (0, 0, 1), "angle": 0.0, "irradiance": (1, 1, 1), **changed})

    def point(scene: antumbra_native.Scene, **changed: Any) -> None:
        arguments = {"position": (0, 0, 1), "radius": 0.0, "intensity": (1, 1, 1), **changed}
        scene.add_point_light("Lamp", **arguments)

    def sky(scene: antumbra_native.Scene, cells: int = 1, value: float = math.nan) -> None:
        scene.set_sky("Lamp", np.full((6, cells, cells, 3), value))

    for add, changed in (
        (sun, {"direction": (0, 0, 0)}),
        (sun, {"angle": math.nan}),
        (sun, {"angle": 4.0}),
        (sun, {"irradiance": (1, math.inf, 1)}),
        (point, {"position": (0, math.nan, 1)}),
        (point, {"radius": -1.0}),
        (point, {"cone": (np.eye(3), 4.0, 0.5)}),
        (point, {"cone": (np.full((3, 3), math.nan), 1.0, 0.5)}),
        (sky, {}),
        (sky, {"cells": 3, "value": 1.0}),
    ):
        scene = white_floor()
        add(scene, **changed)
        with pytest.raises(antumbra_native.InvalidSceneError, match="“Lamp”"):
            antumbra_native.start(scene).result()
