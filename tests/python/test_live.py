# SPDX-License-Identifier: GPL-3.0-or-later
"""A stage of a running bake as triangles for a screen."""

import numpy as np
from antumbra.core import live
from antumbra.core.colours import srgb_encoded
from antumbra.core.record import Material
from meshes import quad_surface, record, scene, split_in_four

GREY = Material("grey", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0))


def stage(world_from_object=None):
    baked = split_in_four(quad_surface())
    shape = baked.corner_radiance.shape
    baked.corner_radiance[:] = np.linspace(0.0, 1.2, baked.corner_radiance.size).reshape(shape)
    return baked, live.live_triangles([baked], scene(record(quad_surface(), world_from_object), materials=[GREY]))


def test_corners_stand_in_the_world_and_have_screen_colours():
    matrix = np.array([[2.0, 0, 0, 5], [0, 2, 0, 0], [0, 0, 2, -1], [0, 0, 0, 1]])
    baked, (positions, colours) = stage(matrix)
    assert positions.shape == (24, 3)
    assert np.allclose(positions, baked.positions[baked.triangles.reshape(-1)] * 2.0 + (5.0, 0.0, -1.0))
    expected = srgb_encoded(np.clip(baked.corner_radiance.reshape(-1, 3), 0.0, 1.0))
    assert np.abs(colours[:, :3] - expected).max() < 1.0 / 255.0
    assert (colours[:, 3] == 1.0).all()


def test_what_would_take_too_long_is_not_drawn(monkeypatch):
    monkeypatch.setattr(live, "MOST_TRIANGLES", 7)
    assert stage()[1] is None
