# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of its own in which Cycles looks at the samples of surfaces.

Each object that Cycles bakes costs it some hundredths of a second, so surfaces whose colours do not depend on the
object sit on one bench: one mesh that holds the samples of all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ..core.carry import carry_attribute, carry_normals
from ..core.face_samples import Samples
from ..core.lights import Floats
from ..core.pieces import GO_ON, Pieces
from ..core.record import Attribute, IntArray, Surface
from .attribute_types import write_attribute
from .mesh_write import activate_uv_maps, write_faces, write_normals
from .neutral_material import GENERATED, OBJECT, PLACED, NeutralMaterials, attributes_of, may_emit
from .temporary import marked, remove

_NAME = "Antumbra Pass"

_MAPS = frozenset({"FLOAT2", "FLOAT_COLOR", "BYTE_COLOR"})
"""Types of attributes that materials find without naming them."""

# Surfaces that sit in each other: every ray that starts on one meets all of them, so that a thousand of them take
# several times as long as apart; few share what an object costs. By 16, by 48 and by 128, 300 cubes with a noise take
# 1.9 and 1.6 s (all 300 as one: 6 s) and 2,000 take 6.5, 5.0 and 4.5 s.
_NEIGHBOURS = 48

# Material slots that a mesh can have: each surface brings some.
_MOST_ON_BENCH = 2_000

Colours = NDArray[np.float32]
"""(N, 7) per sample: diffuse colour, opacity, emission."""


@dataclass(slots=True)
class Sitter:
    """A surface with its materials that is looked at once, for one record or for many instances."""

    surface: Surface
    world_from_object: Floats
    materials: list[Any]
    """Per slot, Blender's own, where its faces are looked at; else None."""
    slot_materials: tuple[int, ...]
    """Per slot, the number in SceneRecord.materials."""
    wanted: NDArray[np.bool_]
    """Per slot: whether its faces are looked at."""
    depends_on: set[str]
    """Which of GENERATED, OBJECT and PLACED its colours may depend on."""
    number: int
    records: list[int] = field(default_factory=list)

    def slots(self) -> IntArray:
        """(F,) slot of each face."""
        return slots_of_faces(self.surface, len(self.slot_materials))

    @property
    def bench(self) -> object:
        """Sitters with the same can be looked at as one mesh."""
        if PLACED in self.depends_on or {GENERATED, OBJECT} <= self.depends_on:
            return self.number
        layers = tuple(sorted((layer.name, layer.domain, layer.data_type) for layer in self.layers()))
        surface = self.surface
        names = (surface.active_uv, surface.active_render_uv, surface.active_render_colour)
        return (layers, names, surface.corner_normals is None, tuple(self.depends_on))

    @property
    def sits_alone(self) -> bool:
        return isinstance(self.bench, int)

    @property
    def neighbours(self) -> int:
        """How many may share its bench: many where they can sit apart, few where all must sit in the same place."""
        return _NEIGHBOURS if self.depends_on else _MOST_ON_BENCH

    def layers(self) -> list[Attribute]:
        """The attributes that its materials may ask for."""
        named = set().union(*(attributes_of(material) for material in self.materials if material is not None))
        return [
            attribute
            for attribute in self.surface.attributes or []
            if attribute.domain != "EDGE" and (attribute.data_type in _MAPS or attribute.name in named)
        ]


Seated = tuple[Sitter, Samples]


def slots_of_faces(surface: Surface, slots: int) -> IntArray:
    """(F,) slot of each face; what is out of range takes the last one, as in Blender."""
    return np.asarray(np.clip(surface.face_materials, 0, slots - 1), dtype=np.int32)


@dataclass(eq=False, slots=True)
class _Bench:
    """A place for sitters that can be looked at as one mesh."""

    first: Sitter
    """One of them: what it has in common with the others is asked of it."""
    materials: list[Any]
    """By slot."""
    slots: dict[int, int]
    """By the materials' session_uid."""
    neutral: Any
    """The object whose diffuse colour is looked at."""
    glowing: Any | None
    """The one whose emission is looked at, where there may be any."""

    def slot(self, material: Any) -> int:
        """The slot of a material; any one for faces without, at which nobody looks."""
        return 0 if material is None else self.slots[material.session_uid]


class Studio:
    """The scene, to be removed with everything in it when all is seen.

    It is furnished before anything is looked at, since a new object or a material in a slot makes Blender go through
    the relations of all objects of the user's scene too. What is looked at changes meshes only.
    """

    def __init__(self, neutral: NeutralMaterials) -> None:
        self._neutral = neutral
        self._benches: list[_Bench] = []
        self._datablocks: list[Any] = []
        self._taken = 0.0
        self._scene: Any = marked(bpy.data.scenes.new(_NAME))
        self._datablocks.append(self._scene)
        scene = self._scene
        # One sample on the processor: a colour has no noise, and a card would take longer to get ready.
        scene.render.engine = "CYCLES"
        scene.cycles.samples = 1
        scene.cycles.device = "CPU"

    def remove(self) -> None:
        remove(self._datablocks)

    def furnish(self, sitters: list[Sitter]) -> None:
        """Make a bench for these, with a slot for each material, whichever sitter's it is."""
        by_uid = {m.session_uid: m for sitter in sitters for m in sitter.materials if m is not None}
        materials = list(by_uid.values())
        glows = any(map(may_emit, materials))
        self._benches.append(
            _Bench(
                first=sitters[0],
                materials=materials,
                slots={uid: slot for slot, uid in enumerate(by_uid)},
                neutral=self._object([self._neutral.of(material) for material in materials]),
                glowing=self._object(materials) if glows else None,
            )
        )

    def _object(self, materials: list[Any]) -> Any:
        mesh: Any = marked(bpy.data.meshes.new(_NAME))
        self._datablocks.append(mesh)
        obj: Any = marked(bpy.data.objects.new(_NAME, mesh))
        self._datablocks.append(obj)
        for material in materials:
            mesh.materials.append(material)
        self._scene.collection.objects.link(obj)
        return obj

    def look(self, parts: list[tuple[int, list[Seated]]]) -> Pieces[list[list[Colours]]]:
        """What Cycles sees of sitters on some of the benches, by the benches' numbers: of each at its samples."""
        on = [(self._benches[number], seated) for number, seated in parts]
        # Diffuse colour and opacity, without gloss
        diffuse = self._look([(bench, bench.neutral, seated) for bench, seated in on], "DIFFUSE", {"COLOR"})

        # Emission, of the materials as they are
        glowing = [(bench, bench.glowing, seated) for bench, seated in on if bench.glowing is not None]
        if glowing:
            yield GO_ON
        emitted = dict(
            zip(map(id, (bench for bench, _, _ in glowing)), self._look(glowing, "EMIT", set()), strict=True)
        )
        together = []
        for (bench, seated), colour in zip(on, diffuse, strict=True):
            light = emitted[id(bench)][:, :3] if id(bench) in emitted else np.zeros_like(colour[:, :3])
            found = np.concatenate([colour, light], axis=1)
            ends = np.cumsum([len(samples.positions) for _, samples in seated])
            together.append(np.split(found, ends[:-1]))
        return together

    def _look(self, seated: list[tuple[_Bench, Any, list[Seated]]], kind: str, parts: set[str]) -> list[Colours]:
        """One pass at all samples of each bench."""
        if not seated:
            return []
        self._taken = 0.0
        for bench, obj, sitters in seated:
            self._seat(bench, obj, sitters)
        self._bake([obj for _, obj, _ in seated], kind, parts)
        colours = [_colours(obj) for _, obj, _ in seated]
        for _, obj, _ in seated:
            # What others sit on is not in sight
            obj.data.clear_geometry()
        return colours

    def _seat(self, bench: _Bench, obj: Any, seated: list[Seated]) -> None:
        """Make the bench's mesh that of the samples."""
        mesh, first = obj.data, bench.first
        positions = [_places(*each) for each in seated]
        if not first.depends_on:
            positions = _side_by_side(positions)
        write_faces(mesh, np.concatenate(positions), _joined_triangles(seated))
        slots = []
        for sitter, samples in seated:
            of_sitter = np.array([bench.slot(material) for material in sitter.materials], dtype=np.int32)
            slots.append(of_sitter[sitter.slots()[sitter.surface.triangle_faces[samples.source_triangle]]])
        mesh.polygons.foreach_set("material_index", np.concatenate(slots))

        # What materials may ask for
        for layer in first.layers():
            write_attribute(mesh, _joined_layer(layer, seated))
        activate_uv_maps(mesh, first.surface)
        mesh.color_attributes.new(_NAME, "FLOAT_COLOR", "CORNER")
        mesh.color_attributes.active_color_name = _NAME
        if first.surface.active_render_colour in mesh.color_attributes:
            mesh.color_attributes.render_color_index = mesh.color_attributes.find(first.surface.active_render_colour)
        normals = [carry_normals(sitter.surface, samples) for sitter, samples in seated]
        if all(each is not None for each in normals):
            write_normals(mesh, np.concatenate([each for each in normals if each is not None]))
        mesh.use_auto_texspace = False
        if first.sits_alone:
            mesh.texspace_location, mesh.texspace_size = first.surface.texture_space
            obj.matrix_world = Matrix(first.world_from_object.tolist())
        else:
            mesh.texspace_location, mesh.texspace_size = (0.5,) * 3, (0.5,) * 3
            # Benches stand apart: colours here know nothing of the world.
            width = max(float(np.ptp(each[:, 0])) for each in positions)
            self._taken += 2.0 * width
            obj.location.x = self._taken
        mesh.update()

    def _bake(self, objects: list[Any], kind: str, parts: set[str]) -> None:
        """Let Cycles write one pass into the objects' colours."""
        override: dict[str, Any] = {
            "scene": self._scene,
            "view_layer": self._scene.view_layers[0],
            "active_object": objects[0],
            "object": objects[0],
            "selected_objects": objects,
            "selected_editable_objects": objects,
        }
        with bpy.context.temp_override(**override):
            bpy.ops.object.bake(
                type=kind,  # type: ignore[arg-type]
                pass_filter=parts,  # type: ignore[arg-type]
                target="VERTEX_COLORS",
                use_selected_to_active=False,
                use_clear=False,
                use_cage=False,
                save_mode="INTERNAL",
            )


def _places(sitter: Sitter, samples: Samples) -> Floats:
    """Where the samples stand: within the object's box where colours depend on that, else in the object's space."""
    if sitter.sits_alone or GENERATED not in sitter.depends_on:
        return samples.positions
    location, size = (np.asarray(each, dtype=np.float64) for each in sitter.surface.texture_space)
    return np.asarray((samples.positions - location) / (2.0 * size) + 0.5)


def _side_by_side(places: list[Floats]) -> list[Floats]:
    """The same one after the other along x."""
    moved, taken = [], 0.0
    for each in places:
        low, high = each[:, 0].min(), each[:, 0].max()
        moved.append(each + (taken - low, 0.0, 0.0))
        taken += 1.5 * (high - low)
    return moved


def _joined_triangles(seated: list[Seated]) -> IntArray:
    count = sum(len(samples.triangles) for _, samples in seated)
    # Every triangle has corners of its own.
    return np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def _joined_layer(layer: Attribute, seated: list[Seated]) -> Attribute:
    values = []
    for sitter, samples in seated:
        (own,) = (each for each in sitter.layers() if each.name == layer.name)
        values.append(carry_attribute(own, sitter.surface, samples).values)
    return Attribute(layer.name, layer.domain, layer.data_type, np.concatenate(values), layer.blends)


def _colours(obj: Any) -> NDArray[np.float32]:
    """(N, 4) what the last pass wrote."""
    data = obj.data.attributes[_NAME].data
    values = np.empty(len(data) * 4, dtype=np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)
