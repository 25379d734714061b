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
import os
import subprocess
import sys
import tempfile
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


WATCHER = f"""
import sys, time
while True:
    line = next(line for line in open(sys.argv[1]) if line.startswith("VmRSS"))
    print(time.perf_counter(), 1024 * int(line.split()[1]), flush=True)
    time.sleep({1.0 / LOOKS_A_SECOND})
"""


class Watch:
    """Looks at the process's memory from another process: in a second thread of Python, Blender's own calls crash."""

    def __init__(self) -> None:
        self.looks = tempfile.TemporaryFile(mode="w+")  # noqa: SIM115  It is closed with the process.
        status = f"/proc/{os.getpid()}/status"
        self.watcher = subprocess.Popen([sys.executable, "-c", WATCHER, status], stdout=self.looks)

    def end(self) -> None:
        self.watcher.terminate()
        self.watcher.wait()

    def most(self, start: float, end: float) -> int:
        """Between two moments of the system's monotonic clock."""
        self.looks.seek(0)
        looks = [line.split() for line in self.looks if line.endswith("\n")]
        return max((int(held) for moment, held in looks if start <= float(moment) <= end), default=0)


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
    before = held("VmRSS") if STATUS.is_file() else None
    watch = Watch() if STATUS.is_file() else None
    start = time.perf_counter()
    code = importlib.import_module(f"{EXTENSION}.cli").run(arguments)
    if code != 0:
        sys.exit(code)
    baked.unlink()

    report = json.loads(Path(out).read_text(encoding="utf-8"))
    memory: dict[str, int | None] = dict.fromkeys(("before", "read", "solve", "write", "most"))
    if watch and before is not None:
        watch.end()
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
