# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake as somebody at the desk does it: press, watch, cancel, bake again, undo, redo."""

BAKE = "bpy.ops.antumbra.bake()"
CANCEL = "bpy.ops.antumbra.cancel_bake()"
STOP = "bpy.ops.antumbra.stop_bake()"

# Where the buttons beside the progress bar are, as shares of the editor's width.
RIGHT, LEFT_OF_IT = 0.9, 0.825

# Settings of a bake that would take hours.
ENDLESS = "cubes_on_a_plane(tolerance=1e-6, max_level=16)"


def test_bake_cancel_bake_again_undo_redo(blender):
    blender.ask(ENDLESS)
    before = blender.ask("fingerprint()")
    blender.screenshot("1 before")

    # Press Bake, watch
    blender.press(BAKE)
    blender.until("is_solving()")
    blender.screenshot("2 running")
    assert blender.ask("fingerprint()") == before

    # Cancel
    blender.press(CANCEL, at=RIGHT)
    blender.until("not running.is_running()")
    blender.screenshot("3 cancelled")
    assert blender.ask("fingerprint()") == before
    assert "ancelled" in blender.ask("outcome.last_outcome.lines[0]")

    # Bake again, to the end
    blender.ask("setattr(bpy.context.scene.antumbra, 'tolerance', 0.05)")
    blender.ask("bpy.ops.ed.undo_push(message='Tolerance')")
    before = blender.ask("fingerprint()")
    blender.press(BAKE)
    blender.until("len(baked_objects()) == 5")
    light = blender.ask("light()")
    blender.screenshot("4 baked")
    assert len(set(light.values())) > 1

    # Undo takes all of it back in one step, redo brings it again
    blender.over_viewport()
    blender.key("ctrl+z")
    blender.until("not baked_objects()")
    blender.screenshot("5 undone")
    assert blender.ask("fingerprint()") == before
    blender.key("ctrl+shift+z")
    blender.until("len(baked_objects()) == 5")
    assert blender.ask("light()") == light
    blender.screenshot("6 redone")


def test_stop_keeps_the_light_found_so_far(blender):
    blender.ask(ENDLESS)
    blender.press(BAKE)
    blender.until("running.is_running()")
    blender.press(STOP, at=LEFT_OF_IT)
    blender.until("len(baked_objects()) == 5")
    assert blender.ask("max(radiance(obj.data).max() for obj in baked_objects()) > 0")


def test_the_status_bar_cancels_too(blender):
    blender.ask(ENDLESS)
    blender.press(BAKE)
    blender.until("running.is_running()")
    blender.press_in_status_bar(CANCEL)
    blender.until("not running.is_running()")
    assert blender.ask("baked_objects()") == []
