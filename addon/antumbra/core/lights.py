# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights in the solver's units, by the formulas that Cycles follows.

With P = energy · colour · 2^exposure · temperature colour · emission of its nodes:

- An area light of P watts sends the radiance L = P / (pi·A) from its -Z side, A being its area in the world; with
  "normalize" off L = P / pi. The solver takes the exitance pi·L.
- A point or spot light of P watts has the intensity P / (4 pi), whatever its radius. With "normalize" off it sends the
  radiance L = P / pi; something round of radius r has the intensity pi·r²·L, and a point is taken for one of radius 1.
- A sun of P W/m² brings that much to what faces it, whatever its angle. With "normalize" off P is the radiance of its
  disc, pi·sin²(angle/2) steradians large, but of a sun without an angle still the irradiance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Colour = tuple[float, float, float]

# A disk becomes a regular polygon of the same area. With 64 sides the form factor from a disk's own radius away is
# off by 1.3e-7; fewer sides are seen first by receivers close to the rim, more cost time at every receiver.
DISK_SIDES = 64


@dataclass(frozen=True, slots=True)
class AreaLamp:
    """A Blender area light as its data says it."""

    shape: str
    """SQUARE, RECTANGLE, DISK or ELLIPSE."""
    size_x_m: float
    size_y_m: float
    power_rgb: Colour
    """energy · colour · 2^exposure · temperature colour."""
    normalize: bool


def outline_in_light(lamp: AreaLamp) -> Floats:
    """Corners (K, 3) in the light's own space, counter-clockwise seen from -Z, the lit side."""
    size_x = lamp.size_x_m
    size_y = lamp.size_x_m if lamp.shape in ("SQUARE", "DISK") else lamp.size_y_m
    if lamp.shape in ("SQUARE", "RECTANGLE"):
        corners_xy = np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]]) / 2.0
    else:
        # A regular n-gon of radius r has the area n/2 · sin(2 pi/n) · r².
        step = 2.0 * math.pi / DISK_SIDES
        radius = 0.5 * math.sqrt(step / math.sin(step))
        angles = -step * np.arange(DISK_SIDES)
        corners_xy = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    corners = np.zeros((len(corners_xy), 3))
    corners[:, :2] = corners_xy * (size_x, size_y)
    return corners


def outline_in_world(lamp: AreaLamp, world_from_light: Floats) -> Floats:
    """Corners (K, 3) in the world, counter-clockwise seen from the lit side, also when the light is mirrored."""
    corners = outline_in_light(lamp) @ world_from_light[:3, :3].T + world_from_light[:3, 3]
    lit_direction = -world_from_light[:3, 2]
    if area_vector(corners) @ lit_direction < 0.0:
        corners = corners[::-1]
    return np.ascontiguousarray(corners)


def area_vector(outline: Floats) -> Floats:
    """Normal of a flat outline (K, 3) times its area."""
    spokes = outline - outline[0]
    return np.asarray(np.cross(spokes[1:-1], spokes[2:]).sum(axis=0) / 2.0)


def exitance_rgb(lamp: AreaLamp, outline_world: Floats) -> Colour | None:
    """pi·L in W/m² per channel; None when the light has no area to send it from."""
    area_m2 = float(np.linalg.norm(area_vector(outline_world)))
    if area_m2 == 0.0:
        return None
    return scaled(lamp.power_rgb, 1.0 / area_m2 if lamp.normalize else 1.0)


def sun_irradiance_rgb(strength_rgb: Colour, angle: float, normalize: bool) -> Colour:
    """W/m² per channel on what faces the sun; its angle, the diameter of its disc, in radians."""
    by_radiance = not normalize and angle > 0.0
    return scaled(strength_rgb, math.pi * math.sin(angle / 2.0) ** 2 if by_radiance else 1.0)


def point_intensity_rgb(power_rgb: Colour, radius_m: float, normalize: bool) -> Colour:
    """W/sr per channel of a point or spot light."""
    if normalize:
        return scaled(power_rgb, 1.0 / (4.0 * math.pi))
    return scaled(power_rgb, radius_m**2 if radius_m > 0.0 else 1.0 / math.pi)


def cone_from_world(world_from_light: Floats) -> Floats | None:
    """Turns directions (3, 3) into a space where a spot light's cone is round about +z; None when its scale is 0.

    The light shines along its -Z; a light that is scaled unevenly has an elliptical cone.
    """
    linear = world_from_light[:3, :3]
    if not np.isfinite(linear).all() or np.linalg.matrix_rank(linear) < 3:
        return None
    return np.asarray(np.diag([1.0, 1.0, -1.0]) @ np.linalg.inv(linear))


def scaled(colour: Colour, factor: float) -> Colour:
    """Every channel times a number."""
    red, green, blue = colour
    return red * factor, green * factor, blue * factor
