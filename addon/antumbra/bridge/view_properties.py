# SPDX-License-Identifier: GPL-3.0-or-later
"""`scene.antumbra_view`: how bakes are looked at. Nothing of it changes a bake."""
# mypy: disable-error-code="valid-type"

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, PointerProperty
from bpy.types import PropertyGroup

from .redraw import redraw_viewports


def _show(_group: Any, context: bpy.types.Context) -> None:
    # The module that does it reads these properties.
    from .view import show

    if context.scene is not None:
        show(context.scene)


def _redraw(_group: Any, _context: bpy.types.Context) -> None:
    # A click draws everything anew; a script that sets a property does not.
    redraw_viewports()


class AntumbraView(PropertyGroup):
    """How the bakes of a scene are shown in its viewports."""

    mode: EnumProperty(
        name="Show",
        description="What the viewport shows of baked light where it shows attributes: Solid shading, Attribute colour",
        items=[
            ("STORED", "Stored Light", "The light as it is stored; brighter than 1 looks like 1"),
            ("EXPOSED", "Exposed", "The light times a preview exposure, for rooms that are too dark or too bright"),
            ("FALSE_COLOURS", "False Colours", "Illuminance in lux, or luminance in cd/m², with a legend"),
            (
                "ERROR",
                "Error",
                "How far the light is off by the solver's own estimate, in % of its mean, with a legend",
            ),
        ],
        update=_show,
    )
    exposure: FloatProperty(
        name="Exposure",
        description="Stops by which the preview is brighter: each doubles the light. The stored light stays as it is",
        default=0.0,
        soft_min=-10.0,
        soft_max=10.0,
        step=10,
        update=_show,
    )
    range_end: FloatProperty(
        name="Range",
        description="Light that has the last of the false colours, in lx or cd/m². 0 chooses it from the light",
        default=0.0,
        min=0.0,
        soft_max=10_000.0,
        update=_show,
    )
    overlay: EnumProperty(
        name="Overlay",
        description="What is drawn over baked meshes in the viewport",
        items=[
            ("NONE", "None", "Nothing"),
            (
                "LINES",
                "Shadow Lines",
                "The edges that lie on shadow boundaries and contacts, each kind in its colour",
            ),
            ("ELEMENTS", "Elements", "Every edge of the mesh, those on lines in their colours"),
        ],
        update=_redraw,
    )
    live_preview: BoolProperty(
        name="Live Preview",
        description="While a bake runs, draw its mesh and light over the originals in the viewport after each stage",
        default=True,
        update=_redraw,
    )
    error_curve: BoolProperty(
        name="Error Curve",
        description="Draw into the viewport's corner how the error of the last bake fell with the seconds that it took",
        default=False,
        update=_redraw,
    )


def register() -> None:
    bpy.utils.register_class(AntumbraView)
    bpy.types.Scene.antumbra_view = PointerProperty(type=AntumbraView)  # type: ignore[attr-defined]


def unregister() -> None:
    del bpy.types.Scene.antumbra_view  # type: ignore[attr-defined]
    bpy.utils.unregister_class(AntumbraView)


def view_of(scene: bpy.types.Scene) -> Any:
    """The scene's AntumbraView."""
    return scene.antumbra_view  # type: ignore[attr-defined]
