# SPDX-License-Identifier: GPL-3.0-or-later
"""The command: exit codes, its one line of complaint, and the files it writes."""

import json
import struct

import bpy
import pytest
from extension import module
from scenes import add_area_light, add_cube, add_plane, baked_objects, select


@pytest.fixture
def blend(tmp_path):
    """A saved scene, open."""
    add_plane(size=6.0)
    add_cube().location = (0, 0, 1.5)
    add_area_light(location=(0, 0, 4))
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def run(*argv):
    return module("cli").run([*map(str, argv), "--progress", "none"])


def complaint(capsys):
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("antumbra:")]
    assert len(lines) == 1
    return lines[0]


def test_writes_the_bake_its_report_and_its_export(blend, tmp_path):
    output, report, glb = tmp_path / "out.blend", tmp_path / "report.json", tmp_path / "out.glb"
    assert run("--output", output, "--report", report, "--glb", glb, "--set", "tolerance=0.1") == 0

    written = json.loads(report.read_text())
    assert list(written) == ["version", "settings", "scene", "timings", "memory", "timeline", "result", "warnings"]
    assert written["settings"]["tolerance"] == 0.1
    assert written["scene"]["objects"] == 2
    assert written["result"]["triangles"] > 14

    bpy.ops.wm.open_mainfile(filepath=str(output))
    assert {obj["antumbra_source"] for obj in baked_objects()} == {"Plane", "Cube"}
    assert sum(len(obj.data.polygons) for obj in baked_objects()) == written["result"]["triangles"]

    content = glb.read_bytes()
    length = struct.unpack_from("<I", content, 12)[0]
    gltf = json.loads(content[20 : 20 + length])
    assert len(gltf["meshes"]) == 2
    for mesh in gltf["meshes"]:
        (primitive,) = mesh["primitives"]
        colour = gltf["accessors"][primitive["attributes"]["COLOR_0"]]
        assert colour["count"] > 0
    assert "KHR_materials_unlit" in gltf["extensionsUsed"]
    assert all(node["extras"]["antumbra_scale"] > 0 for node in gltf["nodes"])


def test_writes_the_report_as_a_page_and_its_course(blend, tmp_path):
    page, course = tmp_path / "report.html", tmp_path / "course.csv"
    written = ("--output", tmp_path / "out.blend", "--report-page", page, "--report-csv", course)
    assert run(*written, "--set", "tolerance=0.1") == 0
    html = page.read_text(encoding="utf-8")
    assert html.count("<figure") == 6
    assert "verified error" in html
    lines = course.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "time_s,shots,elements,vertices,unshot,error,error_low,error_high,estimated"
    assert len(lines) > 3


def test_the_export_changes_nothing_in_the_open_file(blend, tmp_path):
    from fingerprint import fingerprint

    bpy.context.scene.antumbra.receivers = "ALL"
    bpy.ops.antumbra.bake()
    before = fingerprint()
    module("bridge.gltf").export_glb(bpy.context.scene, tmp_path / "out.glb")
    assert fingerprint() == before


def test_without_output_the_bake_lies_beside_the_scene(blend):
    size = blend.stat().st_size
    assert run("--set", "tolerance=0.2") == 0
    assert blend.with_name("scene-baked.blend").is_file()
    assert blend.stat().st_size == size


def test_bakes_all_when_nothing_is_selected_and_only_the_selected_otherwise(blend, tmp_path):
    select(bpy.data.objects["Cube"])
    assert run("--output", tmp_path / "out.blend", "--set", "tolerance=0.2") == 0
    assert [obj["antumbra_source"] for obj in baked_objects()] == ["Cube"]


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["--set", "tolerance"], "not of the form NAME=VALUE"),
        (["--set", "colour=1"], "no setting “colour”"),
        (["--set", "tolerance=2"], "between 1e-06 and 1"),
        (["--set", "method=RAYS"], "one of ADM, DM, AS, UNIFORM"),
        (["--output", "/nowhere/at/all/out.blend"], "/nowhere/at/all does not exist"),
        (["--report", "/nowhere/at/all/out.json"], "/nowhere/at/all does not exist"),
        (["--fast"], "unrecognized arguments: --fast"),
        (["--output"], "expected one argument"),
    ],
)
def test_bad_arguments(blend, tmp_path, capsys, argv, message):
    before = sorted(tmp_path.iterdir())
    assert run(*argv) == 2
    assert message in complaint(capsys)
    assert sorted(tmp_path.iterdir()) == before


def test_no_file_was_opened(capsys):
    """Blender runs a command on its startup scene when FILE is missing."""
    add_cube()
    add_area_light()
    assert bpy.data.filepath == ""
    assert run() == 2
    assert "no scene" in complaint(capsys)


def test_no_light(blend, tmp_path, capsys):
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    before = sorted(tmp_path.iterdir())
    assert run() == 2
    assert "sends light" in complaint(capsys)
    assert sorted(tmp_path.iterdir()) == before


def test_progress_as_json(blend, tmp_path, capsys):
    argv = ["--output", str(tmp_path / "out.blend"), "--progress", "json", "--set", "tolerance=0.05"]
    assert module("cli").run(argv) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines() if line.startswith("{")]
    assert lines
    for line in lines:
        assert 0.0 <= line["fraction"] <= 1.0
        assert line["file"] == str(blend)
    *running, last = lines
    assert running
    for line in running:
        assert set(line) == {"file", "stage", "fraction", "shots", "elements", "unshot"}
    assert last["stage"] == "written"
    assert last["triangles"] > 14
    assert last["output"] == argv[1]


def test_several_files_are_baked_one_after_the_other_and_a_bad_one_keeps_none_from_it(blend, tmp_path, capsys):
    other, dark, folder = tmp_path / "other.blend", tmp_path / "dark.blend", tmp_path / "baked"
    folder.mkdir()
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.wm.save_as_mainfile(filepath=str(other), copy=True)
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    bpy.ops.wm.save_as_mainfile(filepath=str(dark), copy=True)
    argv = [blend, dark, tmp_path / "missing.blend", other, "--output", folder, "--report", folder]
    argv += ["--glb", folder, "--set", "tolerance=0.2", "--progress", "json"]
    assert module("cli").run([*map(str, argv)]) == 2
    written = sorted(path.name for path in folder.iterdir() if not path.name.endswith("1"))
    expected = [name for stem in ("other", "scene") for name in (f"{stem}-baked.blend", f"{stem}.glb", f"{stem}.json")]
    assert written == expected
    assert json.loads((folder / "scene.json").read_text())["scene"]["objects"] == 2
    assert json.loads((folder / "other.json").read_text())["scene"]["objects"] == 1

    said = capsys.readouterr()
    complaints = [line for line in said.err.splitlines() if line.startswith("antumbra:")]
    assert len(complaints) == 2
    assert "dark.blend" in complaints[0]
    assert "sends light" in complaints[0]
    assert "missing.blend" in complaints[1]
    lines = [json.loads(line) for line in said.out.splitlines() if line.startswith("{")]
    ends = [(line["file"], line["stage"]) for line in lines if line["stage"] in ("written", "failed")]
    assert ends == [
        (str(blend), "written"),
        (str(dark), "failed"),
        (str(tmp_path / "missing.blend"), "failed"),
        (str(other), "written"),
    ]
