# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a user meets Antumbra: the panel, the Object menu and the status bar."""

from . import menu, panel, status_bar


def register() -> None:
    panel.register()
    menu.register()
    status_bar.register()


def unregister() -> None:
    status_bar.unregister()
    menu.unregister()
    panel.unregister()
