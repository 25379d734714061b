# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a user meets Antumbra: the panels, the Object menu and the status bar."""

from . import curve, keys, menu, object_panel, overlay, panel, status_bar, translations, view_panel


def register() -> None:
    translations.register()
    panel.register()
    view_panel.register()
    object_panel.register()
    menu.register()
    status_bar.register()
    overlay.register()
    curve.register()
    keys.register()


def unregister() -> None:
    keys.unregister()
    curve.unregister()
    overlay.unregister()
    status_bar.unregister()
    menu.unregister()
    object_panel.unregister()
    view_panel.unregister()
    panel.unregister()
    translations.unregister()
