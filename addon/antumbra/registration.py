# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that Blender is told about, in order; unregister() takes it back in the reverse order."""

from __future__ import annotations

from types import ModuleType

from . import cli, operators, ui
from .bridge import preflight, properties, running, temporary, view_properties

_ROOMS: tuple[ModuleType, ...] = (properties, view_properties, temporary, running, preflight, operators, ui, cli)


def register() -> None:
    for room in _ROOMS:
        room.register()


def unregister() -> None:
    for room in reversed(_ROOMS):
        room.unregister()
