# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the baked objects of a .blend as a .glb whose vertex colours are the light.

... export_glb.py -- BAKED.blend OUT.glb

glTF colours end at 1: the brightest ones are clipped after all were divided by one number, which each object carries
as the extra `antumbra_scale`. The .blend keeps the unclipped values.
"""

import sys

import bpy
import numpy as np

ATTRIBUTE = "Radiosity"
# A lamp that is baked too would leave everything else black: the brightest corners may clip.
CLIPPED_SHARE = 0.002


def corner_colours(mesh: bpy.types.Mesh) -> np.ndarray:
    """The attribute as (corners, 4)."""
    data = mesh.color_attributes[ATTRIBUTE].data
    colours = np.empty(len(data) * 4, dtype=np.float32)
    data.foreach_get("color", colours)
    return colours.reshape(-1, 4)


def unlit() -> bpy.types.Material:
    """Make a material that shows the colours as they are: the graph that every exporter turns into COLOR_0, unlit."""
    material = bpy.data.materials.new("Antumbra unlit")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    attribute = nodes.new("ShaderNodeVertexColor")
    attribute.layer_name = ATTRIBUTE
    background = nodes.new("ShaderNodeBackground")
    output = nodes.new("ShaderNodeOutputMaterial")
    links.new(attribute.outputs["Color"], background.inputs["Color"])
    links.new(background.outputs["Background"], output.inputs["Surface"])
    return material


def main() -> None:
    source, output = sys.argv[sys.argv.index("--") + 1 :]
    bpy.ops.wm.open_mainfile(filepath=source)
    baked = [o for o in bpy.context.view_layer.objects if o.type == "MESH" and ATTRIBUTE in o.data.color_attributes]
    if not baked:
        sys.exit(f"{source} holds no baked object")
    values = np.concatenate([corner_colours(o.data)[:, :3].max(axis=1) for o in baked])
    scale = max(float(np.quantile(values, 1.0 - CLIPPED_SHARE)), 1e-6)
    material = unlit()
    bpy.ops.object.select_all(action="DESELECT")
    for mesh in {o.data for o in baked}:
        colours = corner_colours(mesh)
        colours[:, :3] = np.clip(colours[:, :3] / scale, 0.0, 1.0)
        colours[:, 3] = 1.0
        mesh.color_attributes[ATTRIBUTE].data.foreach_set("color", colours.ravel())
        mesh.color_attributes.active_color_name = ATTRIBUTE
        mesh.materials.clear()
        mesh.materials.append(material)
        mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), dtype=np.int32))
    for baked_object in baked:
        baked_object["antumbra_scale"] = scale
        baked_object.hide_set(False)
        baked_object.select_set(True)
    if "io_scene_gltf2" not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.ops.export_scene.gltf(filepath=output, export_format="GLB", use_selection=True, export_extras=True)


main()
