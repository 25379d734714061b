# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the installed extension in Blender's window, with mouse and keys. Their pictures stay in target/window."""

import os
import re
from pathlib import Path

import pytest
from blender_window import BlenderWindow, missing

FOLDER = Path(os.environ.get("ANTUMBRA_WINDOW_FOLDER", "target/window"))


@pytest.fixture
def blender(request):
    """A Blender with an empty scene, its Properties editor at Render."""
    lacking = missing()
    if lacking:
        pytest.skip("missing: " + "; ".join(lacking))
    window = BlenderWindow((FOLDER / re.sub(r"\W+", "-", request.node.name).strip("-")).absolute())
    try:
        window.ask(PREPARE)
        window.until("True")
        yield window
    finally:
        window.close()


PREPARE = """
import importlib
import numpy as np
import scenes
from fingerprint import fingerprint
from scenes import *

EXTENSION = "bl_ext.user_default.antumbra"


def module(name):
    return importlib.import_module(f"{EXTENSION}.{name}")


running, outcome = module("bridge.running"), module("bridge.outcome")
for obj in list(bpy.data.objects):
    bpy.data.objects.remove(obj)
for screen_area in bpy.context.window_manager.windows[0].screen.areas:
    if screen_area.type == "PROPERTIES":
        screen_area.spaces.active.context = "RENDER"
        for region in screen_area.regions:
            region.tag_redraw()


def is_solving():
    # Once its scene is read nothing of a bake is in the file
    return running.is_running() and running._running.is_read


def cubes_on_a_plane(**settings):
    for index in range(4):
        add_cube(f"Cube {index}").location = (3 * index - 4.5, 0, 1)
    add_plane(size=20.0)
    add_area_light(location=(1, 1, 6), energy=1500.0)
    for name, value in {"receivers": "ALL", **settings}.items():
        setattr(bpy.context.scene.antumbra, name, value)
    view_all()
    bpy.ops.ed.undo_push(message="Scene")


def view_all():
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.view_all()


def light():
    return {obj.name: radiance(obj.data).tobytes().hex()[:4000] for obj in baked_objects()}
"""
