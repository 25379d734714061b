# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults: after each of them Blender lives on, one line says what happened, and the file is as it was."""

import os
import time
from pathlib import Path

import antumbra_native
import bpy
import pytest
from extension import module
from fingerprint import fingerprint
from scenes import add_area_light, add_cubes_below_a_lamp, add_mesh, add_plane, bake, baked_objects
from test_command_line import blend, complaint, run  # noqa: F401  (blend is a fixture)

STAGES = ("preparing", "linking surfaces", "finding shadow boundaries", "shooting light", "verifying")


@pytest.fixture
def scene_to_bake():
    """Cubes on a plane below a lamp, and how they are before anything happens to them."""
    add_cubes_below_a_lamp()
    bpy.context.scene.antumbra.receivers = "ALL"
    bpy.context.scene.antumbra.tolerance = 0.1
    return fingerprint()


def refused(message):
    with pytest.raises(RuntimeError, match=message) as raised:
        bpy.ops.antumbra.bake()
    assert len(str(raised.value).strip().splitlines()) == 1
    return str(raised.value)


def message_of_bake():
    """Why it was refused; empty when it was not."""
    try:
        bpy.ops.antumbra.bake()
    except RuntimeError as error:
        return str(error).strip()
    return ""


def test_a_panic_of_the_solver_ends_with_a_file_to_report(scene_to_bake, monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with monkeypatch.context() as failing:
        failing.setattr(antumbra_native, "start", lambda scene, **_settings: antumbra_native._start_failing(scene))
        message = refused("failing as asked for.*bug in Antumbra")
    (path,) = tmp_path.iterdir()
    assert str(path) in message
    assert fingerprint() == scene_to_bake
    # The file has all of it, and the next bake is like any
    native = antumbra_native.Scene()
    settings = module("core.reproduction").load(path, native)
    assert len(antumbra_native.start(native, **settings).result().meshes) == 5
    assert bpy.ops.antumbra.bake() == {"FINISHED"}
    assert len(baked_objects()) == 5


def test_memory_that_would_run_out_is_said_before_it_is_spent(scene_to_bake, monkeypatch):
    with monkeypatch.context() as scarce:
        scarce.setattr(module("core.bake"), "free_bytes", lambda: 1000)
        refused("at least .* of memory and .* are free")
    assert fingerprint() == scene_to_bake
    assert bpy.ops.antumbra.bake() == {"FINISHED"}


@pytest.mark.parametrize("stage", STAGES)
def test_cancelled_at_every_stage(scene_to_bake, stage):
    running = module("bridge.running")
    settings = module("core.settings").Settings(tolerance=0.002, receivers="ALL", verify_points=1_000_000)
    running.start(module("bridge.host").new_bake(settings), bpy.context.scene)
    job = running._running.bake.job
    # Some are over before anybody looks: then the cancel comes in the next one
    reached = STAGES[STAGES.index(stage) :]
    while job.progress().stage not in reached and not job.done():
        time.sleep(0.001)
    bpy.ops.antumbra.cancel_bake()
    running.abandon()
    assert job.done()
    assert fingerprint() == scene_to_bake


@pytest.mark.parametrize("slices", [0, 1, 2, 3, 5])
def test_cancelled_while_its_meshes_are_made(scene_to_bake, slices):
    settings = module("core.settings").Settings(tolerance=0.1, receivers="ALL")
    job = module("bridge.host").new_bake(settings)
    job.begin()
    job.wait()
    pieces = job.prepare()
    for _ in range(slices):
        next(pieces, None)
    job.abandon()
    assert fingerprint() == scene_to_bake


@pytest.mark.parametrize(("name", "value"), [("method", 99), ("tolerance", -3.0), ("domain", 99), ("max_level", 10**6)])
def test_settings_that_a_broken_file_holds(scene_to_bake, name, value):
    """Blender reads what is stored as it is; what cannot be is refused, or taken as the default."""
    group = bpy.context.scene.antumbra
    stored = (
        group.bl_system_properties_get(do_create=True) if bpy.app.version >= (5, 0) else bpy.context.scene["antumbra"]
    )
    stored[name] = value
    before = fingerprint()
    said = message_of_bake()
    if said:
        assert len(said.splitlines()) == 1
        assert name in said
        assert fingerprint() == before
    else:
        assert len(baked_objects()) == 5


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("option", ["--report", "--report-page", "--report-csv"])
def test_a_full_disk(blend, tmp_path, capsys, option):  # noqa: F811
    content = blend.read_bytes()
    assert run("--output", tmp_path / "out.blend", option, "/dev/full", "--set", "tolerance=0.2") == 2
    assert "No space left" in complaint(capsys)
    assert blend.read_bytes() == content


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no such folder elsewhere")
def test_an_output_that_cannot_be_written(blend, tmp_path, capsys):  # noqa: F811
    content = blend.read_bytes()
    taken = tmp_path / "taken.blend"
    taken.mkdir()
    assert run("--output", taken, "--set", "tolerance=0.2") == 2
    assert "taken.blend" in complaint(capsys)
    assert blend.read_bytes() == content


def test_a_report_that_cannot_be_written_is_said(scene_to_bake, monkeypatch, tmp_path):
    bpy.ops.antumbra.bake()
    before = fingerprint()
    monkeypatch.setattr("pathlib.Path.write_text", lambda *_args, **_kwargs: (_ for _ in ()).throw(OSError(28, "full")))
    with pytest.raises(RuntimeError, match="report could not be written"):
        bpy.ops.antumbra.show_report()
    assert fingerprint() == before


def test_a_face_that_crosses_itself_is_baked_as_its_triangles():
    """A bow-tie: Blender cuts it in two triangles, which overlap or face away from each other."""
    add_mesh("Bow-tie", [(-1, -1, 0), (1, 1, 0), (1, -1, 0), (-1, 1, 0)], [(0, 1, 2, 3)])
    add_plane(size=6).location.z = -1
    add_area_light(location=(0, 0, 4))
    bake()
    assert len(baked_objects()) == 2
