# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface in other languages: a table by language, which Blender asks for every label and tooltip.

A text that is missing here stays English. Another language is another table of the same texts.
"""

from __future__ import annotations

from collections.abc import Mapping

import bpy

_GERMAN: Mapping[str, str] = {
    "Advanced": "Erweitert",
    "All Light": "Alles Licht",
    "All Objects": "Alle Objekte",
    "Bake Radiosity": "Radiosity backen",
    "Before the Bake": "Vor dem Backen",
    "Best": "Beste",
    "Check Scene": "Szene prüfen",
    "Colour Steps": "Farbstufen",
    "Data Type": "Datentyp",
    "Domain": "Domäne",
    "Draft": "Entwurf",
    "Elements": "Elemente",
    "Error": "Fehler",
    "Exposed": "Belichtet",
    "Exposure": "Belichtung",
    "Face Corner": "Flächenecke",
    "False Colours": "Falschfarben",
    "Game": "Spiel",
    "Good": "Gut",
    "Layers": "Ebenen",
    "Light Only": "Nur Licht",
    "Light and Colour": "Licht und Farbe",
    "Live Preview": "Live-Vorschau",
    "Make Export-Ready": "Für Export vorbereiten",
    "Max Triangles": "Höchstens Dreiecke",
    "Metals": "Metalle",
    "Method": "Methode",
    "New Objects": "Neue Objekte",
    "Output": "Ausgabe",
    "Preset": "Vorgabe",
    "Quality": "Qualität",
    "Quantity": "Größe",
    "Remove Bake": "Bake entfernen",
    "Replace Meshes": "Netze ersetzen",
    "Selected Objects": "Ausgewählte Objekte",
    "Shadow Lines": "Schattenlinien",
    "Show": "Zeigen",
    "Show in Viewport": "Im Ansichtsfenster zeigen",
    "Stored Light": "Gespeichertes Licht",
    "Time Limit": "Zeitgrenze",
    "Tolerance": "Toleranz",
    "Transport": "Transport",
    "View": "Ansicht",
}

LANGUAGES: Mapping[str, Mapping[str, str]] = {"de_DE": _GERMAN}

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
