# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties > Object > Antumbra Radiosity: the part of an object in bakes."""

from __future__ import annotations

from typing import Any

import bpy

# What becomes a mesh, and what puts instances of meshes into the scene.
_TYPES = frozenset({"MESH", "CURVE", "SURFACE", "META", "FONT", "EMPTY"})


class ANTUMBRA_PT_object(bpy.types.Panel):
    """What this object does in a bake."""

    bl_label = "Antumbra Radiosity"
    bl_space_type: Any = "PROPERTIES"
    bl_region_type: Any = "WINDOW"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.object is not None and context.object.type in _TYPES

    def draw(self, context: bpy.types.Context) -> None:
        layout: Any = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        obj: Any = context.object
        layout.prop(obj.antumbra_part, "kind")


def register() -> None:
    bpy.utils.register_class(ANTUMBRA_PT_object)


def unregister() -> None:
    bpy.utils.unregister_class(ANTUMBRA_PT_object)
