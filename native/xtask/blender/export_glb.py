# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the bake in a .blend as a .glb, with the installed extension's own exporter.

... export_glb.py -- BAKED.blend OUT.glb

Not by the baking command's own --glb, so that it works in the bpy module too, which cannot start a second Blender.
"""

import importlib
import sys
from pathlib import Path

import bpy

EXTENSION = "bl_ext.user_default.antumbra"

source, output = sys.argv[sys.argv.index("--") + 1 :]
if EXTENSION not in bpy.context.preferences.addons:
    bpy.ops.preferences.addon_enable(module=EXTENSION)
bpy.ops.wm.open_mainfile(filepath=source)
importlib.import_module(f"{EXTENSION}.bridge.gltf").export_glb(bpy.context.scene, Path(output))
