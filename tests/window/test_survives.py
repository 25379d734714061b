# SPDX-License-Identifier: GPL-3.0-or-later
"""What somebody may do at the desk while a bake is running."""

import pytest

BAKE = "bpy.ops.antumbra.bake()"


@pytest.fixture
def baking(blender):
    """A bake that would take hours, and an earlier step that can be undone."""
    blender.ask("cubes_on_a_plane(tolerance=1e-6, max_level=16)")
    blender.ask("bpy.data.objects['Cube 1'].location.z = 2.0")
    blender.ask("bpy.ops.ed.undo_push(message='Lift')")
    blender.press(BAKE)
    blender.until("running.is_running()")
    return blender


def stop(window):
    window.ask("running.request_stop()")


def test_undo_and_redo(baking):
    baking.over_viewport()
    baking.key("ctrl+z")
    baking.until("bpy.data.objects['Cube 1'].location.z == 1.0")
    assert baking.ask("running.is_running()")
    baking.key("ctrl+shift+z")
    baking.until("bpy.data.objects['Cube 1'].location.z == 2.0")
    baking.key("ctrl+z")
    stop(baking)
    baking.until("len(baked_objects()) == 5")
    # The light is that of the scene when Bake was pressed, and one step further back lies the scene without it.
    baking.key("ctrl+z")
    baking.until("not baked_objects()")
    assert baking.ask("bpy.data.objects['Cube 1'].location.z") == 1.0


def test_deleting_a_baked_object(baking):
    baking.ask("select(bpy.data.objects['Cube 2'])")
    baking.over_viewport()
    baking.key("Delete")
    baking.until("'Cube 2' not in bpy.data.objects")
    stop(baking)
    baking.until("len(baked_objects()) == 4")
    assert any("deleted" in line for line in baking.ask("running.last_outcome.lines"))


def test_edit_mode_holds_the_result_back(baking):
    baking.ask("select(bpy.data.objects['Cube 0'])")
    baking.over_viewport()
    baking.key("Tab")
    baking.until("bpy.context.mode == 'EDIT_MESH'")
    stop(baking)
    baking.until("'Object Mode' in running.waiting_for()")
    baking.screenshot("waiting")
    assert not baking.ask("baked_objects()")
    baking.key("Tab")
    baking.until("len(baked_objects()) == 5")


def test_a_drag_holds_the_result_back(baking):
    baking.ask("select(bpy.data.objects['Cube 0'])")
    baking.over_viewport()
    baking.key("g")
    baking.until("len(bpy.context.window_manager.windows[0].modal_operators) > 0")
    stop(baking)
    baking.until("'current action' in running.waiting_for()")
    baking.key("Escape")
    baking.until("len(baked_objects()) == 5")


def test_escape_ends_a_drag_first_and_then_the_bake(baking):
    before = baking.ask("fingerprint()")
    baking.ask("select(bpy.data.objects['Cube 0'])")
    baking.over_viewport()
    baking.key("g")
    baking.until("len(bpy.context.window_manager.windows[0].modal_operators) > 0")
    baking.key("Escape")
    baking.until("len(bpy.context.window_manager.windows[0].modal_operators) == 0")
    assert baking.ask("running.is_running()")
    baking.key("Escape")
    baking.until("not running.is_running()")
    baking.ask("select()")
    assert baking.ask("fingerprint()") == before


def test_a_new_file_ends_the_bake(baking):
    baking.over_viewport()
    baking.key("ctrl+n")
    baking.in_dialog("g")  # General
    baking.in_dialog("d")  # Don't Save
    baking.until("not running.is_running()")
    assert not baking.ask("running.is_running()")
    assert "Cube 1" not in baking.ask("list(bpy.data.objects.keys())")


def test_disabling_the_add_on_ends_the_bake(baking):
    baking.ask("bpy.ops.preferences.addon_disable(module=EXTENSION)")
    assert not baking.ask("running.is_running()")
    assert not baking.ask("hasattr(bpy.types.Scene, 'antumbra')")
    baking.screenshot("disabled")
    baking.ask("bpy.ops.preferences.addon_enable(module=EXTENSION)")
    assert baking.ask("bpy.context.scene.antumbra.method") == "ADM"


def test_quitting_ends_the_bake(baking):
    baking.over_viewport()
    baking.key("ctrl+q")
    baking.in_dialog("d")  # Don't Save
    assert baking.process.wait(20) == 0
