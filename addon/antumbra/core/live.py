# SPDX-License-Identifier: GPL-3.0-or-later
"""A stage of a running bake as triangles for a screen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .carry import BakedMesh
from .colours import srgb_encoded
from .record import FloatArray, SceneRecord

# More than this would take longer to hand to the graphics card than a viewport should stand still.
MOST_TRIANGLES = 300_000

# sRGB by table, in half of the time of its powers: a step is less than one of 255 everywhere.
_STEPS = 1 << 16
_ENCODED = srgb_encoded(np.linspace(0.0, 1.0, _STEPS)).astype(np.float32)


def live_triangles(meshes: Sequence[BakedMesh], scene: SceneRecord) -> tuple[FloatArray, FloatArray] | None:
    """World positions (N, 3) and colours (N, 4) of the corners, three to a triangle; None where they are too many.

    Colours are for the screen: sRGB, opaque, ending at 1.
    """
    if sum(len(mesh.triangles) for mesh in meshes) > MOST_TRIANGLES:
        return None
    positions, colours = [], []
    for mesh in meshes:
        matrix = scene.objects[mesh.object].world_from_object
        world = mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]
        positions.append(world[mesh.triangles.reshape(-1)].astype(np.float32))
        colours.append(mesh.corner_radiance.reshape(-1, 3))
    if not positions:
        return None
    rgba = np.ones((sum(len(each) for each in colours), 4), dtype=np.float32)
    steps = np.clip(np.concatenate(colours), 0.0, 1.0) * np.float32(_STEPS - 1)
    rgba[:, :3] = _ENCODED[steps.astype(np.int32)]
    return np.concatenate(positions), rgba
