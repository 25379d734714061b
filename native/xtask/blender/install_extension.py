# SPDX-License-Identifier: GPL-3.0-or-later
"""Install and enable an extension zip in the bpy module, as `blender --command extension install-file` does.

python install_extension.py -- ZIP
"""

import sys

import bpy

(zip_path,) = sys.argv[sys.argv.index("--") + 1 :]
bpy.ops.preferences.addon_enable(module="bl_pkg")
bpy.ops.extensions.package_install_files(filepath=zip_path, repo="user_default", enable_on_install=True)
if "bl_ext.user_default.antumbra" not in bpy.context.preferences.addons:
    sys.exit(f"{zip_path} was not installed and enabled")
bpy.ops.wm.save_userpref()
