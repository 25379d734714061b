"""The Antumbra radiosity solver.

    scene = Scene()
    white = scene.add_material("white", (0.8, 0.8, 0.8), (0, 0, 0))
    scene.add_object("Floor", positions, triangles, materials, matrix, None, receives=True)
    scene.add_area_light("Lamp", outline, (10, 10, 10))
    bake = start(scene, tolerance=0.01).result()

Lengths are metres, colours scene-linear rgb. Exitance is pi times the emitted radiance, in W/m².
An array of the wrong type raises TypeError, one of the wrong shape ValueError; both name the object, the array,
what came and what was expected. Everything else that can be wrong raises an AntumbraError.
"""

from collections.abc import Sequence
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Floats: TypeAlias = NDArray[np.float32] | NDArray[np.float64]
_Integers: TypeAlias = NDArray[np.integer[Any]]

__all__ = [
    "AntumbraError",
    "Bake",
    "BakeCancelled",
    "BakedMesh",
    "InvalidSceneError",
    "InvalidSettingError",
    "Job",
    "NoLightError",
    "NoReceiverError",
    "Progress",
    "Scene",
    "SolverPanicError",
    "__version__",
    "_start_failing",
    "start",
]

__version__: str

class AntumbraError(Exception):
    """Base of every error the solver raises."""

class InvalidSceneError(AntumbraError):
    """The scene holds something that cannot be computed."""

    object: str | None
    """Name of the object it is about, where there is one."""
    index: int | None
    """Index of the vertex, corner or triangle it is about, where there is one."""

class InvalidSettingError(AntumbraError):
    """A setting is out of its range."""

    setting: str | None
    """Name of the setting."""

class NoLightError(AntumbraError):
    """Nothing in the scene sends light."""

class NoReceiverError(AntumbraError):
    """No surface is there to be baked."""

class BakeCancelled(AntumbraError):
    """The bake was cancelled."""

class SolverPanicError(AntumbraError):
    """The solver met a state it holds to be impossible: a bug in Antumbra."""

@final
class Scene:
    """Everything that lights, shadows, reflects or receives.

    Arrays are copied when they are added; their values are checked when the bake starts to solve.
    """

    def __new__(cls) -> Scene: ...
    def add_material(
        self,
        name: str,
        reflectance: Sequence[float],
        exitance: Sequence[float],
        *,
        transmittance: Sequence[float] = ...,
    ) -> int:
        """Add a diffuse material, its exitance on both sides, and return its index.

        transmittance is the share of light that goes on straight behind it; it reflects at most the rest to others.
        """

    def add_object(
        self,
        name: str,
        positions: _Floats,
        triangles: _Integers,
        materials: _Integers,
        world_from_object: _Floats,
        corner_normals: _Floats | None,
        receives: bool,
        *,
        blocks: bool = True,
        sends: bool = True,
    ) -> int:
        """Add a triangle mesh in its own space and return its index.

        positions (V, 3), triangles (T, 3), materials (T,), world_from_object (4, 4) with rows as numpy and Blender
        have them, corner_normals (T, 3, 3) in object space, or None to shade every triangle flat. Objects that do not
        block let light through whatever their materials; those that do not send reflect and emit nothing to others.
        """

    def add_area_light(
        self,
        name: str,
        outline: _Floats,
        exitance: Sequence[float],
        spread: float = ...,
        casts_shadows: bool = True,
        *,
        lit_objects: Sequence[int] | None = None,
        blocking_objects: Sequence[int] | None = None,
    ) -> None:
        """Add a flat light that does not block.

        outline (K, 3) is convex, in world space, and counter-clockwise seen from the one side that is lit. spread is
        the full angle, in radians, that its light is kept to; pi, the default, keeps it to its side.
        lit_objects are the indices of the objects that it lights, blocking_objects of those that block its light, each
        None for all; so for all lights.
        """

    def add_sun(
        self,
        name: str,
        direction: Sequence[float],
        angle: float,
        irradiance: Sequence[float],
        casts_shadows: bool = True,
        *,
        lit_objects: Sequence[int] | None = None,
        blocking_objects: Sequence[int] | None = None,
    ) -> None:
        """Add a sun.

        direction is towards it, angle its diameter in radians, irradiance, W/m², that of what faces it.
        """

    def add_point_light(
        self,
        name: str,
        position: Sequence[float],
        radius: float,
        intensity: Sequence[float],
        faces_receiver: bool = True,
        casts_shadows: bool = True,
        cone: tuple[_Floats, float, float] | None = None,
        *,
        lit_objects: Sequence[int] | None = None,
        blocking_objects: Sequence[int] | None = None,
    ) -> None:
        """Add a light from a point; with a radius, from a disc that faces its receiver, or from a sphere.

        intensity is in W/sr. cone makes it a spot light: a matrix (3, 3) that turns directions in the world into a
        space where the cone is round about +z, its full angle in radians, and the share of it, 0 to 1, over which it
        fades.
        """

    def set_sky(self, name: str, exitance: _Floats) -> None:
        """Set what shines from all around: exitance (6, N, N, 3), pi times the radiance, on the faces of a cube.

        Face 2a + s is towards +a (s = 0) or -a (s = 1), a being x, y or z. Of the next two axes, in this order and
        beginning again with x, columns run along the first and rows along the second, both from negative to positive.
        N is a power of two.
        """

def start(
    scene: Scene,
    *,
    method: str = "ADM",
    tolerance: float = 0.01,
    element_size: float = 0.0,
    max_level: int = 8,
    max_blockers: int = 4,
    time_limit: float = 0.0,
    triangle_budget: int = 0,
    quantity: str = "RADIOSITY",
    transport: str = "AUTO",
    layers: str = "TOTAL",
    verify_points: int = 1000,
    threads: int = 0,
) -> Job:
    """Start a bake in a thread of its own and return at once.

    The scene's data moves into the bake: starting a second one from it raises RuntimeError. A setting out of its
    range raises InvalidSettingError and leaves the scene as it was. method is ADM, DM, AS or UNIFORM, quantity
    RADIOSITY or IRRADIANCE, transport AUTO, SHOOTING, HIERARCHICAL or RAYS, layers TOTAL or SEPARATE. The
    light of up to verify_points random points is compared with light along random paths, for the report.
    """

def _start_failing(scene: Scene) -> Job:
    """Start a job whose solver panics: for tests of what becomes of a bug."""

@final
class Job:
    """A running bake. Dropping it cancels the bake and waits for its thread."""

    def progress(self) -> Progress:
        """Return the latest snapshot; never waits for the solver."""

    def cancel(self) -> None:
        """Ask the bake to give up; result() then raises BakeCancelled."""

    def stop(self) -> None:
        """Ask the bake to finish with what it has."""

    def preview(self) -> list[BakedMesh] | None:
        """Return the meshes as they were at a stage of the bake, each only once; None when there is no new one.

        Asking is what makes the solver keep the next one, so that a bake that nobody watches costs nothing.
        """

    def done(self) -> bool:
        """Whether result() would return or raise at once."""

    def result(self) -> Bake:
        """Wait for the bake, without Python's lock, and hand it over or raise why there is none.

        Can be called once. Ctrl+C while waiting cancels the bake.
        """

@final
class Progress:
    """A snapshot of how far a bake has come."""

    @property
    def stage(self) -> str:
        """What the solver is doing, in lower-case English."""
    @property
    def fraction(self) -> float:
        """Share of the expected work that is done, 0 to 1."""
    @property
    def shots(self) -> int:
        """Shots so far."""
    @property
    def elements(self) -> int:
        """Leaf elements of the mesh."""
    @property
    def unshot(self) -> float:
        """Share of the emitted light that has not been distributed yet."""

@final
class Bake:
    """The refined meshes with their light, and what it took to make them."""

    @property
    def meshes(self) -> list[BakedMesh]:
        """One mesh per receiving object, in the order of the input."""
    @property
    def report(self) -> str:
        """JSON with scene, timings, timeline, result and warnings."""

@final
class BakedMesh:
    """A refined triangle mesh, V vertices and T triangles. The arrays share the solver's memory."""

    @property
    def object(self) -> int:
        """Index that add_object returned."""
    @property
    def positions(self) -> NDArray[np.float64]:
        """(V, 3) in object space; source vertices keep their exact coordinates."""
    @property
    def vertex_source_triangle(self) -> NDArray[np.int32]:
        """(V,) a source triangle that holds the vertex."""
    @property
    def vertex_barycentric(self) -> NDArray[np.float64]:
        """(V, 3) the vertex in that triangle; exactly a unit vector at a source vertex."""
    @property
    def triangles(self) -> NDArray[np.int32]:
        """(T, 3) corner vertices, wound like the source triangle."""
    @property
    def source_triangle(self) -> NDArray[np.int32]:
        """(T,) the source triangle that the triangle is a part of."""
    @property
    def corner_barycentric(self) -> NDArray[np.float64]:
        """(T, 3, 3) each corner in the source triangle."""
    @property
    def source_edge(self) -> NDArray[np.int8]:
        """(T, 3) the source triangle's edge that edge k to k+1 lies on, 0 to 2, or -1."""
    @property
    def edge_line(self) -> NDArray[np.int8]:
        """(T, 3) the line that edge k to k+1 lies on.

        0 none, 1 where the slope of light changes, 2 where a sharp shadow ends, 3 where something touches the face.
        """
    @property
    def corner_radiance(self) -> NDArray[np.float32]:
        """(T, 3, 3) scene-linear rgb per corner, B/pi or H/pi, never clipped."""
    @property
    def corner_error(self) -> NDArray[np.float32] | None:
        """(T, 3) rms error that the solver estimates around each corner, as a share of the mean light.

        0 where the light is even and where nothing was refined; None in a preview.
        """
    @property
    def corner_direct(self) -> NDArray[np.float32] | None:
        """(T, 3, 3) the part of it that comes from emitters, the surface's own emission included.

        None unless layers is SEPARATE.
        """
    @property
    def corner_indirect(self) -> NDArray[np.float32] | None:
        """(T, 3, 3) the part of it that other surfaces reflected before; None unless layers is SEPARATE."""
