# SPDX-License-Identifier: GPL-3.0-or-later
"""Job: a bake in a thread that can be watched, stopped, cancelled and dropped while Python goes on."""

import gc
import json
import signal
import threading
import time

import antumbra_native
import pytest
from native_scenes import lit_floor

# The solver looks for a wish every 50 ms; the rest is for a busy machine.
PROMPT_S = 2.0


def endless() -> antumbra_native.Job:
    """Start a bake that would take minutes."""
    return antumbra_native.start(lit_floor(cells=8), tolerance=1e-6, max_level=14)


def test_progress_ends_at_one() -> None:
    job = antumbra_native.start(lit_floor())
    while not job.done():
        assert 0.0 <= job.progress().fraction <= 1.0
        time.sleep(0.001)
    progress = job.progress()
    assert (progress.stage, progress.fraction) == ("done", 1.0)
    assert progress.shots >= 1
    assert progress.elements >= 1
    assert 0.0 <= progress.unshot < 1.0
    job.result()


def test_result_is_handed_over_once() -> None:
    job = antumbra_native.start(lit_floor())
    job.result()
    assert job.done()
    with pytest.raises(RuntimeError, match="taken before"):
        job.result()


def test_cancel_is_prompt() -> None:
    job = endless()
    time.sleep(0.2)
    assert not job.done()
    start = time.monotonic()
    job.cancel()
    with pytest.raises(antumbra_native.BakeCancelled):
        job.result()
    assert time.monotonic() - start < PROMPT_S


def test_stop_keeps_what_there_is() -> None:
    job = antumbra_native.start(lit_floor(cells=8), tolerance=1e-4)
    job.stop()
    bake = job.result()
    assert len(bake.meshes) == 1
    assert json.loads(bake.report)["result"]["ended_by"] == "stopped"


def test_dropping_a_job_ends_its_thread() -> None:
    job = endless()
    time.sleep(0.1)
    start = time.monotonic()
    del job
    gc.collect()
    assert time.monotonic() - start < PROMPT_S


def test_waiting_leaves_python_alone() -> None:
    job = endless()
    ticks = 0

    def tick() -> None:
        nonlocal ticks
        for _ in range(20):
            time.sleep(0.01)
            ticks += 1
        job.cancel()

    # `result` waits in this thread: the other one only gets on when the interpreter's lock is free.
    thread = threading.Thread(target=tick)
    thread.start()
    with pytest.raises(antumbra_native.BakeCancelled):
        job.result()
    assert ticks == 20
    thread.join()


def test_ctrl_c_cancels_a_waiting_bake() -> None:
    # A process that a shell started in the background inherits "ignore"; a person at a prompt does not.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        job = endless()
        threading.Timer(0.2, lambda: signal.raise_signal(signal.SIGINT)).start()
        start = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            job.result()
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - start < 0.2 + PROMPT_S
    assert job.done()


def test_a_preview_is_there_once_for_each_stage_and_only_for_who_asks() -> None:
    job = antumbra_native.start(lit_floor(cells=8), tolerance=1e-3)
    previews = []
    while not job.done():
        preview = job.preview()
        if preview is not None:
            previews.append(preview)
    (final,) = job.result().meshes
    assert previews
    for (mesh,) in previews:
        assert mesh.corner_radiance.shape == (len(mesh.triangles), 3, 3)
        assert mesh.edge_line.shape == mesh.triangles.shape
        assert len(mesh.triangles) <= len(final.triangles)
    assert job.preview() is None
