# SPDX-License-Identifier: GPL-3.0-or-later
"""Antumbra: radiosity baked into vertex colours on a mesh that is refined where the light needs it.

The rooms of this house, each importing only from those before it:

    core        what happens: settings, formulas, interpolation, the course of a bake; numpy only, no bpy
    bridge      Blender's data <-> core's arrays
    operators   buttons that gather, start and report
    ui          panels, menus, progress
    cli         the same bake from the command line
"""


def register() -> None:
    # Imported here so that antumbra.core loads in a Python without Blender.
    from . import registration

    registration.register()


def unregister() -> None:
    from . import registration

    registration.unregister()
