# SPDX-License-Identifier: GPL-3.0-or-later
"""Render two bakes of one scene as the paper's figure 4: meshes above, the shaded scenes below.

... render_figure.py -- LEFT.blend RIGHT.blend OUT.png

Both are shown at the same exposure, the one that suits the left.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[3]))

from native.xtask.blender.render_picture import render_bake, save_picture

GAP = 6
"""Pixels of white between the pictures."""

left, right, output = sys.argv[sys.argv.index("--") + 1 :]
left_mesh, left_light, stops = render_bake(left)
right_mesh, right_light, _ = render_bake(right, stops)

height, width, channels = left_mesh.shape
figure = np.ones((2 * height + GAP, 2 * width + GAP, channels), dtype=np.float32)
# Bottom row first.
figure[:height, :width], figure[:height, width + GAP :] = left_light, right_light
figure[height + GAP :, :width], figure[height + GAP :, width + GAP :] = left_mesh, right_mesh
save_picture(figure, output)
