# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the paper's test scene: a cube floats over a plane under two lights of different colour.

... paper.py -- OUT.blend [direct=LIGHTS]

The cube has edges of 1 m, is turned by 20 degrees and floats 0.5 m above a plane of 6 m; the lights are squares of
0.5 m at a height of 4 m.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.scenes.building import Shape, add, add_camera, add_light, make, matte

# Exitance pi·L in W/m² of each light, and where it hangs.
LIGHTS = (
    ("light0", (120.0, 80.0, 40.0), (-1.5, -1.0, 4.0)),
    ("light1", (30.0, 60.0, 110.0), (1.2, 1.4, 4.0)),
)
LIGHT_EDGE_M = 0.5


def build() -> None:
    """Add the scene to the open file."""
    plane = Shape().mesh([(x, y, 0.0) for y in (-3.0, 3.0) for x in (-3.0, 3.0)], [(0, 1, 3, 2)])
    add("plane", plane, matte("plane", (0.7, 0.7, 0.7)))
    corners = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
    cube = [(x, y, z) for z in (0.5, 1.5) for x, y in corners]
    sides = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    turned = Shape().mesh(cube, [(0, 3, 2, 1), (4, 5, 6, 7), *sides]).standing(0.0, 0.0, 20.0)
    add("cube", turned, matte("cube", (0.5, 0.5, 0.5)))
    for name, exitance_rgb, place in LIGHTS:
        add_light(name, exitance_rgb, place, (LIGHT_EDGE_M, LIGHT_EDGE_M))
    add_camera((5.2, -7.4, 6.4), (0.0, -0.1, 0.3), 38.0)


if __name__ == "__main__":
    make(build)
