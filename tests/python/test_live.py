# SPDX-License-Identifier: GPL-3.0-or-later
"""A stage of a running bake as triangles for a screen."""

import numpy as np
from antumbra.core import live
from antumbra.core.colours import srgb_encoded
from antumbra.core.pieces import at_once
from antumbra.core.record import Material
from meshes import quad_surface, record, scene, split_in_four

GREY = Material("grey", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0))


def stage(world_from_object=None, count=1):
    baked = split_in_four(quad_surface())
    shape = baked.corner_radiance.shape
    baked.corner_radiance[:] = np.linspace(0.0, 1.2, baked.corner_radiance.size).reshape(shape)
    pieces = live.live_pieces([baked] * count, scene(record(quad_surface(), world_from_object), materials=[GREY]))
    return baked, at_once(pieces)


def test_corners_stand_in_the_world_and_have_screen_colours():
    matrix = np.array([[2.0, 0, 0, 5], [0, 2, 0, 0], [0, 0, 2, -1], [0, 0, 0, 1]])
    baked, ((positions, colours),) = stage(matrix)
    assert positions.shape == (24, 3)
    assert np.allclose(positions, baked.positions[baked.triangles.reshape(-1)] * 2.0 + (5.0, 0.0, -1.0))
    expected = srgb_encoded(np.clip(baked.corner_radiance.reshape(-1, 3), 0.0, 1.0))
    assert np.abs(colours[:, :3] - expected).max() < 1.0 / 255.0
    assert (colours[:, 3] == 1.0).all()


def test_what_would_take_too_long_is_not_drawn(monkeypatch):
    monkeypatch.setattr(live, "MOST_TRIANGLES", 7)
    assert stage()[1] == []


def test_pieces_are_no_larger_than_they_may_be_and_together_are_everything(monkeypatch):
    _, (whole,) = stage(count=3)
    monkeypatch.setattr(live, "_PIECE", 5)
    _, pieces = stage(count=3)
    assert len(pieces) > 1
    assert all(len(positions) <= 2 * 3 * 5 for positions, _ in pieces)
    for k in range(2):
        assert np.array_equal(np.concatenate([piece[k] for piece in pieces]), whole[k])
