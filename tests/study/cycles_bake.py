# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake one scene into vertex colours with Cycles, for comparison: uniform meshes of several sizes, several samples.

... cycles_bake.py -- SCENE.blend FOLDER TIME_LIMIT_S TRIANGLE_BUDGET SAMPLES,...

What an artist would do without the extension: every face is cut evenly, and Cycles bakes diffuse light and emission.
It is done as well as Cycles can: faces are parted at sharp edges, so that a colour per vertex, one path-traced point
each, is enough; materials do not shine; nothing is clamped; the lamps are few, so there is no light tree. FOLDER gets
for each CYCLESsamples-SIZE a .json and an .npz as of `bake.py`, SIZE being the longest edge over the scene's diagonal.
Samples are left at the first size that takes longer than the limit, or would make more triangles.
"""

import json
import math
import sys
import time
from pathlib import Path

import bpy  # isort: skip  bmesh is part of it
import bmesh
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.study.reference import diagonal_m, set_up_cycles

SIZES = tuple(0.5**power for power in range(3, 10))
ATTRIBUTE = "light"
SHARP_RAD = 1e-3
"""Faces that meet at more than this have a light each: far above the rounding of normals of one plane."""


def is_flat(face: bmesh.types.BMFace) -> bool:
    """Whether all corners lie in one plane, within the rounding of single precision."""
    ways = [vertex.co - face.verts[0].co for vertex in face.verts]
    return bool(max(abs(way.dot(face.normal)) for way in ways) <= 1e-6 * max(way.length for way in ways))


def cut(receiver: bpy.types.Object, longest_m: float) -> None:
    """Halve all edges until none is longer, and part the mesh at sharp edges. Objects are not scaled here."""
    mesh = bmesh.new()
    mesh.from_mesh(receiver.data)
    # A face that is not flat is two triangles, for the reference and for the solver too.
    bent = [face for face in mesh.faces if not is_flat(face)]
    bmesh.ops.triangulate(mesh, faces=bent, quad_method="FIXED")
    while max(edge.calc_length() for edge in mesh.edges) > longest_m:
        bmesh.ops.subdivide_edges(mesh, edges=mesh.edges[:], cuts=1, use_grid_fill=True)
    sharp = [edge for edge in mesh.edges if len(edge.link_faces) == 2 and edge.calc_face_angle() > SHARP_RAD]
    bmesh.ops.split_edges(mesh, edges=sharp)
    bmesh.ops.triangulate(mesh, faces=mesh.faces[:])
    mesh.to_mesh(receiver.data)
    mesh.free()
    attributes = receiver.data.color_attributes
    attributes.active_color = attributes.new(ATTRIBUTE, "FLOAT_COLOR", "POINT")


def receivers_of_open_file() -> list[bpy.types.Object]:
    """All meshes, each with data and scale of its own."""
    receivers = [o for o in bpy.context.scene.objects if o.type == "MESH" and not o.hide_render]
    for receiver in receivers:
        receiver.data = receiver.data.copy()
        receiver.data.transform(receiver.matrix_world)
        receiver.matrix_world = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    return receivers


def take_off_gloss() -> None:
    """Let materials reflect all of their colour diffusely, as the solver and the reference understand them."""
    for material in bpy.data.materials:
        for node in material.node_tree.nodes if material.node_tree else ():
            if node.type == "BSDF_PRINCIPLED":
                node.inputs["Specular IOR Level"].default_value = 0.0


def bake(receivers: list[bpy.types.Object], samples: int) -> tuple[float, float]:
    """Bake what surfaces send; returns seconds on the clock and of the processor."""
    set_up_cycles(samples)
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other in receivers)
    bpy.context.view_layer.objects.active = receivers[0]
    clock, processor = time.perf_counter(), time.process_time()
    passes = {"DIRECT", "INDIRECT", "DIFFUSE", "EMIT"}
    bpy.ops.object.bake(type="COMBINED", pass_filter=passes, target="VERTEX_COLORS", margin=0)
    return time.perf_counter() - clock, time.process_time() - processor


def save(receivers: list[bpy.types.Object], path: Path) -> tuple[int, int]:
    """Write triangles as `bake.py` does; returns vertices and triangles."""
    corners, colours, sources, vertices = [], [], [], 0
    for number, receiver in enumerate(receivers):
        mesh = receiver.data
        mesh.calc_loop_triangles()
        triangles = np.empty(len(mesh.loop_triangles) * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        positions = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
        mesh.vertices.foreach_get("co", positions)
        values = np.empty(len(mesh.vertices) * 4, dtype=np.float32)
        mesh.color_attributes[ATTRIBUTE].data.foreach_get("color", values)
        corners.append(positions.reshape(-1, 3)[triangles].reshape(-1, 3, 3))
        colours.append(values.reshape(-1, 4)[triangles, :3].reshape(-1, 3, 3))
        sources.append(np.full(len(corners[-1]), number, dtype=np.int32))
        vertices += len(mesh.vertices)
    all_corners = np.concatenate(corners)
    np.savez(
        path,
        corners=all_corners,
        colours=np.concatenate(colours),
        sources=np.concatenate(sources),
        source_names=np.array([receiver.name for receiver in receivers]),
    )
    return vertices, len(all_corners)


def triangles_at(receivers: list[bpy.types.Object], longest_m: float) -> int:
    """How many there would be."""
    count = 0
    for receiver in receivers:
        mesh = receiver.data
        ends = [[mesh.vertices[v].co for v in edge.vertices] for edge in mesh.edges]
        halvings = max(0, math.ceil(math.log2(max((b - a).length for a, b in ends) / longest_m)))
        mesh.calc_loop_triangles()
        count += len(mesh.loop_triangles) * int(4**halvings)
    return count


def main() -> None:
    scene, folder, time_limit, budget, samples_list = sys.argv[sys.argv.index("--") + 1 :]
    Path(folder).mkdir(parents=True, exist_ok=True)
    for samples in map(int, samples_list.split(",")):
        for size in SIZES:
            bpy.ops.wm.open_mainfile(filepath=scene)
            longest_m = size * diagonal_m()
            receivers = receivers_of_open_file()
            if triangles_at(receivers, longest_m) > int(budget):
                break
            take_off_gloss()
            for receiver in receivers:
                cut(receiver, longest_m)
            solve_s, cpu_s = bake(receivers, samples)
            path = Path(folder, f"CYCLES{samples}-{size:g}")
            vertices, triangles = save(receivers, path.with_name(f"{path.name}.npz"))
            report = {
                "result": {"vertices": vertices, "triangles": triangles, "ended_by": "converged"},
                "timings": {"solve_s": solve_s, "cpu_s": cpu_s},
            }
            path.with_name(f"{path.name}.json").write_text(json.dumps(report) + "\n", encoding="utf-8")
            print(
                f"{Path(scene).stem:<20} CYCLES {samples:<8} {vertices:>9,} vertices {solve_s:>8.2f} s",
                # stdout belongs to Blender.
                file=sys.stderr,
                flush=True,
            )
            if solve_s > float(time_limit):
                break


if __name__ == "__main__":
    main()
