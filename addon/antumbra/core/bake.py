# SPDX-License-Identifier: GPL-3.0-or-later
"""The course of one bake: read, solve, write, report. How each is done is the host's and the solver's business."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from .carry import BakedMesh
from .errors import BakeError, InputError, MemoryShortageError, NoLightError
from .memory import free_bytes
from .pieces import Pieces, at_once, timed
from .preflight import bytes_text, estimate
from .record import SceneRecord
from .report import Timings, assemble
from .settings import Settings


class Progress(Protocol):
    """How far the solver has come."""

    @property
    def stage(self) -> str: ...
    @property
    def fraction(self) -> float: ...
    @property
    def shots(self) -> int: ...
    @property
    def elements(self) -> int: ...
    @property
    def unshot(self) -> float: ...


class Solution(Protocol):
    """What the solver found."""

    @property
    def meshes(self) -> Sequence[BakedMesh]: ...
    @property
    def report(self) -> str: ...


class Job(Protocol):
    """A solver at work in a thread of its own; result() raises BakeError."""

    def progress(self) -> Progress: ...
    def preview(self) -> Sequence[BakedMesh] | None:
        """The meshes as they were at a stage of the bake, each stage at most once."""

    def cancel(self) -> None: ...
    def stop(self) -> None: ...
    def done(self) -> bool: ...
    def result(self) -> Solution: ...


class Host(Protocol):
    """The program whose scene is baked. Its verbs leave it as it was when they raise."""

    def read(self, settings: Settings) -> Pieces[SceneRecord]: ...
    def prepare(self, scene: SceneRecord, solution: Solution, settings: Settings) -> Pieces[None]:
        """Make what write() will put into the scene, which does not change yet."""

    def write(self, scene: SceneRecord, solution: Solution, settings: Settings) -> list[str]:
        """Put it into the scene, prepared or not; return warnings."""

    def discard(self) -> None:
        """Take away what was prepared and not written."""


# How often a waiting caller looks: often enough that a bar moves smoothly, seldom enough to cost nothing.
_POLL_S = 0.02


class Bake:
    """One bake. `begin` reads and starts, `finish` writes; in between the host is free to go on.

    `beginning` does the same as `begin` in pieces. Once the job is done, `prepare` may do most of the writing in
    pieces, so that the host need not wait for all of it.
    """

    def __init__(self, host: Host, start: Callable[[SceneRecord, Settings], Pieces[Job]], settings: Settings) -> None:
        self._host = host
        self._start = start
        self._settings = settings
        self._solution: Solution | None = None
        self._refusal: BakeError | None = None
        self._job: Job | None = None
        self._write_s = 0.0

    def begin(self) -> None:
        """Read the scene and start the solver."""
        at_once(self.beginning())

    def beginning(self) -> Pieces[None]:
        """Read the scene and start the solver; may be left off and begun anew."""
        self._settings.validate()
        self._cpu_start = time.process_time()
        read_start = time.perf_counter()
        self._scene = yield from self._host.read(self._settings)
        if not any(record.receives for record in self._scene.objects):
            raise InputError("there is nothing to bake: no receiving mesh object has a face with area")
        self._refuse_what_memory_cannot_hold()
        self._solve_start = time.perf_counter()
        self._read_s = self._solve_start - read_start
        self._job = yield from self._start(self._scene, self._settings)

    def _refuse_what_memory_cannot_hold(self) -> None:
        """Memory that runs out ends the whole program: what is known to need more than there is must not begin."""
        needed, free = estimate(self._scene, self._settings, cores=1).bytes[0], free_bytes()
        if free is not None and needed > free:
            raise MemoryShortageError(
                f"this bake takes at least {bytes_text(needed)} of memory and {bytes_text(free)} are free: "
                "bake fewer objects at a time, or simpler ones"
            )

    @property
    def job(self) -> Job:
        """The solver at work, once the bake has begun."""
        assert self._job is not None
        return self._job

    @property
    def scene(self) -> SceneRecord:
        """What was read."""
        return self._scene

    @property
    def elapsed_s(self) -> float:
        """Seconds since the solver started."""
        return time.perf_counter() - self._solve_start

    def wait(self, watch: Callable[[Progress], None] | None = None) -> None:
        """Block until the solver is done, showing its progress to `watch`."""
        while not self.job.done():
            if watch is not None:
                watch(self.job.progress())
            time.sleep(_POLL_S)

    def abandon(self) -> None:
        """Cancel the solver and wait until its thread has ended."""
        if self._job is not None:
            self._job.cancel()
            try:
                self._take()
            except BakeError:
                pass  # Whatever it ended with, nobody waits for it any more.
        self._host.discard()

    def prepare(self) -> Pieces[None]:
        """Take the solution and make its meshes; raises BakeError when there is none."""
        yield from timed(self._host.prepare(self._scene, self._take(), self._settings), self._add_write_time)

    def _add_write_time(self, seconds: float) -> None:
        self._write_s += seconds

    def finish(self) -> dict[str, Any]:
        """Take the solution, write it and return the report; raises BakeError when there is none."""
        solution = self._take()
        write_start = time.perf_counter()
        write_warnings = self._host.write(self._scene, solution, self._settings)
        self._write_s += time.perf_counter() - write_start
        timings = Timings(
            read_s=self._read_s,
            solve_s=self._solve_s,
            write_s=self._write_s,
            cpu_s=time.process_time() - self._cpu_start,
        )
        return assemble(self._settings, solution.report, timings, self._scene.all_warnings() + write_warnings)

    def _take(self) -> Solution:
        """The solution, or why there is none, as often as it is asked for."""
        if self._refusal is not None:
            raise self._refusal
        if self._solution is None:
            try:
                self._solution = self.job.result()
            except NoLightError as error:
                self._refusal = NoLightError(self._explain_darkness(str(error)))
                raise self._refusal from None
            except BakeError as error:
                self._refusal = error
                raise
            self._solve_s = time.perf_counter() - self._solve_start
        return self._solution

    def _explain_darkness(self, message: str) -> str:
        """Lights that were left out are the likeliest reason why a user sees light and the solver none."""
        left_out = self._scene.lights_left_out_sentences()
        return f"{message} ({'; '.join(left_out)})" if left_out else message
