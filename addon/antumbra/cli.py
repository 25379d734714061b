# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake as a command: `blender -b FILE.blend -c antumbra [options]`, or of several files, one after the other.

With the bpy module, which has no `-c`, open the file and call `run(argv)`. Both return the exit code: 0 only when all
bakes were written, 2 for bad arguments or input, 1 when Antumbra itself failed; what is not 0 has one line on stderr
for each file that was not baked.

Progress goes to stdout, as `bar` in lines like `antumbra:  42 % shooting light, 1,234 elements`, as `json` in one
object a line: {"file", "stage", "fraction", "shots", "elements", "unshot"}, and for each file at its end {"file",
"stage", "fraction", "triangles", "seconds", "verified", "estimated", "warnings", "output"} or {"file", "stage",
"error"}.
"""

from __future__ import annotations

import json
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy

from .bridge.gltf import export_glb, export_saved_glb
from .bridge.host import new_bake
from .bridge.properties import settings_of
from .bridge.scene_read import selected_uids
from .bridge.surroundings import scene_of
from .core.arguments import COMMAND, Arguments, Target, parse
from .core.bake import Progress
from .core.errors import BakeError, InputError, SolverBugError
from .core.report import error_text, verified_error
from .core.report_page import curve_csv, page
from .core.settings import Settings, parse_assignments

# Progress lines go to a log or another program: this many a second is enough to look alive.
_LINES_PER_S = 4.0

_handle: Any = None


def run(argv: Sequence[str]) -> int:
    """Bake the open file, or the files that are given; returns the exit code."""
    try:
        opened = Path(bpy.data.filepath) if bpy.data.filepath else None
        arguments = parse(argv, opened)
        parse_assignments(arguments.assignments)
    except BakeError as error:
        return _fail(2, str(error))
    except SystemExit as end:
        # argparse has printed its help.
        return 0 if end.code is None else int(end.code)
    codes = [_bake_file(target, arguments, opened) for target in arguments.targets]
    # A bug of ours matters more than a bad file.
    return min((code for code in codes if code), default=0)


def _bake_file(target: Target, arguments: Arguments, opened: Path | None) -> int:
    """Bake one file and say how it went; returns its exit code."""
    try:
        if target.file != opened or len(arguments.targets) > 1:
            _open(target.file)
        report = _bake(target, arguments)
    except SolverBugError as error:
        return _fail(1, str(error), target, arguments)
    except (BakeError, OSError) as error:
        return _fail(2, str(error), target, arguments)
    except Exception as error:  # noqa: BLE001  The files after this one are baked all the same.
        traceback.print_exc()
        return _fail(1, f"{type(error).__name__}: {error}", target, arguments)
    _tell(report, target, arguments)
    return 0


def _open(file: Path) -> None:
    try:
        bpy.ops.wm.open_mainfile(filepath=str(file), load_ui=False)
    except RuntimeError as error:
        raise InputError(f"{file} could not be opened: {str(error).strip().splitlines()[-1]}") from None


def _bake(target: Target, arguments: Arguments) -> dict[str, Any]:
    settings = _settings(arguments.assignments)
    if target.output.is_dir():
        # Blender 4.2 would put the file in the place of an empty folder.
        raise InputError(f"{target.output} could not be written: it is a folder")

    # Bake
    bake = new_bake(settings)
    bake.begin()
    bake.wait(_watcher(arguments.progress, target))
    report = bake.finish()

    # Write the files
    _save(target.output)
    if target.report is not None:
        target.report.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    if target.report_page is not None:
        target.report_page.write_text(page(report), encoding="utf-8")
    if target.report_csv is not None:
        target.report_csv.write_text(curve_csv(report), encoding="utf-8")
    if target.glb is not None:
        if bpy.context.window is None and bpy.app.binary_path:
            export_saved_glb(target.output, target.glb)
        else:
            export_glb(scene_of(bpy.context), target.glb)
    return report


def _save(output: Path) -> None:
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(output), copy=True, check_existing=False)
    except RuntimeError as error:
        raise InputError(f"{output} could not be written: {str(error).strip().splitlines()[-1]}") from None


def _settings(assignments: tuple[str, ...]) -> Settings:
    """The scene's settings with those of the command line on top, kept in the saved file too."""
    scene: Any = scene_of(bpy.context)
    given = parse_assignments(assignments)
    settings = Settings(**{**settings_of(scene).as_dict(), **given})
    # Where nobody can select anything, a file saved without a selection means everything.
    if settings.receivers == "SELECTED" and not selected_uids(bpy.context):
        settings = Settings(**{**settings.as_dict(), "receivers": "ALL"})
    settings.validate()
    for name, value in given.items():
        setattr(scene.antumbra, name, value)
    return settings


def _watcher(kind: str, target: Target) -> Callable[[Progress], None] | None:
    if kind == "none":
        return None
    next_time = 0.0

    def watch(progress: Progress) -> None:
        nonlocal next_time
        now = time.monotonic()
        if now >= next_time:
            next_time = now + 1.0 / _LINES_PER_S
            if kind == "json":
                _show_json(progress, target)
            else:
                _show_line(progress)

    return watch


def _show_json(progress: Progress, target: Target) -> None:
    _print_json(
        file=str(target.file),
        stage=progress.stage,
        fraction=progress.fraction,
        shots=progress.shots,
        elements=progress.elements,
        unshot=progress.unshot,
    )


def _show_line(progress: Progress) -> None:
    text = f"{COMMAND}: {progress.fraction * 100:3.0f} % {progress.stage}, {progress.elements:,} elements"
    # In a terminal each line is drawn over the one before.
    print(f"{text:<72}", end="\r" if sys.stdout.isatty() else "\n", flush=True)


def _tell(report: dict[str, Any], target: Target, arguments: Arguments) -> None:
    result, timings = report["result"], report["timings"]
    seconds = timings["read_s"] + timings["solve_s"] + timings["write_s"]
    for warning in report["warnings"]:
        print(f"{COMMAND}: warning: {warning}", file=sys.stderr)
    if arguments.progress == "json":
        _print_json(
            file=str(target.file),
            stage="written",
            fraction=1.0,
            triangles=result["triangles"],
            seconds=round(seconds, 3),
            verified=verified_error(report),
            estimated=result["estimated_error"],
            warnings=report["warnings"],
            output=str(target.output),
        )
    else:
        error = error_text(report)
        of = f", {error}" if error else ""
        print(f"{COMMAND}: {result['triangles']:,} triangles in {seconds:.1f} s{of} -> {target.output}", flush=True)


def _fail(code: int, message: str, target: Target | None = None, arguments: Arguments | None = None) -> int:
    if target is not None and arguments is not None:
        if arguments.progress == "json":
            _print_json(file=str(target.file), stage="failed", error=message)
        if len(arguments.targets) > 1 and str(target.file) not in message:
            message = f"{target.file}: {message}"
    print(f"{COMMAND}: {message}", file=sys.stderr, flush=True)
    return code


def _print_json(**values: Any) -> None:
    print(json.dumps(values), flush=True)


def register() -> None:
    global _handle
    _handle = bpy.utils.register_cli_command(COMMAND, run)


def unregister() -> None:
    bpy.utils.unregister_cli_command(_handle)
