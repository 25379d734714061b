# SPDX-License-Identifier: GPL-3.0-or-later
"""The native solver behind core's protocols: SceneRecord in, its errors as BakeError out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar, cast

import antumbra_native

from ..core.bake import Job, Progress, Solution
from ..core.carry import BakedMesh
from ..core.errors import BakeError, CancelledError, InputError, NoLightError, SettingError, SolverBugError
from ..core.pieces import GO_ON, Pieces, at_once
from ..core.record import AreaLight, PointLight, SceneRecord, Sun
from ..core.reproduction import Calls
from ..core.settings import Settings

_Result = TypeVar("_Result")

# Faces of textured surfaces have materials of their own, and there may be a hundred thousand.
_MATERIALS_AT_A_TIME = 4_096

# From the most special to the most general; the first that fits is taken.
_ERRORS: tuple[tuple[type[Exception], type[BakeError]], ...] = (
    (antumbra_native.NoLightError, NoLightError),
    (antumbra_native.NoReceiverError, InputError),
    (antumbra_native.InvalidSettingError, SettingError),
    (antumbra_native.InvalidSceneError, InputError),
    (antumbra_native.BakeCancelled, CancelledError),
    (antumbra_native.SolverPanicError, SolverBugError),
    (antumbra_native.AntumbraError, BakeError),
)


def start(scene: SceneRecord, settings: Settings) -> Pieces[Job]:
    """Hand the scene over and start the solver in a thread of its own."""
    native = antumbra_native.Scene()
    yield from _tell(native, scene)
    arguments = _arguments(settings)
    job = _translated(lambda: antumbra_native.start(native, **arguments))
    return _Job(job, scene, arguments)


def _tell(native: antumbra_native.Scene, scene: SceneRecord) -> Pieces[None]:
    for number, material in enumerate(scene.materials):
        if number % _MATERIALS_AT_A_TIME == 0:
            yield GO_ON
        native.add_material(
            material.name,
            material.reflectance_rgb,
            material.exitance_rgb,
            transmittance=material.transmittance_rgb,
        )
    for record in scene.objects:
        surface = record.surface
        normals = surface.corner_normals
        native.add_object(
            record.name,
            surface.positions,
            surface.triangles,
            record.triangle_materials(),
            record.world_from_object,
            None if normals is None else normals[surface.triangle_corners],
            record.receives,
            blocks=record.blocks,
            sends=record.sends,
        )
        yield GO_ON
    for light in scene.lights:
        _add_light(native, light, scene)
    if scene.sky is not None:
        native.set_sky(scene.sky.name, scene.sky.exitance_rgb)


def _arguments(settings: Settings) -> dict[str, Any]:
    return {
        "method": settings.method,
        "tolerance": settings.tolerance,
        "element_size": settings.element_size,
        "max_level": settings.max_level,
        "max_blockers": settings.max_blockers,
        "time_limit": settings.time_limit,
        "triangle_budget": settings.triangle_budget,
        "quantity": settings.quantity,
        "transport": settings.transport,
        "layers": settings.layers,
        "verify_points": settings.verify_points,
    }


def _add_light(native: antumbra_native.Scene, light: AreaLight | Sun | PointLight, scene: SceneRecord) -> None:
    linked = {"lit_objects": light.links.lit, "blocking_objects": light.links.blocking}
    links = {name: None if linked is None else linked.among(scene.objects) for name, linked in linked.items()}
    if isinstance(light, AreaLight):
        native.add_area_light(
            light.name,
            light.outline_world,
            light.exitance_rgb,
            light.spread,
            light.casts_shadows,
            **links,
        )
    elif isinstance(light, Sun):
        native.add_sun(
            light.name,
            light.towards,
            light.angle,
            light.irradiance_rgb,
            light.casts_shadows,
            **links,
        )
    else:
        cone = light.cone
        native.add_point_light(
            light.name,
            light.position,
            light.radius_m,
            light.intensity_rgb,
            light.faces_receiver,
            light.casts_shadows,
            None if cone is None else (cone.cone_from_world, cone.angle, cone.blend),
            **links,
        )


class _Job:
    """A native job that raises BakeError."""

    def __init__(self, job: antumbra_native.Job, scene: SceneRecord, arguments: dict[str, Any]) -> None:
        self._job = job
        self._scene = scene
        self._arguments = arguments

    def progress(self) -> Progress:
        return self._job.progress()

    def preview(self) -> Sequence[BakedMesh] | None:
        return self._job.preview()

    def cancel(self) -> None:
        self._job.cancel()

    def stop(self) -> None:
        self._job.stop()

    def done(self) -> bool:
        return self._job.done()

    def result(self) -> Solution:
        try:
            return _translated(self._job.result)
        except SolverBugError as error:
            raise SolverBugError(self._with_file(str(error))) from error

    def _with_file(self, message: str) -> str:
        """The message with a file to report, if there is room for one."""
        calls = Calls()
        at_once(_tell(cast("antumbra_native.Scene", calls), self._scene))
        try:
            path = calls.save(self._arguments, message)
        except OSError:
            return message
        return f"{message} with {path}, which holds the scene's geometry, materials and lights"


def _translated(call: Callable[[], _Result]) -> _Result:
    try:
        return call()
    except antumbra_native.AntumbraError as error:
        ours = next(ours for theirs, ours in _ERRORS if isinstance(error, theirs))
        raise ours(str(error)) from error
