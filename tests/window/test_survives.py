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
    blender.until("is_solving()")
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
    assert any("deleted" in line for line in baking.ask("outcome.last_outcome.lines"))


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


def test_the_garbage_collector_waits_for_the_end_of_the_bake(baking):
    frozen = "__import__('gc').get_freeze_count()"
    assert baking.ask(frozen) > 0
    baking.ask("running.request_cancel()")
    assert baking.ask(frozen) == 0


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


# So many pieces of reading, done in one go, end in the middle of it.
IN_THE_MIDDLE = """
bpy.context.scene.antumbra.tolerance = 0.2
bpy.ops.antumbra.bake("INVOKE_DEFAULT")
for _ in range({pieces}):
    next(running._running.reading.pieces)
assert not running._running.is_read
"""

OURS = "[each.name for kind in ('scenes', 'objects', 'meshes', 'materials') for each in getattr(bpy.data, kind) if "
OURS += "'antumbra_temporary' in each.keys()]"


@pytest.fixture
def scene_to_read(blender):
    """Cubes with a noise, which Cycles has to look at."""
    blender.ask("cubes_on_a_plane()")
    blender.ask("""
material = add_material("Noise")
shader = material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node
noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
material.node_tree.links.new(noise.outputs["Color"], shader.inputs["Color"])
for index in range(4):
    bpy.data.objects[f"Cube {index}"].data.materials.append(material)
bpy.ops.ed.undo_push(message="Noise")
bpy.data.objects["Cube 1"].location.z = 2.0
bpy.ops.ed.undo_push(message="Lift")
""")
    return blender


@pytest.mark.parametrize("pieces", [2, 20, 60])
def test_undo_and_saving_while_the_scene_is_read(scene_to_read, pieces, tmp_path):
    window = scene_to_read
    window.ask(IN_THE_MIDDLE.format(pieces=pieces) + "bpy.ops.ed.undo()\nanswer = " + OURS)
    assert window.ask(OURS + " if running._running.reading.pieces is None else []") == []
    window.until("len(baked_objects()) == 5")
    # What was baked is the scene after the undo
    lifted = "max(v.co.z for v in baked_of('Cube 1').data.vertices) + baked_of('Cube 1').location.z"
    assert abs(window.ask(lifted) - 2.0) < 1e-6
    assert window.ask(OURS) == []

    path = str(tmp_path / "middle.blend")
    window.ask(IN_THE_MIDDLE.format(pieces=pieces) + f"bpy.ops.wm.save_as_mainfile(filepath={path!r}, copy=True)")
    window.until("not running.is_running()")
    window.ask(f"bpy.ops.wm.open_mainfile(filepath={path!r})")
    assert window.ask(OURS) == []
    assert window.ask("len(bpy.data.scenes)") == 1


def test_cancel_while_the_scene_is_read(scene_to_read):
    window = scene_to_read
    before = window.ask("fingerprint()")
    window.ask(IN_THE_MIDDLE.format(pieces=40) + "running.request_cancel()")
    assert not window.ask("running.is_running()")
    window.ask("setattr(bpy.context.scene.antumbra, 'tolerance', 0.01)")
    assert window.ask("fingerprint()") == before
    assert window.ask(OURS) == []


def test_reading_waits_for_object_mode(scene_to_read):
    window = scene_to_read
    window.ask("select(bpy.data.objects['Cube 0'])")
    window.ask(IN_THE_MIDDLE.format(pieces=10) + "bpy.ops.object.mode_set(mode='EDIT')")
    window.until("'Object Mode' in running.waiting_for()")
    window.screenshot("waiting to read")
    window.ask("bpy.ops.object.mode_set(mode='OBJECT')")
    window.until("len(baked_objects()) == 5")
