# SPDX-License-Identifier: GPL-3.0-or-later
"""How long the window has to wait while a large scene is baked, and how soon a cancel ends it: measured.json.

No number is held against a clock: a screen without a graphics card, drawn by the processor that the solver works on,
waits longer than a desk's. `idle_s` is what drawing alone costs here. What the add-on itself does is measured in
seconds on the wall and of the main thread's processor time, which a busy machine does not stretch.
"""

import json
import os
import time

import pytest

# A file to bake and measure as well.
SCENE = os.environ.get("ANTUMBRA_MEASURED_SCENE")

BAKE = "bpy.ops.antumbra.bake()"

HILLS = """
hills = add_grid("Hills", cells=224, size=20.0)
points = positions(hills.data).copy()
points[:, 2] = 0.4 * np.sin(points[:, 0]) * np.cos(1.3 * points[:, 1])
hills.data.vertices.foreach_set("co", points.reshape(-1))
hills.data.update()
for index in range(60):
    add_cube(f"Cube {index}").location = (index % 10 * 2 - 9, index // 10 * 3 - 8, 2)
add_area_light(location=(1, 1, 12), energy=5000.0)
bpy.context.scene.antumbra.receivers = "ALL"
bpy.context.scene.antumbra.tolerance = 0.2
view_all()
bpy.ops.ed.undo_push(message="Scene")
"""

# As many objects as an interior has, most of them with textures that Cycles has to look at.
INTERIOR = """
material = add_material("Checks")
shader = material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node
checks = material.node_tree.nodes.new("ShaderNodeTexChecker")
places = material.node_tree.nodes.new("ShaderNodeTexCoord")
material.node_tree.links.new(places.outputs["UV"], checks.inputs["Vector"])
material.node_tree.links.new(checks.outputs["Color"], shader.inputs["Color"])
for index in range(780):
    thing = add_grid(f"Thing {index}", cells=13, size=0.8)
    thing.data.uv_layers.new(name="UV")
    thing.location = (index % 30, index // 30, 0.01 * (index % 7))
    if index % 4:
        thing.data.materials.append(material)
add_area_light(location=(15, 13, 12), energy=5000.0)
bpy.context.scene.antumbra.receivers = "ALL"
bpy.context.scene.antumbra.tolerance = 0.5
view_all()
bpy.ops.ed.undo_push(message="Scene")
"""

# Time that the add-on itself keeps Blender from anything else, by what it does.
OWN_TIME = """
import time

own = {"start": [], "read": [], "stage": [], "prepare": [], "finish": []}


def timed(owner, name, key):
    function = getattr(owner, name)

    def measured(*arguments):
        start, of_thread = time.monotonic(), time.thread_time()
        try:
            return function(*arguments)
        finally:
            own[key].append((time.monotonic() - start, time.thread_time() - of_thread))

    setattr(owner, name, measured)


timed(running, "start", "start")
timed(running, "_read_slice", "read")
timed(running, "_bring_stage", "stage")
timed(running, "_prepare_slice", "prepare")
timed(running, "_try_to_finish", "finish")
"""


def test_waits_and_cancel(blender):
    blender.ask(HILLS)
    blender.ask(OWN_TIME)
    time.sleep(2.0)
    blender.ask("agent.longest_wait()")
    time.sleep(3.0)
    measured = {"triangles": 2 * 224**2 + 60 * 12, "idle_s": blender.ask("agent.longest_wait()[1]")}

    # Cancel: from the click to the moment when no bake runs
    blender.press(BAKE)
    blender.until("running.is_running()")
    x, y = blender.find("bpy.ops.antumbra.cancel_bake()", at=0.9)
    blender.move(x, y)
    blender.ask("agent.watch(running.is_running)")
    clicked = blender.click_here()
    blender.until("not running.is_running()")
    measured["cancel_s"] = blender.ask("agent.watched_since[False]") - clicked
    blender.ask("agent.watch(None) or [times.clear() for times in own.values()]")

    # A whole bake
    blender.ask("agent.longest_wait()")
    blender.press(BAKE)
    blender.until("len(baked_objects()) == 61", 600.0)
    measured["longest_wait_s"] = blender.ask("agent.longest_wait()[1]")
    measured["own_s"] = blender.ask(LONGEST)
    blender.screenshot("baked")
    keep(blender, measured)
    assert measured["cancel_s"] > 0.0


def test_waits_while_an_interior_is_read(blender):
    blender.ask(INTERIOR)
    blender.ask(OWN_TIME)
    blender.press(BAKE)
    blender.until("running.is_running() and running._running.is_read", 600.0)
    measured = {"objects": 780, "triangles": 780 * 2 * 13**2, "own_s": blender.ask(LONGEST)}
    blender.ask("running.request_cancel()")
    keep(blender, measured)
    assert blender.ask("baked_objects()") == []


@pytest.mark.skipif(not SCENE, reason="ANTUMBRA_MEASURED_SCENE names no .blend")
def test_waits_in_a_scene_of_yours(blender):
    blender.ask(f"bpy.ops.wm.open_mainfile(filepath={os.path.abspath(SCENE)!r})")
    blender.ask(OWN_TIME)
    blender.ask("bpy.context.scene.antumbra.receivers, bpy.context.scene.antumbra.tolerance = 'ALL', 0.2")
    blender.ask("bpy.ops.antumbra.bake('INVOKE_DEFAULT')")
    blender.until("not running.is_running()", 3600.0)
    triangles = blender.ask("outcome.last_report['result']['triangles']")
    keep(blender, {"scene": SCENE, "triangles": triangles, "own_s": blender.ask(LONGEST)})
    assert triangles > 0


# Of each thing that the add-on does: how often it did that, and the longest times, in seconds: [wall, processor].
LONGEST = "{name: [len(times), sorted(times)[-5:]] for name, times in own.items() if times}"


def keep(blender, measured):
    text = json.dumps(measured, indent=1)
    (blender.folder / "measured.json").write_text(text + "\n")
    print(text)
