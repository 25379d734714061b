# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's background as light from all around.

A constant background is read from its nodes. Of any other, Cycles renders the six faces of a cube, in a scene of its
own that holds nothing but the world and a camera; the user's scenes are not touched.
"""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from ..core.lights import Floats
from ..core.pieces import Pieces
from ..core.record import SceneRecord, Sky
from .materials import constant_colour, constant_float, linked_node, uses_nodes
from .world_render import rendered_cube


def read_world(world: bpy.types.World | None, scene: SceneRecord) -> Pieces[None]:
    """Add the background to the scene, unless it is black."""
    if world is None or not _lights_surfaces(world):
        return
    colour = _constant_radiance(world)
    if colour is not None:
        radiance = np.broadcast_to(colour, (6, 1, 1, 3))
    else:
        try:
            radiance = yield from rendered_cube(world)
        except (RuntimeError, TypeError) as error:
            reason = "Backgrounds that Cycles cannot render here are left out"
            scene.lights_left_out.setdefault(f"{reason} ({str(error).strip()})", []).append(world.name)
            return
    if radiance.any():
        exitance = np.ascontiguousarray(math.pi * radiance, dtype=np.float64)
        scene.sky = Sky(world.name, exitance)


def may_shine(world: bpy.types.World | None) -> bool:
    """Whether the background may send light, as far as can be told without rendering it."""
    if world is None or not _lights_surfaces(world):
        return False
    colour = _constant_radiance(world)
    return colour is None or bool(colour.any())


def _lights_surfaces(world: Any) -> bool:
    # Cycles' own settings are absent where that engine is.
    visibility = getattr(world, "cycles_visibility", None)
    return bool(getattr(visibility, "diffuse", True))


def _constant_radiance(world: Any) -> Floats | None:
    """Radiance per channel; None when it is not the same all around or not known without rendering it."""
    tree = world.node_tree
    if tree is None or not uses_nodes(world):
        return np.array(world.color, dtype=np.float64)
    output = tree.get_output_node("CYCLES")
    background = linked_node(output.inputs["Surface"]) if output is not None else None
    if background is None:
        return np.zeros(3)
    if background.type == "BACKGROUND":
        colour = constant_colour(background.inputs["Color"])
        strength = constant_float(background.inputs["Strength"])
        if strength == 0.0:
            return np.zeros(3)
        if colour is not None and strength is not None:
            return np.array(colour, dtype=np.float64) * strength
    return None
