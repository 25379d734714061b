# SPDX-License-Identifier: GPL-3.0-or-later
"""The modules of the installed extension, by their names inside it."""

import importlib

from conftest import EXTENSION


def module(name):
    return importlib.import_module(f"{EXTENSION}.{name}")


def read_scene(**settings):
    """What a bake of the open scene would read."""
    import bpy

    chosen = module("core.settings").Settings(**{"receivers": "ALL", **settings})
    return module("bridge.scene_read").read_scene(bpy.context, chosen)


def last_warnings():
    """The lines that the last bake of this session left in the panel, without its size and its error."""
    lines = module("bridge.outcome").last_outcome.lines[1:]
    return [line for line in lines if not line.startswith(("Verified error", "Estimated error"))]
