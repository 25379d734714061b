# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scene makers share: shapes of polygons, matte materials, area lights, a camera, and the file.

Lengths are metres, colours are linear RGB, exitances W/m² per channel. A scene is built into the open file, which
`make` empties before and saves after.
"""

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import bpy
from mathutils import Matrix, Vector

Rgb = tuple[float, float, float]
Point = Sequence[float]


@dataclass
class Shape:
    """Polygons that become one mesh. Every method adds some and returns the shape, so that calls can be chained."""

    vertices: list[Vector] = field(default_factory=list)
    faces: list[tuple[int, ...]] = field(default_factory=list)

    def polygon(self, *corners: Point) -> "Shape":
        """Add one polygon with vertices of its own; it faces whoever sees its corners run anticlockwise."""
        return self.mesh(corners, [tuple(range(len(corners)))])

    def mesh(self, vertices: Sequence[Point], faces: Sequence[tuple[int, ...]]) -> "Shape":
        """Add polygons that share vertices, as indices into these vertices."""
        first = len(self.vertices)
        self.vertices += [Vector(vertex) for vertex in vertices]
        self.faces += [tuple(first + corner for corner in face) for face in faces]
        return self

    def box(self, low: Point, high: Point) -> "Shape":
        """Add a closed box along the axes: 6 polygons."""
        corners = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
        return self.mesh(corners, [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])

    def prism(
        self, start: Point, end: Point, radius_m: float, sides: int, end_radius_m: float | None = None
    ) -> "Shape":
        """Add a closed round bar from start to end: `sides` quads and two caps. Radii are those of the corners."""
        ends = Vector(start), Vector(end)
        turn = (ends[1] - ends[0]).to_track_quat("Z", "Y")
        angles = [2.0 * math.pi * (side + 0.5) / sides for side in range(sides)]
        rings = [
            [centre + turn @ Vector((radius * math.cos(a), radius * math.sin(a), 0.0)) for a in angles]
            for centre, radius in zip(ends, (radius_m, radius_m if end_radius_m is None else end_radius_m), strict=True)
        ]
        mantle = [(side, (side + 1) % sides, sides + (side + 1) % sides, sides + side) for side in range(sides)]
        caps = [tuple(reversed(range(sides))), tuple(range(sides, 2 * sides))]
        return self.mesh(rings[0] + rings[1], mantle + caps)

    def moved(self, world_from_shape: Matrix) -> "Shape":
        """The same polygons elsewhere. The matrix must not mirror."""
        return Shape([world_from_shape @ vertex for vertex in self.vertices], list(self.faces))

    def standing(self, x: float, y: float, degrees: float = 0.0) -> "Shape":
        """The same polygons, turned about the z axis and put down at x, y."""
        return self.moved(Matrix.Translation((x, y, 0.0)) @ Matrix.Rotation(math.radians(degrees), 4, "Z"))


def matte(name: str, reflectance: Rgb) -> bpy.types.Material:
    """Make a material that is diffuse and nothing else, or return the one of this name."""
    if name in bpy.data.materials:
        return bpy.data.materials[name]
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        # Later versions give every material its nodes and warn about this switch.
        material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*reflectance, 1.0)
    shader.inputs["Roughness"].default_value = 1.0
    # Without this a part of the light goes into a gloss that radiosity does not know.
    shader.inputs["Specular IOR Level"].default_value = 0.0
    return material


def add(name: str, shape: Shape, material: bpy.types.Material) -> bpy.types.Object:
    """Add a mesh object of one material."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(shape.vertices, [], shape.faces)
    mesh.materials.append(material)
    added = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(added)
    return added


def add_light(
    name: str, exitance_rgb: Rgb, place: Point, size_m: tuple[float, float], towards: Point = (0.0, 0.0, -1.0)
) -> bpy.types.Object:
    """Add a rectangular area light. One that shines down has its first size along x; see `to_track_quat` for others."""
    light = bpy.data.lights.new(name, "AREA")
    light.shape = "SQUARE" if size_m[0] == size_m[1] else "RECTANGLE"
    light.size, light.size_y = size_m
    strongest = max(exitance_rgb)
    # Blender's power of a light is exitance times area; its colour only tints.
    light.energy = strongest * size_m[0] * size_m[1]
    light.color = [channel / strongest for channel in exitance_rgb]
    lamp = bpy.data.objects.new(name, light)
    lamp.location = place
    if tuple(towards) != (0.0, 0.0, -1.0):
        lamp.rotation_euler = Vector(towards).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(lamp)
    return lamp


def add_camera(eye: Point, target: Point, lens_mm: float, size: tuple[int, int] = (960, 720)) -> None:
    """Look from eye to target in pictures of `size` pixels."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    view = Vector(target) - Vector(eye)
    camera.matrix_world = Matrix.Translation(eye) @ view.to_track_quat("-Z", "Y").to_matrix().to_4x4()
    camera.data.lens = lens_mm
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = size


def measure_only(receivers: Sequence[bpy.types.Object]) -> None:
    """Select what a study of this scene measures; when nothing is selected, that is everything."""
    bpy.context.view_layer.update()
    for receiver in receivers:
        receiver.select_set(True)


def patch_count() -> int:
    """Polygons of all meshes as modelled, a quad and an n-gon counting one each."""
    counts: list[int] = [len(o.data.polygons) for o in bpy.context.scene.objects if o.type == "MESH"]
    return sum(counts)


def only_direct_light(lights: int) -> None:
    """Turn the scene into a variant for counting elements: its first `lights` lights, and no second bounce.

    Every surface becomes black, so the variant has to be baked as irradiance. The strongest light counts as the first.
    """
    lamps = sorted((o for o in bpy.context.scene.objects if o.type == "LIGHT"), key=lambda o: -o.data.energy)
    for lamp in lamps[lights:]:
        bpy.data.objects.remove(lamp)
    for material in bpy.data.materials:
        if material.node_tree is not None and "Principled BSDF" in material.node_tree.nodes:
            shader = material.node_tree.nodes["Principled BSDF"]
            shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)


def make(build: Callable[..., None], *arguments: str) -> None:
    """Build the scene into an empty file and save it: the script's arguments are OUT.blend and maybe `direct=COUNT`."""
    output, *options = sys.argv[sys.argv.index("--") + 1 + len(arguments) :]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    build(*arguments)
    for option in options:
        name, _, value = option.partition("=")
        if name != "direct" or not value.isdigit():
            sys.exit(f"“{option}” is not direct=COUNT")
        only_direct_light(int(value))
    bpy.ops.wm.save_as_mainfile(filepath=output, check_existing=False)
