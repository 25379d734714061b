# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a world's background onto the faces of a cube of directions."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..core.lights import Floats
from ..core.pieces import TURN, Pieces
from .temporary import marked, remove

# Cells along each side of a face: 0.2 to 0.4 degrees, less than the sun. With fewer, a sun that is part of the
# background would be a blurred one; more cost time for borders of shadows that few skies draw.
_CELLS = 256

# Cycles' samples per cell, spread over its area.
_SAMPLES = 16

# Cells that are brighter than this many times the mean are rendered once more, since a sun that is hit by chance would
# err by as much as its share of the light.
_BRIGHT = 20.0
_SAMPLES_OF_BRIGHT = 1024
# Cells around them that are rendered with them: a sun's border that no sample met.
_MARGIN = 2


def rendered_cube(world: bpy.types.World) -> Pieces[Floats]:
    """Mean radiance of the cells (6, N, N, 3) of a cube: face 2a + s towards +a or -a; see the solver's set_sky.

    Raises RuntimeError or TypeError where Cycles is not there to render it.
    """
    images_before = {image.name for image in bpy.data.images}
    scene = marked(bpy.data.scenes.new("Antumbra world"))
    camera = marked(bpy.data.cameras.new("Antumbra world"))
    viewer = marked(bpy.data.objects.new("Antumbra world", camera))
    try:
        with tempfile.TemporaryDirectory() as folder:
            _prepare(scene, viewer, world, Path(folder) / "face.exr")
            faces = np.empty((6, _CELLS, _CELLS, 3))
            for face in range(6):
                yield TURN
                faces[face] = _face(scene, viewer, face, _SAMPLES)
            yield from _sharpen(scene, viewer, faces)
    finally:
        remove([scene])
        remove([viewer, camera])
        # The first render of all makes one for its result.
        results = [image for image in bpy.data.images if image.type == "RENDER_RESULT"]
        for image in [image for image in results if image.name not in images_before]:
            bpy.data.images.remove(image)
    return faces


def _prepare(scene: Any, viewer: bpy.types.Object, world: bpy.types.World, path: Path) -> None:
    scene.world = world
    scene.collection.objects.link(viewer)
    scene.camera = viewer
    camera: Any = viewer.data
    camera.type = "PERSP"
    camera.sensor_fit = "HORIZONTAL"
    camera.lens, camera.sensor_width = 1.0, 2.0  # 90 degrees
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = _CELLS
    render.resolution_percentage = 100
    render.film_transparent = False
    render.use_compositing = render.use_sequencer = False
    render.filepath = str(path)
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode = "RGB"
    render.image_settings.color_depth = "32"
    render.use_file_extension = False
    render.use_overwrite = True
    cycles = scene.cycles
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.film_exposure = 1.0
    # Every cell counts what lies in it and nothing else.
    cycles.pixel_filter_type = "BOX"
    cycles.seed = 0


def _face(scene: Any, viewer: bpy.types.Object, face: int, samples: int) -> Floats:
    """Render one face: rows and columns as the solver has them."""
    axis, away = divmod(face, 2)
    towards, column, row = (np.eye(3)[(axis + k) % 3] for k in range(3))
    # A camera looks along its -Z, with its picture's columns along X and its rows, from below, along Y. For the faces
    # towards +a that would be left-handed: they are taken mirrored and turned back.
    mirrored = away == 0
    axes = [-column, row, -towards] if mirrored else [column, row, towards]
    viewer.matrix_world = Matrix(np.stack(axes, axis=1).tolist()).to_4x4()
    scene.cycles.samples = samples
    picture = _render(scene)
    return picture[:, ::-1] if mirrored else picture


def _sharpen(scene: Any, viewer: bpy.types.Object, faces: Floats) -> Pieces[None]:
    """Render what is much brighter than the mean with more samples."""
    brightness = faces.max(axis=-1)
    limit = _BRIGHT * brightness.mean()
    render = scene.render
    render.use_border = True
    for face in range(6):
        rows, columns = np.nonzero(brightness[face] > limit)
        if not len(rows):
            continue
        yield TURN
        top, bottom = min(rows.max() + 1 + _MARGIN, _CELLS), max(rows.min() - _MARGIN, 0)
        left, right = max(columns.min() - _MARGIN, 0), min(columns.max() + 1 + _MARGIN, _CELLS)
        ends = (_CELLS - right, _CELLS - left) if face % 2 == 0 else (left, right)
        render.border_min_x, render.border_max_x = (end / _CELLS for end in ends)
        render.border_min_y, render.border_max_y = bottom / _CELLS, top / _CELLS
        finer = _face(scene, viewer, face, _SAMPLES_OF_BRIGHT)
        faces[face, bottom:top, left:right] = finer[bottom:top, left:right]


def _render(scene: Any) -> Floats:
    """Render to a file and read it: the picture's pixels from below, (rows, columns, 3)."""
    bpy.ops.render.render(write_still=True, scene=scene.name)
    image: Any = bpy.data.images.load(scene.render.filepath)
    try:
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty(_CELLS * _CELLS * image.channels, dtype=np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(_CELLS, _CELLS, image.channels)[:, :, :3].astype(np.float64)
    finally:
        bpy.data.images.remove(image)
