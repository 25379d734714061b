# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake one scene with several methods and tolerances, through the installed extension, in one process.

... bake.py -- SCENE.blend FOLDER QUANTITY TIME_LIMIT_S TRIANGLE_BUDGET METHOD,... TOLERANCE,...

Each bake is what `cargo xtask bake` starts: the extension's own command line on the opened file. FOLDER gets for each
METHOD-TOLERANCE a .json, the bake's report or {"refused": ...}, and an .npz with the triangles of everything baked:
`corners` (T, 3, 3) m, `colours` (T, 3, 3) B/pi, `sources` (T) as indices into `source_names`.

A method is left at its first tolerance that it does not reach within the limits: finer ones cost more. A method that
the extension refuses is left out with the extension's own words. What is said here goes to stderr: stdout belongs to
Blender.
"""

import contextlib
import importlib
import io
import json
import sys
from collections.abc import Iterable
from pathlib import Path

import bpy
import numpy as np

EXTENSION = "bl_ext.user_default.antumbra"
ATTRIBUTE = "Radiosity"


def baked_objects() -> list[bpy.types.Object]:
    """What bakes made in the open file."""
    collections = bpy.context.scene.collection.children_recursive
    return [item for made in collections if made.name == "Antumbra" for item in made.objects]


def save_triangles(path: Path, baked: Iterable[bpy.types.Object]) -> None:
    """Write the triangles of baked objects."""
    corners, colours, sources, names = [], [], [], []
    for item in baked:
        mesh = item.data
        mesh.calc_loop_triangles()
        loops = np.empty(len(mesh.loop_triangles) * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("loops", loops)
        vertex_of_loop = np.empty(len(mesh.loops), dtype=np.int32)
        mesh.loops.foreach_get("vertex_index", vertex_of_loop)
        positions = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
        mesh.vertices.foreach_get("co", positions)
        world = np.array(item.matrix_world)
        positions = positions.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
        values = np.empty(len(mesh.loops) * 4, dtype=np.float32)
        mesh.color_attributes[ATTRIBUTE].data.foreach_get("color", values)
        corners.append(positions[vertex_of_loop[loops]].reshape(-1, 3, 3))
        colours.append(values.reshape(-1, 4)[loops, :3].reshape(-1, 3, 3))
        source = item["antumbra_source"]
        if source not in names:
            names.append(source)
        sources.append(np.full(len(corners[-1]), names.index(source), dtype=np.int32))
    np.savez(
        path,
        corners=np.concatenate(corners),
        colours=np.concatenate(colours),
        sources=np.concatenate(sources),
        source_names=np.array(names),
    )


def bake_one(scene: str, folder: Path, name: str, settings: dict[str, object]) -> dict[str, object]:
    """Bake; returns the report, or why there is none."""
    blend, report = folder / f"{name}.blend", folder / f"{name}.json"
    bpy.ops.wm.open_mainfile(filepath=scene)
    arguments = ["--output", str(blend), "--report", str(report), "--progress", "none"]
    for setting, value in settings.items():
        arguments += ["--set", f"{setting}={value}"]
    said = io.StringIO()
    with contextlib.redirect_stderr(said):
        code = importlib.import_module(f"{EXTENSION}.cli").run(arguments)
    lines = said.getvalue().strip().splitlines()
    if code != 0:
        return {"refused" if code == 2 else "failed": lines[-1] if lines else f"exit code {code}"}
    save_triangles(folder / f"{name}.npz", baked_objects())
    blend.unlink()
    return dict(json.loads(report.read_text(encoding="utf-8")))


def main() -> None:
    scene, folder, quantity, time_limit, budget, methods, tolerances = sys.argv[sys.argv.index("--") + 1 :]
    if EXTENSION not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=EXTENSION)
    Path(folder).mkdir(parents=True, exist_ok=True)
    for method in methods.split(","):
        for tolerance in sorted(map(float, tolerances.split(",")), reverse=True):
            name = f"{method}-{tolerance:g}"
            settings = {
                "method": method,
                "tolerance": tolerance,
                "quantity": quantity,
                # Also where the scene selects what is measured: what is not baked is not refined, and sends worse.
                "receivers": "ALL",
                "time_limit": time_limit,
                "triangle_budget": budget,
            }
            report = bake_one(scene, Path(folder), name, settings)
            Path(folder, f"{name}.json").write_text(json.dumps(report) + "\n", encoding="utf-8")
            said = report.get("refused") or report.get("failed")
            if said:
                print(f"*** {Path(scene).stem}, {method}: SKIPPED: {said}", file=sys.stderr, flush=True)
                break
            result, timings = dict(report["result"]), dict(report["timings"])  # type: ignore[call-overload]
            print(
                f"{Path(scene).stem:<20} {method:<8} {tolerance:<8g} {result['vertices']:>9,} vertices "
                f"{timings['solve_s']:>8.2f} s  {result['ended_by']}",
                file=sys.stderr,
                flush=True,
            )
            if result["ended_by"] != "converged":
                break


if __name__ == "__main__":
    main()
