# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface in other languages: a table by language, which Blender asks for every label and tooltip.

A text that is missing in a table stays English, as warnings do, which are made of names and numbers. Another language
is another table of the same texts.
"""

from __future__ import annotations

from collections.abc import Mapping

import bpy

from . import german

LANGUAGES: Mapping[str, Mapping[str, str]] = {"de_DE": german.TEXTS}

# Labels of buttons are asked for as operators', all others without a context.
_CONTEXTS = ("*", "Operator")


def register() -> None:
    table = {
        language: {(context, text): translated for text, translated in texts.items() for context in _CONTEXTS}
        for language, texts in LANGUAGES.items()
    }
    bpy.app.translations.register(__package__, table)


def unregister() -> None:
    bpy.app.translations.unregister(__package__)
