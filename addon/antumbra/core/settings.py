# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of one bake: one table that the panel, the command line and the report all read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from .errors import SettingError


@dataclass(frozen=True, slots=True)
class Choice:
    """One value of a setting that is chosen from a list."""

    value: str
    label: str
    description: str


@dataclass(frozen=True, slots=True)
class Spec:
    """How a setting is shown and what it may be."""

    label: str
    description: str
    default: bool | int | float | str
    minimum: float = -math.inf
    maximum: float = math.inf
    subtype: str = "NONE"
    """Blender's subtype, which brings the unit."""
    choices: tuple[Choice, ...] = ()


# The largest value of Blender's integer properties.
_INT_MAX = 2**31 - 1

SPECS: Mapping[str, Spec] = {
    "method": Spec(
        "Method",
        "How the mesh is refined",
        "ADM",
        choices=(
            Choice(
                "ADM",
                "Shadow Boundaries",
                "Cut faces along the shadow boundaries that can be noticed, then refine them where the light changes: "
                "sharp shadows from few triangles",
            ),
            Choice(
                "DM",
                "All Shadow Boundaries",
                "Cut faces along every shadow boundary of every light and every lit surface, noticeable or not: for "
                "comparison, with many more triangles",
            ),
            Choice(
                "AS",
                "Adaptive",
                "Subdivide faces where the light on them changes: regular triangles, and many of them at sharp shadows",
            ),
            Choice("UNIFORM", "Uniform", "Cut every face to the same size: predictable, but wasteful"),
        ),
    ),
    "tolerance": Spec(
        "Tolerance",
        "Wanted error of the light, as a share of the scene's mean light: 0.01 is 1 %. Half of it takes about "
        "twice the triangles and the time",
        0.01,
        minimum=1e-6,
        maximum=1.0,
    ),
    "element_size": Spec(
        "Element Size",
        "Longest edge before the light refines anything, in metres. 0 chooses it from the scene",
        0.0,
        minimum=0.0,
        subtype="DISTANCE",
    ),
    "max_level": Spec(
        "Max Level",
        "How many times a face may be halved where the light changes. One more makes four times the triangles there",
        8,
        minimum=0,
        maximum=16,
    ),
    "max_blockers": Spec(
        "Max Blockers",
        "A piece of surface with more shadow casters than this towards one light is subdivided before its shadow "
        "boundaries are drawn",
        4,
        minimum=0,
        maximum=_INT_MAX,
    ),
    "time_limit": Spec(
        "Time Limit",
        "Finish with the light found so far after this many seconds. 0 sets no limit",
        0.0,
        minimum=0.0,
        subtype="TIME_ABSOLUTE",
    ),
    "triangle_budget": Spec(
        "Max Triangles",
        "Stop refining at this many triangles in all baked meshes. 0 leaves the limit to the solver",
        0,
        minimum=0,
        maximum=_INT_MAX,
    ),
    "verify_points": Spec(
        "Verify Points",
        "At how many random points the result is compared with light along random paths, at most, to tell its error. "
        "More take longer; 0 tells none",
        1000,
        minimum=0,
        maximum=1_000_000,
    ),
    "transport": Spec(
        "Transport",
        "How surfaces exchange light",
        "AUTO",
        choices=(
            Choice("AUTO", "Automatic", "Choose from the size of the scene; the report says which it was"),
            Choice(
                "HIERARCHICAL",
                "Hierarchical",
                "Link surfaces as coarsely as the tolerance allows and solve for all bounces at once: also for nearly "
                "white rooms",
            ),
            Choice("RAYS", "Rays", "Let every surface look around along rays: for scenes of very many faces"),
            Choice("SHOOTING", "Shooting", "Let one patch after the other shoot its light"),
        ),
    ),
    "receivers": Spec(
        "Bake",
        "Which objects get baked. All objects that are visible in renders cast shadows and reflect light",
        "SELECTED",
        choices=(
            Choice("SELECTED", "Selected Objects", "Bake the selected mesh objects"),
            Choice("ALL", "All Objects", "Bake every mesh object that is visible in renders"),
        ),
    ),
    "output": Spec(
        "Output",
        "Where the refined meshes go",
        "NEW",
        choices=(
            Choice("NEW", "New Objects", 'Make new objects in the collection "Antumbra" and hide the originals'),
            Choice("REPLACE", "Replace Meshes", "Give the objects the refined meshes; Remove Bake brings theirs back"),
        ),
    ),
    "quantity": Spec(
        "Quantity",
        "What the colour attribute holds",
        "RADIOSITY",
        choices=(
            Choice("RADIOSITY", "Light and Colour", "What the surface sends out, its emission included"),
            Choice("IRRADIANCE", "Light Only", "What a white surface would send out: for use over textures"),
        ),
    ),
    "metals": Spec(
        "Metals",
        "What becomes of metals, which reflect no diffuse light",
        "MATTE",
        choices=(
            Choice("MATTE", "Matte", "A metal reflects its base colour like paint"),
            Choice("BLACK", "Black", "A metal reflects no diffuse light, as in the diffuse pass of Cycles"),
        ),
    ),
    "layers": Spec(
        "Layers",
        "Which colour attributes are written",
        "TOTAL",
        choices=(
            Choice("TOTAL", "All Light", "One colour attribute with all light"),
            Choice(
                "SEPARATE",
                "Direct and Indirect Too",
                "Two more colour attributes, whose sum is the first: light from emitters, and light that surfaces "
                "reflected before",
            ),
        ),
    ),
    "data_type": Spec(
        "Data Type",
        "How colours are stored",
        "FLOAT_COLOR",
        choices=(
            Choice("FLOAT_COLOR", "Float", "As exact and as bright as they are"),
            Choice(
                "BYTE_COLOR",
                "Byte",
                "In a quarter of the memory: 8 bits a channel with the steps of sRGB, and brighter than 1 becomes 1",
            ),
        ),
    ),
    "domain": Spec(
        "Domain",
        "Where colours are stored",
        "CORNER",
        choices=(
            Choice("CORNER", "Face Corner", "One for each corner of each face: light may jump at edges and contacts"),
            Choice(
                "POINT",
                "Vertex",
                "One for each vertex, the mean of its corners: for programs that know no others. Light runs across "
                "sharp edges and under what touches a surface",
            ),
        ),
    ),
    "colour_steps": Spec(
        "Colour Steps",
        "Round each channel to this many steps as the eye sees them; brighter than 1 becomes 1. 0 keeps colours smooth",
        0,
        minimum=0,
        maximum=256,
    ),
}


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of one bake; the names are those of `scene.antumbra` and of `--set NAME=VALUE`."""

    method: str = "ADM"
    tolerance: float = 0.01
    element_size: float = 0.0
    max_level: int = 8
    max_blockers: int = 4
    time_limit: float = 0.0
    triangle_budget: int = 0
    verify_points: int = 1000
    transport: str = "AUTO"
    receivers: str = "SELECTED"
    output: str = "NEW"
    quantity: str = "RADIOSITY"
    metals: str = "MATTE"
    layers: str = "TOTAL"
    data_type: str = "FLOAT_COLOR"
    domain: str = "CORNER"
    colour_steps: int = 0

    def validate(self) -> None:
        """Raise SettingError for the first value out of its range."""
        for name, value in asdict(self).items():
            spec = SPECS[name]
            if spec.choices:
                allowed = [choice.value for choice in spec.choices]
                if value not in allowed:
                    raise SettingError(f"setting {name} = {value}: must be one of {', '.join(allowed)}")
            elif not (math.isfinite(value) and spec.minimum <= value <= spec.maximum):
                raise SettingError(f"setting {name} = {value}: must be {range_text(spec)}")

    def as_dict(self) -> dict[str, Any]:
        """Name to value, in the order of the fields."""
        return asdict(self)


def parse_assignments(assignments: Iterable[str]) -> dict[str, Any]:
    """Turn `NAME=VALUE` texts into typed values by name; the last one of a name wins."""
    return dict(_parse_assignment(text) for text in assignments)


def _parse_assignment(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    name, value = name.strip(), value.strip()
    if not equals:
        raise SettingError(f"“{text}” is not of the form NAME=VALUE")
    kinds = {field.name: type(SPECS[field.name].default) for field in fields(Settings)}
    if name not in kinds:
        raise SettingError(f"there is no setting “{name}”; the settings are {', '.join(kinds)}")
    try:
        return name, value.upper() if kinds[name] is str else kinds[name](value)
    except ValueError:
        wanted = "a whole number" if kinds[name] is int else "a number"
        raise SettingError(f"setting {name} = {value}: must be {wanted}") from None


def range_text(spec: Spec) -> str:
    """The range of a number, for people."""
    if spec.maximum == math.inf:
        return f"a number of at least {spec.minimum:g}"
    return f"between {spec.minimum:g} and {spec.maximum:g}"
