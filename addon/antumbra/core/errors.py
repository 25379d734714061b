# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a bake was refused: each message is one line that a user can act on."""


class BakeError(Exception):
    """The bake cannot be done; nothing was changed."""


class SettingError(BakeError):
    """A setting is unknown or out of its range."""


class InputError(BakeError):
    """The scene, the selection or the mode does not allow a bake."""


class NoLightError(InputError):
    """Nothing that was read sends light."""


class MemoryShortageError(InputError):
    """There is less memory than the bake takes at least."""


class CancelledError(BakeError):
    """The user asked to cancel."""


class SolverBugError(BakeError):
    """The solver failed in a way it should not: a bug in Antumbra, not in the scene."""
