# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a sunlit room: a table and a bench in a room with a wide window, sun and sky outside.

... sunlit.py -- OUT.blend [direct=LIGHTS]

The room is 5 m by 4 m by 2.7 m, its window 2.4 m by 1.5 m with a cross of bars. The sun stands 35 degrees high and has
Blender's default angle, its light falls on floor, table and the wall behind. All but a few per cent of what reaches the
ceiling has been reflected.
"""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.scenes.building import Shape, add, add_camera, make, matte, measure_only

X, Y, Z = 2.5, 2.0, 2.7
WINDOW = (-1.2, 1.2, 0.9, 2.4)
"""Its borders along y and z, in the wall at x = X."""
BAR_M = 0.05
SUN_W, SKY_RGB = 4.0, (0.5, 0.7, 1.0)


def room() -> Shape:
    """Floor, ceiling and walls as seen from inside, the wall with the window in four parts."""
    shape = Shape()
    shape.polygon((-X, -Y, 0), (X, -Y, 0), (X, Y, 0), (-X, Y, 0))
    shape.polygon((-X, -Y, Z), (-X, Y, Z), (X, Y, Z), (X, -Y, Z))
    shape.polygon((-X, -Y, 0), (-X, Y, 0), (-X, Y, Z), (-X, -Y, Z))
    shape.polygon((-X, -Y, 0), (-X, -Y, Z), (X, -Y, Z), (X, -Y, 0))
    shape.polygon((-X, Y, 0), (X, Y, 0), (X, Y, Z), (-X, Y, Z))
    left, right, low, high = WINDOW
    for y0, y1, z0, z1 in ((-Y, left, 0, Z), (right, Y, 0, Z), (left, right, 0, low), (left, right, high, Z)):
        shape.polygon((X, y0, z0), (X, y0, z1), (X, y1, z1), (X, y1, z0))
    return shape


def build() -> None:
    """Add the scene to the open file."""
    half = 0.5 * BAR_M
    left, right, low, high = WINDOW
    middle = 0.5 * (low + high)
    bars = Shape().box((X - half, -half, low), (X + half, half, high))
    bars.box((X - half, left, middle - half), (X + half, right, middle + half))
    table = Shape().box((-0.4, -0.9, 0.70), (0.5, 0.9, 0.74))
    for x in (-0.36, 0.40):
        for y in (-0.86, 0.80):
            table.box((x, y, 0.0), (x + 0.06, y + 0.06, 0.70))
    bench = Shape().box((-2.3, -1.0, 0.0), (-1.8, 1.0, 0.45))
    measured = [
        add("room", room(), matte("plaster", (0.75, 0.72, 0.66))),
        add("table", table, matte("wood", (0.45, 0.30, 0.18))),
        add("bench", bench, matte("cloth", (0.20, 0.30, 0.42))),
    ]
    add("bars", bars, matte("paint", (0.8, 0.8, 0.8)))

    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy = SUN_W
    sun.matrix_world = Matrix.Rotation(math.radians(10), 4, "Z") @ Matrix.Rotation(math.radians(55), 4, "Y")
    bpy.context.scene.collection.objects.link(sun)
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*SKY_RGB, 1.0)
    add_camera((-2.3, -1.7, 1.9), (0.6, 0.4, 0.7), 20.0)
    measure_only(measured)


if __name__ == "__main__":
    make(build)
