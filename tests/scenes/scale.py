# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a furnished flat of as many triangles as asked for: more rooms and finer furniture, the same kind of place.

... scale.py -- TRIANGLES OUT.blend

Rooms and the triangles of each grow with the square root of what is asked for. Every room has a panel below its ceiling
and a reading lamp; doorways and openings lead to the rooms beside it, so that light crosses. The shell of a room has
always about the same polygons; everything that stands in it is rounded more finely, and the shelf holds more books.
Objects of one kind share a mesh.
"""

import math
import random
import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.scenes.building import Point, Rgb, Shape, add, add_camera, add_light, make, matte

LENGTH_M, DEPTH_M, HEIGHT_M, WALL_M = 5.0, 4.0, 2.7, 0.12
"""A room along x, along y and upwards, and the walls between rooms."""

DOOR_M, WINDOW_M = (0.25, 1.15, 0.0, 2.1), (0.6, 1.8, 1.0, 2.1)
"""Where the openings in walls along y, and in those along x, begin and end: across, then upwards."""

TRIANGLES_OF_ROOM = 500
"""In a flat of two rooms, which is the smallest."""

SMALLEST, LARGEST = 800, 4_000_000

WALL, FLOOR, CEILING = (0.72, 0.70, 0.66), (0.38, 0.27, 0.18), (0.82, 0.82, 0.80)
WOOD, DARK_WOOD, METAL = (0.45, 0.30, 0.18), (0.22, 0.13, 0.08), (0.35, 0.35, 0.36)
CLOTH, CUSHION, CLAY, PAINT = (0.20, 0.30, 0.42), (0.55, 0.40, 0.20), (0.55, 0.28, 0.18), (0.6, 0.5, 0.45)
BOOKS: tuple[Rgb, ...] = ((0.50, 0.12, 0.10), (0.12, 0.22, 0.42), (0.14, 0.34, 0.18), (0.62, 0.52, 0.30))
PANEL_EXITANCE_RGB = (60.0, 54.0, 45.0)


def rounded(low: Point, high: Point, radius_m: float, cuts: int) -> Shape:
    """A closed box with rounded edges, of 12 · cuts² triangles once quads are cut in two; one cut is a plain box."""
    centre, half = (Vector(low) + Vector(high)) / 2.0, (Vector(high) - Vector(low)) / 2.0
    if cuts == 1:
        return Shape().box(low, high)
    radius = min(radius_m, half.x, half.y, half.z)
    inner = half - Vector((radius, radius, radius))
    numbers: dict[tuple[int, int, int], int] = {}
    vertices: list[Vector] = []

    def number(place: tuple[int, int, int]) -> int:
        if place not in numbers:
            numbers[place] = len(vertices)
            # Half of the cuts are spent on the edges: a line of vertices for each step around them.
            at = [2.0 * k / cuts - 1.0 for k in place]
            on_box = Vector([math.copysign(abs(at[axis]) ** 0.6, at[axis]) * half[axis] for axis in range(3)])
            core = Vector([max(-inner[axis], min(inner[axis], on_box[axis])) for axis in range(3)])
            away = on_box - core
            vertices.append(centre + core + (away.normalized() * radius if away.length > 0.0 else away))
        return numbers[place]

    faces = []
    for axis in range(3):
        for side in (0, cuts):
            for i in range(cuts):
                for j in range(cuts):
                    square = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                    places = []
                    for u, v in square if side else reversed(square):
                        place = [0, 0, 0]
                        place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3] = side, u, v
                        places.append((place[0], place[1], place[2]))
                    faces.append(tuple(number(place) for place in places))
    return Shape().mesh(vertices, faces)


def turned(profile: list[tuple[float, float]], sides: int, rings: int) -> Shape:
    """A closed solid of revolution about the z axis, standing at the origin: `sides` around and `rings` along it.

    `profile`: radii and heights from the foot to the top, metres, joined by straight lines.
    """
    lengths = [math.dist(a, b) for a, b in pairwise(profile)]
    places = []
    for ring in range(rings + 1):
        left = sum(lengths) * ring / rings
        for (a, b), length in zip(pairwise(profile), lengths, strict=True):
            if left <= length or (a, b) == (profile[-2], profile[-1]):
                share = min(left / length, 1.0)
                places.append((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
                break
            left -= length
    angles = [2.0 * math.pi * (side + 0.5) / sides for side in range(sides)]
    vertices = [(r * math.cos(a), r * math.sin(a), z) for r, z in places for a in angles]
    faces: list[tuple[int, ...]] = [
        (ring * sides + side, ring * sides + after, (ring + 1) * sides + after, (ring + 1) * sides + side)
        for ring in range(rings)
        for side in range(sides)
        for after in [(side + 1) % sides]
    ]
    faces += [tuple(reversed(range(sides))), tuple(range(rings * sides, (rings + 1) * sides))]
    return Shape().mesh(vertices, faces)


def joined(*shapes: Shape) -> Shape:
    """All of them as one."""
    whole = Shape()
    for shape in shapes:
        whole.mesh(shape.vertices, shape.faces)
    return whole


def leg(cuts: int, height_m: float, radius_m: float, x: float, y: float) -> Shape:
    """A turned leg, thinner at its foot."""
    profile = [(0.7 * radius_m, 0.0), (radius_m, 0.6 * height_m), (0.8 * radius_m, height_m)]
    return turned(profile, 3 * cuts, cuts).standing(x, y)


def table(cuts: int) -> Shape:
    """Its top and four legs."""
    legs = [leg(cuts, 0.71, 0.035, x, y) for x in (-0.62, 0.62) for y in (-0.32, 0.32)]
    return joined(rounded((-0.7, -0.4, 0.71), (0.7, 0.4, 0.75), 0.02, cuts), *legs)


def chair(cuts: int) -> Shape:
    """A chair that faces +y: a seat, four legs and a back."""
    legs = [leg(cuts, 0.42, 0.022, x, y) for x in (-0.18, 0.18) for y in (-0.18, 0.18)]
    back = rounded((-0.2, -0.22, 0.46), (0.2, -0.18, 0.9), 0.018, cuts)
    return joined(rounded((-0.22, -0.22, 0.42), (0.22, 0.22, 0.46), 0.018, cuts), *legs, back)


def sofa(cuts: int) -> Shape:
    """A sofa that faces +y, its back at y = 0."""
    parts = [((-0.9, 0.0, 0.0), (0.9, 0.85, 0.26)), ((-0.9, 0.0, 0.26), (0.9, 0.2, 0.8))]
    parts += [((-0.9, 0.2, 0.26), (-0.74, 0.85, 0.56)), ((0.74, 0.2, 0.26), (0.9, 0.85, 0.56))]
    parts += [((-0.73, 0.21, 0.26), (-0.005, 0.83, 0.42)), ((0.005, 0.21, 0.26), (0.73, 0.83, 0.42))]
    return joined(*(rounded(low, high, 0.05, cuts) for low, high in parts))


def cushion(cuts: int) -> Shape:
    """Nearly a ball, its lowest point at the origin."""
    return rounded((-0.18, -0.09, 0.0), (0.18, 0.09, 0.3), 0.09, cuts)


SHELVES, SHELF_LOW_M, SHELF_PITCH_M, SHELF_BOARD_M = 3, 0.06, 0.44, 0.02


def shelf(cuts: int) -> Shape:
    """A shelf 1 m wide, its back at y = 0 and its front at y = -0.3."""
    high = SHELF_LOW_M + SHELVES * SHELF_PITCH_M + SHELF_BOARD_M
    parts = [((side, -0.3, 0.0), (side + 0.02, 0.0, high)) for side in (-0.5, 0.48)]
    for board in range(SHELVES + 1):
        z = SHELF_LOW_M + SHELF_PITCH_M * board
        parts.append(((-0.48, -0.3, z), (0.48, -0.01, z + SHELF_BOARD_M)))
    parts.append(((-0.48, -0.01, 0.0), (0.48, 0.0, high)))
    return joined(*(rounded(low, high, 0.004, max(1, cuts // 2)) for low, high in parts))


def vase(cuts: int) -> Shape:
    """Turned, and round at its belly."""
    profile = [(0.05, 0.0), (0.09, 0.07), (0.1, 0.12), (0.07, 0.2), (0.03, 0.25), (0.05, 0.28)]
    return turned(profile, 4 * cuts, 3 * cuts)


def side_table(cuts: int) -> Shape:
    """A round top on a foot."""
    foot = turned([(0.16, 0.0), (0.14, 0.02), (0.03, 0.05), (0.03, 0.48)], 4 * cuts, 2 * cuts)
    top = turned([(0.23, 0.48), (0.25, 0.5), (0.24, 0.52)], 6 * cuts, cuts)
    return joined(foot, top)


def lamp(cuts: int) -> Shape:
    """A stand with an arm; the light is added apart."""
    foot = turned([(0.15, 0.0), (0.14, 0.02), (0.014, 0.04), (0.014, 1.6)], 4 * cuts, 2 * cuts)
    return joined(foot, Shape().prism((0.0, 0.0, 1.6), (0.3, 0.0, 1.6), 0.012, 3 * cuts))


def picture(cuts: int) -> Shape:
    """A frame with its picture against a wall at x = 0, seen from -x; its middle is the origin."""
    frame = rounded((-0.02, -0.44, -0.34), (0.0, 0.44, 0.34), 0.01, cuts)
    return joined(frame, Shape().box((-0.025, -0.4, -0.3), (-0.02, 0.4, 0.3)))


def book(_cuts: int) -> Shape:
    """A book 1 m thick, which its object makes thinner; its spine is at y = 0 and faces -y."""
    return Shape().box((0.0, 0.0, 0.0), (1.0, 0.17, 0.28))


@dataclass(frozen=True)
class Piece:
    """A kind of furniture, and where it stands in a room: x, y, z in metres and degrees about the z axis."""

    name: str
    make: Callable[[int], Shape]
    colour: Rgb
    places: tuple[tuple[float, float, float, float], ...]


PIECES = (
    Piece("table", table, WOOD, ((2.3, 2.4, 0.0, 0.0),)),
    Piece("chair", chair, DARK_WOOD, ((1.95, 1.95, 0.0, 0.0), (2.65, 2.9, 0.0, 180.0))),
    Piece("sofa", sofa, CLOTH, ((3.4, 0.02, 0.0, 0.0),)),
    Piece("cushion", cushion, CUSHION, ((2.95, 0.4, 0.42, 10.0), (3.9, 0.38, 0.42, -15.0))),
    Piece("shelf", shelf, WOOD, ((4.3, DEPTH_M, 0.0, 0.0),)),
    Piece("vase", vase, CLAY, ((2.5, 2.4, 0.75, 0.0),)),
    Piece("side table", side_table, DARK_WOOD, ((4.68, 0.36, 0.0, 0.0),)),
    Piece("lamp", lamp, METAL, ((2.25, 0.3, 0.0, 30.0),)),
    Piece("picture", picture, PAINT, ((LENGTH_M, 2.6, 1.5, 0.0),)),
)
BOOK_TRIANGLES = 12


@dataclass(frozen=True)
class Flat:
    """Rooms by rows and columns, how finely each kind of furniture is cut, and books in all."""

    columns: int
    rows: int
    cuts: tuple[int, ...]
    books: int

    @property
    def rooms(self) -> int:
        return self.columns * self.rows


def triangles_of(shape: Shape) -> int:
    """Of its polygons."""
    return sum(len(face) - 2 for face in shape.faces)


def plan(triangles: int) -> Flat:
    """The flat of that many triangles; it misses them by less than a book."""
    wanted = max(2.0, 2.0 * math.sqrt(triangles / (2 * TRIANGLES_OF_ROOM)))
    columns = max(2, math.ceil(math.sqrt(wanted)))
    rows = max(1, round(wanted / columns))
    rooms = columns * rows
    shells = sum(triangles_of(shell(columns, rows, c, r)) for c in range(columns) for r in range(rows))
    books = round(triangles * 0.1 / BOOK_TRIANGLES)
    # Kinds take turns at becoming finer, so that there is a flat for every number.
    known: dict[tuple[int, int], int] = {}

    def count(kind: int, cuts: int) -> int:
        if (kind, cuts) not in known:
            known[kind, cuts] = triangles_of(PIECES[kind].make(cuts)) * len(PIECES[kind].places)
        return known[kind, cuts]

    cuts = [1] * len(PIECES)
    step = 0
    furniture = sum(count(kind, 1) for kind in range(len(PIECES)))
    while True:
        kind = step % len(PIECES)
        finer = furniture - count(kind, cuts[kind]) + count(kind, cuts[kind] + 1)
        if shells + rooms * finer + books * BOOK_TRIANGLES > triangles:
            break
        cuts[kind], furniture = cuts[kind] + 1, finer
        step += 1
    left = triangles - shells - rooms * furniture
    return Flat(columns, rows, tuple(cuts), max(0, left // BOOK_TRIANGLES))


def wall(shape: Shape, at: Callable[[float, float], Point], length_m: float, hole: tuple[float, ...] | None) -> None:
    """Add a wall, as cells around a hole where it has one. `at`: the place of what is so far across and so high."""
    xs = (0.0, length_m) if hole is None else (0.0, hole[0], hole[1], length_m)
    zs = (0.0, HEIGHT_M) if hole is None else tuple(sorted({0.0, hole[2], hole[3], HEIGHT_M}))
    for left, right in pairwise(xs):
        for bottom, top in pairwise(zs):
            if hole is None or (left, bottom) != (hole[0], hole[2]):
                shape.polygon(at(left, bottom), at(right, bottom), at(right, top), at(left, top))


def reveal(shape: Shape, at: Callable[[float, float, float], Point], hole: tuple[float, ...]) -> None:
    """Add the four sides of an opening through a wall. `at`: the place so far across, so high and so deep."""
    left, right, bottom, top = hole
    outline = ((left, bottom), (right, bottom), (right, top), (left, top))
    for (x, z), (next_x, next_z) in zip(outline, outline[1:] + outline[:1], strict=True):
        shape.polygon(at(x, z, 0.0), at(next_x, next_z, 0.0), at(next_x, next_z, WALL_M), at(x, z, WALL_M))


def shell(columns: int, rows: int, column: int, row: int) -> Shape:
    """Walls with their openings, floor and ceiling of a room; all faces inwards."""
    shape = Shape()
    x, y, z = LENGTH_M, DEPTH_M, HEIGHT_M
    doors = [DOOR_M if there else None for there in (column > 0, column + 1 < columns)]
    windows = [WINDOW_M if there else None for there in (row > 0, row + 1 < rows)]

    def mirrored(hole: tuple[float, ...] | None, length_m: float) -> tuple[float, ...] | None:
        return hole and (length_m - hole[1], length_m - hole[0], hole[2], hole[3])

    wall(shape, lambda across, up: (0.0, across, up), y, doors[0])
    wall(shape, lambda across, up: (x, y - across, up), y, mirrored(doors[1], y))
    wall(shape, lambda across, up: (x - across, 0.0, up), x, mirrored(windows[0], x))
    wall(shape, lambda across, up: (across, y, up), x, windows[1])
    if doors[1]:
        reveal(shape, lambda across, up, deep: (x + deep, y - across, up), mirrored(doors[1], y) or DOOR_M)
    if windows[1]:
        reveal(shape, lambda across, up, deep: (across, y + deep, up), windows[1])
    shape.polygon((0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0))
    return shape.polygon((0, 0, z), (0, y, z), (x, y, z), (x, 0, z))


def build(asked: str) -> None:
    """Add the flat to the open file."""
    flat = plan(int(asked))
    chance = random.Random(1994)
    meshes = [furniture_mesh(piece, cuts) for piece, cuts in zip(PIECES, flat.cuts, strict=True)]
    spine = [furniture_mesh(Piece(f"book{k}", book, colour, ()), 1) for k, colour in enumerate(BOOKS)]
    for room in range(flat.rooms):
        column, row = room % flat.columns, room // flat.columns
        origin = Matrix.Translation((column * (LENGTH_M + WALL_M), row * (DEPTH_M + WALL_M), 0.0))
        walls = add(f"shell{room}", shell(flat.columns, flat.rows, column, row), matte("wall", WALL))
        walls.data.materials.append(matte("floor", FLOOR))
        walls.data.materials.append(matte("ceiling", CEILING))
        walls.data.polygons[-2].material_index, walls.data.polygons[-1].material_index = 1, 2
        walls.matrix_world = origin
        for piece, mesh in zip(PIECES, meshes, strict=True):
            for number, (x, y, z, degrees) in enumerate(piece.places):
                turn = degrees + (chance.uniform(-12.0, 12.0) if piece.name in {"chair", "cushion", "vase"} else 0.0)
                place(f"{piece.name}{room}.{number}", mesh, origin, (x, y, z), turn)
        first, end = (flat.books * k // flat.rooms for k in (room, room + 1))
        fill_shelf(room, origin, spine, end - first, chance)

        # Rooms are lit alike in kind, not in strength
        strength = chance.uniform(0.6, 1.4)
        exitance = tuple(strength * channel for channel in PANEL_EXITANCE_RGB)
        panel = add_light(f"panel{room}", (exitance[0], exitance[1], exitance[2]), (0, 0, 0), (0.8, 0.8))
        panel.matrix_world = origin @ Matrix.Translation((2.5, 2.0, HEIGHT_M - 0.06))
        add_spot(room, origin, strength)
    add_camera((0.3, 3.7, 1.9), (3.2, 0.9, 0.6), 20.0)
    bpy.context.view_layer.update()


def furniture_mesh(piece: Piece, cuts: int) -> bpy.types.Mesh:
    """Smooth but for its edges."""
    shape = piece.make(cuts)
    mesh = bpy.data.meshes.new(piece.name)
    mesh.from_pydata(shape.vertices, [], shape.faces)
    mesh.materials.append(matte(piece.name, piece.colour))
    if cuts > 1:
        mesh.shade_smooth()
        mesh.set_sharp_from_angle(angle=math.radians(40.0))
    return mesh


def place(name: str, mesh: bpy.types.Mesh, origin: Matrix, at: Point, degrees: float, thickness: float = 1.0) -> None:
    """Put an object of a mesh into a room."""
    item = bpy.data.objects.new(name, mesh)
    turn = Matrix.Rotation(math.radians(degrees), 4, "Z") @ Matrix.Scale(thickness, 4, (1.0, 0.0, 0.0))
    item.matrix_world = origin @ Matrix.Translation(at) @ turn
    bpy.context.scene.collection.objects.link(item)


def fill_shelf(room: int, origin: Matrix, meshes: list[bpy.types.Mesh], count: int, chance: random.Random) -> None:
    """Books side by side on each board, with a hair between them."""
    for board in range(SHELVES):
        first, end = (count * k // SHELVES for k in (board, board + 1))
        x, z = -0.47, SHELF_LOW_M + SHELF_PITCH_M * board + SHELF_BOARD_M
        for number in range(first, end):
            thickness = chance.uniform(0.6, 1.0) * min(0.05, 0.93 / (end - first))
            at = (4.3 + x, DEPTH_M - chance.uniform(0.2, 0.26), z)
            place(f"book{room}.{number}", meshes[chance.randrange(len(meshes))], origin, at, 0.0, 0.94 * thickness)
            x += thickness


def add_spot(room: int, origin: Matrix, strength: float) -> None:
    """The reading lamp's light, at the end of its arm."""
    light = bpy.data.lights.new(f"reading light{room}", "SPOT")
    light.energy, light.color = 40.0 * strength, (1.0, 0.85, 0.65)
    light.shadow_soft_size, light.spot_size, light.spot_blend = 0.05, math.radians(110.0), 0.5
    item = bpy.data.objects.new(light.name, light)
    towards = Vector((0.35, 0.1, -1.0)).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    item.matrix_world = origin @ Matrix.Translation((2.25 + 0.32, 0.3 + 0.18, 1.56)) @ towards
    bpy.context.scene.collection.objects.link(item)


if __name__ == "__main__":
    asked = sys.argv[sys.argv.index("--") + 1]
    if not asked.isdigit() or not SMALLEST <= int(asked) <= LARGEST:
        sys.exit(f"“{asked}” is no number of triangles from {SMALLEST:,} to {LARGEST:,}")
    make(build, asked)
