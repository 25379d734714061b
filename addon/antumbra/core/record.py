# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene as plain arrays: everything a bake needs of it, free of Blender's pointers.

Blender's datablocks are named by their session_uid, which survives undo and renaming; a pointer would not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .lights import Floats

FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Attribute:
    """A named layer of a mesh."""

    name: str
    domain: str
    """POINT, EDGE, FACE or CORNER."""
    data_type: str
    """Blender's name, such as FLOAT2."""
    values: NDArray[Any]
    """(N, width), one row per element of the domain."""
    blends: bool
    """Whether values in between make sense; otherwise the nearest one is taken."""


@dataclass(slots=True)
class Surface:
    """An evaluated mesh as triangles: V vertices, T triangles, C corners, E edges, F faces."""

    positions: FloatArray
    """(V, 3) in object space."""
    triangles: IntArray
    """(T, 3) vertices."""
    triangle_corners: IntArray
    """(T, 3) corners of the face that the triangle is a part of."""
    triangle_faces: IntArray
    """(T,)"""
    triangle_edges: IntArray
    """(T, 3) the mesh edge from corner k to k+1, or -1 inside a face."""
    face_materials: IntArray
    """(F,) material slots."""
    corner_normals: FloatArray | None
    """(C, 3) shading normals in object space; None when every face is flat."""
    has_custom_normals: bool
    attributes: list[Attribute] | None = None
    """What a baked mesh has to carry on; None until a receiver asks for it."""
    active_uv: str = ""
    active_render_uv: str = ""
    active_render_colour: str = ""
    texture_space: tuple[tuple[float, ...], tuple[float, ...]] = ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    """Location and size of the box in which generated texture coordinates run from 0 to 1."""


@dataclass(frozen=True, slots=True)
class Material:
    """A matte surface."""

    name: str
    reflectance_rgb: tuple[float, float, float]
    exitance_rgb: tuple[float, float, float]
    """pi·L in W/m², on both sides."""
    transmittance_rgb: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Share of light that goes on straight behind it."""


@dataclass(frozen=True, slots=True)
class ObjectRecord:
    """One mesh in the world: an object, or one instance of one."""

    name: str
    """Of the object that owns the mesh."""
    owner_uid: int
    """session_uid of the object in the scene: the mesh's own, or the one that makes the instance."""
    is_instance: bool
    surface: Surface
    world_from_object: Floats
    """(4, 4)"""
    slot_materials: tuple[int, ...]
    """Per material slot: index into SceneRecord.materials; never empty."""
    slot_uids: tuple[int | None, ...]
    """Per material slot: session_uid of its material; empty when the mesh has no slots."""
    receives: bool
    blocks: bool = True
    """Whether light stops at it, where its materials do not let it through."""
    sends: bool = True
    """Whether others get light from it."""
    face_materials: IntArray | None = None
    """(F,) index into SceneRecord.materials per face, where these tell more than the slots."""
    varying_faces: NDArray[np.bool_] | None = None
    """(F,) whether colours vary over the face, whose material is their mean; None where none do."""

    def triangle_materials(self) -> IntArray:
        """(T,) indices into SceneRecord.materials."""
        if self.face_materials is not None:
            return self.face_materials[self.surface.triangle_faces]
        slots = np.clip(self.surface.face_materials, 0, len(self.slot_materials) - 1)
        materials = np.asarray(self.slot_materials, dtype=np.int32)
        return np.asarray(materials[slots][self.surface.triangle_faces], dtype=np.int32)


@dataclass(frozen=True, slots=True)
class Linked:
    """Objects that are linked to a light: some of the scene, or all but some."""

    uids: frozenset[int]
    """session_uids of objects, which stand for their instances."""
    all_but: bool

    def among(self, objects: list[ObjectRecord]) -> list[int]:
        """Their places in the list."""
        return [index for index, each in enumerate(objects) if (each.owner_uid in self.uids) != self.all_but]


@dataclass(frozen=True, slots=True)
class Links:
    """What a light has to do with; None stands for everything."""

    lit: Linked | None = None
    blocking: Linked | None = None


@dataclass(frozen=True, slots=True)
class AreaLight:
    """A flat light that shines to one side and does not block."""

    name: str
    outline_world: Floats
    """(K, 3), convex, counter-clockwise seen from the lit side."""
    exitance_rgb: tuple[float, float, float]
    spread: float = math.pi
    """The full angle that its light is kept to, radians."""
    casts_shadows: bool = True
    links: Links = Links()


@dataclass(frozen=True, slots=True)
class Sun:
    """Light from far away."""

    name: str
    towards: tuple[float, float, float]
    angle: float
    """Diameter of its disc, radians."""
    irradiance_rgb: tuple[float, float, float]
    """W/m² on what faces it."""
    casts_shadows: bool
    links: Links = Links()


@dataclass(frozen=True, slots=True)
class Cone:
    """What a spot light keeps of a point's light."""

    cone_from_world: Floats
    """(3, 3), into a space where the cone is round about +z."""
    angle: float
    """Full angle, radians."""
    blend: float
    """Share of it, 0 to 1, over which it fades."""


@dataclass(frozen=True, slots=True)
class PointLight:
    """Light from a point or from something round; with a cone, a spot light."""

    name: str
    position: tuple[float, float, float]
    radius_m: float
    faces_receiver: bool
    """A disc that turns to its receiver (soft falloff), otherwise a sphere."""
    intensity_rgb: tuple[float, float, float]
    """W/sr."""
    casts_shadows: bool
    cone: Cone | None = None
    links: Links = Links()


@dataclass(frozen=True, slots=True)
class Sky:
    """Light from all around."""

    name: str
    exitance_rgb: Floats
    """(6, N, N, 3), pi times the radiance, on the faces of a cube as the solver orders them."""


@dataclass(slots=True)
class SceneRecord:
    """What was read: objects in the order in which the solver numbers them."""

    objects: list[ObjectRecord] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    lights: list[AreaLight | Sun | PointLight] = field(default_factory=list)
    sky: Sky | None = None
    lights_left_out: dict[str, list[str]] = field(default_factory=dict)
    """Names by the reason why they were left out."""
    warnings: list[str] = field(default_factory=list)

    def lights_left_out_sentences(self) -> list[str]:
        """One sentence per reason, naming the lights."""
        return [f"{reason}: {name_list(names)}" for reason, names in self.lights_left_out.items()]

    def all_warnings(self) -> list[str]:
        """One sentence each."""
        return self.warnings + self.lights_left_out_sentences()


def name_list(names: list[str], most: int = 5) -> str:
    """“A”, “B” and 3 more."""
    shown = ", ".join(f"“{name}”" for name in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
