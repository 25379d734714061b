# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the paper's test scene: a cube floats over a plane under two lights of different colour.

... paper.py -- OUT.blend

The cube has edges of 1 m, is turned by 20 degrees and floats 0.5 m above a plane of 6 m; the lights are squares of
0.5 m at a height of 4 m.
"""

import math
import sys

import bpy
from mathutils import Matrix, Vector

# Exitance pi·L in W/m² of each light, and where it hangs.
LIGHTS = (
    ("light0", (120.0, 80.0, 40.0), (-1.5, -1.0, 4.0)),
    ("light1", (30.0, 60.0, 110.0), (1.2, 1.4, 4.0)),
)
LIGHT_EDGE_M = 0.5


def matte(name: str, reflectance: float) -> bpy.types.Material:
    """Make a material that is diffuse and nothing else."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        # Later versions give every material its nodes and warn about this switch.
        material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (reflectance, reflectance, reflectance, 1.0)
    shader.inputs["Roughness"].default_value = 1.0
    # Without this a part of the light goes into a gloss that radiosity does not know.
    shader.inputs["Specular IOR Level"].default_value = 0.0
    return material


def add_mesh(name: str, vertices: list[Vector], faces: list[tuple[int, ...]], reflectance: float) -> None:
    """Add a mesh object with one matte material."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(matte(name, reflectance))
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))


def add_light(name: str, exitance: tuple[float, float, float], place: tuple[float, float, float]) -> None:
    """Add a square area light that shines downwards, Blender's own direction for one that is not turned."""
    light = bpy.data.lights.new(name, "AREA")
    light.shape = "SQUARE"
    light.size = LIGHT_EDGE_M
    strongest = max(exitance)
    # Blender's power of a light is exitance times area; its colour only tints.
    light.energy = strongest * LIGHT_EDGE_M**2
    light.color = [channel / strongest for channel in exitance]
    lamp = bpy.data.objects.new(name, light)
    lamp.location = place
    bpy.context.collection.objects.link(lamp)


def add_camera() -> None:
    """Look down on plane and cube from the front right."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    eye, target = Vector((5.2, -7.4, 6.4)), Vector((0.0, -0.1, 0.3))
    camera.matrix_world = Matrix.Translation(eye) @ (target - eye).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    camera.data.lens = 38.0
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 960, 720


def main() -> None:
    (output,) = sys.argv[sys.argv.index("--") + 1 :]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    plane = [Vector((x, y, 0.0)) for y in (-3.0, 3.0) for x in (-3.0, 3.0)]
    add_mesh("plane", plane, [(0, 1, 3, 2)], 0.7)
    turn = Matrix.Rotation(math.radians(20.0), 3, "Z")
    corners = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
    cube = [turn @ Vector((x, y, z)) for z in (0.5, 1.5) for x, y in corners]
    sides = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    add_mesh("cube", cube, [(0, 3, 2, 1), (4, 5, 6, 7), *sides], 0.5)
    for name, exitance, place in LIGHTS:
        add_light(name, exitance, place)
    add_camera()
    bpy.ops.wm.save_as_mainfile(filepath=output)


main()
