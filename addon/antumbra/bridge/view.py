# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked light as the viewport shows it: an attribute for the screen beside the stored one, which is never touched."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.carry import ERROR
from ..core.colours import RADIOSITY, VIEW
from ..core.record import Attribute, FloatArray
from ..core.view import automatic_end, exposed, false_colours, photometric, unit_of
from .attribute_types import write_attribute
from .properties import state_of
from .view_properties import view_of

IRRADIANCE = "antumbra_irradiance"
"""Custom property of a baked mesh: whether its light is H/pi and not B/pi."""


def baked_meshes(scene: bpy.types.Scene) -> list[Any]:
    """The meshes in this scene that hold baked light, each once."""
    meshes: dict[int, Any] = {}
    objects: Any = scene.objects
    for obj in objects:
        if state_of(obj).role in ("BAKED", "REPLACED") and obj.data is not None and RADIOSITY in obj.data.attributes:
            meshes[obj.data.session_uid] = obj.data
    return list(meshes.values())


def stored_light(mesh: Any) -> FloatArray:
    """(N, 4) the mesh's light, per corner or vertex."""
    data = mesh.attributes[RADIOSITY].data
    colours = np.empty(len(data) * 4, dtype=np.float32)
    data.foreach_get("color", colours)
    return colours.reshape(-1, 4)


def range_of(scene: bpy.types.Scene) -> tuple[float, str]:
    """The end of the false colours' range in this scene, and its unit."""
    meshes = baked_meshes(scene)
    if view_of(scene).mode == "ERROR":
        return automatic_end([_error_percent(mesh) for mesh in meshes]), "%"
    is_irradiance = any(mesh.get(IRRADIANCE) for mesh in meshes)
    end = float(view_of(scene).range_end)
    if end <= 0.0:
        end = automatic_end([photometric(stored_light(mesh)[:, :3], bool(mesh.get(IRRADIANCE))) for mesh in meshes])
    return end, unit_of(is_irradiance)


def show(scene: bpy.types.Scene) -> None:
    """Bring what the viewport shows of every bake in this scene up to its view properties."""
    view = view_of(scene)
    meshes = [mesh for mesh in baked_meshes(scene) if mesh.library is None]
    if view.mode == "STORED":
        for mesh in meshes:
            if VIEW in mesh.attributes:
                mesh.attributes.remove(mesh.attributes[VIEW])
            _activate(mesh, RADIOSITY)
        return
    end = range_of(scene)[0] if view.mode in ("FALSE_COLOURS", "ERROR") else 0.0
    for mesh in meshes:
        if view.mode == "ERROR":
            errors = false_colours(_error_percent(mesh), end)
            _write(mesh, "CORNER", np.concatenate([errors, np.ones((len(errors), 1))], axis=1))
            continue
        light = stored_light(mesh)
        shown = np.ones_like(light)
        if view.mode == "FALSE_COLOURS":
            shown[:, :3] = false_colours(photometric(light[:, :3], bool(mesh.get(IRRADIANCE))), end)
        else:
            shown[:, :3] = exposed(light[:, :3], view.exposure)
        _write(mesh, mesh.attributes[RADIOSITY].domain, shown)


def _error_percent(mesh: Any) -> FloatArray:
    """(C,) per corner: the error that the solver estimated, in per cent of the mean light; 0 where it told none."""
    errors = np.zeros(len(mesh.loops), dtype=np.float32)
    if ERROR in mesh.attributes:
        mesh.attributes[ERROR].data.foreach_get("value", errors)
    return errors * np.float32(100.0)


def _write(mesh: Any, domain: str, colours: Any) -> None:
    """Show (N, 4) colours of a domain."""
    if VIEW in mesh.attributes and mesh.attributes[VIEW].domain != domain:
        mesh.attributes.remove(mesh.attributes[VIEW])
    write_attribute(mesh, Attribute(VIEW, domain, "FLOAT_COLOR", colours, blends=True))
    _activate(mesh, VIEW)


def _activate(mesh: Any, name: str) -> None:
    """Make an attribute the one that the viewport shows; renders go on with the stored light."""
    mesh.color_attributes.active_color_name = name
    mesh.color_attributes.render_color_index = mesh.color_attributes.find(RADIOSITY)
    mesh.update_tag()
