# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a baked mesh as colour attributes, in the way that the user wants to store it, and what that loses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .carry import BakedMesh
from .lights import Floats
from .pieces import GO_ON, Pieces, rows_of
from .record import Attribute, FloatArray
from .settings import Settings

RADIOSITY = "Radiosity"
"""Name of the colour attribute that a bake writes."""

DIRECT, INDIRECT = "Radiosity Direct", "Radiosity Indirect"
"""Names of those with its two parts."""

VIEW = "Radiosity View"
"""Name of the colour attribute that shows light on a screen, exposed or in false colours."""

EXPORT = "Radiosity Export"
"""Name of the colour attribute with light from 0 to 1 for programs that take no more."""

HDR = "_RADIOSITY"
"""Name of the attribute with all light in files: glTF wants an underscore and capitals."""

LIGHT = frozenset({RADIOSITY, DIRECT, INDIRECT, VIEW, EXPORT, HDR})

Linear = NDArray[np.floating[Any]]

# A jump of light around a vertex that nobody would notice, as a share of the brightest light on the mesh: a step of
# 8-bit colour is as large.
_NOTICEABLE = 1.0 / 255.0


def light_attributes(baked: BakedMesh, settings: Settings) -> Pieces[list[Attribute]]:
    """The colour attributes of a baked mesh, opaque, the one with all light first."""
    attributes = []
    for name, radiance in _layers(baked):
        rgb: Linear = radiance
        if settings.domain == "POINT":
            rgb = yield from _mean_at_vertices(radiance, baked)
        rgba = np.ones((len(rgb), 4), dtype=np.float32)
        for rows in rows_of(len(rgb)):
            rgba[rows, :3] = in_steps(rgb[rows], settings.colour_steps) if settings.colour_steps > 0 else rgb[rows]
            yield GO_ON
        attributes.append(Attribute(name, settings.domain, settings.data_type, rgba, blends=True))
    return attributes


def storage_losses(meshes: list[BakedMesh], settings: Settings) -> list[str]:
    """What the chosen way of storing loses of this light, one sentence each."""
    losses = []
    if settings.domain == "POINT":
        counts = np.array([_vertices_with_jumps(baked) for baked in meshes])
        if counts[:, 0].any():
            losses.append(
                f"domain POINT: at {counts[:, 0].sum():,} of {counts[:, 1].sum():,} vertices the light differs around "
                "the vertex, and its mean is kept; CORNER keeps each"
            )
    if settings.data_type == "BYTE_COLOR" or settings.colour_steps > 0:
        brightest = [float(radiance.max(initial=0.0)) for baked in meshes for _, radiance in _layers(baked)]
        if max(brightest, default=0.0) > 1.0:
            losses.append(
                f"{_storage_name(settings)}: colours up to {max(brightest):.3g} were clipped at 1; FLOAT_COLOR without "
                "steps keeps them"
            )
    return losses


def in_steps(rgb: Linear, steps: int) -> Floats:
    """Scene-linear colours, each channel the nearest of so many from 0 to 1 that are evenly spread in sRGB."""
    most = max(steps - 1, 1)
    return srgb_decoded(np.round(srgb_encoded(np.clip(rgb, 0.0, 1.0)) * most) / most)


def srgb_encoded(linear: Linear) -> Floats:
    """IEC 61966-2-1, for values from 0 on."""
    curved = 1.055 * np.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.asarray(np.where(linear <= 0.0031308, 12.92 * linear, curved))


def srgb_decoded(encoded: Linear) -> Floats:
    """The inverse of srgb_encoded."""
    curved = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.asarray(np.where(encoded <= 0.04045, encoded / 12.92, curved))


def _storage_name(settings: Settings) -> str:
    if settings.data_type == "BYTE_COLOR":
        return "data_type BYTE_COLOR"
    return f"colour_steps {settings.colour_steps}"


def _layers(baked: BakedMesh) -> list[tuple[str, FloatArray]]:
    """The layers that there are, (3T, 3) each."""
    layers = ((RADIOSITY, baked.corner_radiance), (DIRECT, baked.corner_direct), (INDIRECT, baked.corner_indirect))
    return [(name, radiance.reshape(-1, 3)) for name, radiance in layers if radiance is not None]


def _mean_at_vertices(rgb: FloatArray, baked: BakedMesh) -> Pieces[Floats]:
    """(V, 3) from (3T, 3): each vertex's mean over its corners, by the angles of the triangles there.

    By angles, since a plain mean would change with how a flat face happens to be cut.
    """
    count = len(baked.positions)
    whole, sums = np.zeros(count), np.zeros((count, 3))
    by_triangle = rgb.reshape(-1, 3, 3)
    for rows in rows_of(len(baked.triangles)):
        angles = _corner_angles(baked.positions[baked.triangles[rows]])
        corners = baked.triangles[rows].reshape(-1)
        whole += np.bincount(corners, weights=angles.reshape(-1), minlength=count)
        for channel in range(3):
            weighted = angles * by_triangle[rows, :, channel]
            sums[:, channel] += np.bincount(corners, weights=weighted.reshape(-1), minlength=count)
        yield GO_ON
    return sums / whole[:, None]


def _corner_angles(triangles: Floats) -> Floats:
    """(T, 3) radians, from (T, 3, 3) positions."""
    forward = np.roll(triangles, -1, axis=1) - triangles
    backward = np.roll(triangles, 1, axis=1) - triangles
    across = np.linalg.norm(np.cross(forward, backward), axis=2)
    along = np.einsum("tkx,tkx->tk", forward, backward)
    # A triangle without area may be all that a vertex has.
    return np.asarray(np.maximum(np.arctan2(across, along), np.finfo(np.float32).tiny))


def _vertices_with_jumps(baked: BakedMesh) -> tuple[int, int]:
    """How many vertices have corners whose light differs noticeably, of how many."""
    corners = baked.triangles.reshape(-1)
    rgb = baked.corner_radiance.reshape(-1, 3)
    shape = (len(baked.positions), 3)
    least, most = np.full(shape, np.inf), np.full(shape, -np.inf)
    for channel in range(3):
        # Ten times as fast as whole rows.
        np.minimum.at(least[:, channel], corners, rgb[:, channel])
        np.maximum.at(most[:, channel], corners, rgb[:, channel])
    jumps = (most - least).max(axis=1) > _NOTICEABLE * np.abs(rgb).max(initial=0.0)
    return int(jumps.sum()), len(jumps)
