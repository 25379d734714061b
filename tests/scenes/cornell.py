# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the Cornell box: the coordinates and colours that Cornell University measured and published, open at the front.

... cornell.py -- OUT.blend [direct=LIGHTS]

The published millimetres are scaled to a box of about 5.5 m (1/100), its y (up) becomes our z, and its z (depth) our y.
That swap mirrors, so x is turned round as well: red stays on the left of a camera that looks in. The reflectances are
the published spectra as the linear RGB that most renderers use for them, the light's are its emission at 700, 600 and
500 nm. The lamp is an area light; it hangs 1 mm (scaled: 0.01 m) below the ceiling, whose plane the published one
shares.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.scenes.building import Shape, add, add_camera, add_light, make, matte

Published = tuple[tuple[float, float, float], ...]

WHITE, RED, GREEN = (0.7295, 0.7355, 0.729), (0.611, 0.0555, 0.062), (0.117, 0.4125, 0.115)
# Its absolute strength is not published.
LAMP_EXITANCE_RGB = (18.4, 15.6, 8.0)
LAMP_X_MM, LAMP_Y_MM, LAMP_Z_MM = (213.0, 343.0), 548.8, (227.0, 332.0)
LAMP_BELOW_CEILING_M = 0.01

# In published order: seen from inside, and from outside the blocks, every polygon runs anticlockwise.
WALLS: dict[str, tuple[tuple[float, float, float], Published]] = {
    "floor": (WHITE, ((552.8, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 559.2), (549.6, 0.0, 559.2))),
    "ceiling": (WHITE, ((556.0, 548.8, 0.0), (556.0, 548.8, 559.2), (0.0, 548.8, 559.2), (0.0, 548.8, 0.0))),
    "back": (WHITE, ((549.6, 0.0, 559.2), (0.0, 0.0, 559.2), (0.0, 548.8, 559.2), (556.0, 548.8, 559.2))),
    "right": (GREEN, ((0.0, 0.0, 559.2), (0.0, 0.0, 0.0), (0.0, 548.8, 0.0), (0.0, 548.8, 559.2))),
    "left": (RED, ((552.8, 0.0, 0.0), (549.6, 0.0, 559.2), (556.0, 548.8, 559.2), (556.0, 548.8, 0.0))),
}
BLOCKS: dict[str, Published] = {
    "short": ((130.0, 165.0, 65.0), (82.0, 165.0, 225.0), (240.0, 165.0, 272.0), (290.0, 165.0, 114.0)),
    "tall": ((423.0, 330.0, 247.0), (265.0, 330.0, 296.0), (314.0, 330.0, 456.0), (472.0, 330.0, 406.0)),
}


def world_from_published(point: tuple[float, float, float]) -> tuple[float, float, float]:
    """Published millimetres to metres of this scene, the box's middle at x = 0."""
    x, y, z = point
    return (2.78 - x / 100.0, z / 100.0, y / 100.0)


def build() -> None:
    """Add the scene to the open file."""
    for name, (reflectance, corners) in WALLS.items():
        add(name, Shape().polygon(*map(world_from_published, corners)), matte(name, reflectance))
    for name, top in BLOCKS.items():
        # As published: a top and four sides that end on the floor.
        bottom = [(x, 0.0, z) for x, _, z in top]
        sides = [(i, 4 + i, 4 + (i + 1) % 4, (i + 1) % 4) for i in range(4)]
        vertices = [world_from_published(corner) for corner in (*top, *bottom)]
        add(name, Shape().mesh(vertices, [(0, 1, 2, 3), *sides]), matte(name, WHITE))
    low = world_from_published((LAMP_X_MM[1], LAMP_Y_MM, LAMP_Z_MM[0]))
    high = world_from_published((LAMP_X_MM[0], LAMP_Y_MM, LAMP_Z_MM[1]))
    place = ((low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2] - LAMP_BELOW_CEILING_M)
    add_light("lamp", LAMP_EXITANCE_RGB, place, (high[0] - low[0], high[1] - low[1]))
    # Published too: 35 mm focal length for an image of 25 mm.
    add_camera((0.0, -8.0, 2.73), (0.0, 0.0, 2.73), 35.0 / 25.0 * 36.0, (720, 720))


if __name__ == "__main__":
    make(build)
