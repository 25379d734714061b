# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that is read in slices while Blender goes on.

While that lasts there are datablocks of ours in the file, so whoever wants to undo or to save puts it off: these are
removed first, and reading begins anew. So does it where something that is read was deleted.
"""

from __future__ import annotations

import math
import time

from ..core.bake import Bake
from ..core.errors import BakeError
from ..core.pieces import Pieces, at_once, for_a_moment

# Between two slices Blender gets its turn.
PAUSE_S = 0.001

# How long it waits for a slice: about a frame of a screen, so that nobody sees it stutter.
SLICE_S = 0.015

# Most slices make Blender draw its viewports anew. Where that takes longer than the slice, as without a
# graphics card, reading goes on for as long, so that the whole does not take ten times its time; up to where somebody
# would notice one slice by itself, with the piece that ends it.
_LONGEST_SLICE_S = 0.03

# Somebody who deletes things all the time is told so.
_MOST_READINGS = 5


class Slices:
    """One after the other, of pieces that someone waits for."""

    def __init__(self) -> None:
        self._end = math.inf
        """When the last one was over, by time.perf_counter()."""

    def do_one(self, pieces: Pieces[object]) -> bool:
        """Go on for a moment; returns whether no piece is left."""
        of_blender = time.perf_counter() - self._end - PAUSE_S
        try:
            return for_a_moment(pieces, min(max(of_blender, SLICE_S), _LONGEST_SLICE_S))
        finally:
            self._end = time.perf_counter()


class SlowReading:
    """The reading of a bake's scene, to whose end the solver starts."""

    def __init__(self, bake: Bake) -> None:
        self._bake = bake
        self._begun = 0
        self._slices = Slices()
        self.pieces: Pieces[None] | None = None
        """None while it is put off."""
        self.is_over = False

    def all_at_once(self) -> None:
        """Without a stop, where nobody waits; raises BakeError."""
        at_once(self._begin())
        self.is_over = True

    def first_piece(self) -> None:
        """What refuses most scenes that cannot be baked; raises BakeError."""
        next(self._begin())

    def slice(self) -> None:
        """Go on for a moment; raises BakeError."""
        try:
            self.is_over = self._slices.do_one(self.pieces or self._begin())
        except ReferenceError:
            self.put_off()
            if self._begun >= _MOST_READINGS:
                raise BakeError(
                    "things were deleted again and again while the scene was read; nothing was changed"
                ) from None

    def put_off(self) -> None:
        """Take what is ours out of the file; the next slice begins anew."""
        if self.pieces is not None:
            self.pieces.close()
        self.pieces = None

    def _begin(self) -> Pieces[None]:
        self._begun += 1
        self.pieces = self._bake.beginning()
        return self.pieces
