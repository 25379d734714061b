# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, checked: which files are baked, and where what comes of each goes."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from .errors import InputError, SettingError
from .settings import SPECS, Spec, range_text

COMMAND = "antumbra"

_EPILOG = """\
examples:
  blender -b room.blend -c antumbra --set tolerance=0.02 --report room.json
  blender -b -c antumbra a.blend b.blend c.blend --output baked/ --progress json
"""


@dataclass(frozen=True, slots=True)
class Target:
    """One file, and what is written for it."""

    file: Path
    output: Path
    report: Path | None
    report_page: Path | None
    report_csv: Path | None
    glb: Path | None


@dataclass(frozen=True, slots=True)
class Arguments:
    """The command line."""

    targets: tuple[Target, ...]
    assignments: tuple[str, ...]
    progress: str


class _Parser(argparse.ArgumentParser):
    """Bad arguments earn one line, not the whole usage."""

    def error(self, message: str) -> NoReturn:
        raise SettingError(message)


def parse(argv: Sequence[str], opened: Path | None) -> Arguments:
    """Check the arguments; `opened` is the file that Blender has open, if any. Raises SettingError or InputError."""
    given = _parser().parse_args(list(argv))
    files = [path.absolute() for path in given.files]
    if not files:
        # A missing FILE makes Blender run the command on its startup scene.
        if opened is None:
            raise InputError("there is no scene: the .blend file was not given or could not be opened")
        targets = [
            Target(
                file=opened,
                output=(given.output or opened.with_name(f"{opened.stem}-baked.blend")).absolute(),
                report=given.report.absolute() if given.report else None,
                report_page=given.report_page.absolute() if given.report_page else None,
                report_csv=given.report_csv.absolute() if given.report_csv else None,
                glb=given.glb.absolute() if given.glb else None,
            )
        ]
    else:
        for folder in (given.output, given.report, given.report_page, given.report_csv, given.glb):
            if folder is not None and not folder.is_dir():
                raise InputError(f"{folder} is no folder, which is wanted where files are named")
        targets = [
            Target(
                file=file,
                output=(given.output or file.parent).absolute() / f"{file.stem}-baked.blend",
                report=given.report.absolute() / f"{file.stem}.json" if given.report else None,
                report_page=given.report_page.absolute() / f"{file.stem}.html" if given.report_page else None,
                report_csv=given.report_csv.absolute() / f"{file.stem}.csv" if given.report_csv else None,
                glb=given.glb.absolute() / f"{file.stem}.glb" if given.glb else None,
            )
            for file in files
        ]
    _check(targets)
    return Arguments(tuple(targets), tuple(given.set), given.progress)


def _check(targets: list[Target]) -> None:
    written: dict[Path, Path] = {}
    for target in targets:
        for path in (target.output, target.report, target.report_page, target.report_csv, target.glb):
            if path is None:
                continue
            if not path.parent.is_dir():
                raise InputError(f"the folder {path.parent} does not exist")
            if path in written:
                raise InputError(f"{written[path]} and {target.file} would both be written to {path}")
            written[path] = target.file


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog=f"blender --background [FILE.blend] --command {COMMAND}",
        usage="%(prog)s [FILE.blend ...] [options]",
        description=(
            "Bake radiosity into vertex colours: of the selected objects of the open file, or of all when none is "
            "selected. Named files are baked one after the other; one that fails keeps none of the others from it.\n\n"
            "exit codes: 0 all was written, 2 bad arguments or input, 1 a bug. Each failure has one line on stderr."
        ),
        epilog=f"{_settings_text()}\n{_EPILOG}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.description = "\n\n".join(textwrap.fill(part, 90) for part in str(parser.description).split("\n\n"))
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE.blend", help="bake these instead of the open file")
    parser.add_argument(
        "--output",
        type=Path,
        help="the baked .blend; otherwise FILE-baked.blend beside FILE. Of named files: a folder",
    )
    parser.add_argument("--report", type=Path, help="the report of the bake as JSON. Of named files: a folder")
    parser.add_argument(
        "--report-page", type=Path, help="the report with plots, as an HTML page. Of named files: a folder"
    )
    parser.add_argument(
        "--report-csv", type=Path, help="the course of the bake as CSV: time, error, elements. Of named files: a folder"
    )
    parser.add_argument(
        "--glb", type=Path, help="the baked objects as glTF, colours fitted to 0..1. Of named files: a folder"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of this bake; may be given again"
    )
    parser.add_argument(
        "--progress",
        choices=("bar", "json", "none"),
        default="bar",
        help="lines for people, one JSON object a line, or nothing; bar when not given",
    )
    return parser


def _settings_text() -> str:
    """Every setting with its values and default, as wide as a terminal."""
    lines = ["settings:"]
    for name, spec in SPECS.items():
        lines.append(f"  {name}={_values_text(spec)}  (default {spec.default})")
        lines += textwrap.wrap(spec.description, 84, initial_indent=" " * 6, subsequent_indent=" " * 6)
    return "\n".join(lines) + "\n"


def _values_text(spec: Spec) -> str:
    return "|".join(choice.value for choice in spec.choices) if spec.choices else range_text(spec)
