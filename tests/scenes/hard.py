# SPDX-License-Identifier: GPL-3.0-or-later
"""Make one of the scenes that are hard to mesh: thin things, contacts, intersections, light from a reflecting card.

... hard.py -- CASE OUT.blend [direct=LIGHTS]

The cases are `CASES` below. Each stands on a floor at z = 0, touching it exactly where something stands.
"""

import math
import random
import sys
from collections.abc import Callable
from pathlib import Path

import bpy  # noqa: F401  (mathutils comes with it)
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.scenes.building import Shape, add, add_camera, add_light, make, matte, measure_only

GREY, LIGHT_GREY, DARK = (0.5, 0.5, 0.5), (0.7, 0.7, 0.7), (0.05, 0.05, 0.05)
WOOD, LEAF, WHITE, METAL = (0.45, 0.30, 0.18), (0.12, 0.35, 0.10), (0.85, 0.85, 0.85), (0.35, 0.35, 0.36)
WARM, COOL = (110.0, 85.0, 55.0), (40.0, 60.0, 95.0)
SPOKES = 32


def floor(half_m: float) -> None:
    """Add a square floor about the origin."""
    corners = [(-half_m, -half_m, 0.0), (half_m, -half_m, 0.0), (half_m, half_m, 0.0), (-half_m, half_m, 0.0)]
    add("floor", Shape().polygon(*corners), matte("floor", LIGHT_GREY))


def blinds() -> None:
    """Tilted slats before a window of light: many narrow shadows that widen with the distance."""
    floor(2.0)
    wall = [(2.0, -2.0, 0.0), (-2.0, -2.0, 0.0), (-2.0, -2.0, 2.4), (2.0, -2.0, 2.4)]
    add("wall", Shape().polygon(*wall), matte("wall", GREY))
    slats = Shape()
    for number in range(16):
        # A slat of 80 × 4 mm, tilted by 35 degrees about x.
        a, z = math.radians(35.0), 0.75 + 0.075 * number
        across, up = (0.04 * math.cos(a), 0.04 * math.sin(a)), (-0.002 * math.sin(a), 0.002 * math.cos(a))
        section = [
            (s * across[0] + t * up[0], s * across[1] + t * up[1]) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        ends = [(x, 1.5 + y, z + height) for x in (-0.8, 0.8) for y, height in section]
        slats.mesh(ends, [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
    add("slats", slats, matte("slats", WHITE))
    add_light("window", (60.0, 62.0, 66.0), (0.0, 1.8, 1.3), (1.4, 1.0), (0.0, -1.0, 0.0))
    add_camera((3.4, 4.3, 3.1), (0.0, -0.2, 0.7), 32.0)


def fence() -> None:
    """Pickets with pointed tops on two rails, low light from the side."""
    floor(3.0)
    pickets = Shape()
    for number in range(21):
        x = -2.0 + 0.2 * number
        left, right = x - 0.05, x + 0.05
        outline = [(left, 0.0), (right, 0.0), (right, 0.9), (x, 1.0), (left, 0.9)]
        corners = [(u, y, v) for y in (-0.01, 0.01) for u, v in outline]
        sides = [(i, (i + 1) % 5, 5 + (i + 1) % 5, 5 + i) for i in range(5)]
        pickets.mesh(corners, [(0, 1, 2, 3, 4), (9, 8, 7, 6, 5), *(side[::-1] for side in sides)])
    add("pickets", pickets, matte("wood", WOOD))
    rails = Shape().box((-2.1, 0.01, 0.2), (2.1, 0.04, 0.28)).box((-2.1, 0.01, 0.65), (2.1, 0.04, 0.73))
    add("rails", rails, matte("wood", WOOD))
    add_light("lamp", WARM, (0.6, 2.4, 2.2), (0.5, 0.5), (0.0, -0.8, -0.6))
    add_camera((3.6, -5.2, 3.4), (0.0, -0.3, 0.3), 35.0)


def stairs() -> None:
    """Ten solid steps side by side, a rail on posts; every step stands on the floor and touches the next."""
    floor(2.5)
    steps = Shape()
    for number in range(10):
        steps.box((-0.6, -1.4 + 0.28 * number, 0.0), (0.6, -1.4 + 0.28 * (number + 1), 0.17 * (number + 1)))
    add("steps", steps, matte("stone", GREY))
    rail = Shape()
    for number in range(10):
        y, z = -1.26 + 0.28 * number, 0.17 * (number + 1)
        rail.prism((0.5, y, z), (0.5, y, z + 0.9), 0.012, 6)
    rail.prism((0.5, -1.4, 0.17 + 0.9 - 0.085), (0.5, 1.4, 1.7 + 0.9 + 0.085), 0.025, 8)
    add("rail", rail, matte("metal", METAL))
    add_light("lamp", WARM, (1.6, -1.2, 3.2), (0.5, 0.5))
    add_light("lamp2", COOL, (-1.4, 0.8, 3.6), (0.4, 0.4))
    add_camera((4.3, -4.6, 3.4), (0.0, 0.0, 0.8), 35.0)


def wheel() -> None:
    """A bicycle's wheel that stands on the floor: a rim and 32 spokes 3 mm thin."""
    floor(1.2)
    outer, inner, half = 0.35, 0.325, 0.014
    ring = 48
    vertices = []
    for number in range(ring):
        # It stands on one corner, put at exactly 0: rounding would leave it off the floor.
        a = 2.0 * math.pi * number / ring
        direction = (math.sin(a), -math.cos(a))
        for radius, y in ((outer, -half), (outer, half), (inner, half), (inner, -half)):
            z = 0.0 if number == 0 and radius == outer else outer + radius * direction[1]
            vertices.append((radius * direction[0], y, z))
    faces = [
        (4 * i + j, 4 * i + (j + 1) % 4, 4 * ((i + 1) % ring) + (j + 1) % 4, 4 * ((i + 1) % ring) + j)
        for i in range(ring)
        for j in range(4)
    ]
    add("rim", Shape().mesh(vertices, faces), matte("rim", GREY))
    add("hub", Shape().prism((0.0, -0.035, outer), (0.0, 0.035, outer), 0.02, 12), matte("metal", METAL))
    spokes = Shape()
    for number in range(SPOKES):
        a = 2.0 * math.pi * (number + 0.5) / SPOKES
        # Laced alternately from both ends of the hub, and not radially.
        start, side = a + (0.9 if number // 2 % 2 else -0.9), 0.028 if number % 2 else -0.028
        low = (0.018 * math.sin(start), side, outer - 0.018 * math.cos(start))
        high = (0.33 * math.sin(a), 0.0, outer - 0.33 * math.cos(a))
        spokes.prism(low, high, 0.0015, 4)
    add("spokes", spokes, matte("metal", METAL))
    add_light("lamp", WARM, (0.3, 0.9, 0.9), (0.12, 0.12), (-0.2, -0.75, -0.6))
    add_camera((0.8, -1.7, 1.0), (0.0, -0.05, 0.2), 35.0)


def tree() -> None:
    """A tree of cards: a trunk, a few branches, 300 leaves of one quad each in no order."""
    floor(2.5)
    wood = Shape().prism((0.0, 0.0, 0.0), (0.0, 0.0, 1.4), 0.09, 10, 0.05)
    chance = random.Random(7)
    leaves = Shape()
    card = Shape().polygon((-0.05, -0.03, 0), (0.05, -0.03, 0), (0.05, 0.03, 0), (-0.05, 0.03, 0))
    for number in range(12):
        a, up = 2.0 * math.pi * number / 12 + chance.uniform(-0.2, 0.2), chance.uniform(0.15, 0.7)
        start = (0.0, 0.0, 0.7 + 0.05 * number)
        tip = (0.75 * math.cos(a), 0.75 * math.sin(a), start[2] + up)
        wood.prism(start, tip, 0.02, 6, 0.008)
        for _ in range(25):
            t = chance.uniform(0.35, 1.05)
            middle = [s + t * (e - s) + chance.gauss(0.0, 0.09) for s, e in zip(start, tip, strict=True)]
            pitch, yaw = chance.uniform(-1.0, 1.0), chance.uniform(0.0, 2.0 * math.pi)
            turned = Matrix.Rotation(yaw, 4, "Z") @ Matrix.Rotation(pitch, 4, "Y")
            leaves.mesh(card.moved(Matrix.Translation(middle) @ turned).vertices, card.faces)
    add("wood", wood, matte("wood", WOOD))
    add("leaves", leaves, matte("leaf", LEAF))
    add_light("lamp", WARM, (1.0, 0.8, 4.0), (0.6, 0.6))
    add_camera((3.6, -5.0, 3.0), (0.0, 0.0, 0.8), 35.0)


def cube() -> None:
    """A cube that stands on the floor: light jumps across the contact."""
    floor(2.0)
    add("cube", Shape().box((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)).standing(0.0, 0.0, 25.0), matte("cube", GREY))
    add_light("lamp", WARM, (-1.3, -0.9, 2.8), (0.4, 0.4))
    add_camera((3.2, -4.4, 3.6), (0.0, 0.0, 0.3), 35.0)


def boxes() -> None:
    """Boxes that stand in one another, so that no mesh edge lies where they meet."""
    floor(2.0)
    first = Shape().box((-0.7, -0.3, 0.0), (0.7, 0.3, 0.6))
    second = Shape().box((-0.25, -0.8, 0.0), (0.25, 0.8, 0.9))
    third = Shape().box((-0.15, -0.15, 0.0), (0.15, 0.15, 1.6))
    for name, shape, degrees in (("first", first, 15.0), ("second", second, 40.0), ("third", third, 70.0)):
        add(name, shape.standing(0.0, 0.0, degrees), matte(name, GREY))
    add_light("lamp", WARM, (-1.2, -1.1, 2.8), (0.4, 0.4))
    add_camera((3.2, -4.4, 3.6), (0.0, 0.0, 0.4), 35.0)


def touching() -> None:
    """A blocker that touches the light: a post hangs from the middle of a square lamp, its top in the lamp's plane."""
    floor(2.0)
    add("post", Shape().box((-0.1, -0.1, 1.4), (0.1, 0.1, 2.0)).standing(0.1, 0.0, 30.0), matte("post", GREY))
    add_light("lamp", WARM, (0.0, 0.0, 2.0), (0.6, 0.6))
    add_camera((3.0, -4.2, 3.0), (0.0, 0.0, 0.7), 35.0)


def shelf() -> None:
    """A room whose strongest light comes second hand: a lamp in a dark box shines at a white card only.

    The card, which closes the box's back, lights the room through its open front, and a small block on the floor casts
    a real shadow in that light. No light reaches the room straight from the lamp.
    """
    x, y, z = 2.0, 1.5, 2.0
    inside = Shape().polygon((-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0))
    inside.polygon((-x, -y, z), (-x, y, z), (x, y, z), (x, -y, z))
    inside.polygon((-x, -y, 0), (-x, y, 0), (-x, y, z), (-x, -y, z))
    inside.polygon((x, y, 0), (x, -y, 0), (x, -y, z), (x, y, z))
    inside.polygon((-x, y, 0), (x, y, 0), (x, y, z), (-x, y, z))
    inside.polygon((x, -y, 0), (-x, -y, 0), (-x, -y, z), (x, -y, z))
    room = add("room", inside, matte("room", GREY))
    # The box hangs on the wall at the far x and opens towards the room below its front.
    box = Shape().box((1.2, -0.4, 0.6), (2.0, 0.4, 0.62)).box((1.2, -0.4, 1.5), (2.0, 0.4, 1.52))
    box.box((1.2, -0.4, 0.62), (2.0, -0.38, 1.5)).box((1.2, 0.38, 0.62), (2.0, 0.4, 1.5))
    box.box((1.2, -0.38, 1.1), (1.22, 0.38, 1.5))
    add("box", box, matte("dark", DARK))
    card = Shape().mesh([(1.9, -0.38, 0.62), (1.9, 0.38, 0.62), (1.9, 0.38, 1.5), (1.9, -0.38, 1.5)], [(3, 2, 1, 0)])
    add("card", card, matte("card", WHITE))
    standing = Shape().box((0.0, -0.15, 0.0), (0.3, 0.15, 0.45)).standing(0.1, 0.1, 20.0)
    block = add("block", standing, matte("block", GREY))
    # The card is hundreds of times as bright as the room: an error relative to both would tell of the card alone.
    measure_only([room, block])
    # It faces the card squarely: nothing before the card lies in front of the lamp's plane but the dark box.
    add_light("lamp", (2600.0, 2400.0, 2100.0), (1.35, 0.0, 1.4), (0.12, 0.12), (1.0, 0.0, 0.0))
    add_camera((-1.9, -1.3, 1.75), (0.6, 0.2, 0.4), 22.0)


CASES: dict[str, Callable[[], None]] = {
    case.__name__: case for case in (blinds, fence, stairs, wheel, tree, cube, boxes, touching, shelf)
}


def build(case: str) -> None:
    """Add a case to the open file."""
    CASES[case]()


if __name__ == "__main__":
    asked = sys.argv[sys.argv.index("--") + 1]
    if asked not in CASES:
        sys.exit(f"“{asked}” is none of {', '.join(CASES)}")
    make(build, asked)
