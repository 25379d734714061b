# SPDX-License-Identifier: GPL-3.0-or-later
"""The course of a bake with the real solver, for a scene that is made of arrays and written to a list."""

import json

import numpy as np
import pytest
from antumbra.bridge import solver
from antumbra.core.bake import Bake
from antumbra.core.errors import CancelledError, InputError, NoLightError, SettingError
from antumbra.core.pieces import GO_ON
from antumbra.core.record import AreaLight, Material
from antumbra.core.report import verified_error
from antumbra.core.settings import Settings
from meshes import quad_surface, record, scene

GREY = Material("grey", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0))
LAMP = AreaLight("lamp", np.array([[0.0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]), (4.0, 2.0, 1.0))


class ArrayHost:
    """A host whose scene is at hand."""

    def __init__(self, the_scene):
        self.scene = the_scene
        self.prepared = []
        self.written = []

    def read(self, settings):
        yield GO_ON
        return self.scene

    def prepare(self, the_scene, solution, settings):
        for mesh in solution.meshes:
            self.prepared.append(mesh)
            yield GO_ON

    def write(self, the_scene, solution, settings):
        self.written.append(solution)
        return ["written with care"]

    def discard(self):
        self.prepared.clear()


def lit_quad():
    return ArrayHost(scene(record(quad_surface()), materials=[GREY], lights=[LAMP]))


def test_report_has_the_fields_of_version_1():
    host = lit_quad()
    bake = Bake(host, solver.start, Settings(tolerance=0.1))
    host.scene.warnings.append("something")
    bake.begin()
    bake.wait()
    report = bake.finish()
    assert list(report) == ["version", "settings", "scene", "timings", "memory", "timeline", "result", "warnings"]
    assert report["version"] == 1
    assert report["settings"] == Settings(tolerance=0.1).as_dict()
    assert {"objects", "triangles", "lights"} <= set(report["scene"])
    assert {"read_s", "solve_s", "write_s", "cpu_s"} <= set(report["timings"])
    assert all(seconds >= 0.0 for seconds in report["timings"].values())
    assert {"time_s", "shots", "elements", "vertices", "unshot"} <= set(report["timeline"][-1])
    assert {"triangles", "vertices"} <= set(report["result"])
    verification = report["result"]["verification"]
    counts = {"points", "paths", "rays", "time_s", "places"}
    assert set(verification) == counts | {"error", "bias", "p99", "energy_defect", "noise"}
    error, low, high = verification["error"]
    assert 0.0 <= low <= error <= high < 0.2
    assert report["timeline"][-1]["error"] == pytest.approx(verification["error"], abs=1e-6)
    assert report["warnings"][:2] == ["something", "written with care"]
    assert json.loads(json.dumps(report)) == report
    assert len(host.written) == 1


@pytest.mark.parametrize(
    ("error", "words"),
    [
        ([0.00912, 0.0071, 0.0113], "verified error 0.9 % (0.7 to 1.1)"),
        ([0.1234, 0.101, 0.152], "verified error 12 % (10 to 15)"),
        ([0.0002, 0.0, 0.0007], "verified error 0.02 % (0.00 to 0.07)"),
        ([0.0078, 0.0, 0.0158], "verified error 0.8 % (0.0 to 1.6)"),
        ([0.0, 0.0, 0.012], "verified error below 1.2 %"),
        (None, None),
    ],
)
def test_the_verified_error_in_words(error, words):
    verification = None if error is None else {"error": error}
    assert verified_error({"result": {"verification": verification}}) == words


def test_nothing_is_verified_where_that_is_not_wanted():
    bake = Bake(lit_quad(), solver.start, Settings(tolerance=0.1, verify_points=0))
    bake.begin()
    report = bake.finish()
    assert report["result"]["verification"] is None
    assert all(iteration["error"] is None for iteration in report["timeline"])


def test_meshes_may_be_prepared_in_pieces_before_they_are_written():
    host = lit_quad()
    bake = Bake(host, solver.start, Settings(tolerance=0.1))
    bake.begin()
    bake.wait()
    assert len(list(bake.prepare())) == len(host.prepared) == 1
    assert not host.written
    assert bake.finish()["timings"]["write_s"] > 0.0
    assert host.written[0].meshes[0] is host.prepared[0]


def test_giving_up_discards_what_was_prepared():
    host = lit_quad()
    bake = Bake(host, solver.start, Settings(tolerance=0.1))
    bake.begin()
    bake.wait()
    next(bake.prepare())
    bake.abandon()
    assert host.prepared == []


def test_without_light_the_message_names_the_lights_left_out():
    host = lit_quad()
    host.scene.lights.clear()
    host.scene.lights_left_out["Sun lights are left out"] = ["Sun"]
    bake = Bake(host, solver.start, Settings())
    bake.begin()
    with pytest.raises(NoLightError, match="Sun lights are left out: “Sun”"):
        bake.finish()
    assert host.written == []


def test_nothing_to_bake():
    host = ArrayHost(scene(record(quad_surface(), receives=False), materials=[GREY], lights=[LAMP]))
    with pytest.raises(InputError, match="nothing to bake"):
        Bake(host, solver.start, Settings()).begin()


def test_settings_are_checked_before_anything_is_read():
    class Unread(ArrayHost):
        def read(self, settings):
            raise AssertionError("read although the settings are wrong")

    with pytest.raises(SettingError, match="tolerance"):
        Bake(Unread(scene(materials=[])), solver.start, Settings(tolerance=-1.0)).begin()


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda s: s.objects[0].surface.positions.__setitem__((2, 1), np.nan), "“Quad”.*vertex 2"),
        (lambda s: s.objects[0].world_from_object.__setitem__((0, 3), np.inf), "“Quad”.*transform"),
        (lambda s: s.materials.__setitem__(0, Material("too bright", (1.5, 1, 1), (0, 0, 0))), "“too bright”.*1.5"),
    ],
)
def test_what_cannot_be_computed_is_named(spoil, message):
    host = lit_quad()
    spoil(host.scene)
    bake = Bake(host, solver.start, Settings())
    with pytest.raises(InputError, match=message):  # noqa: PT012  either may be the one that notices
        bake.begin()
        bake.finish()
    assert host.written == []


def test_a_cancelled_bake_writes_nothing():
    host = lit_quad()
    bake = Bake(host, solver.start, Settings(tolerance=1e-6, max_level=16))
    bake.begin()
    bake.job.cancel()
    with pytest.raises(CancelledError):
        bake.finish()
    assert host.written == []


def test_abandon_ends_the_solver():
    bake = Bake(lit_quad(), solver.start, Settings(tolerance=1e-6, max_level=16))
    bake.begin()
    bake.abandon()
    assert bake.job.done()
