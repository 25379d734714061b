# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: what is written where, and help that leaves nothing out."""

import pytest
from antumbra.core.arguments import parse
from antumbra.core.errors import InputError, SettingError
from antumbra.core.settings import SPECS


def test_the_open_file_is_baked_beside_itself(tmp_path):
    (target,) = parse([], tmp_path / "room.blend").targets
    assert (target.output, target.report, target.glb) == (tmp_path / "room-baked.blend", None, None)


def test_named_files_go_into_folders(tmp_path):
    files = [str(tmp_path / name) for name in ("a.blend", "b.blend")]
    targets = parse([*files, "--output", str(tmp_path), "--report", str(tmp_path)], None).targets
    assert [target.output.name for target in targets] == ["a-baked.blend", "b-baked.blend"]
    assert [target.report.name for target in targets] == ["a.json", "b.json"]


def test_two_files_of_one_name_are_not_written_over_each_other(tmp_path):
    folders = [tmp_path / "x", tmp_path / "y"]
    for folder in folders:
        folder.mkdir()
    files = [str(folder / "room.blend") for folder in folders]
    with pytest.raises(InputError, match="both be written to"):
        parse([*files, "--output", str(tmp_path)], None)
    assert len(parse(files, None).targets) == 2


@pytest.mark.parametrize(
    ("argv", "error", "message"),
    [
        ([], InputError, "no scene"),
        (["a.blend", "--output", "/nowhere/at/all"], InputError, "no folder"),
        (["--progress", "loud"], SettingError, "loud"),
        (["--fast"], SettingError, "--fast"),
    ],
)
def test_bad_arguments(argv, error, message):
    with pytest.raises(error, match=message):
        parse(argv, None)


def test_help_names_every_option_every_setting_and_every_value(capsys):
    with pytest.raises(SystemExit) as end:
        parse(["--help"], None)
    assert end.value.code == 0
    text = capsys.readouterr().out
    for option in ("--output", "--report", "--glb", "--set", "--progress", "FILE.blend", "exit codes"):
        assert option in text
    for name, spec in SPECS.items():
        assert f"{name}=" in text
        for choice in spec.choices:
            assert choice.value in text
    assert max(map(len, text.splitlines())) <= 110
