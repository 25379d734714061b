# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene: what is taken, what is refused, and how it is named."""

from typing import Any

import antumbra_native
import numpy as np
import pytest
from native_scenes import LAMP, floor_arrays, lit_floor


def baked_positions(**changed: Any) -> Any:
    return antumbra_native.start(lit_floor(**changed), method="UNIFORM", element_size=5.0).result().meshes[0].positions


def test_indices_count_up() -> None:
    scene = antumbra_native.Scene()
    assert [scene.add_material(name, (0, 0, 0), (0, 0, 0)) for name in "abc"] == [0, 1, 2]
    assert [scene.add_object(name, **floor_arrays()) for name in "abc"] == [0, 1, 2]


@pytest.mark.parametrize("float_type", [np.float32, np.float64, ">f4"])
@pytest.mark.parametrize("int_type", [np.int32, np.uint32, np.int64])
def test_number_types_give_the_same_mesh(float_type: Any, int_type: Any) -> None:
    arrays = floor_arrays()
    same = baked_positions(
        positions=arrays["positions"].astype(float_type),
        world_from_object=arrays["world_from_object"].astype(float_type),
        triangles=arrays["triangles"].astype(int_type),
        materials=arrays["materials"].astype(int_type),
    )
    np.testing.assert_array_equal(same, baked_positions())


def test_memory_order_does_not_matter() -> None:
    positions = floor_arrays()["positions"]
    padded = np.zeros((len(positions), 5))
    padded[:, 1:4] = positions
    np.testing.assert_array_equal(baked_positions(positions=np.asfortranarray(positions)), baked_positions())
    np.testing.assert_array_equal(baked_positions(positions=padded[:, 1:4]), baked_positions())


def test_arrays_are_owned() -> None:
    positions = floor_arrays()["positions"]
    scene = lit_floor(positions=positions)
    positions[:] = np.nan
    assert np.isfinite(antumbra_native.start(scene, method="UNIFORM").result().meshes[0].positions).all()


def test_matrix_has_rows() -> None:
    """Moved up by 0.5 the floor is nearer to its lamp, and its middle gets the light of that distance."""
    middle = []
    for height in (0.0, 0.5):
        matrix = np.eye(4)
        matrix[2, 3] = height
        scene = lit_floor(cells=2, world_from_object=matrix)
        mesh = antumbra_native.start(scene, method="UNIFORM", element_size=5.0).result().meshes[0]
        corner = np.argwhere((mesh.positions[mesh.triangles] == 0.0).all(axis=2))[0]
        middle.append(float(mesh.corner_radiance[tuple(corner)][0]))

    # Closed form under the middle of a square: four times the factor under the corner of its quarter.
    def factor(edge: float, distance: float) -> float:
        a = edge / distance
        root = np.sqrt(1 + a * a)
        return float(4 * 2 * a / root * np.arctan(a / root) / (2 * np.pi))

    wanted = [0.5 * 10.0 * factor(0.25, distance) / np.pi for distance in (1.0, 0.5)]
    np.testing.assert_allclose(middle, wanted, rtol=1e-6)


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"positions": np.zeros((4, 2))}, ValueError, "positions has shape (4, 2), expected (N, 3)"),
        ({"positions": np.zeros(12)}, ValueError, "positions has shape (12,), expected (N, 3)"),
        ({"positions": np.zeros((4, 3), int)}, TypeError, "positions has dtype int64, expected float32 or float64"),
        ({"positions": [[0.0, 0.0, 0.0]]}, TypeError, "positions is a list, expected a numpy array"),
        ({"triangles": np.zeros((2, 4), int)}, ValueError, "triangles has shape (2, 4), expected (N, 3)"),
        ({"triangles": np.zeros((2, 3))}, TypeError, "triangles has dtype float64, expected integer"),
        ({"materials": np.zeros(3, int)}, ValueError, "materials has shape (3,), expected (2,)"),
        ({"world_from_object": np.eye(3)}, ValueError, "world_from_object has shape (3, 3), expected (4, 4)"),
        ({"corner_normals": np.zeros((6, 3))}, ValueError, "corner_normals has shape (6, 3), expected (2, 3, 3)"),
    ],
)
def test_wrong_arrays_are_refused(changed: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error) as refused:
        lit_floor(**changed)
    assert str(refused.value) == f"object “Floor”: {message}"


def test_negative_index_names_its_triangle() -> None:
    with pytest.raises(antumbra_native.InvalidSceneError, match="vertex -1") as refused:
        lit_floor(triangles=np.array([[0, 1, 3], [0, 3, -1]]))
    assert (refused.value.object, refused.value.index) == ("Floor", 1)


def test_colours_have_three_channels() -> None:
    scene = antumbra_native.Scene()
    with pytest.raises(ValueError, match="length 3"):
        scene.add_material("grey", (0.5, 0.5), (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="length 3"):
        scene.add_area_light("Lamp", LAMP, (1.0, 1.0, 1.0, 1.0))
