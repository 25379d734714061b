# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's data to core's arrays and back."""
