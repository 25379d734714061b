# SPDX-License-Identifier: GPL-3.0-or-later
"""What overlays are drawn with exists in this Blender. Without a window nothing is drawn; tests/window looks."""

import ast
from pathlib import Path

import blf
import gpu
import pytest
from extension import module

SOURCES = [
    Path(module("registration").__file__).parent / "ui" / f"{name}.py" for name in ("drawing", "overlay", "curve")
]


def calls():
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                yield ast.unparse(node.func), node.args


def test_every_shader_is_one_of_blenders_own():
    names = {args[0].value for function, args in calls() if function == "gpu.shader.from_builtin"}
    assert {"UNIFORM_COLOR", "SMOOTH_COLOR", "POLYLINE_FLAT_COLOR"} <= names
    # Blender lists them in its documentation, with what each wants to be told.
    known = gpu.shader.__doc__
    assert [name for name in names if f"``{name}``" not in known] == []
    for name in names:
        described = known.split(f"``{name}``")[1].split("``")[0]
        assert "vec3 pos" in described
        assert ("vec4 color" in described.split("Uniforms")[0]) == ("UNIFORM" not in name)
        assert ("viewportSize" in described and "lineWidth" in described) == name.startswith("POLYLINE")


@pytest.mark.parametrize("library", [gpu, blf])
def test_every_function_is_there(library):
    name = library.__name__
    called = {function for function, _ in calls() if function.startswith(f"{name}.")}
    assert len(called) > 3
    for function in called:
        found = library
        for part in function.split(".")[1:]:
            found = getattr(found, part)
        assert callable(found)


def test_blend_and_depth_modes_are_known():
    modes = {(function, args[0].value) for function, args in calls() if function.startswith("gpu.state.") and args}
    modes = {(function, mode) for function, mode in modes if isinstance(mode, str)}
    assert len(modes) >= 3
    for function, mode in modes:
        assert mode in getattr(gpu.state, function.rsplit(".", 1)[1]).__doc__
