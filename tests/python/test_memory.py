# SPDX-License-Identifier: GPL-3.0-or-later
"""What does not fit into memory is refused before the solver begins, by name."""

import sys

import antumbra.core.bake as core_bake
import pytest
from antumbra.bridge import solver
from antumbra.core import memory
from antumbra.core.bake import Bake
from antumbra.core.errors import InputError, MemoryShortageError
from antumbra.core.settings import Settings
from test_bake import lit_quad


def test_a_bake_that_needs_more_than_there_is_does_not_begin(monkeypatch):
    monkeypatch.setattr(core_bake, "free_bytes", lambda: 100)
    host = lit_quad()
    bake = Bake(host, solver.start, Settings())
    with pytest.raises(MemoryShortageError, match=r"at least .* of memory and .* are free") as raised:
        bake.begin()
    assert isinstance(raised.value, InputError)
    assert not host.written
    assert bake._job is None


@pytest.mark.parametrize("free", [None, 10**12])
def test_where_there_is_enough_or_nobody_knows_it_begins(monkeypatch, free):
    monkeypatch.setattr(core_bake, "free_bytes", lambda: free)
    bake = Bake(lit_quad(), solver.start, Settings(tolerance=0.1))
    bake.begin()
    bake.wait()
    bake.finish()


@pytest.mark.skipif(sys.platform != "linux", reason="other systems tell in other ways")
def test_linux_tells_how_much_is_free():
    free = memory.free_bytes()
    assert free is not None
    assert 10**7 < free < 10**14


def test_a_containers_limit_counts_and_its_caches_do_not(tmp_path):
    for name, text in (
        ("memory.max", "1000\n"),
        ("memory.current", "700\n"),
        ("memory.stat", "anon 1\ninactive_file 150\n"),
    ):
        (tmp_path / name).write_text(text)
    assert memory._left_in_group(tmp_path) == 450
    (tmp_path / "memory.max").write_text("max\n")
    assert memory._left_in_group(tmp_path) is None
    assert memory._left_in_group(tmp_path / "missing") is None
