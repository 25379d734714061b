# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene looked at before a bake; what was found is kept for the panel until the next look or the next file."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..core.errors import InputError
from ..core.preflight import Estimate, Finding, estimate, find
from ..core.record import SceneRecord, name_list
from ..core.settings import Settings
from .properties import state_of
from .scene_read import read_geometry, selected_uids
from .surroundings import scene_of, view_layer_of
from .world import may_shine


@dataclass(frozen=True, slots=True)
class Preflight:
    """What was found in one scene."""

    scene_uid: int
    findings: list[Finding]
    estimate: Estimate | None


_last: Preflight | None = None


def last_of(scene: bpy.types.Scene) -> Preflight | None:
    """What was found in this scene, if it is the one that was looked at."""
    return _last if _last is not None and _last.scene_uid == scene.session_uid else None


def look(context: bpy.types.Context, settings: Settings) -> Preflight:
    """Look at the scene and remember what was found."""
    global _last
    scene = scene_of(context)
    findings: list[Finding] = _hidden(context, settings)
    estimated = None
    try:
        reader = read_geometry(context, settings)
    except InputError as error:
        findings.insert(0, Finding("ERROR", str(error)))
    else:
        record = reader.scene
        shines = may_shine(scene.world)
        findings += [finding for finding in find(record) if not (shines and finding.level == "ERROR")]
        findings += [Finding("WARNING", warning, _objects_of(warning, record)) for warning in record.all_warnings()]
        if not any(each.receives for each in record.objects):
            findings.insert(
                0, Finding("ERROR", "nothing to bake: no receiving mesh has a face that is visible in renders")
            )
        else:
            estimated = estimate(record, settings, os.cpu_count() or 1)
    _last = Preflight(scene.session_uid, findings, estimated)
    return _last


def _hidden(context: bpy.types.Context, settings: Settings) -> list[Finding]:
    """Meshes that somebody sees in the viewport and no render shows."""
    chosen = selected_uids(context) if settings.receivers == "SELECTED" else None
    hidden: list[Any] = []
    for obj in view_layer_of(context).objects:
        wanted = chosen is None or obj.session_uid in chosen
        # Originals that a bake has hidden are read all the same.
        if obj.type == "MESH" and obj.hide_render and wanted and state_of(obj).role == "NONE" and obj.visible_get():
            hidden.append(obj)
    if not hidden:
        return []
    text = f"{name_list([obj.name for obj in hidden], most=2)}: hidden in renders, takes no part"
    return [Finding("WARNING", text, tuple(obj.session_uid for obj in hidden))]


def _objects_of(warning: str, record: SceneRecord) -> tuple[int, ...]:
    """session_uids of the objects that have the material which a warning begins with."""
    numbers = {n for n, material in enumerate(record.materials) if warning.startswith(f"material “{material.name}”")}
    having = (each.owner_uid for each in record.objects if not numbers.isdisjoint(each.slot_materials))
    return tuple(dict.fromkeys(having))


def forget_errors() -> None:
    """Once a bake is written, what was said to make one impossible is not true any more, and the rest may not be."""
    if _last is not None and any(finding.level == "ERROR" for finding in _last.findings):
        _forget()


@persistent  # type: ignore[untyped-decorator]
def _forget(*_args: object) -> None:
    global _last
    _last = None


def register() -> None:
    bpy.app.handlers.load_pre.append(_forget)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_forget)
    _forget()
