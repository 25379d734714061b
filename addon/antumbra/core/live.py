# SPDX-License-Identifier: GPL-3.0-or-later
"""A stage of a running bake as triangles for a screen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .carry import BakedMesh
from .colours import srgb_encoded
from .pieces import GO_ON, Pieces
from .record import FloatArray, SceneRecord

# More than this would take longer to hand to the graphics card than a viewport should stand still.
MOST_TRIANGLES = 300_000

# Triangles of a piece: a hundredth of a second here, and as much on the way to the graphics card.
_PIECE = 16_384

# sRGB by table, in half of the time of its powers: a step is less than one of 255 everywhere.
_STEPS = 1 << 16
_ENCODED = srgb_encoded(np.linspace(0.0, 1.0, _STEPS)).astype(np.float32)


LivePiece = tuple[FloatArray, FloatArray]
"""World positions (N, 3) and colours (N, 4) of corners, three to a triangle. Colours are for the screen: sRGB, opaque,
ending at 1."""


def live_pieces(meshes: Sequence[BakedMesh], scene: SceneRecord) -> Pieces[list[LivePiece]]:
    """All triangles, some thousands to a piece; none where they are too many."""
    pieces: list[LivePiece] = []
    if sum(len(mesh.triangles) for mesh in meshes) > MOST_TRIANGLES:
        return pieces
    positions: list[FloatArray] = []
    colours: list[NDArray[Any]] = []
    for mesh in meshes:
        matrix = scene.objects[mesh.object].world_from_object
        for first in range(0, len(mesh.triangles), _PIECE):
            triangles = mesh.triangles[first : first + _PIECE]
            world = mesh.positions[triangles.reshape(-1)] @ matrix[:3, :3].T + matrix[:3, 3]
            positions.append(world.astype(np.float32))
            colours.append(mesh.corner_radiance[first : first + _PIECE].reshape(-1, 3))
            # Small meshes share a piece: each is drawn by a call of its own.
            if sum(len(each) for each in positions) >= 3 * _PIECE:
                pieces.append(_piece(positions, colours))
                positions, colours = [], []
                yield GO_ON
    if positions:
        pieces.append(_piece(positions, colours))
    return pieces


def _piece(positions: list[FloatArray], colours: list[NDArray[Any]]) -> LivePiece:
    rgba = np.ones((sum(len(each) for each in colours), 4), dtype=np.float32)
    steps = np.clip(np.concatenate(colours), 0.0, 1.0) * np.float32(_STEPS - 1)
    rgba[:, :3] = _ENCODED[steps.astype(np.int32)]
    return np.concatenate(positions), rgba
