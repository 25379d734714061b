# SPDX-License-Identifier: GPL-3.0-or-later
"""Make an interior of 4,738 patches: a dining room with tables, chairs, shelves of books, a sofa, windows and lamps.

... interior.py -- OUT.blend [direct=LIGHTS]

A patch is one polygon as modelled. The paper's own interior has as many; its data is not published, so this is a room
of the same size in patches and not the same room. Furniture stands exactly on what bears it. Other sizes of the same
room come from other values of `Interior`.
"""

import math
import random
import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import bpy
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.scenes.building import (
    Point,
    Rgb,
    Shape,
    add,
    add_camera,
    add_light,
    make,
    matte,
    patch_count,
)

PATCHES = 4738
HEIGHT_M = 2.7
RUG_M = 0.012
PITCH_M = 3.0
"""From one table, with its window, pendant and radiator, to the next."""
SHELF_PITCH_M = 1.02
COMPARTMENTS = 5

WALL, FLOOR, CEILING = (0.72, 0.70, 0.66), (0.38, 0.27, 0.18), (0.82, 0.82, 0.80)
WOOD, DARK_WOOD, WHITE, METAL, GLASS = (
    (0.45, 0.30, 0.18),
    (0.22, 0.13, 0.08),
    (0.78, 0.78, 0.76),
    (0.35, 0.35, 0.36),
    (0.06, 0.07, 0.09),
)
CLOTH, RUG, SHADE, CLAY = (0.20, 0.30, 0.42), (0.50, 0.20, 0.17), (0.75, 0.68, 0.55), (0.55, 0.28, 0.18)
BOOKS: tuple[Rgb, ...] = ((0.50, 0.12, 0.10), (0.12, 0.22, 0.42), (0.14, 0.34, 0.18), (0.62, 0.52, 0.30))
PENDANT_EXITANCE_RGB, FLOOR_LAMP_EXITANCE_RGB = (240.0, 190.0, 130.0), (190.0, 160.0, 120.0)


@dataclass(frozen=True)
class Interior:
    """How much stands in the room. The defaults give `PATCHES` patches, which `build` asserts for them."""

    tables: int = 2
    chairs_per_table: int = 6
    shelves: int = 4
    books: int = 399

    @property
    def length_m(self) -> float:
        """Along x; the windows are on the wall at the far y."""
        return 1.0 + PITCH_M * self.tables

    @property
    def depth_m(self) -> float:
        """Along y."""
        return max(5.6, 1.5 + SHELF_PITCH_M * self.shelves)


def bars(shape: Shape, ends: list[tuple[Point, Point]], radius_m: float, sides: int) -> Shape:
    """Add one prism per pair of ends."""
    for start, end in ends:
        shape.prism(start, end, radius_m, sides)
    return shape


def table(length_m: float, width_m: float, height_m: float) -> Shape:
    """A table of 70 patches: its top, four round legs, an apron between them."""
    x, y, under = length_m / 2.0, width_m / 2.0, height_m - 0.03
    shape = Shape().box((-x, -y, under), (x, y, height_m))
    legs = [(sx * (x - 0.07), sy * (y - 0.07)) for sx in (-1, 1) for sy in (-1, 1)]
    bars(shape, [((lx, ly, 0.0), (lx, ly, under)) for lx, ly in legs], 0.035, 8)
    for side in (-1, 1):
        across, along = side * (y - 0.07), side * (x - 0.07)
        shape.box((-x + 0.07, across - 0.01, under - 0.09), (x - 0.07, across + 0.01, under))
        shape.box((along - 0.01, -y + 0.07, under - 0.09), (along + 0.01, y - 0.07, under))
    return shape


def chair() -> Shape:
    """A chair of 92 patches that faces +y: a seat, round legs and stretchers, a back of a rail and three round bars."""
    shape = Shape().box((-0.22, -0.22, 0.43), (0.22, 0.22, 0.46))
    bars(shape, [((x, 0.19, 0.0), (x, 0.19, 0.43)) for x in (-0.19, 0.19)], 0.02, 8)
    bars(shape, [((x, -0.225, 0.0), (x, -0.225, 0.9)) for x in (-0.19, 0.19)], 0.02, 8)
    bars(shape, [((-0.19, -0.225, z), (0.19, -0.225, z)) for z in (0.56, 0.66, 0.76)], 0.011, 6)
    bars(shape, [((x, -0.225, 0.2), (x, 0.19, 0.2)) for x in (-0.19, 0.19)], 0.011, 6)
    return shape.box((-0.18, -0.24, 0.82), (0.18, -0.21, 0.89))


def shelf() -> Shape:
    """A shelf of 54 patches, 1 m wide along x and 0.3 m deep from its back at y = 0 to the front at y = -0.3."""
    shape = Shape().box((-0.5, -0.3, 0.0), (-0.48, 0.0, 2.1)).box((0.48, -0.3, 0.0), (0.5, 0.0, 2.1))
    for board in range(COMPARTMENTS + 1):
        z = 0.416 * board
        shape.box((-0.48, -0.3, z), (0.48, -0.01, z + 0.02))
    return shape.box((-0.48, -0.01, 0.0), (0.48, 0.0, 2.1))


def row_of_books(count: int, chance: random.Random) -> Shape:
    """Books side by side from the left of a compartment, 6 patches each; neighbours touch."""
    shape = Shape()
    x = -0.48 + chance.uniform(0.0, 0.15)
    for _ in range(count):
        thickness = chance.uniform(0.02, 0.05) * min(1.0, 15.0 / count)
        front, height = -chance.uniform(0.20, 0.27), chance.uniform(0.2, 0.34)
        shape.box((x, front, 0.0), (x + thickness, -0.06, height))
        x += thickness
    return shape


def sofa() -> Shape:
    """A sofa of 82 patches that faces +y, its back at y = 0."""
    shape = Shape().box((-1.0, 0.0, 0.12), (1.0, 0.9, 0.28))
    shape.box((-1.0, 0.0, 0.28), (1.0, 0.2, 0.85))
    for side in (-1, 1):
        inner, outer = sorted((side * 0.85, side * 1.0))
        shape.box((inner, 0.2, 0.28), (outer, 0.9, 0.6))
    for cushion in range(3):
        left = -0.85 + 1.7 / 3.0 * cushion
        shape.box((left + 0.005, 0.2, 0.28), (left + 1.7 / 3.0 - 0.005, 0.88, 0.43))
    return bars(shape, [((x, y, 0.0), (x, y, 0.12)) for x in (-0.9, 0.9) for y in (0.1, 0.8)], 0.03, 8)


def sideboard() -> Shape:
    """A sideboard of 96 patches, its back at y = 0, doors and handles towards -y."""
    shape = Shape().box((-0.75, -0.42, 0.1), (0.75, 0.0, 0.8))
    for door in range(3):
        left = -0.74 + 0.495 * door
        shape.box((left, -0.44, 0.12), (left + 0.485, -0.42, 0.78))
        shape.prism((left + 0.06, -0.455, 0.4), (left + 0.06, -0.455, 0.55), 0.015, 6)
    return bars(shape, [((x, y, 0.0), (x, y, 0.1)) for x in (-0.68, 0.68) for y in (-0.36, -0.06)], 0.025, 10)


def picture(width_m: float, height_m: float) -> Shape:
    """A framed picture of 30 patches against a wall at y = 0 that is seen from -y; the middle is the origin."""
    x, z = width_m / 2.0, height_m / 2.0
    shape = Shape().box((-x, -0.015, -z), (x, 0.0, z))
    for side in (-1, 1):
        low, high = sorted((side * x, side * (x + 0.04)))
        shape.box((low, -0.03, -z - 0.04), (high, 0.0, z + 0.04))
        low, high = sorted((side * z, side * (z + 0.04)))
        shape.box((-x, -0.03, low), (x, 0.0, high))
    return shape


def door() -> Shape:
    """A door with its frame and handle against a wall at y = 0, seen from -y: 64 patches."""
    shape = Shape().box((-0.45, -0.02, 0.0), (0.45, 0.0, 2.02))
    for x in (-0.38, 0.06):
        for low, high in ((0.15, 0.9), (1.05, 1.88)):
            shape.box((x, -0.032, low), (x + 0.32, -0.02, high))
    shape.box((-0.53, -0.04, 0.0), (-0.45, 0.0, 2.1)).box((0.45, -0.04, 0.0), (0.53, 0.0, 2.1))
    shape.box((-0.45, -0.04, 2.02), (0.45, 0.0, 2.1))
    return shape.prism((0.4, -0.02, 1.0), (0.4, -0.07, 1.0), 0.012, 6).prism(
        (0.41, -0.07, 1.0), (0.28, -0.07, 1.0), 0.012, 6
    )


def radiator() -> Shape:
    """A radiator of 76 patches against a wall at y = 0: ten ribs on two pipes."""
    shape = Shape()
    for rib in range(10):
        x = -0.5 + 0.11 * rib
        shape.box((x, -0.12, 0.12), (x + 0.03, -0.04, 0.68))
    return bars(shape, [((-0.55, -0.08, z), (0.55, -0.08, z)) for z in (0.17, 0.63)], 0.015, 6)


def window() -> Shape:
    """A window's frame with two bars and its sill, 42 patches, in a reveal 1.2 m wide, 1.3 m high and 0.12 m deep."""
    shape = Shape()
    for low, high in ((-0.6, -0.55), (0.55, 0.6)):
        shape.box((low, 0.06, 0.0), (high, 0.12, 1.3))
    for low, high in ((0.0, 0.05), (1.25, 1.3)):
        shape.box((-0.55, 0.06, low), (0.55, 0.12, high))
    shape.box((-0.02, 0.07, 0.05), (0.02, 0.11, 1.25)).box((-0.55, 0.08, 0.8), (0.55, 0.1, 0.83))
    return shape.box((-0.68, -0.1, -0.03), (0.68, 0.0, 0.0))


def round_shade(low_z: float, high_z: float, low_radius_m: float, high_radius_m: float) -> Shape:
    """A lamp's shade of 16 patches, open above and below."""
    angles = [2.0 * math.pi * (side + 0.5) / 16 for side in range(16)]
    rings = [
        (radius * math.cos(a), radius * math.sin(a), z)
        for radius, z in ((low_radius_m, low_z), (high_radius_m, high_z))
        for a in angles
    ]
    return Shape().mesh(rings, [(side, (side + 1) % 16, 16 + (side + 1) % 16, 16 + side) for side in range(16)])


def room(length_m: float, depth_m: float, window_xs: list[float]) -> tuple[Shape, Shape, Shape]:
    """Walls with reveals, the panes that close them, and floor and ceiling; everything faces inwards."""
    walls, panes = Shape(), Shape()
    low_x, high_x, low_y, high_y = 0.0, length_m, 0.0, depth_m
    walls.polygon((low_x, low_y, 0), (low_x, high_y, 0), (low_x, high_y, HEIGHT_M), (low_x, low_y, HEIGHT_M))
    walls.polygon((high_x, high_y, 0), (high_x, low_y, 0), (high_x, low_y, HEIGHT_M), (high_x, high_y, HEIGHT_M))
    walls.polygon((high_x, low_y, 0), (low_x, low_y, 0), (low_x, low_y, HEIGHT_M), (high_x, low_y, HEIGHT_M))
    # The wall with windows is a grid with cells left out, so that polygons meet at corners only.
    xs = sorted({low_x, high_x, *(x - 0.6 for x in window_xs), *(x + 0.6 for x in window_xs)})
    zs = (0.0, 0.9, 2.2, HEIGHT_M)
    for left, right in pairwise(xs):
        for bottom, top in pairwise(zs):
            hole = bottom == 0.9 and any(abs((left + right) / 2.0 - x) < 0.1 for x in window_xs)
            near = [(left, high_y, bottom), (right, high_y, bottom), (right, high_y, top), (left, high_y, top)]
            if not hole:
                walls.polygon(*near)
                continue
            far = [(x, y + 0.12, z) for x, y, z in near]
            for side in range(4):
                after = (side + 1) % 4
                walls.polygon(near[side], near[after], far[after], far[side])
            panes.polygon(*far)
    ground = Shape().polygon((low_x, low_y, 0), (high_x, low_y, 0), (high_x, high_y, 0), (low_x, high_y, 0))
    return walls, panes, ground


def at(shape: Shape, place: Point, degrees: float = 0.0) -> Shape:
    """The shape turned about the z axis, then moved to the place."""
    return shape.moved(Matrix.Translation(place) @ Matrix.Rotation(math.radians(degrees), 4, "Z"))


def build(interior: Interior = Interior()) -> None:
    """Add the room to the open file."""
    length, depth = interior.length_m, interior.depth_m
    table_xs = [0.4 + PITCH_M * (0.5 + number) for number in range(interior.tables)]
    table_y = depth - 2.2

    # The shell
    walls, panes, ground = room(length, depth, table_xs)
    add("walls", walls, matte("wall", WALL))
    add("panes", panes, matte("glass", GLASS))
    add("floor", ground, matte("floor", FLOOR))
    corners = [(0.0, 0.0), (0.0, depth), (length, depth), (length, 0.0)]
    add("ceiling", Shape().polygon(*((x, y, HEIGHT_M) for x, y in corners)), matte("ceiling", CEILING))
    add("skirting", Shape().box((0.0, 0.0, 0.0), (length - 0.4, 0.012, 0.08)), matte("white", WHITE))
    add("door", at(door(), (0.0, 1.2, 0.0), 90.0), matte("white", WHITE))

    # Tables with what belongs to each: chairs, a pendant, a window, a radiator
    for number, x in enumerate(table_xs):
        add(f"table{number}", at(table(1.6, 0.9, 0.75), (x, table_y, 0.0)), matte("wood", WOOD))
        places = [(x - 0.4, -0.5, 0.0), (x + 0.4, -0.5, 5.0), (x - 0.4, 0.5, 184.0), (x + 0.4, 0.5, 178.0)]
        places += [(x - 0.86, 0.0, -92.0), (x + 0.86, 0.0, 88.0)]
        for seat, (chair_x, chair_y, degrees) in enumerate(places[: interior.chairs_per_table]):
            placed = at(chair(), (chair_x, table_y + chair_y, 0.0), degrees)
            add(f"chair{number}.{seat}", placed, matte("dark wood", DARK_WOOD))
        vase = Shape().prism((0, 0, 0.75), (0, 0, 0.95), 0.05, 12, 0.09)
        add(f"vase{number}", at(vase, (x + 0.2, table_y, 0.0)), matte("clay", CLAY))
        hanging = Shape().prism((0, 0, 1.86), (0, 0, 2.68), 0.006, 6).prism((0, 0, 2.68), (0, 0, HEIGHT_M), 0.06, 12)
        add(f"pendant{number}", at(hanging, (x, table_y, 0.0)), matte("metal", METAL))
        add(f"shade{number}", at(round_shade(1.6, 1.86, 0.26, 0.1), (x, table_y, 0.0)), matte("shade", SHADE))
        add_light(f"pendant light{number}", PENDANT_EXITANCE_RGB, (x, table_y, 1.62), (0.3, 0.3))
        add(f"window{number}", at(window(), (x, depth, 0.9)), matte("white", WHITE))
        add(f"radiator{number}", at(radiator(), (x, depth, 0.0)), matte("white", WHITE))

    # Shelves along the wall at the far x, and their books
    chance = random.Random(1994)
    compartments = interior.shelves * COMPARTMENTS
    for number in range(interior.shelves):
        place = (length, 0.85 + SHELF_PITCH_M * number, 0.0)
        add(f"shelf{number}", at(shelf(), place, -90.0), matte("wood", WOOD))
        for row in range(COMPARTMENTS):
            index = number * COMPARTMENTS + row
            count = interior.books * (index + 1) // compartments - interior.books * index // compartments
            if count:
                books = at(row_of_books(count, chance), (place[0], place[1], 0.416 * row + 0.02), -90.0)
                colour = index * 7 % len(BOOKS)
                add(f"books{number}.{row}", books, matte(f"books{colour}", BOOKS[colour]))

    # The corner to sit in
    middle = length / 2.0 - 0.3
    add("sofa", at(sofa(), (middle, 0.05, 0.0)), matte("cloth", CLOTH))
    add("rug", Shape().box((middle - 1.1, 1.1, 0.0), (middle + 1.1, 2.3, RUG_M)), matte("rug", RUG))
    add("coffee table", at(table(0.9, 0.5, 0.42), (middle, 1.7, RUG_M)), matte("dark wood", DARK_WOOD))
    add("sideboard", at(sideboard(), (0.0, table_y - 0.1, 0.0), 90.0), matte("wood", WOOD))
    pot = Shape().prism((0, 0, 0.8), (0, 0, 1.05), 0.06, 12, 0.11)
    add("pot", at(pot, (0.22, table_y - 0.5, 0.0)), matte("clay", CLAY))
    for number, offset in enumerate((-0.8, 0.0, 0.8)):
        framed = at(picture(0.55, 0.4), (middle + offset, 0.0, 1.6), 180.0)
        add(f"picture{number}", framed, matte("cloth", CLOTH))

    # Two lamps that stand in corners and light the ceiling
    for number, (x, y) in enumerate(((0.75, depth - 0.75), (length - 1.2, 0.8))):
        foot = Shape().prism((0, 0, 0), (0, 0, 0.03), 0.14, 16).prism((0, 0, 0.03), (0, 0, 1.5), 0.015, 8)
        add(f"lamp{number}", at(foot, (x, y, 0.0)), matte("metal", METAL))
        add(f"lamp shade{number}", at(round_shade(1.5, 1.72, 0.1, 0.2), (x, y, 0.0)), matte("shade", SHADE))
        add_light(f"floor lamp light{number}", FLOOR_LAMP_EXITANCE_RGB, (x, y, 1.7), (0.24, 0.24), (0.0, 0.0, 1.0))

    add_camera((0.35, 0.3, 1.75), (4.1, 3.3, 0.85), 20.0)
    bpy.context.view_layer.update()
    if interior == Interior():
        assert patch_count() == PATCHES, f"{patch_count()} patches instead of {PATCHES}"


if __name__ == "__main__":
    make(build)
