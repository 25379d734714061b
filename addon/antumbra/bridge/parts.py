# SPDX-License-Identifier: GPL-3.0-or-later
"""Which part an object takes in a bake, by the user's choice and by its ray visibility; and which objects take none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .properties import part_of

LEFT_OUT = {
    "VOLUME": "volumes",
    "CURVES": "hair",
    "POINTCLOUD": "point clouds",
    "GPENCIL": "grease pencil",
    "GREASEPENCIL": "grease pencil",
}
"""Types of objects that a render shows and a bake does not, with their names for people."""


@dataclass(frozen=True, slots=True)
class Part:
    """What an object does with light."""

    receives: bool
    """Whether it may be baked."""
    blocks: bool
    sends: bool


def read_part(obj: Any, owner: Any, view_layer: Any) -> Part | None:
    """The part of an object, or of its instance that the owner makes; None when it takes none.

    As in Cycles, what either of the two hides from a kind of light is hidden.
    """
    both = (obj,) if obj == owner else (obj, owner)
    kinds = {part_of(each) for each in both}
    if "EXCLUDED" in kinds:
        return None
    shadows = all(each.visible_shadow for each in both)
    reflects = all(each.visible_diffuse for each in both)
    # A hole in the picture neither shades nor lights the rest of it.
    holdout = any(each.is_holdout or each.holdout_get(view_layer=view_layer) for each in both)
    only_blocks, only_receives = "BLOCKER" in kinds, "RECEIVER" in kinds
    return Part(
        receives=not only_blocks,
        blocks=shadows and not holdout and not only_receives,
        sends=reflects and not holdout and not only_blocks and not only_receives,
    )


def has_hair(obj: Any) -> bool:
    """Whether particles of an object render as hair, which no mesh shows."""
    return any(
        system.settings.type == "HAIR" and system.settings.render_type == "PATH" for system in obj.particle_systems
    )
