# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake as a command: `blender -b FILE.blend -c antumbra [options]`.

With the bpy module, which has no `-c`, open the file and call `run(argv)`. Both return the exit code: 0 only when a
bake was written, 2 for bad arguments or input, 1 when Antumbra itself failed; what is not 0 has one line on stderr.

Progress goes to stdout, as `bar` in lines like `antumbra:  42 % shooting light, 1,234 elements`, as `json` in one
object a line: {"stage", "fraction", "shots", "elements", "unshot"}.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import bpy

from .bridge.gltf import export_glb
from .bridge.host import new_bake
from .bridge.properties import settings_of
from .bridge.scene_read import selected_uids
from .bridge.surroundings import scene_of
from .core.bake import Progress
from .core.errors import BakeError, InputError, SettingError, SolverBugError
from .core.report import verified_error
from .core.report_page import curve_csv, page
from .core.settings import Settings, parse_assignments

COMMAND = "antumbra"

# Progress lines go to a log or another program: this many a second is enough to look alive.
_LINES_PER_S = 4.0

_handle: Any = None


@dataclass(frozen=True, slots=True)
class Arguments:
    """The command line, checked."""

    output: Path
    report: Path | None
    report_page: Path | None
    report_csv: Path | None
    glb: Path | None
    assignments: tuple[str, ...]
    progress: str


def run(argv: Sequence[str]) -> int:
    """Bake the open file; returns the exit code."""
    try:
        # A missing FILE makes Blender run the command on its startup scene.
        if not bpy.data.filepath:
            raise InputError("there is no scene: the .blend file was not given or could not be opened")
        arguments = _parse(argv)
        report = _bake(arguments)
    except SolverBugError as error:
        return _fail(1, str(error))
    except (BakeError, OSError) as error:
        return _fail(2, str(error))
    except SystemExit as end:
        # argparse has printed its help.
        return 0 if end.code is None else int(end.code)
    _print_summary(report, arguments)
    return 0


def _bake(arguments: Arguments) -> dict[str, Any]:
    settings = _settings(arguments.assignments)
    files = (arguments.output, arguments.report, arguments.report_page, arguments.report_csv, arguments.glb)
    for path in files:
        if path is not None and not path.parent.is_dir():
            raise InputError(f"the folder {path.parent} does not exist")

    # Bake
    bake = new_bake(settings)
    bake.begin()
    watch = _watcher(arguments.progress)
    bake.wait(watch)
    report = bake.finish()

    # Write the files
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output), copy=True, check_existing=False)
    if arguments.report is not None:
        arguments.report.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    if arguments.report_page is not None:
        arguments.report_page.write_text(page(report), encoding="utf-8")
    if arguments.report_csv is not None:
        arguments.report_csv.write_text(curve_csv(report), encoding="utf-8")
    if arguments.glb is not None:
        export_glb(scene_of(bpy.context), arguments.glb)
    return report


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


class _Parser(argparse.ArgumentParser):
    """Bad arguments earn one line, not the whole usage."""

    def error(self, message: str) -> NoReturn:
        raise SettingError(message)


def _parse(argv: Sequence[str]) -> Arguments:
    parser = _Parser(
        prog=f"blender --background FILE.blend --command {COMMAND}",
        description="Bake radiosity into vertex colours: the selected objects, or all when none is selected.",
    )
    parser.add_argument("--output", type=Path, help="baked .blend; FILE-baked.blend beside FILE when not given")
    parser.add_argument("--report", type=Path, help="report of the bake as JSON")
    parser.add_argument(
        "--report-page", type=Path, help="the report with plots, as an HTML page that needs nothing else"
    )
    parser.add_argument(
        "--report-csv", type=Path, help="the course of the bake as CSV: time, error, elements, unshot light"
    )
    parser.add_argument("--glb", type=Path, help="baked objects as glTF, colours fitted to 0..1")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of this bake")
    parser.add_argument("--progress", choices=("bar", "json", "none"), default="bar")
    given = parser.parse_args(list(argv))
    scene_path = Path(bpy.data.filepath)
    return Arguments(
        output=(given.output or scene_path.with_name(f"{scene_path.stem}-baked.blend")).absolute(),
        report=given.report.absolute() if given.report else None,
        report_page=given.report_page.absolute() if given.report_page else None,
        report_csv=given.report_csv.absolute() if given.report_csv else None,
        glb=given.glb.absolute() if given.glb else None,
        assignments=tuple(given.set),
        progress=given.progress,
    )


def _watcher(kind: str) -> Callable[[Progress], None] | None:
    if kind == "none":
        return None
    show = _show_json if kind == "json" else _show_lines
    next_time = 0.0

    def watch(progress: Progress) -> None:
        nonlocal next_time
        now = time.monotonic()
        if now >= next_time:
            next_time = now + 1.0 / _LINES_PER_S
            show(progress)

    return watch


def _show_json(progress: Progress) -> None:
    line = {
        "stage": progress.stage,
        "fraction": progress.fraction,
        "shots": progress.shots,
        "elements": progress.elements,
        "unshot": progress.unshot,
    }
    print(json.dumps(line), flush=True)


def _show_lines(progress: Progress) -> None:
    text = f"{COMMAND}: {progress.fraction * 100:3.0f} % {progress.stage}, {progress.elements:,} elements"
    # In a terminal each line is drawn over the one before.
    print(f"{text:<72}", end="\r" if sys.stdout.isatty() else "\n", flush=True)


def _print_summary(report: dict[str, Any], arguments: Arguments) -> None:
    result, timings = report["result"], report["timings"]
    seconds = timings["read_s"] + timings["solve_s"] + timings["write_s"]
    for warning in report["warnings"]:
        print(f"{COMMAND}: warning: {warning}", file=sys.stderr)
    error = verified_error(report)
    of = f", {error}" if error else ""
    print(f"{COMMAND}: {result['triangles']:,} triangles in {seconds:.1f} s{of} -> {arguments.output}", flush=True)


def _fail(code: int, message: str) -> int:
    print(f"{COMMAND}: {message}", file=sys.stderr, flush=True)
    return code


def register() -> None:
    global _handle
    _handle = bpy.utils.register_cli_command(COMMAND, run)


def unregister() -> None:
    bpy.utils.unregister_cli_command(_handle)
