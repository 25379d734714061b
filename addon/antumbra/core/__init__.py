# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake does, apart from Blender: runs in any Python with numpy."""
