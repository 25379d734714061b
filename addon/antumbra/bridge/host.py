# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as core.bake's Host."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ..core.bake import Bake, Solution
from ..core.record import SceneRecord
from ..core.settings import Settings
from . import solver
from .scene_read import read_scene
from .scene_write import PreparedMeshes, write_solution


class BlenderHost:
    """The scene of the current context; the context is asked anew by each verb, since a job outlives it."""

    def __init__(self) -> None:
        self._prepared = PreparedMeshes()

    def read(self, settings: Settings) -> SceneRecord:
        return read_scene(bpy.context, settings)

    def prepare(self, scene: SceneRecord, solution: Solution, settings: Settings) -> Iterator[None]:
        return self._prepared.make(bpy.context, scene, solution, settings)

    def write(self, scene: SceneRecord, solution: Solution, settings: Settings) -> list[str]:
        return write_solution(bpy.context, scene, solution, settings, self._prepared)

    def discard(self) -> None:
        self._prepared.discard()


def new_bake(settings: Settings) -> Bake:
    """A bake of the current scene by the native solver."""
    return Bake(BlenderHost(), solver.start, settings)
