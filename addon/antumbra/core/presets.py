# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that belong together, by what the bake is for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from .settings import Settings


@dataclass(frozen=True, slots=True)
class Preset:
    """A named choice of the settings that make quality and size; all others stay as they are."""

    label: str
    description: str
    tolerance: float
    triangle_budget: int = 0
    data_type: str = "FLOAT_COLOR"
    domain: str = "CORNER"
    colour_steps: int = 0


PRESETS: Mapping[str, Preset] = {
    "DRAFT": Preset("Draft", "See within seconds where light and shadow fall: 5 % error wanted", 0.05),
    "GOOD": Preset("Good", "What most pictures need: 1 % error wanted", 0.01),
    "BEST": Preset("Best", "Smooth also where one looks closely: 0.3 % error wanted, several times the time", 0.003),
    "GAME": Preset(
        "Game",
        "At most 20,000 triangles in all baked meshes, and 4 bytes of light for each vertex. Colours end at 1",
        0.02,
        triangle_budget=20_000,
        data_type="BYTE_COLOR",
        domain="POINT",
    ),
    "RETRO": Preset(
        "Retro",
        "At most 3,000 triangles, 4 bytes of light for each vertex, in 32 steps a channel as consoles of the nineties "
        "had them",
        0.05,
        triangle_budget=3_000,
        data_type="BYTE_COLOR",
        domain="POINT",
        colour_steps=32,
    ),
}


def apply_preset(settings: Settings, name: str) -> Settings:
    """The settings with what the preset says."""
    return replace(settings, **_values(PRESETS[name]))


def preset_of(settings: Settings) -> str | None:
    """The preset that these settings have, if any."""
    given = settings.as_dict()
    fitting = (name for name, preset in PRESETS.items() if _values(preset).items() <= given.items())
    return next(fitting, None)


def _values(preset: Preset) -> dict[str, Any]:
    values = asdict(preset)
    del values["label"], values["description"]
    return values
