# SPDX-License-Identifier: GPL-3.0-or-later
"""Run pytest with the installed extension enabled, in the bpy module or by `blender --background --python`.

... run_pytest.py -- [--site FOLDER] [PYTEST ARGUMENT]...

FOLDER holds pytest for a Blender whose own Python has none.
"""

import os
import sys

import bpy

arguments = sys.argv[sys.argv.index("--") + 1 :]
if arguments[:1] == ["--site"]:
    # At the end: what Blender brings goes first.
    sys.path.append(arguments[1])
    arguments = arguments[2:]
# Blender's own Python may live in a folder that belongs to the system.
sys.dont_write_bytecode = True

import pytest  # noqa: E402  (only now on the path)

if "bl_ext.user_default.antumbra" not in bpy.context.preferences.addons:
    # The bpy module starts from factory settings, not from the saved preferences.
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.antumbra")
code = int(pytest.main(["-p", "no:cacheprovider", *arguments]))
sys.stdout.flush()
sys.stderr.flush()
# Blender turns SystemExit into a code of its own in some versions, and tears down what tests may have left behind.
os._exit(code)
