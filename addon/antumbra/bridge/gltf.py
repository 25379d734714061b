# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked objects ready for glTF, their light as COLOR_0.

Blender's exporter writes a colour attribute unchanged only where a material uses it as Color Attribute -> Background
-> Output, which is an unlit material in glTF. glTF allows colours from 0 to 1 only, so all are divided by one number,
which each node's extras hold as `antumbra_scale`: COLOR_0 times it is the radiance, but for the few brightest corners.
`_RADIOSITY` holds all of it, where the exporter is told to write attributes.
"""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import addon_utils
import bpy
import numpy as np

from ..core.colours import EXPORT, HDR, RADIOSITY, VIEW, srgb_encoded
from ..core.errors import InputError
from ..core.record import Attribute
from .attribute_types import write_attribute
from .originals import ENCODING_PROPERTY, SCALE_PROPERTY
from .properties import state_of
from .view import stored_light

MATERIAL = "Antumbra Unlit"

# Where Blender's exporter keeps what its window was last set to, and reads it when it opens.
_EXPORT_WINDOW = "glTF2ExportSettings"

# The scale and the light without limit.
_WHAT_BAKES_NEED: dict[str, Any] = {"export_extras": True, "export_attributes": True}

# This share of the corners is clipped at 1. Were it 0, one baked lamp would leave everything else black.
_CLIPPED_SHARE = 0.002


def make_export_ready(scene: bpy.types.Scene, encoding: str = "LINEAR") -> float:
    """Give every bake of the scene what other programs need, and return the radiance that becomes 1.

    Blender's glTF export window is set to write visible objects, with custom properties and attributes.

    encoding: LINEAR, as glTF wants it, or SRGB, for programs that show vertex colours as they are.
    """
    baked = _baked_objects(scene)
    material = bpy.data.materials.get(MATERIAL) or _unlit_material()
    scale = _scale([obj.data for obj in baked])
    for mesh in {obj.data.session_uid: obj.data for obj in baked}.values():
        _make_mesh_ready(mesh, material, scale, encoding)
    for obj in baked:
        obj[SCALE_PROPERTY] = scale
        obj[ENCODING_PROPERTY] = encoding
    set_so_far = scene.get(_EXPORT_WINDOW)
    # By itself it would write the hidden originals as well, which lie where the bakes lie.
    chosen = {**_WHAT_BAKES_NEED, "use_visible": True}
    scene[_EXPORT_WINDOW] = {**(set_so_far.to_dict() if set_so_far else {}), **chosen}
    return scale


def export_glb(scene: bpy.types.Scene, path: Path) -> None:
    """Write the baked objects of the scene to a .glb; the scene is as before afterwards."""
    baked = _baked_objects(scene)
    if not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
        addon_utils.enable("io_scene_gltf2")
    export_scene = bpy.data.scenes.new("Antumbra Export")
    copies: list[Any] = []
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
                export_animations=False,
                export_apply=False,
                **_WHAT_BAKES_NEED,
            )
    finally:
        meshes = [copy.data for copy in copies]
        # Not in one batch: only this way does Blender let go of a scene that it shows.
        bpy.data.scenes.remove(export_scene)
        bpy.data.batch_remove(copies)
        bpy.data.batch_remove([*meshes, material])


def export_saved_glb(blend: Path, path: Path) -> None:
    """Write the baked objects of a saved file to a .glb, by another Blender.

    In a --command Blender's exporter finds no window to ask for its cursor and fails; a script has one.
    """
    code = (
        "import importlib, pathlib; import bpy; "
        f"gltf = importlib.import_module({__name__!r}); "
        f"gltf.export_glb(bpy.context.scene, pathlib.Path({str(path)!r}))"
    )
    command = [bpy.app.binary_path, "--background", str(blend), "--python-exit-code", "1", "--python-expr", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0 or not path.is_file():
        said = (done.stderr or done.stdout).strip().splitlines()
        raise RuntimeError(f"Blender could not export {path}: {said[-1] if said else 'it said nothing'}")


def _baked_objects(scene: bpy.types.Scene) -> list[Any]:
    baked = [obj for obj in scene.objects if state_of(obj).role in ("BAKED", "REPLACED")]
    if not baked:
        raise InputError("there is no bake to export")
    return baked


def _export_copy(obj: bpy.types.Object, material: bpy.types.Material, scale: float) -> bpy.types.Object:
    mesh: Any = obj.data.copy()  # type: ignore[union-attr]
    _make_mesh_ready(mesh, material, scale, "LINEAR")
    copy = bpy.data.objects.new(obj.name, mesh)
    copy.matrix_world = obj.matrix_world
    copy[SCALE_PROPERTY] = scale
    return copy


def _make_mesh_ready(mesh: Any, material: bpy.types.Material, scale: float, encoding: str) -> None:
    if VIEW in mesh.attributes:
        mesh.attributes.remove(mesh.attributes[VIEW])
    light = stored_light(mesh)
    domain = mesh.attributes[RADIOSITY].domain
    fitted = np.ones_like(light)
    fitted[:, :3] = np.clip(light[:, :3] / scale, 0.0, 1.0)
    if encoding == "SRGB":
        fitted[:, :3] = srgb_encoded(fitted[:, :3])
    write_attribute(mesh, Attribute(EXPORT, domain, "FLOAT_COLOR", fitted, blends=True))
    write_attribute(mesh, Attribute(HDR, domain, "FLOAT_VECTOR", light[:, :3], blends=True))
    mesh.color_attributes.active_color_name = EXPORT
    mesh.color_attributes.render_color_index = mesh.color_attributes.find(EXPORT)
    mesh.materials.clear()
    mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), dtype=np.int32))
    mesh.update_tag()


def _unlit_material() -> bpy.types.Material:
    material = bpy.data.materials.new(MATERIAL)
    # From 5.0 on, materials have nodes from the start.
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree: Any = material.node_tree
    tree.nodes.clear()
    colour = tree.nodes.new("ShaderNodeVertexColor")
    colour.layer_name = EXPORT
    background = tree.nodes.new("ShaderNodeBackground")
    background.location.x = 200.0
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location.x = 400.0
    tree.links.new(colour.outputs["Color"], background.inputs["Color"])
    tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    return material


def _scale(meshes: list[Any]) -> float:
    """The radiance that becomes 1."""
    brightest = np.concatenate([stored_light(mesh)[:, :3].max(axis=1) for mesh in meshes])
    radiance = float(np.quantile(brightest, 1.0 - _CLIPPED_SHARE))
    return radiance if radiance > 0.0 else 1.0
