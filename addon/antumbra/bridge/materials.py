# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials to a matte reflectance, an exitance, and the share of light that goes through them.

Read exactly: Principled, Diffuse, Emission, Transparent, Glass and Glossy, and Mix and Add of these, with constant
inputs. Read as one colour where nothing better can be had: an image on a colour input, by its mean. For everything else
a reader of passes can look at the faces themselves; without it the material's viewport colour is taken, with a warning
that names the material. Blender multiplies an emission into every channel, on both sides of a face.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..core.colours import srgb_decoded
from ..core.pieces import GO_ON, Pieces
from ..core.record import Material, SceneRecord
from .neutral_material import GLASS, METALS, trees_of

Rgb = tuple[float, float, float]

# What Blender's own default material reflects.
_DEFAULT_GREY: Rgb = (0.8, 0.8, 0.8)
_BLACK: Rgb = (0.0, 0.0, 0.0)
_WHITE: Rgb = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class _Shading:
    """What a shader does with light."""

    reflectance: Rgb = _BLACK
    radiance: Rgb = _BLACK
    through: Rgb = _BLACK

    def scaled(self, factor: float) -> _Shading:
        return _Shading(*(_scaled(part, factor) for part in (self.reflectance, self.radiance, self.through)))

    def __add__(self, other: _Shading) -> _Shading:
        return _Shading(
            _added(self.reflectance, other.reflectance),
            _added(self.radiance, other.radiance),
            _added(self.through, other.through),
        )


class MaterialReader:
    """Reads each material and each image of one bake once."""

    def __init__(self, scene: SceneRecord, metals_are_matte: bool = True) -> None:
        self._scene = scene
        self.metals_are_matte = metals_are_matte
        self._index_by_uid: dict[int | None, int] = {}
        self._mean_by_image_uid: dict[int, Rgb | None] = {}
        self._unread: dict[int, str] = {}
        self._textured: set[int] = set()

    def index(self, material: Any) -> int:
        """Index into SceneRecord.materials; None is Blender's default grey."""
        uid = None if material is None else material.original.session_uid
        if uid not in self._index_by_uid:
            index = self._index_by_uid[uid] = len(self._scene.materials)
            self._scene.materials.append(self._read(material, index))
        return self._index_by_uid[uid]

    def read_images(self, scene: bpy.types.Scene) -> Pieces[None]:
        """Find the means of images that materials of the scene's objects use as colours, one at a time."""
        for material in _materials_of(scene):
            for tree in trees_of(material):
                for node in tree.nodes:
                    if node.type == "TEX_IMAGE" and node.image is not None and _colours_a_shader(node):
                        if node.image.session_uid in self._mean_by_image_uid:
                            continue
                        self._image_mean(node.image)
                        yield GO_ON

    def wants_passes(self, index: int, has_uv_map: bool) -> bool:
        """Whether looking at the faces tells more of a material than its nodes did."""
        return index in self._unread or (has_uv_map and index in self._textured)

    def may_emit(self, index: int) -> bool:
        """Whether a material emits, or its nodes did not tell."""
        return index in self._unread or any(self._scene.materials[index].exitance_rgb)

    def do_without_passes(self, index: int) -> None:
        """Name a material whose viewport colour has to do."""
        reason = self._unread.pop(index, None)
        if reason is not None:
            self._warn_of_viewport_colour(self._scene.materials[index].name, reason)

    def _read(self, material: bpy.types.Material | None, index: int) -> Material:
        if material is None:
            return Material("no material", _DEFAULT_GREY, _BLACK)
        try:
            shading = self._read_nodes(material, index)
        except _UnreadableError as error:
            missing = _missing_image(material)
            if missing is None:
                self._unread[index] = str(error)
            else:
                self._warn_of_viewport_colour(material.name, f"its image “{missing}” has no pixels")
            shading = _Shading(_viewport_colour(material))
        red, green, blue = (math.pi * value for value in shading.radiance)
        return Material(material.name, shading.reflectance, (red, green, blue), _share(shading.through))

    def _warn_of_viewport_colour(self, name: str, reason: str) -> None:
        self._scene.warnings.append(f"material “{name}”: {reason}; its viewport colour is used")

    def _read_nodes(self, material: bpy.types.Material, index: int) -> _Shading:
        tree = material.node_tree
        if tree is None or not uses_nodes(material):
            return _Shading(_viewport_colour(material))
        output = tree.get_output_node("CYCLES")
        shader = linked_node(output.inputs["Surface"]) if output is not None else None
        if shader is None and output is not None and linked_node(output.inputs["Volume"]) is not None:
            self._scene.warnings.append(f"material “{material.name}”: its volume is left out")
            return _Shading(through=_WHITE)
        if shader is None:
            self._scene.warnings.append(f"material “{material.name}” has no shader and is black")
            return _Shading()
        return self._read_shader(material, shader, index)

    def _read_shader(self, material: bpy.types.Material, node: Any, index: int) -> _Shading:
        kind = "MUTED" if node.mute else node.type
        match kind:
            case "BSDF_PRINCIPLED":
                return self._read_principled(material, node, index)
            case "BSDF_DIFFUSE":
                return _Shading(reflectance=self._colour(node.inputs["Color"], index))
            case "EMISSION":
                strength = self._float(node.inputs["Strength"])
                return _Shading(radiance=_scaled(self._colour(node.inputs["Color"], index), strength))
            case "BSDF_TRANSPARENT":
                return _Shading(through=self._colour(node.inputs["Color"], index))
            case "HOLDOUT":
                return _Shading(through=_WHITE)
            case "MIX_SHADER":
                share = min(max(self._float(node.inputs[0]), 0.0), 1.0)
                first = self._read_input(material, node.inputs[1], index)
                second = self._read_input(material, node.inputs[2], index)
                return first.scaled(1.0 - share) + second.scaled(share)
            case "ADD_SHADER":
                first = self._read_input(material, node.inputs[0], index)
                return first + self._read_input(material, node.inputs[1], index)
        if kind in GLASS:
            self.warn_of_glass(material)
            return _Shading(through=self._colour(node.inputs["Color"], index))
        if kind in METALS:
            self.warn_of_metal(material)
            colour = node.inputs.get("Color") or node.inputs["Base Color"]
            return _Shading(reflectance=self._colour(colour, index) if self.metals_are_matte else _BLACK)
        raise _UnreadableError(f"its node “{node.name}” cannot be read")

    def _read_principled(self, material: bpy.types.Material, node: Any, index: int) -> _Shading:
        base = self._colour(node.inputs["Base Color"], index)
        strength = self._float(node.inputs["Emission Strength"])
        glow = _scaled(self._colour(node.inputs["Emission Color"], index), strength) if strength else _BLACK
        metallic, glass, alpha = (
            min(max(self._float(node.inputs[name]), 0.0), 1.0) for name in ("Metallic", "Transmission Weight", "Alpha")
        )
        if metallic > 0.0:
            self.warn_of_metal(material)
            if self.metals_are_matte:
                metallic = 0.0
        through_glass = (1.0 - metallic) * glass
        matte = (1.0 - metallic) * (1.0 - glass)
        if through_glass > 0.0:
            self.warn_of_glass(material)
        return _Shading(
            reflectance=_scaled(base, alpha * matte),
            radiance=_scaled(glow, alpha),
            # Cycles tints light by the root of the base colour where it enters and where it leaves.
            through=_added(_scaled(_WHITE, 1.0 - alpha), _scaled(_roots(base), alpha * through_glass)),
        )

    def _read_input(self, material: bpy.types.Material, socket: Any, index: int) -> _Shading:
        shader = linked_node(socket)
        return _Shading() if shader is None else self._read_shader(material, shader, index)

    def warn_of_glass(self, material: bpy.types.Material) -> None:
        """Say once what becomes of a material's glass."""
        warning = (
            f"material “{material.name}”: light goes straight through its glass, which neither bends nor mirrors it"
        )
        if warning not in self._scene.warnings:
            self._scene.warnings.append(warning)

    def warn_of_metal(self, material: bpy.types.Material) -> None:
        """Say once what becomes of a material's metal."""
        how = "is baked as a matte surface" if self.metals_are_matte else "reflects no diffuse light"
        warning = f"material “{material.name}”: its metal {how}"
        if warning not in self._scene.warnings:
            self._scene.warnings.append(warning)

    def _colour(self, socket: Any, index: int) -> Rgb:
        colour = constant_colour(socket)
        if colour is not None:
            return colour
        node = linked_node(socket)
        if node is not None and node.type == "TEX_IMAGE" and node.image is not None and not node.mute:
            mean = self._image_mean(node.image)
            if mean is not None:
                self._textured.add(index)
                return mean
        name = "" if node is None else f" “{node.name}”"
        raise _UnreadableError(f"its node{name} at “{socket.name}” cannot be read")

    def _float(self, socket: Any) -> float:
        value = constant_float(socket)
        if value is None:
            raise _UnreadableError(f"its node at “{socket.name}” cannot be read")
        return value

    def _image_mean(self, image: bpy.types.Image) -> Rgb | None:
        original: Any = image.original
        uid = original.session_uid
        if uid not in self._mean_by_image_uid:
            self._mean_by_image_uid[uid] = _mean_colour(original)
        return self._mean_by_image_uid[uid]


def _materials_of(scene: bpy.types.Scene) -> list[Any]:
    """The materials of a scene's objects, and of the objects in the collections that these make instances of."""
    objects: dict[int, Any] = {obj.session_uid: obj for obj in scene.objects}
    for obj in list(objects.values()):
        if obj.instance_collection is not None:
            objects.update((each.session_uid, each) for each in obj.instance_collection.all_objects)
    slots = (slot.material for obj in objects.values() for slot in obj.material_slots)
    return list({material.session_uid: material for material in slots if material is not None}.values())


def _colours_a_shader(node: Any) -> bool:
    return any(link.to_node.outputs and link.to_node.outputs[0].type == "SHADER" for link in node.outputs[0].links)


def _missing_image(material: bpy.types.Material) -> str | None:
    """The name of an image that the material uses and that is not there."""
    for tree in trees_of(material):
        for node in tree.nodes:
            if node.type != "TEX_IMAGE" or node.image is None or not any(o.is_linked for o in node.outputs):
                continue
            # Tiles, sequences and films keep their pixels elsewhere, where Cycles finds them.
            if node.image.source in ("FILE", "GENERATED") and len(node.image.original.pixels) == 0:
                return str(node.image.name)
    return None


class _UnreadableError(Exception):
    """A material's nodes hold what this reader does not know."""


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
        bytes_of = np.rint(rgb * 255.0).astype(np.uint8)
        counts = np.stack([np.bincount(bytes_of[:, k], minlength=256) for k in range(3)], axis=1)
        red, green, blue = (srgb_decoded(np.arange(256) / 255.0) @ counts / len(rgb)).tolist()
        return red, green, blue
    red, green, blue = (float(value) for value in rgb.mean(axis=0, dtype=np.float64))
    return red, green, blue


def _scaled(colour: Rgb, factor: float) -> Rgb:
    return colour[0] * factor, colour[1] * factor, colour[2] * factor


def _roots(colour: Rgb) -> Rgb:
    red, green, blue = (math.sqrt(max(value, 0.0)) for value in colour)
    return red, green, blue


def _share(colour: Rgb) -> Rgb:
    """From 0 to 1: shaders may be added up to more."""
    red, green, blue = (min(max(value, 0.0), 1.0) for value in colour)
    return red, green, blue


def _added(a: Rgb, b: Rgb) -> Rgb:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
