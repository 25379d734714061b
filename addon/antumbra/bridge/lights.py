# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights to outlines with an exitance; what cannot be read yet is named."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.lights import AreaLamp, Floats, exitance_rgb, outline_in_world
from ..core.record import AreaLight, SceneRecord
from .materials import constant_colour, constant_float, linked_node, uses_nodes


def read_light(light: bpy.types.Light, name: str, world_from_light: Floats, scene: SceneRecord) -> None:
    """Add the light to the scene, or its name to those left out."""
    if light.type != "AREA":
        kind = light.type.capitalize()
        _leave_out(scene, f"{kind} lights come in a later release and are left out", name)
        return
    area: Any = light
    if area.spread < np.pi * (1.0 - 1e-6):
        scene.warnings.append(f"light “{name}”: its spread is not modelled yet; it shines to all sides of its front")
    if not area.use_shadow:
        scene.warnings.append(f"light “{name}”: it casts shadows although its own setting says no")
    lamp = AreaLamp(
        shape=area.shape,
        size_x_m=area.size,
        size_y_m=area.size_y,
        power_rgb=_power_rgb(area, name, scene),
        normalize=getattr(area, "normalize", True),  # Since 4.5.
    )
    outline = outline_in_world(lamp, world_from_light)
    exitance = exitance_rgb(lamp, outline)
    if exitance is None:
        _leave_out(scene, "Lights without area are left out", name)
    elif any(exitance):
        scene.lights.append(AreaLight(name, outline, exitance))


def read_world(world: bpy.types.World | None, scene: SceneRecord) -> None:
    """Name the background when it would light the scene."""
    if world is None:
        return
    strength = 1.0
    colour: tuple[float, ...] = tuple(world.color[:])
    tree = world.node_tree
    if tree is not None and uses_nodes(world):
        output = tree.get_output_node("CYCLES")
        background = linked_node(output.inputs["Surface"]) if output is not None else None
        if background is None:
            return
        if background.type == "BACKGROUND":
            # A linked colour or strength counts as light.
            linked_colour = constant_colour(background.inputs["Color"])
            linked_strength = constant_float(background.inputs["Strength"])
            colour = (1.0, 1.0, 1.0) if linked_colour is None else linked_colour
            strength = 1.0 if linked_strength is None else linked_strength
    if strength != 0.0 and any(colour):
        _leave_out(scene, "Light from the world's background comes in a later release and is left out", world.name)


def _power_rgb(light: Any, name: str, scene: SceneRecord) -> tuple[float, float, float]:
    """energy · colour · 2^exposure · temperature colour · emission of the light's nodes."""
    power = np.array(light.color, dtype=np.float64) * light.energy
    # Exposure and temperature came with 4.5.
    power *= 2.0 ** getattr(light, "exposure", 0.0)
    if getattr(light, "use_temperature", False):
        power *= np.array(light.temperature_color)
    power *= _node_factor(light, name, scene)
    red, green, blue = (float(value) for value in power)
    return red, green, blue


def _node_factor(light: Any, name: str, scene: SceneRecord) -> Floats:
    """colour · strength of the Emission that a light's nodes put out; Blender multiplies it in."""
    none = np.ones(3)
    # The switch is to go with Blender 6.0.
    if not getattr(light, "use_nodes", True) or light.node_tree is None:
        return none
    output = light.node_tree.get_output_node("CYCLES")
    emission = linked_node(output.inputs["Surface"]) if output is not None else None
    if emission is not None and emission.type == "EMISSION":
        colour = constant_colour(emission.inputs["Color"])
        strength = constant_float(emission.inputs["Strength"])
        if colour is not None and strength is not None:
            return np.asarray(np.array(colour) * strength, dtype=np.float64)
    scene.warnings.append(f"light “{name}”: its nodes cannot be read yet and are ignored")
    return none


def _leave_out(scene: SceneRecord, reason: str, name: str) -> None:
    scene.lights_left_out.setdefault(reason, []).append(name)
