# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface in other languages."""

import ast
from pathlib import Path

import bpy
import pytest
from extension import module


def texts_of_the_interface():
    """Every text in the extension's source, where labels come from."""
    folder = Path(module("registration").__file__).parent
    files = [path for path in folder.rglob("*.py") if path.name != "translations.py"]
    nodes = [node for path in files for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    return {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}


def test_no_translation_is_of_a_text_that_is_gone():
    texts = texts_of_the_interface()
    for language in module("ui.translations").LANGUAGES.values():
        assert set(language) - texts == set()


def test_blender_finds_them():
    view = bpy.context.preferences.view
    before = view.language
    try:
        view.language = "de_DE"
    except TypeError:
        pytest.skip("this Blender is built without languages")
    try:
        view.use_translate_interface = True
        assert bpy.app.translations.pgettext_iface("Tolerance") == "Toleranz"
        assert bpy.app.translations.pgettext_iface("Bake Radiosity", "Operator") == "Radiosity backen"
    finally:
        view.language = before
