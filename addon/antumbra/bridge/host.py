# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as core.bake's Host."""

from __future__ import annotations

import bpy

from ..core.bake import Bake, Solution
from ..core.pieces import GO_ON, Pieces, at_once
from ..core.record import SceneRecord
from ..core.settings import Settings
from . import solver
from .scene_read import reading
from .scene_write import PreparedMeshes, write_solution
from .textures import show_textures


class BlenderHost:
    """The scene of the current context; the context is asked anew by each verb, since a job outlives it."""

    def __init__(self) -> None:
        self._prepared = PreparedMeshes()
        self._texture_warnings: list[str] | None = None
        """Of the solution at hand, once its meshes show their textures."""
        self._textured: set[int] = set()

    def read(self, settings: Settings) -> Pieces[SceneRecord]:
        return reading(bpy.context, settings)

    def prepare(self, scene: SceneRecord, solution: Solution, settings: Settings) -> Pieces[None]:
        yield from self._show_textures(scene, solution, settings)
        yield from self._prepared.make(bpy.context, scene, solution, settings)

    def write(self, scene: SceneRecord, solution: Solution, settings: Settings) -> list[str]:
        warnings = at_once(self._show_textures(scene, solution, settings))
        self._texture_warnings = None
        return warnings + write_solution(bpy.context, scene, solution, settings, self._prepared)

    def discard(self) -> None:
        self._prepared.discard()

    def _show_textures(self, scene: SceneRecord, solution: Solution, settings: Settings) -> Pieces[list[str]]:
        if self._texture_warnings is None:
            self._texture_warnings = yield from show_textures(scene, solution, settings, self._textured)
            yield GO_ON
        return self._texture_warnings


def new_bake(settings: Settings) -> Bake:
    """A bake of the current scene by the native solver."""
    return Bake(BlenderHost(), solver.start, settings)
