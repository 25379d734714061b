# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake one scene with Cycles' own bake into vertex colours, as one would without this extension.

... vertex_bake.py -- SCENE.blend FOLDER EDGE_M SAMPLES,...

All meshes are cut until no edge is longer than EDGE_M, and Cycles bakes what they send, at each corner of a face, into
their colours. FOLDER gets for each number of samples what bake.py writes for a tolerance: CYCLES-SAMPLES.json with the
size and the time of the bake alone, and an .npz with the triangles. Bounces and clamping are those of reference.py.
"""

import json
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import bmesh  # The bpy module has it once bpy is there.

from tests.study.bake import ATTRIBUTE, save_triangles
from tests.study.reference import set_up_cycles


def cut(obj: bpy.types.Object, edge_m: float) -> None:
    """Halve edges until none is longer; objects of the study's scenes are not scaled."""
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    while True:
        long = [edge for edge in mesh.edges if edge.calc_length() > edge_m]
        if not long:
            break
        bmesh.ops.subdivide_edges(mesh, edges=long, cuts=1, use_grid_fill=True)
    bmesh.ops.triangulate(mesh, faces=mesh.faces)
    mesh.to_mesh(obj.data)
    mesh.free()


def main() -> None:
    scene, folder, edge_m, *samples = sys.argv[sys.argv.index("--") + 1 :]
    bpy.ops.wm.open_mainfile(filepath=scene)
    meshes = [obj for obj in bpy.context.view_layer.objects if obj.type == "MESH"]
    for obj in meshes:
        cut(obj, float(edge_m))
        obj.data.color_attributes.active_color = obj.data.color_attributes.new(ATTRIBUTE, "FLOAT_COLOR", "CORNER")
        obj.select_set(True)
        obj["antumbra_source"] = obj.name
    bpy.context.view_layer.objects.active = meshes[0]
    counts = np.array([(len(obj.data.vertices), len(obj.data.polygons)) for obj in meshes]).sum(axis=0).tolist()
    size = {"vertices": counts[0], "triangles": counts[1], "ended_by": "converged"}
    for count in map(int, samples[0].split(",")):
        set_up_cycles(count)
        start, cpu_start = time.perf_counter(), time.process_time()
        parts = {"DIRECT", "INDIRECT", "COLOR"}
        bpy.ops.object.bake(type="DIFFUSE", pass_filter=parts, target="VERTEX_COLORS", margin=0)
        timings = {"solve_s": time.perf_counter() - start, "cpu_s": time.process_time() - cpu_start}
        path = Path(folder, f"CYCLES-{count}.json")
        path.write_text(json.dumps({"result": size, "timings": timings}) + "\n", encoding="utf-8")
        save_triangles(path.with_suffix(".npz"), meshes)
        print(
            f"{Path(scene).stem:<20} CYCLES   {count:<8} {size['vertices']:>9,} vertices {timings['solve_s']:>8.2f} s",
            file=sys.stderr,
            flush=True,
        )


if __name__ == "__main__":
    main()
