# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a user meets Antumbra: the panels, the Object menu and the status bar."""

from . import menu, object_panel, overlay, panel, status_bar, view_panel


def register() -> None:
    panel.register()
    view_panel.register()
    object_panel.register()
    menu.register()
    status_bar.register()
    overlay.register()


def unregister() -> None:
    overlay.unregister()
    status_bar.unregister()
    menu.unregister()
    object_panel.unregister()
    view_panel.unregister()
    panel.unregister()
