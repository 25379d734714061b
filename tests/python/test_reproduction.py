# SPDX-License-Identifier: GPL-3.0-or-later
"""A solver that fails leaves a file from which its bake can be repeated, and its caller alive."""

import antumbra_native
import numpy as np
import pytest
from antumbra.bridge import solver
from antumbra.core.bake import Bake
from antumbra.core.errors import SolverBugError
from antumbra.core.reproduction import load
from antumbra.core.settings import Settings
from native_scenes import lit_floor
from test_bake import lit_quad


def test_a_panic_is_an_exception():
    job = antumbra_native._start_failing(lit_floor())
    with pytest.raises(antumbra_native.SolverPanicError, match=r"failing as asked for.*bug in Antumbra"):
        job.result()
    # And the next bake is as good as any
    assert len(antumbra_native.start(lit_floor()).result().meshes) == 1


@pytest.fixture
def failing(monkeypatch, tmp_path):
    """A bake whose solver fails, with a temporary folder of its own."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(antumbra_native, "start", lambda scene, **_settings: antumbra_native._start_failing(scene))
    bake = Bake(lit_quad(), solver.start, Settings(tolerance=0.1))
    bake.begin()
    bake.wait()
    monkeypatch.undo()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return bake


def test_the_file_repeats_the_bake(failing, tmp_path):
    with pytest.raises(SolverBugError) as raised:
        failing.finish()
    (path,) = tmp_path.iterdir()
    assert f"please report it with {path}" in str(raised.value)
    assert len(str(raised.value).splitlines()) == 1

    scene = antumbra_native.Scene()
    settings = load(path, scene)
    assert settings["tolerance"] == 0.1
    (repeated,) = antumbra_native.start(scene, **settings).result().meshes
    bake = Bake(lit_quad(), solver.start, Settings(tolerance=0.1))
    bake.begin()
    bake.wait()
    (mesh,) = bake._take().meshes
    np.testing.assert_array_equal(mesh.corner_radiance, repeated.corner_radiance)
    np.testing.assert_array_equal(mesh.positions, repeated.positions)


def test_where_no_file_can_be_written_the_message_says_what_it_can(failing, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "missing"))
    with pytest.raises(SolverBugError, match=r"please report it$"):
        failing.finish()
