# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface in other languages."""

import ast
from pathlib import Path

import bpy
import pytest
from extension import module
from test_faults import STAGES

FOLDER = Path(module("registration").__file__).parent


def texts_of_the_source():
    """Every text in the extension's source, where labels come from."""
    files = [path for path in FOLDER.rglob("*.py") if path.name != "german.py"]
    nodes = [node for path in files for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    return {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}


def texts_of_properties(struct):
    """Names and tooltips of the properties that we added to a struct."""
    theirs = {*bpy.types.Operator.bl_rna.properties.keys(), *bpy.types.PropertyGroup.bl_rna.properties.keys()}
    for prop in struct.bl_rna.properties:
        if prop.identifier in theirs:
            continue
        yield prop.name
        yield prop.description
        for item in getattr(prop, "enum_items_static", ()):
            yield item.name
            yield item.description


def texts_of_the_interface():
    """Whatever somebody may read in buttons, panels, menus, tooltips, progress and legends."""
    scene = bpy.context.scene
    probe = bpy.data.objects.new("Probe", None)
    for group in (scene.antumbra, scene.antumbra_view, probe.antumbra_part):
        yield from texts_of_properties(group)
    for cls in module("operators").CLASSES:
        yield cls.bl_label
        yield cls.__doc__
        yield from texts_of_properties(cls)
    for cls in (
        *module("ui.panel").CLASSES,
        *module("ui.view_panel").CLASSES,
        module("ui.object_panel").ANTUMBRA_PT_object,
    ):
        yield cls.bl_label
    for preset in module("core.presets").PRESETS.values():
        yield preset.label
        yield preset.description
    yield from (
        "Custom",
        *(name for name, _ in module("ui.overlay").KINDS),
        "reading the scene",
        *STAGES,
        "welding",
        "done",
    )

    # What is written in place
    for path in (FOLDER / "ui").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            texts = [keyword.value for keyword in node.keywords if keyword.arg == "text"]
            if isinstance(node.func, ast.Name) and node.func.id == "translated":
                texts += node.args
            yield from (text.value for text in texts if isinstance(text, ast.Constant))
    for obstacle in ("switch to Object Mode", "wait for the render", "finish the current action"):
        yield f"To read the scene, {obstacle}"
        yield f"Light is ready: {obstacle}"
    curve = module("core.error_curve")
    yield from (curve.TIME.title, curve.VERIFIED, curve.ESTIMATED)
    # What is filled in elsewhere
    for name in ("core.report", "core.preflight", "bridge.outcome", "operators.bake"):
        source = Path(module(name).__file__).read_text(encoding="utf-8")
        calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
        named = [call for call in calls if isinstance(call.func, ast.Name) and call.func.id == "translated"]
        yield from (text.value for call in named for text in call.args if isinstance(text, ast.Constant))
    running = Path(module("bridge.running").__file__).read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(running)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "note_outcome":
            lines = [line for argument in node.args if isinstance(argument, ast.List) for line in argument.elts]
            yield from (line.value for line in lines if isinstance(line, ast.Constant))


@pytest.mark.parametrize("language", module("ui.translations").LANGUAGES)
def test_every_text_of_the_interface_is_there(language):
    texts = {text for text in texts_of_the_interface() if text}
    assert len(texts) > 150
    assert texts - set(module("ui.translations").LANGUAGES[language]) == set()


@pytest.mark.parametrize("language", module("ui.translations").LANGUAGES)
def test_no_translation_is_of_a_text_that_is_gone(language):
    known = texts_of_the_source() | set(texts_of_the_interface())
    assert set(module("ui.translations").LANGUAGES[language]) - known == set()


@pytest.mark.parametrize("language", module("ui.translations").LANGUAGES)
def test_what_is_filled_in_is_filled_in_there_too(language):
    for text, translation in module("ui.translations").LANGUAGES[language].items():
        assert text.count("{}") == translation.count("{}")
        assert translation.strip() == translation != ""
        assert not translation.endswith("."), "Blender adds it"


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
