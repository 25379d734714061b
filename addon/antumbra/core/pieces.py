# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work in pieces: a generator that stops between two of them, and whose value is what came of it.

Whoever runs the pieces decides how many to do at a time. What it yields says whether the program around it must have
its turn now (TURN), because the next piece is a long one, or may have it (GO_ON).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from typing import TypeVar

_Result = TypeVar("_Result")

Pieces = Generator[bool, None, _Result]

GO_ON, TURN = False, True

ROWS = 16_384
"""Of arrays, that a piece goes through: some milliseconds of arithmetic."""


def rows_of(count: int, most: int = ROWS) -> Iterator[slice]:
    """Where the parts of an array of so many rows are, none longer than `most`."""
    return (slice(first, min(first + most, count)) for first in range(0, count, most))


def at_once(pieces: Pieces[_Result]) -> _Result:
    """All of it, without a stop."""
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            result: _Result = end.value
            return result


def for_a_moment(pieces: Pieces[object], seconds: float) -> bool:
    """As many pieces as fit into a time, one at least; returns whether none is left."""
    end = time.perf_counter() + seconds
    while True:
        try:
            must_stop = next(pieces)
        except StopIteration:
            return True
        if must_stop or time.perf_counter() >= end:
            return False


def timed(pieces: Pieces[_Result], took: Callable[[float], None]) -> Pieces[_Result]:
    """The same pieces; `took` gets the seconds of each."""
    while True:
        start = time.perf_counter()
        try:
            turn = next(pieces)
        except StopIteration as end:
            took(time.perf_counter() - start)
            result: _Result = end.value
            return result
        took(time.perf_counter() - start)
        yield turn
