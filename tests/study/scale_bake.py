# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake everything in one scene through the installed extension, and tell what it took, memory included.

... scale_bake.py -- SCENE.blend OUT.json NAME=VALUE...

What is baked is thrown away. OUT.json is the bake's report with one more field, `memory_bytes`: of the whole process
what it held `before` the bake, with Blender and the opened file in it, and at `most` at any time (Linux: VmHWM); and
what the bake held beyond `before` when the scene was `read`, at most while it was being solved (`solve`), and at most
while it was being written (`write`). These three are looked at a hundred times a second. All are null elsewhere.
"""

import importlib
import json
import sys
import threading
import time
from pathlib import Path

import bpy

EXTENSION = "bl_ext.user_default.antumbra"
STATUS = Path("/proc/self/status")
LOOKS_A_SECOND = 100


def held(kind: str) -> int:
    """Bytes of memory that the process holds now (VmRSS) or has held at most (VmHWM)."""
    line = next(line for line in STATUS.read_text(encoding="ascii").splitlines() if line.startswith(kind))
    return 1024 * int(line.split()[1])


class Watch(threading.Thread):
    """Looks at the process's memory from when it is started until `end` is set."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.end = threading.Event()
        self.looks: list[tuple[float, int]] = []

    def run(self) -> None:
        while not self.end.wait(1.0 / LOOKS_A_SECOND):
            self.looks.append((time.perf_counter(), held("VmRSS")))

    def most(self, start: float, end: float) -> int:
        """Between two moments."""
        return max((held for moment, held in self.looks if start <= moment <= end), default=0)


def main() -> None:
    scene, out, *assignments = sys.argv[sys.argv.index("--") + 1 :]
    if EXTENSION not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=EXTENSION)
    bpy.ops.wm.open_mainfile(filepath=scene)
    baked = Path(out).with_suffix(".blend")
    arguments = ["--output", str(baked), "--report", out, "--progress", "none"]
    for assignment in ("receivers=ALL", *assignments):
        arguments += ["--set", assignment]

    # Bake, watched
    watch = Watch() if STATUS.is_file() else None
    before = held("VmRSS") if watch else None
    if watch:
        watch.start()
    start = time.perf_counter()
    code = importlib.import_module(f"{EXTENSION}.cli").run(arguments)
    if code != 0:
        sys.exit(code)
    baked.unlink()

    report = json.loads(Path(out).read_text(encoding="utf-8"))
    memory: dict[str, int | None] = dict.fromkeys(("before", "read", "solve", "write", "most"))
    if watch and before is not None:
        watch.end.set()
        watch.join()
        times = report["timings"]
        read = start + times["read_s"]
        solved = read + times["solve_s"]
        memory = {
            "before": before,
            "read": watch.most(start, read) - before,
            "solve": watch.most(read, solved) - before,
            "write": watch.most(solved, solved + times["write_s"]) - before,
            "most": held("VmHWM"),
        }
    report["memory_bytes"] = memory
    Path(out).write_text(json.dumps(report) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
