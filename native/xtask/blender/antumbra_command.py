# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender --background SCENE --command antumbra ...` for the bpy module, which has no command line.

python antumbra_command.py -- SCENE [ARGUMENT OF THE COMMAND]...
"""

import importlib
import sys

import bpy

EXTENSION = "bl_ext.user_default.antumbra"

scene, *arguments = sys.argv[sys.argv.index("--") + 1 :]
bpy.ops.preferences.addon_enable(module=EXTENSION)
try:
    bpy.ops.wm.open_mainfile(filepath=scene)
except RuntimeError as error:
    print(f"antumbra: {str(error).strip().splitlines()[-1]}", file=sys.stderr)
    sys.exit(2)
sys.exit(importlib.import_module(f"{EXTENSION}.cli").run(arguments))
