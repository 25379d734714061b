# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes for the tests of the binding."""

from typing import Any

import antumbra_native
import numpy as np


def floor_arrays(cells: int = 1) -> dict[str, Any]:
    """Arguments of add_object for a floor of 2 m at height 0 that faces up, as 2·cells² triangles."""
    steps = np.linspace(-1.0, 1.0, cells + 1)
    x, y = np.meshgrid(steps, steps)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    lower = np.stack([corner, corner + 1, corner + cells + 2], axis=1)
    upper = np.stack([corner, corner + cells + 2, corner + cells + 1], axis=1)
    triangles = np.concatenate([lower, upper]).astype(np.int32)
    return {
        "positions": np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1),
        "triangles": triangles,
        "materials": np.zeros(len(triangles), dtype=np.int32),
        "world_from_object": np.eye(4),
        "corner_normals": None,
        "receives": True,
    }


# A square of 0.5 m at height 1, counter-clockwise seen from below.
LAMP = np.array([[-0.25, -0.25, 1.0], [-0.25, 0.25, 1.0], [0.25, 0.25, 1.0], [0.25, -0.25, 1.0]])


def lit_floor(cells: int = 1, **changed: Any) -> antumbra_native.Scene:
    """Make a floor under a lamp, some of the floor's arguments changed."""
    scene = antumbra_native.Scene()
    scene.add_material("grey", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0))
    scene.add_object("Floor", **{**floor_arrays(cells), **changed})
    scene.add_area_light("Lamp", LAMP, (10.0, 10.0, 10.0))
    return scene
