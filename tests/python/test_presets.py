# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets: settings by what a bake is for."""

import pytest
from antumbra.core.presets import PRESETS, apply_preset, preset_of
from antumbra.core.settings import Settings


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_valid_and_known_again(name):
    settings = apply_preset(Settings(receivers="ALL", method="AS"), name)
    settings.validate()
    assert preset_of(settings) == name
    # What has nothing to do with quality and size stays.
    assert (settings.receivers, settings.method) == ("ALL", "AS")


def test_the_defaults_are_the_good_ones():
    assert preset_of(Settings()) == "GOOD"
    assert apply_preset(Settings(), "GOOD") == Settings()


def test_what_differs_from_all_of_them_is_none():
    assert preset_of(Settings(tolerance=0.0123)) is None


def test_one_after_the_other_leaves_nothing_behind():
    retro = apply_preset(Settings(), "RETRO")
    assert apply_preset(retro, "BEST") == apply_preset(Settings(), "BEST")
