# SPDX-License-Identifier: GPL-3.0-or-later
"""One table of Blender's attribute types: the property and the buffer that foreach_get and foreach_set take fast."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.record import Attribute


@dataclass(frozen=True, slots=True)
class AttributeType:
    """How one data type is read and written."""

    prop: str
    width: int
    dtype: type[np.generic] | None
    """None for text, which Blender hands over one value at a time only."""
    blends: bool
    """Whether a value between two others makes sense."""


TYPES: dict[str, AttributeType] = {
    "FLOAT": AttributeType("value", 1, np.float32, blends=True),
    "INT": AttributeType("value", 1, np.int32, blends=False),
    "FLOAT_VECTOR": AttributeType("vector", 3, np.float32, blends=True),
    # `color` is scene-linear for both colour types, so both blend as light does.
    "FLOAT_COLOR": AttributeType("color", 4, np.float32, blends=True),
    "BYTE_COLOR": AttributeType("color", 4, np.float32, blends=True),
    "STRING": AttributeType("value", 1, None, blends=False),
    "BOOLEAN": AttributeType("value", 1, np.bool_, blends=False),
    "FLOAT2": AttributeType("vector", 2, np.float32, blends=True),
    "INT8": AttributeType("value", 1, np.int32, blends=False),
    "INT16_2D": AttributeType("value", 2, np.int32, blends=False),
    "INT32_2D": AttributeType("value", 2, np.int32, blends=False),
    # Neither the mean of two rotations nor that of two transforms is one.
    "QUATERNION": AttributeType("value", 4, np.float32, blends=False),
    "FLOAT4X4": AttributeType("value", 16, np.float32, blends=False),
}

# The mesh itself; written as such, not as attributes. custom_normal is tied to the corners' own frames and is carried
# by the shading normals instead.
STRUCTURE = frozenset({"position", ".edge_verts", ".corner_vert", ".corner_edge", "custom_normal"})


def read_attribute(attribute: Any, size: int) -> Attribute | None:
    """Copy an attribute of `size` elements; None for types this table does not know."""
    kind = TYPES.get(attribute.data_type)
    if kind is None:
        return None
    data = attribute.data
    values: NDArray[Any]
    if kind.dtype is None:
        values = np.array([item.value for item in data], dtype=object).reshape(size, 1)
    else:
        values = np.empty(size * kind.width, dtype=kind.dtype)
        data.foreach_get(kind.prop, values)
        values = values.reshape(size, kind.width)
    return Attribute(attribute.name, attribute.domain, attribute.data_type, values, kind.blends)


def write_attribute(mesh: bpy.types.Mesh, attribute: Attribute) -> None:
    """Create the attribute, or fill the one of that name that the mesh already has."""
    kind = TYPES[attribute.data_type]
    if attribute.name not in mesh.attributes:
        mesh.attributes.new(attribute.name, attribute.data_type, attribute.domain)  # type: ignore[arg-type]
    # Fetched by name: new() moves the others in memory.
    target: Any = mesh.attributes[attribute.name]
    if target.data_type != attribute.data_type or target.domain != attribute.domain:
        raise RuntimeError(f"Blender made “{attribute.name}” another type than asked; this is a bug in antumbra")
    data = target.data
    if kind.dtype is None:
        for item, value in zip(data, attribute.values[:, 0], strict=True):
            item.value = value
    else:
        data.foreach_set(kind.prop, np.ascontiguousarray(attribute.values, dtype=kind.dtype).reshape(-1))
