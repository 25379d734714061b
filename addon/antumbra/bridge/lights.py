# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights in the solver's units; what cannot be read yet is named."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from ..core.lights import (
    AreaLamp,
    Colour,
    Floats,
    cone_from_world,
    exitance_rgb,
    outline_in_world,
    point_intensity_rgb,
    sun_irradiance_rgb,
)
from ..core.record import AreaLight, Cone, Linked, Links, PointLight, SceneRecord, Sun
from .materials import constant_colour, constant_float, linked_node

# Blender's 180 degrees as a 32-bit number of radians is a little less or more than pi.
_ROUNDING = 1e-6


def read_light(obj: bpy.types.Object, name: str, world_from_light: Floats, scene: SceneRecord) -> None:
    """Add an evaluated light object to the scene, or its name to those left out."""
    light: Any = obj.data
    # Cycles' own settings are absent where that engine is.
    cycles = getattr(light, "cycles", None)
    if not obj.visible_diffuse or (light.type == "AREA" and getattr(cycles, "is_portal", False)):
        # It brings nothing to a matte surface: a portal only guides Cycles' rays.
        return
    links = read_links(obj)
    power = _power_rgb(light, name, scene)
    if not any(power):
        return
    match light.type:
        case "AREA":
            _read_area(light, name, power, world_from_light, links, scene)
        case "SUN":
            _read_sun(light, name, power, world_from_light, links, scene)
        case _:
            _read_point(light, name, power, world_from_light, links, scene)


def _read_area(
    light: Any, name: str, power: Colour, world_from_light: Floats, links: Links, scene: SceneRecord
) -> None:
    lamp = AreaLamp(light.shape, light.size, light.size_y, power, _normalizes(light))
    outline = outline_in_world(lamp, world_from_light)
    exitance = exitance_rgb(lamp, outline)
    if exitance is None:
        _leave_out(scene, "Lights without area are left out", name)
        return
    spread = light.spread if light.spread < math.pi - _ROUNDING else math.pi
    scene.lights.append(AreaLight(name, outline, exitance, spread, light.use_shadow, links))


def _read_sun(light: Any, name: str, power: Colour, world_from_light: Floats, links: Links, scene: SceneRecord) -> None:
    # It shines along its -Z.
    x, y, z = (float(value) for value in world_from_light[:3, 2])
    if not any((x, y, z)):
        _leave_out(scene, "Lights that are scaled to nothing are left out", name)
        return
    angle = min(light.angle, math.pi)
    irradiance = sun_irradiance_rgb(power, angle, _normalizes(light))
    scene.lights.append(Sun(name, (x, y, z), angle, irradiance, light.use_shadow, links))


def _read_point(
    light: Any, name: str, power: Colour, world_from_light: Floats, links: Links, scene: SceneRecord
) -> None:
    cone = None
    if light.type == "SPOT":
        matrix = cone_from_world(world_from_light)
        if matrix is None:
            _leave_out(scene, "Lights that are scaled to nothing are left out", name)
            return
        cone = Cone(matrix, min(light.spot_size, math.pi), light.spot_blend)
    x, y, z = (float(value) for value in world_from_light[:3, 3])
    radius = light.shadow_soft_size
    scene.lights.append(
        PointLight(
            name=name,
            position=(x, y, z),
            radius_m=radius,
            faces_receiver=light.use_soft_falloff,
            intensity_rgb=point_intensity_rgb(power, radius, _normalizes(light)),
            casts_shadows=light.use_shadow,
            cone=cone,
            links=links,
        )
    )


def _normalizes(light: Any) -> bool:
    # Since 4.5.
    return bool(getattr(light, "normalize", True))


def read_links(obj: Any) -> Links:
    """What an object's light is linked to."""
    linking = obj.original.light_linking
    return Links(_linked(linking.receiver_collection), _linked(linking.blocker_collection))


def _linked(collection: Any) -> Linked | None:
    """The objects of a linking collection: those that it includes, or if none all that it does not exclude."""
    if collection is None:
        return None
    states: dict[str, set[int]] = {"INCLUDE": set(), "EXCLUDE": set()}
    for child, link in zip(collection.children, collection.collection_children, strict=True):
        states[link.light_linking.link_state].update(obj.session_uid for obj in child.all_objects)
    # What is said of an object itself goes before what is said of a collection that it is in.
    for obj, link in zip(collection.objects, collection.collection_objects, strict=True):
        state = link.light_linking.link_state
        for known, members in states.items():
            (members.add if known == state else members.discard)(obj.session_uid)
    includes_any = any(
        link.light_linking.link_state == "INCLUDE"
        for link in (*collection.collection_children, *collection.collection_objects)
    )
    return Linked(frozenset(states["INCLUDE" if includes_any else "EXCLUDE"]), not includes_any)


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
