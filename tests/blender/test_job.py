# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake that runs while Blender goes on; what happens in its window is checked where there is one."""

import bpy
import pytest
from conftest import EXTENSION
from extension import module
from fingerprint import fingerprint
from scenes import add_cubes_below_a_lamp, baked_objects


@pytest.fixture
def long_bake():
    """A job that would take hours."""
    add_cubes_below_a_lamp()
    scene = bpy.context.scene
    settings = module("core.settings").Settings(tolerance=1e-6, max_level=16, receivers="ALL")
    before = fingerprint()
    running = module("bridge.running")
    running.start(module("bridge.host").new_bake(settings), scene)
    assert running.is_running()
    assert fingerprint() == before
    yield running
    running.abandon()


def test_a_second_bake_is_refused_while_one_runs(long_bake):
    with pytest.raises(RuntimeError, match="A bake is running"):
        bpy.ops.antumbra.bake()


def test_progress_can_be_asked_for_at_any_time(long_bake):
    progress = long_bake.progress()
    assert 0.0 <= progress.fraction <= 1.0
    assert progress.stage


def test_cancel_ends_it_and_changes_nothing(long_bake):
    before = fingerprint()
    bake = long_bake._running.bake
    assert bpy.ops.antumbra.cancel_bake() == {"FINISHED"}
    assert not long_bake.is_running()
    assert fingerprint() == before
    # Its thread is waited for when nobody waits for the window any more.
    long_bake.abandon()
    assert bake.job.done()
    assert module("bridge.outcome").last_outcome.lines == ["Cancelled; nothing was changed"]


def test_another_bake_may_begin_at_once_after_a_cancel(long_bake):
    bpy.ops.antumbra.cancel_bake()
    bpy.context.scene.antumbra.receivers, bpy.context.scene.antumbra.tolerance = "ALL", 0.2
    assert bpy.ops.antumbra.bake() == {"FINISHED"}
    assert len(baked_objects()) == 5


def test_stop_keeps_what_is_there(long_bake):
    assert bpy.ops.antumbra.stop_bake() == {"FINISHED"}
    assert bpy.ops.antumbra.finish_bake() == {"FINISHED"}
    assert len(baked_objects()) == 5
    assert not long_bake.is_running()


def test_loading_a_file_cancels(long_bake):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not long_bake.is_running()
    assert not bpy.app.timers.is_registered(long_bake._tick)


def test_disabling_the_extension_cancels_and_leaves_nothing_behind(long_bake):
    bpy.ops.preferences.addon_disable(module=EXTENSION)
    try:
        assert not long_bake.is_running()
        assert not hasattr(bpy.types.Scene, "antumbra")
        assert not hasattr(bpy.types.Object, "antumbra")
        assert not hasattr(bpy.types, "ANTUMBRA_OT_bake")
        assert long_bake._before_load not in bpy.app.handlers.load_pre
    finally:
        bpy.ops.preferences.addon_enable(module=EXTENSION)
    assert bpy.context.scene.antumbra.method == "ADM"


def test_sources_deleted_in_the_meantime_are_left_out(long_bake):
    bpy.data.objects.remove(bpy.data.objects["Cube 1"])
    bpy.data.objects["Cube 2"].name = "Renamed"
    bpy.ops.antumbra.stop_bake()
    bpy.ops.antumbra.finish_bake()
    assert sorted(obj.antumbra.source.name for obj in baked_objects()) == ["Cube 0", "Cube 3", "Plane", "Renamed"]
    assert any("deleted" in line and "“Cube 1”" in line for line in module("bridge.outcome").last_outcome.lines)


def test_a_file_saved_in_the_middle_opens_as_if_there_were_no_bake(long_bake, tmp_path):
    path = str(tmp_path / "middle.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert not long_bake.is_running()
    assert baked_objects() == []
    assert all(obj.antumbra.role == "NONE" for obj in bpy.data.objects)
