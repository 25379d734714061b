# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene evaluated as for a render, without rendering.

Blender hands Python only the viewport's evaluated scene, which lacks what the viewport hides and has the viewport's
subdivision. Render engines get the other one, and Blender calls an engine's `bake` without needing a camera. So an
engine that only looks is registered for the length of one call.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..core.pieces import TURN, Pieces
from .originals import originals_shown
from .surroundings import scene_of
from .temporary import marked, remove

_ENGINE_ID = "ANTUMBRA_READER"

Visit = Callable[[bpy.types.Depsgraph, int], None]


def visit_render_depsgraph(context: bpy.types.Context, visit: Visit) -> Pieces[None]:
    """Call `visit(depsgraph, probe_uid)` once with the scene as evaluated for a render, earlier bakes taken back.

    The object with session_uid probe_uid is ours and to be ignored. What `visit` raises comes out here. Nothing of
    the depsgraph may be kept: it ends with the call. The scene is as before afterwards.

    The evaluation is one piece, however long Blender takes. An object that comes or goes makes Blender go through the
    relations of all objects once more, so these are pieces too.
    """
    # An object that Blender will agree to bake: a triangle without area, with a colour attribute.
    mesh = marked(bpy.data.meshes.new(_ENGINE_ID))
    mesh.from_pydata([(0.0, 0.0, 0.0)] * 3, [], [(0, 1, 2)])
    mesh.color_attributes.new("Color", "FLOAT_COLOR", "CORNER")
    probe = marked(bpy.data.objects.new(_ENGINE_ID, mesh))
    try:
        scene_of(context).collection.objects.link(probe)
        yield TURN
        _evaluate(context, probe, visit)
        yield TURN
    finally:
        remove([probe, mesh])
    yield TURN


def _evaluate(context: bpy.types.Context, probe: bpy.types.Object, visit: Visit) -> None:
    scene: Any = scene_of(context)
    probe_uid = probe.session_uid
    failure: list[BaseException] = []
    visited: list[bool] = []

    class Reader(bpy.types.RenderEngine):
        bl_idname = _ENGINE_ID
        bl_label = "Antumbra Reader"

        def bake(self, depsgraph: Any, obj: Any, pass_type: Any, pass_filter: Any, width: Any, height: Any) -> None:
            visited.append(True)
            try:
                visit(depsgraph, probe_uid)
            except BaseException as error:  # noqa: BLE001  Blender would print it and go on.
                failure.append(error)

    engine_before = scene.render.engine
    bpy.utils.register_class(Reader)
    try:
        scene.render.engine = _ENGINE_ID
        # Overriding the context leaves the user's own selection and active object alone.
        with (
            originals_shown(scene),
            context.temp_override(
                active_object=probe, object=probe, selected_objects=[probe], selected_editable_objects=[probe]
            ),
        ):
            bpy.ops.object.bake(
                type="COMBINED",
                target="VERTEX_COLORS",
                use_selected_to_active=False,
                use_clear=False,
                use_cage=False,
                save_mode="INTERNAL",
            )
    finally:
        scene.render.engine = engine_before
        bpy.utils.unregister_class(Reader)
    if failure:
        raise failure[0]
    if not visited:
        raise RuntimeError("Blender did not evaluate the scene; this is a bug in antumbra")
