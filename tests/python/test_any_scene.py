# SPDX-License-Identifier: GPL-3.0-or-later
"""Whatever arrays and numbers a caller hands over: a bake, or an error of ours in one line."""

from typing import Any

import antumbra_native
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from native_scenes import LAMP, floor_arrays

NUMBERS = st.floats(width=32) | st.sampled_from([0.0, 1.0, -1.0, 0.5, 2.0**100, 2.0**-100])
SHAPES = st.tuples(st.integers(0, 6), st.integers(2, 4)) | st.just((4, 3))
COLOURS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


def array_of(dtype: Any, elements: Any) -> Any:
    return arrays.arrays(dtype, SHAPES, elements=elements)


@st.composite
def floors(draw: Any) -> dict[str, Any]:
    """The arguments of a floor, each as it should be or anything."""
    changed = {
        "positions": array_of(np.float32, st.floats(width=32)) | array_of(np.float64, NUMBERS),
        "triangles": array_of(np.int32, st.integers(-1, 6)),
        "materials": arrays.arrays(np.int32, st.integers(0, 4), elements=st.integers(-1, 2)),
        "world_from_object": arrays.arrays(np.float64, st.sampled_from([(4, 4), (3, 4)]), elements=NUMBERS),
        "corner_normals": arrays.arrays(np.float32, st.sampled_from([(2, 3, 3), (1, 3, 3)]), elements=NUMBERS),
    }
    return {**floor_arrays(), **{name: draw(values) for name, values in changed.items() if draw(st.booleans())}}


@settings(max_examples=400, deadline=None)
@given(floor=floors(), reflectance=COLOURS, emission=COLOURS, strength=COLOURS, tolerance=NUMBERS | st.just(0.3))
def test_a_bake_or_an_error_of_ours(
    floor: dict[str, Any], reflectance: Any, emission: Any, strength: Any, tolerance: float
) -> None:
    outcome = baked_or_refused(floor, reflectance, emission, strength, tolerance)
    if isinstance(outcome, str):
        assert outcome
        assert "\n" not in outcome
        return
    for mesh in outcome.meshes:
        assert np.isfinite(mesh.corner_radiance).all()
        assert (mesh.corner_radiance >= 0.0).all() or min(strength) < 0.0


def baked_or_refused(
    floor: dict[str, Any], reflectance: Any, emission: Any, strength: Any, tolerance: float
) -> antumbra_native.Bake | str:
    """The bake, or what the error says; a panic is neither."""
    scene = antumbra_native.Scene()
    try:
        scene.add_material("grey", reflectance, emission)
        scene.add_object("Floor", **floor)
        scene.add_area_light("Lamp", LAMP, strength)
        job = antumbra_native.start(scene, tolerance=tolerance, triangle_budget=100, max_level=2, verify_points=0)
        return job.result()
    except antumbra_native.SolverPanicError:
        raise
    except (antumbra_native.AntumbraError, TypeError, ValueError) as error:
        return str(error)
