# SPDX-License-Identifier: GPL-3.0-or-later
"""start(): settings are checked first, the scene is taken once, every kind of error has its class."""

from typing import Any

import antumbra_native
import numpy as np
import pytest
from native_scenes import LAMP, floor_arrays, lit_floor


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("method", "HEMICUBE"),
        ("method", "as"),
        ("quantity", "LUX"),
        ("transport", "PHOTONS"),
        ("tolerance", 0.0),
        ("tolerance", float("nan")),
        ("element_size", -1.0),
        ("max_level", 17),
        ("max_level", -1),
        ("max_blockers", -1),
        ("time_limit", float("inf")),
        ("triangle_budget", -1),
        ("verify_points", -1),
        ("verify_points", 2_000_000),
        ("threads", -1),
    ],
)
def test_settings_out_of_range_leave_the_scene(setting: str, value: Any) -> None:
    scene = lit_floor()
    with pytest.raises(antumbra_native.InvalidSettingError, match=f"setting {setting}") as refused:
        antumbra_native.start(scene, **{setting: value})
    assert refused.value.setting == setting
    assert antumbra_native.start(scene).result().meshes


def test_a_scene_is_taken_once() -> None:
    scene = lit_floor()
    antumbra_native.start(scene).result()
    with pytest.raises(RuntimeError, match="taken"):
        antumbra_native.start(scene)
    with pytest.raises(RuntimeError, match="taken"):
        scene.add_material("late", (0, 0, 0), (0, 0, 0))


def test_no_light() -> None:
    scene = antumbra_native.Scene()
    scene.add_material("grey", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0))
    scene.add_object("Floor", **floor_arrays())
    with pytest.raises(antumbra_native.NoLightError):
        antumbra_native.start(scene).result()


def test_no_receiver() -> None:
    with pytest.raises(antumbra_native.NoReceiverError):
        antumbra_native.start(lit_floor(receives=False)).result()


def test_a_vertex_that_is_not_finite_is_named() -> None:
    positions = floor_arrays()["positions"]
    positions[2, 1] = np.nan
    with pytest.raises(antumbra_native.InvalidSceneError) as refused:
        antumbra_native.start(lit_floor(positions=positions)).result()
    assert (refused.value.object, refused.value.index) == ("Floor", 2)


def test_a_vertex_that_is_not_there_is_named() -> None:
    with pytest.raises(antumbra_native.InvalidSceneError) as refused:
        antumbra_native.start(lit_floor(triangles=np.array([[0, 1, 3], [0, 3, 4]]))).result()
    assert (refused.value.object, refused.value.index) == ("Floor", 1)


def test_reflectance_above_one_is_refused() -> None:
    scene = antumbra_native.Scene()
    scene.add_material("mirror", (0.5, 1.5, 0.5), (0.0, 0.0, 0.0))
    scene.add_object("Floor", **floor_arrays())
    scene.add_area_light("Lamp", LAMP, (1.0, 1.0, 1.0))
    with pytest.raises(antumbra_native.InvalidSceneError, match="mirror") as refused:
        antumbra_native.start(scene).result()
    assert refused.value.object is None


def test_every_error_is_an_antumbra_error() -> None:
    classes = [value for value in vars(antumbra_native).values() if isinstance(value, type)]
    errors = [value for value in classes if issubclass(value, Exception)]
    assert len(errors) == 7
    assert all(issubclass(value, antumbra_native.AntumbraError) for value in errors)
