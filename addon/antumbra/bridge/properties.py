# SPDX-License-Identifier: GPL-3.0-or-later
"""What Antumbra keeps in a .blend: the settings of each scene, and what a bake did to each object.

Nothing here says that a bake is running: a file saved in the middle of one opens as if there were none.
"""
# mypy: disable-error-code="valid-type"

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
)
from bpy.types import PropertyGroup

from ..core.settings import SPECS, Settings

# Blender's float properties end here.
_FLOAT_MAX = 3.4e38


def _float(name: str, precision: int = 2) -> Any:
    spec = SPECS[name]
    return FloatProperty(
        name=spec.label,
        description=spec.description,
        default=float(spec.default),
        min=max(spec.minimum, -_FLOAT_MAX),
        max=min(spec.maximum, _FLOAT_MAX),
        precision=precision,
        subtype=spec.subtype,  # type: ignore[arg-type]
    )


def _int(name: str) -> Any:
    spec = SPECS[name]
    return IntProperty(
        name=spec.label,
        description=spec.description,
        default=int(spec.default),
        min=int(spec.minimum),
        max=int(spec.maximum),
    )


def _enum(name: str) -> Any:
    spec = SPECS[name]
    return EnumProperty(
        name=spec.label,
        description=spec.description,
        default=str(spec.default),
        items=[(choice.value, choice.label, choice.description) for choice in spec.choices],
    )


class AntumbraSettings(PropertyGroup):
    """`scene.antumbra`; names, defaults and texts come from core.settings."""

    method: _enum("method")
    tolerance: _float("tolerance", precision=4)
    element_size: _float("element_size", precision=3)
    max_level: _int("max_level")
    max_blockers: _int("max_blockers")
    time_limit: _float("time_limit", precision=1)
    triangle_budget: _int("triangle_budget")
    verify_points: _int("verify_points")
    transport: _enum("transport")
    receivers: _enum("receivers")
    output: _enum("output")
    quantity: _enum("quantity")
    metals: _enum("metals")
    layers: _enum("layers")
    data_type: _enum("data_type")
    domain: _enum("domain")
    colour_steps: _int("colour_steps")


class AntumbraModifier(PropertyGroup):
    """How a modifier was shown before its result was baked into the mesh."""

    show_viewport: BoolProperty()
    show_render: BoolProperty()


class AntumbraObject(PropertyGroup):
    """`object.antumbra`: what a bake did to this object, so that it can be undone in any later session."""

    role: EnumProperty(
        items=[
            ("NONE", "None", "No bake has touched this object"),
            ("HIDDEN", "Hidden", "A baked object stands in for this one"),
            ("REPLACED", "Replaced", "This object shows a baked mesh"),
            ("BAKED", "Baked", "This object was made by a bake"),
        ]
    )
    source: PointerProperty(type=bpy.types.Object)
    hide_viewport: BoolProperty()
    hide_render: BoolProperty()
    original_mesh: PointerProperty(type=bpy.types.Mesh)
    modifiers: CollectionProperty(type=AntumbraModifier)


class AntumbraPart(PropertyGroup):
    """`object.antumbra_part`: what the user wants of this object in bakes; it survives them."""

    kind: EnumProperty(
        name="Part",
        description="What this object does in an Antumbra bake",
        items=[
            ("NORMAL", "Normal", "Blocks and reflects light, and is baked when it is chosen"),
            ("EXCLUDED", "Excluded", "Takes no part: as if it were not there"),
            ("BLOCKER", "Blocker Only", "Casts shadows, but reflects and emits nothing and is never baked"),
            ("RECEIVER", "Receiver Only", "Is baked when it is chosen, but neither casts shadows nor lights others"),
        ],
    )


CLASSES = (AntumbraSettings, AntumbraModifier, AntumbraObject, AntumbraPart)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.antumbra = PointerProperty(type=AntumbraSettings)  # type: ignore[attr-defined]
    bpy.types.Object.antumbra = PointerProperty(type=AntumbraObject)  # type: ignore[attr-defined]
    bpy.types.Object.antumbra_part = PointerProperty(type=AntumbraPart)  # type: ignore[attr-defined]


def unregister() -> None:
    del bpy.types.Object.antumbra_part  # type: ignore[attr-defined]
    del bpy.types.Object.antumbra  # type: ignore[attr-defined]
    del bpy.types.Scene.antumbra  # type: ignore[attr-defined]
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)


def settings_of(scene: bpy.types.Scene) -> Settings:
    """The scene's settings as core knows them."""
    group: Any = scene.antumbra  # type: ignore[attr-defined]
    return Settings(**{name: _as_typed(getattr(group, name)) for name in SPECS})


def _as_typed(value: Any) -> Any:
    """Blender keeps 32-bit floats: 0.01 comes back as 0.009999999776. Seven digits give back what was typed."""
    return float(f"{value:.7g}") if isinstance(value, float) else value


def state_of(obj: bpy.types.Object) -> Any:
    """The object's AntumbraObject."""
    return obj.antumbra  # type: ignore[attr-defined]


def part_of(obj: bpy.types.Object) -> str:
    """The part that the user gave the object: NORMAL, EXCLUDED, BLOCKER or RECEIVER."""
    return str(obj.antumbra_part.kind)  # type: ignore[attr-defined]
