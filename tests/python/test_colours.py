# SPDX-License-Identifier: GPL-3.0-or-later
"""Light as colour attributes: what is stored where, and what is said to be lost."""

import numpy as np
import pytest
from antumbra.core.colours import in_steps, light_attributes, srgb_decoded, srgb_encoded, storage_losses
from antumbra.core.pieces import at_once
from antumbra.core.settings import Settings
from meshes import quad_surface, split_in_four

BY_CORNER, BY_VERTEX = Settings(), Settings(domain="POINT")


@pytest.fixture
def baked():
    return split_in_four(quad_surface())


def test_colours_are_opaque_and_unclipped(baked):
    baked.corner_radiance[:] = 7.5
    (light,) = at_once(light_attributes(baked, BY_CORNER))
    assert (light.name, light.domain, light.data_type) == ("Radiosity", "CORNER", "FLOAT_COLOR")
    assert light.values.shape == (24, 4)
    assert (light.values[:, :3] == 7.5).all()
    assert (light.values[:, 3] == 1.0).all()
    assert storage_losses([baked], BY_CORNER) == []


def test_separate_layers_have_attributes_of_their_own(baked):
    baked.corner_direct = np.full_like(baked.corner_radiance, 2.0)
    baked.corner_indirect = np.full_like(baked.corner_radiance, 3.0)
    layers = {layer.name: layer.values[0, 0] for layer in at_once(light_attributes(baked, BY_CORNER))}
    assert layers == {"Radiosity": 0.0, "Radiosity Direct": 2.0, "Radiosity Indirect": 3.0}


def test_even_light_is_the_same_at_vertices_and_loses_nothing(baked):
    baked.corner_radiance[:] = (1.0, 0.5, 0.25)
    (light,) = at_once(light_attributes(baked, BY_VERTEX))
    assert light.values[:, :3] == pytest.approx(np.tile((1.0, 0.5, 0.25), (len(baked.positions), 1)))
    assert storage_losses([baked], BY_VERTEX) == []


def test_a_vertex_has_the_mean_of_its_corners_by_their_angles(baked):
    """The first triangle of the square is bright, the second dark: one of 45 degrees each at vertex 0."""
    bright = baked.source_triangle == 0
    baked.corner_radiance[bright] = 1.0
    (light,) = at_once(light_attributes(baked, BY_VERTEX))
    at = {tuple(np.round(position[:2], 3)): light.values[index, 0] for index, position in enumerate(baked.positions)}
    assert at[0.0, 0.0] == pytest.approx(0.5)
    assert at[1.0, 0.0] == 1.0
    assert at[0.0, 1.0] == 0.0
    assert at[0.5, 0.5] == pytest.approx(0.5)
    (loss,) = storage_losses([baked], BY_VERTEX)
    # The diagonal's two ends and its middle.
    assert "3 of 9 vertices" in loss


def test_bytes_that_are_too_bright_are_told(baked):
    as_bytes = Settings(data_type="BYTE_COLOR")
    baked.corner_radiance[:] = 1.0
    assert storage_losses([baked], as_bytes) == []
    baked.corner_radiance[3, 1, 2] = 2.5
    (loss,) = storage_losses([baked], as_bytes)
    assert "2.5" in loss


def test_srgb_is_that_of_the_standard_and_comes_back():
    assert np.allclose(srgb_encoded(np.array([0.0, 0.0031308, 0.2140411, 1.0])), [0.0, 0.04045, 0.5, 1.0], atol=1e-5)
    values = np.linspace(0.0, 1.0, 257)
    assert np.allclose(srgb_decoded(srgb_encoded(values)), values, atol=1e-7)


def test_colours_in_steps_are_as_many_as_asked_for_and_never_off_by_more_than_half_of_one():
    values = np.linspace(0.0, 3.0, 10_001)
    stepped = in_steps(values, 32)
    assert len(np.unique(stepped)) == 32
    assert stepped.min() == 0.0
    assert stepped.max() == 1.0
    off = np.abs(srgb_encoded(stepped) - srgb_encoded(np.minimum(values, 1.0)))
    assert off.max() <= 0.5 / 31 + 1e-12


def test_steps_reach_the_attribute_and_say_what_they_clip(baked):
    baked.corner_radiance[:] = np.linspace(0.0, 2.0, baked.corner_radiance.size).reshape(baked.corner_radiance.shape)
    settings = Settings(colour_steps=4)
    (light,) = at_once(light_attributes(baked, settings))
    assert len(np.unique(light.values[:, :3])) == 4
    assert storage_losses([baked], settings) == [
        "colour_steps 4: colours up to 2 were clipped at 1; FLOAT_COLOR without steps keeps them"
    ]
