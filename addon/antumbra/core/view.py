# SPDX-License-Identifier: GPL-3.0-or-later
"""Stored light as colours for a screen: exposed, or as false colours of lux with their legend."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .colours import Linear, srgb_decoded
from .lights import Floats

LUMENS_PER_WATT = 683.0
"""Of light that the eye sees best; what Blender's glTF exporter takes for all light, so that numbers agree."""

# Share of the luminance that the channels of Rec. 709 have.
_LUMINANCE = (0.2126, 0.7152, 0.0722)

# Inferno (CC0, of matplotlib), at nine even steps, sRGB: brightness rises evenly, also for eyes that see few colours.
_INFERNO = np.array(
    [
        (0.001, 0.000, 0.014),
        (0.122, 0.047, 0.283),
        (0.342, 0.062, 0.429),
        (0.550, 0.134, 0.412),
        (0.736, 0.216, 0.330),
        (0.885, 0.320, 0.199),
        (0.972, 0.503, 0.027),
        (0.980, 0.765, 0.224),
        (0.988, 0.998, 0.645),
    ]
)

# This share of all corners is brighter than the end of an automatic range: one lamp shall not darken the rest.
_ABOVE_RANGE = 0.002


def photometric(rgb: Linear, is_irradiance: bool) -> Floats:
    """(N,) of (N, 3) stored light: lux where it is H/pi, cd/m² where it is B/pi."""
    luminance = rgb.astype(np.float64) @ np.array(_LUMINANCE) * LUMENS_PER_WATT
    return np.asarray(math.pi * luminance if is_irradiance else luminance)


def unit_of(is_irradiance: bool) -> str:
    return "lx" if is_irradiance else "cd/m²"


def false_colours(values: Linear, end: float) -> Floats:
    """(N, 3) scene-linear colours of values from 0 to `end`; beyond is the last colour."""
    place = np.clip(values / end, 0.0, 1.0) * (len(_INFERNO) - 1)
    steps = np.arange(len(_INFERNO))
    encoded = np.stack([np.interp(place, steps, _INFERNO[:, channel]) for channel in range(3)], axis=-1)
    return srgb_decoded(encoded)


def exposed(rgb: Linear, stops: float) -> Floats:
    """(N, 3) light times 2 to the stops, ending at 1 as the viewport does."""
    return np.asarray(np.clip(rgb.astype(np.float64) * 2.0**stops, 0.0, 1.0))


def automatic_end(values: list[NDArray[Any]]) -> float:
    """The end of a scale over all values: the next of 1, 2 and 5 times a power of ten."""
    filled = [each for each in values if len(each)]
    if not filled:
        return 1.0
    brightest = float(np.quantile(np.concatenate(filled), 1.0 - _ABOVE_RANGE))
    if not brightest > 0.0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(brightest))
    return next(step * decade for step in (1.0, 2.0, 5.0, 10.0) if step * decade >= brightest * (1.0 - 1e-9))


def legend(end: float, unit: str, ticks: int = 5) -> list[tuple[float, str]]:
    """Places from 0 to 1 along the scale, with their texts."""
    texts = [_number_text(end * k / ticks) for k in range(ticks + 1)]
    return [(k / ticks, text if k < ticks else f"{text} {unit}") for k, text in enumerate(texts)]


def _number_text(value: float) -> str:
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.3g}"
