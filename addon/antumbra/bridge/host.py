# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as core.bake's Host."""

from __future__ import annotations

import bpy

from ..core.bake import Bake, Solution
from ..core.record import SceneRecord
from ..core.settings import Settings
from . import solver
from .scene_read import read_scene
from .scene_write import write_solution
from .textures import show_textures


class BlenderHost:
    """The scene of the current context; the context is asked anew by each verb, since a job outlives it."""

    def read(self, settings: Settings) -> SceneRecord:
        return read_scene(bpy.context, settings)

    def write(self, scene: SceneRecord, solution: Solution, settings: Settings) -> list[str]:
        warnings = show_textures(scene, solution, settings)
        return warnings + write_solution(bpy.context, scene, solution, settings)


def new_bake(settings: Settings) -> Bake:
    """A bake of the current scene by the native solver."""
    return Bake(BlenderHost(), solver.start, settings)
