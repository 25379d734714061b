# SPDX-License-Identifier: GPL-3.0-or-later
"""What is seen before a bake, while it runs, and afterwards."""

import time

import numpy as np

BAKE = "bpy.ops.antumbra.bake()"

# So many of 255 steps is what one sees at a glance.
_PLAIN = 20

# A viewport without a graphics card draws a while after it was told to.
_DRAWN_S = 1.5


def share_that_differs(before, after):
    """Of the pixels of two pictures."""
    return float(np.mean(np.abs(after - before).max(axis=2) > _PLAIN))


def test_the_list_before_a_bake_selects_what_it_names(blender):
    blender.ask("cubes_on_a_plane()")
    blender.ask("bpy.data.objects['Cube 2'].data.materials.append(add_material('Coal', Color=(0, 0, 0, 1)))")
    blender.ask("select(bpy.data.objects['Plane'])")
    blender.scroll_down()
    blender.press("bpy.ops.antumbra.check_scene()")
    blender.until("module('bridge.preflight').last_of(bpy.context.scene) is not None")
    time.sleep(_DRAWN_S)
    blender.screenshot("checked")
    blender.press("bpy.ops.antumbra.select_finding(", at=0.93)
    blender.until("[obj.name for obj in bpy.context.selected_objects] == ['Cube 2']")
    blender.screenshot("selected")


def test_light_is_seen_while_it_is_computed_and_nothing_of_it_stays(blender):
    blender.ask("cubes_on_a_plane(tolerance=1e-4, max_level=16)")
    blender.ask("bpy.context.scene.antumbra_view.live_preview = True")
    before = blender.ask("fingerprint()")
    time.sleep(_DRAWN_S)
    dark = blender.viewport()
    blender.press(BAKE)
    blender.until("running.live_stage(bpy.context.scene) is not None")
    time.sleep(_DRAWN_S)
    blender.screenshot("while it runs")
    assert share_that_differs(dark, blender.viewport()) > 0.05
    assert blender.ask("fingerprint()") == before
    blender.ask("running.request_cancel()")
    blender.until("not running.is_running()")
    time.sleep(_DRAWN_S)
    assert share_that_differs(dark, blender.viewport()) < 0.002
    assert blender.ask("fingerprint()") == before


def test_the_error_curve_is_drawn_into_the_corner_and_goes_again(blender):
    blender.ask("cubes_on_a_plane(tolerance=0.02)")
    blender.press(BAKE)
    blender.until("len(baked_objects()) == 5")
    time.sleep(_DRAWN_S)
    left, top, width, height = blender.region("VIEW_3D")

    def corner():
        return blender.picture().astype(int)[top + height - 250 : top + height, left + width - 400 : left + width]

    before = corner()
    blender.press("error_curve", at=0.7)
    blender.move(left + 200, top + height // 2)
    time.sleep(_DRAWN_S)
    blender.screenshot("error curve")
    after = corner()
    assert share_that_differs(before, after) > 0.5
    red, green, blue = np.moveaxis(after, 2, 0)
    assert np.sum((blue > 190) & (red < 140)) > 100, "the verified error is a blue line"
    assert np.sum((red > 200) & (blue < 100)) > 10, "the estimate is orange"
    assert np.sum((blue > 60) & (blue < 130) & (blue > red + 25)) > 1_000, "the interval is seen through"
    blender.press("error_curve", at=0.7)
    blender.move(left + 200, top + height // 2)
    time.sleep(_DRAWN_S)
    assert share_that_differs(before, corner()) < 0.002


def test_lines_false_colours_and_exposure_are_seen_and_go_again(blender):
    blender.ask("cubes_on_a_plane(tolerance=0.02)")
    blender.ask("bpy.ops.antumbra.bake()")
    blender.ask("bpy.ops.antumbra.show_light()")
    time.sleep(_DRAWN_S)
    light = blender.viewport()
    for name, setting in {
        "lines": "view.overlay = 'LINES'",
        "elements": "view.overlay = 'ELEMENTS'",
        "false colours": "view.mode = 'FALSE_COLOURS'",
        "exposed": "view.mode, view.exposure = 'EXPOSED', -2.0",
    }.items():
        blender.ask(f"view = bpy.context.scene.antumbra_view; {setting}; view_all()")
        time.sleep(_DRAWN_S)
        blender.screenshot(name)
        assert share_that_differs(light, blender.viewport()) > 0.005, name
        blender.ask("view.overlay, view.mode = 'NONE', 'STORED'; view_all()")
        time.sleep(_DRAWN_S)
        assert share_that_differs(light, blender.viewport()) < 0.002, name


def test_the_panel_and_the_legend_speak_german(blender):
    blender.ask("cubes_on_a_plane(tolerance=0.05)")
    blender.press(BAKE)
    blender.until("len(baked_objects()) == 5")
    blender.ask("setattr(bpy.context.scene.antumbra_view, 'overlay', 'ELEMENTS')")
    left, top, width, height = blender.region("PROPERTIES")

    def panel():
        blender.move(left - 300, top + height // 2)
        time.sleep(_DRAWN_S)
        return blender.picture().astype(int)[top : top + height, left : left + width]

    english = panel()
    blender.ask("""
view = bpy.context.preferences.view
view.language = "de_DE"
view.use_translate_interface = view.use_translate_tooltips = True
""")
    german = panel()
    blender.screenshot("german")
    assert blender.ask("bpy.app.translations.pgettext_iface('Before the Bake')") == "Vor dem Backen"
    assert share_that_differs(english, german) > 0.01
    assert "Dreiecke" in blender.ask("outcome.last_outcome.lines[0]")
    x, y = blender.find(BAKE)
    blender.move(x, y)
    time.sleep(_DRAWN_S)
    blender.screenshot("german tooltip")
    blender.ask("setattr(bpy.context.preferences.view, 'language', 'en_US')")
    assert share_that_differs(english, panel()) < 0.01
