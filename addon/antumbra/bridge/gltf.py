# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked objects as glTF, their light as COLOR_0.

Blender's exporter writes a colour attribute unchanged only where a material uses it as Color Attribute -> Background
-> Output, which is an unlit material in glTF. glTF allows colours from 0 to 1 only, so all are divided by one number,
which each node's extras hold as `antumbra_scale`: COLOR_0 times it is the radiance, but for the few brightest corners.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import addon_utils
import bpy
import numpy as np

from ..core.colours import RADIOSITY
from ..core.errors import InputError
from .properties import state_of

SCALE_PROPERTY = "antumbra_scale"

# This share of the corners is clipped at 1. Were it 0, one baked lamp would leave everything else black.
_CLIPPED_SHARE = 0.002


def export_glb(scene: bpy.types.Scene, path: Path) -> None:
    """Write the baked objects of the scene to a .glb; the scene is as before afterwards."""
    baked = [obj for obj in scene.objects if state_of(obj).role in ("BAKED", "REPLACED")]
    if not baked:
        raise InputError("there is no bake to export")
    if not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
        addon_utils.enable("io_scene_gltf2")
    export_scene = bpy.data.scenes.new("Antumbra Export")
    copies: list[bpy.types.Object] = []
    material = _unlit_material()
    try:
        scale = _scale([obj.data for obj in baked])
        for obj in baked:
            copies.append(_export_copy(obj, material, scale))
            export_scene.collection.objects.link(copies[-1])
        with bpy.context.temp_override(scene=export_scene, view_layer=export_scene.view_layers[0]):
            bpy.ops.export_scene.gltf(
                filepath=str(path),
                export_format="GLB",
                use_active_scene=True,
                export_extras=True,
                export_animations=False,
                export_apply=False,
            )
    finally:
        meshes = [copy.data for copy in copies]
        # Not in one batch: only this way does Blender let go of a scene that it shows.
        bpy.data.scenes.remove(export_scene)
        bpy.data.batch_remove(copies)
        bpy.data.batch_remove([*meshes, material])


def _export_copy(obj: bpy.types.Object, material: bpy.types.Material, scale: float) -> bpy.types.Object:
    mesh: Any = obj.data.copy()  # type: ignore[union-attr]
    mesh.materials.clear()
    mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), dtype=np.int32))
    colours = _colours(mesh)
    colours[:, :3] = np.clip(colours[:, :3] / scale, 0.0, 1.0)
    mesh.attributes[RADIOSITY].data.foreach_set("color", colours.reshape(-1))
    copy = bpy.data.objects.new(obj.name, mesh)
    copy.matrix_world = obj.matrix_world
    copy[SCALE_PROPERTY] = scale
    return copy


def _unlit_material() -> bpy.types.Material:
    material = bpy.data.materials.new("Antumbra Export")
    # From 5.0 on, materials have nodes from the start.
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree: Any = material.node_tree
    tree.nodes.clear()
    colour = tree.nodes.new("ShaderNodeVertexColor")
    colour.layer_name = RADIOSITY
    background = tree.nodes.new("ShaderNodeBackground")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(colour.outputs["Color"], background.inputs["Color"])
    tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    return material


def _colours(mesh: Any) -> np.ndarray[Any, np.dtype[np.float32]]:
    data = mesh.attributes[RADIOSITY].data
    colours = np.empty(len(data) * 4, dtype=np.float32)
    data.foreach_get("color", colours)
    return colours.reshape(-1, 4)


def _scale(meshes: list[Any]) -> float:
    """The radiance that becomes 1."""
    brightest = np.concatenate([_colours(mesh)[:, :3].max(axis=1) for mesh in meshes])
    radiance = float(np.quantile(brightest, 1.0 - _CLIPPED_SHARE))
    return radiance if radiance > 0.0 else 1.0
