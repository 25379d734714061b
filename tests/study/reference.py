# SPDX-License-Identifier: GPL-3.0-or-later
"""Compute the light at random points of a scene with Cycles' path tracer, which shares nothing with the solver.

... reference.py -- SCENE.blend OUT.npz [points=N] [samples=N] [seeds=N]

Each point gets a triangle of its own, so small that its corners are one place, a hair above the surface. All of them
are one white mesh that no ray meets, and Cycles bakes the light on it into vertex colours: direct and indirect, up to
32 bounces, nothing clamped, culled or denoised. That gives the irradiance H, hence B = E + rho·H with reflectance and
emission of the surface's own material, which has to be Principled with constants.

The three corners and the seeds are independent estimates; their scatter gives the standard error.

OUT.npz holds, for N points drawn evenly over the area of the receivers, on the sides that the normals point to:
`points` (N, 3) m, `normals` (N, 3), `objects` (N) as indices into `object_names`, `irradiance`, `irradiance_stderr`,
`radiosity` and `radiosity_stderr` (N, 3) W/m², and `settings`, the numbers asked for as text.
"""

import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

OFFSET = 1e-5
"""Height above the surface and size of the triangles, of the scene's diagonal. Smaller and single precision blurs the
triangles' normals (at 1e-6 by 1e-2 rad); larger and points at contacts see around corners."""
MAX_BOUNCES = 32
"""With a reflectance of 0.8 everywhere in a closed room, what comes after them is 0.8³² = 0.08 % of the light."""


@dataclass
class Points:
    """N places on the receiving surfaces and what the material makes of the light there."""

    points: Floats
    normals: Floats
    objects: NDArray[np.int32]
    object_names: list[str]
    reflectance: Floats
    emission: Floats


def material_constants(material: bpy.types.Material | None) -> tuple[Floats, Floats]:
    """Reflectance and exitance pi·L in W/m², (3) each, of a Principled material of constants."""
    if material is None:
        return np.full(3, 0.8), np.zeros(3)
    shaders = [node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED"]
    if len(shaders) != 1 or any(shaders[0].inputs[name].is_linked for name in ("Base Color", "Emission Color")):
        sys.exit(f"material “{material.name}” is not one Principled shader of constants: it has no reference")
    inputs = shaders[0].inputs
    if inputs["Specular IOR Level"].default_value or inputs["Metallic"].default_value:
        sys.exit(f"material “{material.name}” is not matte: it has no reference")
    strength = inputs["Emission Strength"].default_value
    emission = np.array(inputs["Emission Color"].default_value[:3]) * strength * math.pi
    return np.array(inputs["Base Color"].default_value[:3]), emission


def draw_points(count: int, seed: int) -> Points:
    """Draw points evenly over the area of the selected meshes, or of all that renders see when none is selected."""
    selected = {o.name for o in bpy.context.view_layer.objects if o.type == "MESH" and o.select_get()}
    corners, triangle_objects, reflectances, emissions = [], [], [], []
    names: list[str] = []
    for receiver in sorted(bpy.context.scene.objects, key=lambda o: o.name):
        if receiver.type != "MESH" or receiver.hide_render or (selected and receiver.name not in selected):
            continue
        mesh = receiver.data
        mesh.calc_loop_triangles()
        world_from_object = np.array(receiver.matrix_world)
        vertices = np.empty(len(mesh.vertices) * 3)
        mesh.vertices.foreach_get("co", vertices)
        vertices = vertices.reshape(-1, 3) @ world_from_object[:3, :3].T + world_from_object[:3, 3]
        triangles = np.empty(len(mesh.loop_triangles) * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        slots = np.empty(len(mesh.loop_triangles), dtype=np.int32)
        mesh.loop_triangles.foreach_get("material_index", slots)
        corner = vertices[triangles.reshape(-1, 3)]
        if np.linalg.det(world_from_object[:3, :3]) < 0.0:
            corner = corner[:, ::-1]
        constants = [material_constants(material) for material in mesh.materials] or [material_constants(None)]
        corners.append(corner)
        reflectances.append(np.array([constants[slot][0] for slot in slots]).reshape(-1, 3))
        emissions.append(np.array([constants[slot][1] for slot in slots]).reshape(-1, 3))
        triangle_objects.append(np.full(len(corner), len(names), dtype=np.int32))
        names.append(receiver.name)
    corner = np.concatenate(corners)
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    double_area = np.linalg.norm(cross, axis=1)

    # Stratified over the summed areas: less chance in how many points an object gets. Edges have chance 0.
    chance = np.random.default_rng(seed)
    places = (np.arange(count) + chance.random(count)) / count * double_area.sum()
    chosen = np.minimum(np.searchsorted(np.cumsum(double_area), places), len(corner) - 1)
    root, second = np.sqrt(chance.random(count)), chance.random(count)
    weights = np.stack([1.0 - root, root * (1.0 - second), root * second], axis=1)
    return Points(
        points=np.einsum("nc,ncx->nx", weights, corner[chosen]),
        normals=cross[chosen] / double_area[chosen, None],
        objects=np.concatenate(triangle_objects)[chosen],
        object_names=names,
        reflectance=np.concatenate(reflectances)[chosen],
        emission=np.concatenate(emissions)[chosen],
    )


def diagonal_m() -> float:
    """Length of the diagonal of the box around all meshes."""
    corners = np.concatenate(
        [np.array(o.bound_box) @ np.array(o.matrix_world)[:3, :3].T + np.array(o.matrix_world)[:3, 3]
         for o in bpy.context.scene.objects if o.type == "MESH"]
    )  # fmt: skip
    return float(np.linalg.norm(np.ptp(corners, axis=0)))


def add_target(places: Points) -> bpy.types.Object:
    """Add one white mesh of a tiny triangle over each point; rays pass through it."""
    step = OFFSET * diagonal_m()
    # Any vector that is not along the normal spans the triangle's plane with it.
    least = np.eye(3)[np.argmin(np.abs(places.normals), axis=1)]
    u = np.cross(places.normals, least)
    u /= np.linalg.norm(u, axis=1)[:, None]
    v = np.cross(places.normals, u)
    middle = places.points + step * places.normals
    angles = 2.0 * math.pi / 3.0 * np.arange(3)
    vertices = middle[:, None] + step * (
        np.cos(angles)[:, None] * u[:, None] + np.sin(angles)[:, None] * v[:, None]
    )  # fmt: skip
    mesh = bpy.data.meshes.new("reference points")
    mesh.from_pydata(vertices.reshape(-1, 3), [], np.arange(3 * len(middle)).reshape(-1, 3))
    mesh.color_attributes.active_color = mesh.color_attributes.new("light", "FLOAT_COLOR", "CORNER")

    white = bpy.data.materials.new("reference points")
    if bpy.app.version < (5, 0):
        white.use_nodes = True
    nodes = white.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    white.node_tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    mesh.materials.append(white)
    target = bpy.data.objects.new("reference points", mesh)
    bpy.context.scene.collection.objects.link(target)
    # A bake has no camera rays; an object that no ray at all can see would be left out of the bake.
    for kind in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(target, f"visible_{kind}", False)
    return target


def set_up_cycles(samples: int) -> None:
    """Make Cycles unbiased, at whatever cost."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = MAX_BOUNCES
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    # With a handful of lamps the tree costs more than it saves.
    cycles.use_light_tree = False
    cycles.film_exposure = 1.0


def bake_irradiance(target: bpy.types.Object, seed: int) -> Floats:
    """Irradiance in W/m² at each corner: (N, 3 corners, 3 channels)."""
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == target)
    bpy.context.view_layer.objects.active = target
    bpy.context.scene.cycles.seed = seed
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, target="VERTEX_COLORS", margin=0)
    colours = np.empty(len(target.data.loops) * 4, dtype=np.float32)
    target.data.color_attributes["light"].data.foreach_get("color", colours)
    # White sends H/pi.
    return math.pi * colours.reshape(-1, 3, 4)[..., :3].astype(np.float64)


def irradiance_at(places: Points, samples: int, seeds: int) -> tuple[Floats, Floats]:
    """Irradiance and its standard error in W/m², (N, 3) each, from `samples` paths a point in all."""
    per_corner = max(1, math.ceil(samples / (3 * seeds)))
    set_up_cycles(per_corner)
    target = add_target(places)
    estimates = np.concatenate([bake_irradiance(target, seed) for seed in range(seeds)], axis=1)
    bpy.data.objects.remove(target)
    return estimates.mean(axis=1), estimates.std(axis=1, ddof=1) / math.sqrt(estimates.shape[1])


def main() -> None:
    source, output, *options = sys.argv[sys.argv.index("--") + 1 :]
    numbers = {"points": 2000, "samples": 4096, "seeds": 4}
    for option in options:
        name, _, value = option.partition("=")
        if name not in numbers or not value.isdigit():
            sys.exit(f"“{option}” is not one of {', '.join(numbers)} with =COUNT")
        numbers[name] = int(value)
    bpy.ops.wm.open_mainfile(filepath=source)
    start = time.monotonic()
    places = draw_points(numbers["points"], seed=1994)
    irradiance, stderr = irradiance_at(places, numbers["samples"], numbers["seeds"])
    seconds = time.monotonic() - start
    radiosity = places.emission + places.reflectance * irradiance
    radiosity_stderr = places.reflectance * stderr
    np.savez_compressed(
        output,
        points=places.points,
        normals=places.normals,
        objects=places.objects,
        object_names=np.array(places.object_names),
        irradiance=irradiance,
        irradiance_stderr=stderr,
        radiosity=radiosity,
        radiosity_stderr=radiosity_stderr,
        settings=np.array(" ".join(f"{name}={value}" for name, value in numbers.items())),
    )
    noise = float(np.sqrt((stderr**2).mean()) / irradiance.mean())
    print(
        f"{Path(source).stem}: {len(places.points)} points in {seconds:.0f} s, "
        f"standard error {100.0 * noise:.2f} % of the mean irradiance",
        # stdout belongs to Blender.
        file=sys.stderr,
    )


if __name__ == "__main__":
    main()
