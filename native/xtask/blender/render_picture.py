# SPDX-License-Identifier: GPL-3.0-or-later
"""Render the baked objects of a .blend, mesh on the left, light on the right, with Cycles on the processor.

... render_picture.py -- BAKED.blend OUT.png

The light is shown as it is stored, without a lamp: what is dark in the picture is dark in the attribute. Seen by the
scene's camera; without one from above at an angle, with every face that turns its back left out, so that a closed
room can be looked into.
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

ATTRIBUTE = "Radiosity"
WIDTH, LARGEST_HEIGHT = 900, 900
# The exposure puts this share of all corners below white: a lamp in view must not turn the room black.
BELOW_WHITE = 0.97
SAMPLES = 24


def new_material(name: str) -> tuple[bpy.types.Material, bpy.types.Nodes, bpy.types.NodeLinks]:
    """Make a material without nodes."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material, material.node_tree.nodes, material.node_tree.links


def emit(material: bpy.types.Material, colour: bpy.types.NodeSocket, see_through_backs: bool) -> None:
    """Let the material send exactly `colour` to the camera."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    emission = nodes.new("ShaderNodeEmission")
    output = nodes.new("ShaderNodeOutputMaterial")
    links.new(colour, emission.inputs["Color"])
    shader = emission.outputs["Emission"]
    if see_through_backs:
        geometry = nodes.new("ShaderNodeNewGeometry")
        transparent = nodes.new("ShaderNodeBsdfTransparent")
        mix = nodes.new("ShaderNodeMixShader")
        links.new(geometry.outputs["Backfacing"], mix.inputs["Fac"])
        links.new(shader, mix.inputs[1])
        links.new(transparent.outputs["BSDF"], mix.inputs[2])
        shader = mix.outputs["Shader"]
    links.new(shader, output.inputs["Surface"])


def light_material(see_through_backs: bool) -> bpy.types.Material:
    """Show the attribute."""
    material, nodes, _ = new_material("light")
    attribute = nodes.new("ShaderNodeVertexColor")
    attribute.layer_name = ATTRIBUTE
    emit(material, attribute.outputs["Color"], see_through_backs)
    return material


def mesh_material(see_through_backs: bool) -> bpy.types.Material:
    """Show the edges on a surface that is the darker the more it turns away."""
    material, nodes, links = new_material("mesh")
    wire = nodes.new("ShaderNodeWireframe")
    wire.use_pixel_size = True
    wire.inputs["Size"].default_value = 0.9
    weight = nodes.new("ShaderNodeLayerWeight")
    shade = nodes.new("ShaderNodeMapRange")
    shade.inputs["To Min"].default_value = 0.85
    shade.inputs["To Max"].default_value = 0.35
    links.new(weight.outputs["Facing"], shade.inputs["Value"])
    mix = nodes.new("ShaderNodeMixRGB")
    links.new(wire.outputs["Fac"], mix.inputs["Fac"])
    links.new(shade.outputs["Result"], mix.inputs["Color1"])
    mix.inputs["Color2"].default_value = (0.01, 0.02, 0.05, 1.0)
    emit(material, mix.outputs["Color"], see_through_backs)
    return material


def exposure(baked: list[bpy.types.Object]) -> float:
    """Stops that bring the light into the range of a picture."""
    brightest = []
    for mesh in {o.data for o in baked}:
        data = mesh.color_attributes[ATTRIBUTE].data
        colours = np.empty(len(data) * 4, dtype=np.float32)
        data.foreach_get("color", colours)
        brightest.append(colours.reshape(-1, 4)[:, :3].max(axis=1))
    white = float(np.quantile(np.concatenate(brightest), BELOW_WHITE))
    return -float(np.log2(white)) if white > 0.0 else 0.0


def add_camera(scene: bpy.types.Scene, baked: list[bpy.types.Object]) -> None:
    """Look at everything that was baked from above, at an angle, from just far enough away."""
    corners = [o.matrix_world @ Vector(corner) for o in baked for corner in o.bound_box]
    low = Vector([min(corner[axis] for corner in corners) for axis in range(3)])
    high = Vector([max(corner[axis] for corner in corners) for axis in range(3)])
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    direction = Vector((0.55, -0.75, 0.6)).normalized()
    radius = max((high - low).length / 2, 1e-3)
    distance = radius / np.tan(camera.data.angle_y / 2) + radius * 0.2
    eye = (low + high) / 2 + direction * distance
    camera.matrix_world = Matrix.Translation(eye) @ direction.to_track_quat("Z", "Y").to_matrix().to_4x4()
    camera.data.clip_end = 10 * distance
    scene.camera = camera


def render(scene: bpy.types.Scene, material: bpy.types.Material, stops: float, path: Path) -> NDArray[np.float32]:
    """Render with one material on everything and return (rows, columns, 4), bottom row first."""
    bpy.context.view_layer.material_override = material
    scene.view_settings.exposure = stops
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    width, height = scene.render.resolution_x, scene.render.resolution_y
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4)


def set_up(scene: bpy.types.Scene) -> None:
    """Make a plain picture of the stored values: no lamps, no world, no view that bends colours."""
    scene.world = bpy.data.worlds.new("nothing")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = False
    scene.world.color = (0.0, 0.0, 0.0)
    scene.use_nodes = False
    # Its engines are registered while Blender runs; the types know only one.
    render_settings: Any = scene.render
    render_settings.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.gamma = 1.0
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGBA"


def render_bake(source: str, stops: float | None = None) -> tuple[NDArray[np.float32], NDArray[np.float32], float]:
    """Render the mesh and the light of a baked .blend, (rows, columns, 4) each over a dark ground.

    Without `stops` the exposure is chosen from the light; what was used comes third, for a picture to compare with.
    """
    bpy.ops.wm.open_mainfile(filepath=source)
    scene = bpy.context.scene
    baked = [o for o in bpy.context.view_layer.objects if o.type == "MESH" and ATTRIBUTE in o.data.color_attributes]
    if not baked:
        sys.exit(f"{source} holds no baked object")
    for other in scene.objects:
        if other.type != "CAMERA":
            other.hide_render = other not in baked
    set_up(scene)

    own_camera = scene.camera is not None
    render_settings = scene.render
    render_settings.resolution_percentage = 100
    height = WIDTH * render_settings.resolution_y / render_settings.resolution_x if own_camera else WIDTH * 0.75
    render_settings.resolution_x, render_settings.resolution_y = WIDTH, min(round(height), LARGEST_HEIGHT)
    if not own_camera:
        add_camera(scene, baked)
    if stops is None:
        stops = exposure(baked)
    with tempfile.TemporaryDirectory() as folder:
        see_through_backs = not own_camera
        mesh = render(scene, mesh_material(see_through_backs), 0.0, Path(folder, "mesh.png"))
        light = render(scene, light_material(see_through_backs), stops, Path(folder, "light.png"))
    for picture in (mesh, light):
        picture[..., :3] = picture[..., :3] * picture[..., 3:] + 0.08 * (1.0 - picture[..., 3:])
        picture[..., 3] = 1.0
    return mesh, light, stops


def save_picture(pixels: NDArray[np.float32], path: str) -> None:
    """Write (rows, columns, 4), bottom row first, as bytes, so that nothing is converted on the way."""
    picture = bpy.data.images.new("picture", pixels.shape[1], pixels.shape[0])
    picture.pixels.foreach_set(pixels.ravel())
    picture.filepath_raw = path
    picture.file_format = "PNG"
    picture.save()


def main() -> None:
    source, output = sys.argv[sys.argv.index("--") + 1 :]
    mesh, light, _ = render_bake(source)
    save_picture(np.concatenate([mesh, light], axis=1), output)


if __name__ == "__main__":
    main()
