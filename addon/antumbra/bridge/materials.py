# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials to a matte reflectance and an exitance.

Read exactly: Principled (base colour, emission), Diffuse, Emission, and Mix and Add of these, with constant inputs.
Read as one colour: an image on a colour input, by its mean. Everything else falls back to the material's viewport
colour, with a warning that names it. Blender multiplies an emission into every channel, on both sides of a face.
"""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from ..core.record import Material, SceneRecord

Rgb = tuple[float, float, float]

# What Blender's own default material reflects.
_DEFAULT_GREY: Rgb = (0.8, 0.8, 0.8)
_BLACK: Rgb = (0.0, 0.0, 0.0)


class MaterialReader:
    """Reads each material and each image of one bake once."""

    def __init__(self, scene: SceneRecord) -> None:
        self._scene = scene
        self._index_by_uid: dict[int | None, int] = {}
        self._mean_by_image_uid: dict[int, Rgb | None] = {}

    def index(self, material: Any) -> int:
        """Index into SceneRecord.materials; None is Blender's default grey."""
        uid = None if material is None else material.original.session_uid
        if uid not in self._index_by_uid:
            self._index_by_uid[uid] = len(self._scene.materials)
            self._scene.materials.append(self._read(material))
        return self._index_by_uid[uid]

    def _read(self, material: bpy.types.Material | None) -> Material:
        if material is None:
            return Material("no material", _DEFAULT_GREY, _BLACK)
        try:
            reflectance, radiance = self._read_nodes(material)
        except _UnreadableError as error:
            self._scene.warnings.append(f"material “{material.name}”: {error}; its viewport colour is used")
            reflectance, radiance = _viewport_colour(material), _BLACK
        red, green, blue = (math.pi * value for value in radiance)
        return Material(material.name, reflectance, (red, green, blue))

    def _read_nodes(self, material: bpy.types.Material) -> tuple[Rgb, Rgb]:
        tree = material.node_tree
        if tree is None or not uses_nodes(material):
            return _viewport_colour(material), _BLACK
        output = tree.get_output_node("CYCLES")
        shader = linked_node(output.inputs["Surface"]) if output is not None else None
        if shader is None:
            return _BLACK, _BLACK
        return self._read_shader(material, shader)

    def _read_shader(self, material: bpy.types.Material, node: Any) -> tuple[Rgb, Rgb]:
        """(reflectance, emitted radiance) of a shader node."""
        match node.type:
            case "BSDF_PRINCIPLED":
                self._warn_if_not_matte(material, node)
                strength = self._float(node.inputs["Emission Strength"])
                emission = _scaled(self._colour(node.inputs["Emission Color"]), strength) if strength else _BLACK
                return self._colour(node.inputs["Base Color"]), emission
            case "BSDF_DIFFUSE":
                return self._colour(node.inputs["Color"]), _BLACK
            case "EMISSION":
                strength = self._float(node.inputs["Strength"])
                return _BLACK, _scaled(self._colour(node.inputs["Color"]), strength)
            case "MIX_SHADER":
                share = min(max(self._float(node.inputs[0]), 0.0), 1.0)
                first = self._read_input(material, node.inputs[1])
                second = self._read_input(material, node.inputs[2])
                return _mixed(first[0], second[0], share), _mixed(first[1], second[1], share)
            case "ADD_SHADER":
                first = self._read_input(material, node.inputs[0])
                second = self._read_input(material, node.inputs[1])
                return _added(first[0], second[0]), _added(first[1], second[1])
            case _:
                raise _UnreadableError(f"its node “{node.name}” cannot be read yet")

    def _read_input(self, material: bpy.types.Material, socket: Any) -> tuple[Rgb, Rgb]:
        shader = linked_node(socket)
        return (_BLACK, _BLACK) if shader is None else self._read_shader(material, shader)

    def _warn_if_not_matte(self, material: bpy.types.Material, principled: Any) -> None:
        """Say which part of a Principled shader is left out."""
        for name, what, matte in (
            ("Metallic", "metal", 0.0),
            ("Transmission Weight", "glass", 0.0),
            ("Alpha", "transparency", 1.0),
        ):
            if constant_float(principled.inputs[name]) != matte:
                self._scene.warnings.append(f"material “{material.name}”: its {what} is baked as a matte surface")

    def _colour(self, socket: Any) -> Rgb:
        colour = constant_colour(socket)
        if colour is not None:
            return colour
        node = linked_node(socket)
        if node is not None and node.type == "TEX_IMAGE" and node.image is not None:
            mean = self._image_mean(node.image)
            if mean is not None:
                return mean
            raise _UnreadableError(f"its image “{node.image.name}” has no pixels")
        name = "" if node is None else f" “{node.name}”"
        raise _UnreadableError(f"its node{name} at “{socket.name}” cannot be read yet")

    def _float(self, socket: Any) -> float:
        value = constant_float(socket)
        if value is None:
            raise _UnreadableError(f"its node at “{socket.name}” cannot be read yet")
        return value

    def _image_mean(self, image: bpy.types.Image) -> Rgb | None:
        original: Any = image.original
        uid = original.session_uid
        if uid not in self._mean_by_image_uid:
            self._mean_by_image_uid[uid] = _mean_colour(original)
        return self._mean_by_image_uid[uid]


class _UnreadableError(Exception):
    """A material holds what this reader does not know."""


def uses_nodes(owner: Any) -> bool:
    """Whether a material or world is made of nodes; from Blender 5.0 on all are, and the switch is deprecated."""
    return bpy.app.version >= (5, 0) or bool(owner.use_nodes)


def linked_node(socket: Any) -> Any:
    """The node at the other end of an input, seen through reroutes; None when there is none."""
    while socket.is_linked:
        link = socket.links[0]
        if link.is_muted:
            return None
        if link.from_node.type != "REROUTE":
            return link.from_node
        socket = link.from_node.inputs[0]
    return None


def constant_colour(socket: Any) -> Rgb | None:
    """The colour of an input that is unlinked or linked to an RGB node; None otherwise."""
    node = linked_node(socket)
    if node is None:
        red, green, blue = socket.default_value[:3]
    elif node.type == "RGB":
        red, green, blue = node.outputs[0].default_value[:3]
    else:
        return None
    return red, green, blue


def constant_float(socket: Any) -> float | None:
    """The number of an input that is unlinked or linked to a Value node; None otherwise."""
    node = linked_node(socket)
    if node is None:
        return float(socket.default_value)
    return float(node.outputs[0].default_value) if node.type == "VALUE" else None


def _viewport_colour(material: bpy.types.Material) -> Rgb:
    colour: Any = material.diffuse_color
    red, green, blue, _alpha = colour
    return red, green, blue


def _mean_colour(image: Any) -> Rgb | None:
    """Mean of all pixels, scene-linear; None when the image has none."""
    pixels = image.pixels
    if len(pixels) == 0:
        return None
    values = np.empty(len(pixels), dtype=np.float32)
    pixels.foreach_get(values)
    # Greyscale images have one channel, some two.
    channels = values.reshape(-1, image.channels)
    rgb = channels[:, :3] if image.channels >= 3 else np.repeat(channels[:, :1], 3, axis=1)
    # Pixels of byte images come as they are stored, those of float images are linear already.
    if not image.is_float and image.colorspace_settings.name == "sRGB":
        rgb = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    red, green, blue = (float(value) for value in rgb.mean(axis=0, dtype=np.float64))
    return red, green, blue


def _scaled(colour: Rgb, factor: float) -> Rgb:
    return colour[0] * factor, colour[1] * factor, colour[2] * factor


def _added(a: Rgb, b: Rgb) -> Rgb:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _mixed(a: Rgb, b: Rgb, share_of_b: float) -> Rgb:
    return _added(_scaled(a, 1.0 - share_of_b), _scaled(b, share_of_b))
