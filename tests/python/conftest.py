# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of what the extension does apart from Blender."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "addon"))
