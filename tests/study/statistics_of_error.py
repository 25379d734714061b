# SPDX-License-Identifier: GPL-3.0-or-later
"""From values at points to an error with its interval; from errors at tolerances to sizes at a wanted error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RESAMPLES = 1000
"""Bootstrap samples: their own chance moves a 95 % bound by about a tenth of the interval."""


@dataclass(frozen=True)
class RelativeError:
    """Rms error relative to the mean of the reference, with the bounds of its 95 % interval."""

    value: float
    low: float
    high: float


def relative_error(values: Floats, reference: Floats, stderr: Floats, seed: int = 0) -> RelativeError:
    """Error of values (N, 3) against a reference (N, 3) that is itself uncertain by stderr (N, 3).

    sqrt(max(0, mean((B - Bref)² - stderr²))) / mean(Bref): the reference's noise adds its square to the squared
    difference, so it is taken off again. The interval is the percentile bootstrap over the points.
    """
    squares = ((values - reference) ** 2 - stderr**2).mean(axis=1)
    means = reference.mean(axis=1)

    def error(chosen: NDArray[np.intp]) -> float:
        return float(np.sqrt(max(0.0, squares[chosen].mean())) / means[chosen].mean())

    count = len(squares)
    chance = np.random.default_rng(seed)
    resampled = [error(chance.integers(0, count, count)) for _ in range(RESAMPLES)]
    low, high = np.quantile(resampled, [0.025, 0.975])
    return RelativeError(error(np.arange(count)), float(low), float(high))


def at_error(wanted: float, errors: Sequence[float], sizes: Sequence[float]) -> float | None:
    """Size (vertices, seconds) at the wanted error, from a straight line between logarithms; None outside the data.

    The points are those of one method in order of falling tolerance. Where the error does not fall steadily, the first
    crossing from above counts: the cheapest bake that reaches the error.
    """
    for (above, size_above), (below, size_below) in zip(
        zip(errors, sizes, strict=True), list(zip(errors, sizes, strict=True))[1:], strict=False
    ):
        if above >= wanted >= below > 0.0:
            if above == below:
                return size_below
            share = np.log(above / wanted) / np.log(above / below)
            return float(np.exp((1.0 - share) * np.log(size_above) + share * np.log(size_below)))
    return None
