# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything of a file that a user would miss, as plain values that can be compared."""

import bpy
import numpy as np

COLLECTIONS = (
    "actions cameras collections curves images lights materials meshes node_groups objects scenes textures worlds"
).split()


def fingerprint():
    # Matrices of new objects come with the first update.
    bpy.context.view_layer.update()
    return {
        "data": {name: sorted(item.name for item in getattr(bpy.data, name)) for name in COLLECTIONS},
        "objects": {obj.name: _object(obj) for obj in bpy.data.objects},
        "meshes": {mesh.name: _mesh(mesh) for mesh in bpy.data.meshes},
        "collections": {item.name: sorted(obj.name for obj in item.objects) for item in bpy.data.collections},
        "scene": _scene(bpy.context.scene),
    }


def _object(obj):
    # Looking at them makes properties in Blender before 5.0, so they come first.
    state, part = obj.antumbra, obj.antumbra_part.kind
    return {
        "data": obj.data.name if obj.data else None,
        "hidden": (obj.hide_viewport, obj.hide_render, obj.hide_get(), obj.hide_select),
        "selected": obj.select_get(),
        "mode": obj.mode,
        "matrix": [tuple(row) for row in obj.matrix_world],
        "modifiers": [(m.name, m.type, m.show_viewport, m.show_render) for m in obj.modifiers],
        "materials": [(slot.link, slot.material.name if slot.material else None) for slot in obj.material_slots],
        "properties": sorted(obj.keys()),
        "part": part,
        "antumbra": (state.role, _name(state.source), _name(state.original_mesh), len(state.modifiers)),
    }


def _name(item):
    # Undo makes new pointers to what is the same.
    return item.name if item else None


def _mesh(mesh):
    # Edit Mode keeps a mesh's data to itself.
    attributes = {} if mesh.is_editmode else {item.name: _attribute(item) for item in mesh.attributes}
    return {
        "attributes": attributes,
        "users": mesh.users,
        "materials": [material.name if material else None for material in mesh.materials],
        "active colour": mesh.color_attributes.active_color_name,
        "shape": (len(mesh.vertices), len(mesh.edges), len(mesh.loops), len(mesh.polygons)),
    }


def _attribute(attribute):
    if attribute.data_type == "STRING":
        return attribute.domain, attribute.data_type, [item.value for item in attribute.data]
    prop = {"FLOAT_VECTOR": "vector", "FLOAT2": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}.get(
        attribute.data_type, "value"
    )
    width = {
        "FLOAT_VECTOR": 3,
        "FLOAT2": 2,
        "FLOAT_COLOR": 4,
        "BYTE_COLOR": 4,
        "QUATERNION": 4,
        "FLOAT4X4": 16,
        "INT32_2D": 2,
        "INT16_2D": 2,
    }.get(attribute.data_type, 1)
    values = np.zeros(len(attribute.data) * width, dtype=np.float64)
    attribute.data.foreach_get(prop, values)
    return attribute.domain, attribute.data_type, values.tobytes()


def _scene(scene):
    return {
        "engine": scene.render.engine,
        "active": getattr(bpy.context.view_layer.objects.active, "name", None),
        "mode": bpy.context.mode,
        "objects": [obj.name for obj in scene.objects],
        "frame": scene.frame_current,
        "settings": {name: getattr(scene.antumbra, name) for name in scene.antumbra.bl_rna.properties.keys()},
    }
