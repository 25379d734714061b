# SPDX-License-Identifier: GPL-3.0-or-later
"""Take the tutorial's pictures in Blender's window, by doing what the tutorial says.

python make_pictures.py SCENE.blend FOLDER      (`cargo xtask tutorial` calls it)
"""

import sys
import time
from pathlib import Path

from blender_window import BlenderWindow, missing, png
from conftest import PREPARE

# What a viewport without a graphics card needs to draw.
_DRAWN_S = 2.5

# Until the mouse has gone and with it the tooltip.
_REST = (400, 780)

ZOOM = """
window = bpy.context.window_manager.windows[0]
area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
area.spaces.active.region_3d.view_perspective = "CAMERA"
region = next(region for region in area.regions if region.type == "WINDOW")
with bpy.context.temp_override(window=window, area=area, region=region):
    bpy.ops.view3d.view_center_camera()
# The floor that is baked lies in the grid
overlay = area.spaces.active.overlay
overlay.show_floor = overlay.show_axis_x = overlay.show_axis_y = overlay.show_cursor = False
"""


def main(scene, folder):
    lacking = missing()
    if lacking:
        sys.exit("missing: " + "; ".join(lacking))
    work = folder / "work"
    blender = BlenderWindow(work, scene)
    try:
        prepare = PREPARE.replace("    bpy.data.objects.remove(obj)\n", "    pass\n")
        blender.ask(prepare)
        blender.ask("for obj in bpy.context.view_layer.objects: obj.select_set(False)\n" + ZOOM)
        blender.scroll_down(14)

        def shoot(name, area=None, right=170):
            blender.move(*_REST)
            time.sleep(_DRAWN_S)
            picture = blender.picture()
            if area is not None:
                left, top, width, height = blender.region(area)
                picture = picture[top : top + height, left : left + width]
            if area == "VIEW_3D":
                # Without the buttons at its borders
                picture = picture[220:, 58 : width - right]
            (folder / f"{name}.png").write_bytes(png(picture))

        # Check the scene
        blender.ask("setattr(bpy.context.scene.antumbra, 'receivers', 'ALL')")
        blender.press("bpy.ops.antumbra.check_scene()")
        shoot("check", "PROPERTIES")

        # Bake, and watch
        blender.ask("setattr(bpy.context.scene.antumbra, 'tolerance', 0.0002)")
        blender.press("bpy.ops.antumbra.bake()")
        blender.until("running.live_stage(bpy.context.scene) is not None or not running.is_running()")
        shoot("running")
        blender.ask("running.request_cancel()")
        blender.until("not running.is_running()")
        blender.ask("setattr(bpy.context.scene.antumbra, 'tolerance', 0.01)")
        blender.press("bpy.ops.antumbra.bake()")
        blender.until("len(baked_objects()) > 0")

        # Look
        blender.ask("bpy.ops.antumbra.show_light()")
        shoot("baked", "VIEW_3D")
        blender.ask("bpy.context.scene.antumbra_view.overlay = 'LINES'")
        shoot("lines", "VIEW_3D")
        blender.ask("bpy.context.scene.antumbra_view.overlay = 'NONE'")
        blender.ask("bpy.context.scene.antumbra_view.mode = 'FALSE_COLOURS'")
        shoot("false-colours", "VIEW_3D")
        blender.ask("bpy.context.scene.antumbra_view.mode = 'STORED'")
        blender.ask("bpy.context.scene.antumbra_view.error_curve = True")
        shoot("error-curve", "VIEW_3D", right=0)
    finally:
        blender.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]).absolute())
