# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a user meets Antumbra: the panels, the Object menu and the status bar."""

from . import menu, object_panel, panel, status_bar


def register() -> None:
    panel.register()
    object_panel.register()
    menu.register()
    status_bar.register()


def unregister() -> None:
    status_bar.unregister()
    menu.unregister()
    object_panel.unregister()
    panel.unregister()
