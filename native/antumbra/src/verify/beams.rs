//! Light that is not sent alike in all directions, and the part of a panel that it comes from.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::ConeInput;
use crate::visibility::ConvexPolygon;
use crate::visibility::rays::point_on;

/// The least half of a spread, radians, and the one from which on light goes everywhere: Blender's.
pub(super) const LEAST_SPREAD: f64 = 1.7e-4;
const EVERYWHERE: f64 = 0.5 * PI - 1e-6;

/// A point of a panel from which its light may reach a place, and the area that it was chosen from.
pub(super) fn panel_point(
    polygon: &ConvexPolygon,
    half_spread: f64,
    at: DVec3,
    place: [f64; 2],
) -> Option<(DVec3, f64)> {
    let normal = polygon.normal();
    let height = normal.dot(at - polygon.vertices()[0]);
    if height <= 0.0 {
        return None;
    }
    let reach = height * half_spread.min(0.5 * PI - 1e-3).tan();
    if half_spread >= EVERYWHERE || PI * reach * reach >= polygon.area() {
        return Some((point_on(polygon, place), polygon.area()));
    }
    // Light comes from the disc above the place, as far as that is part of the panel.
    let (u, v) = normal.any_orthonormal_pair();
    let [x, y] = in_disc(place);
    let point = at - height * normal + reach * (x * u + y * v);
    let vertices = polygon.vertices();
    let inside = (0..vertices.len()).all(|k| {
        let (from, to) = (vertices[k], vertices[(k + 1) % vertices.len()]);
        (to - from).cross(point - from).dot(normal) >= 0.0
    });
    inside.then_some((point, PI * reach * reach))
}

/// What a spread keeps of light at this cosine from straight ahead: (tan h - tan a)/(tan h - h).
pub(super) fn kept_by_spread(half: f64, cosine: f64) -> f64 {
    if half >= EVERYWHERE || cosine <= 0.0 {
        return if cosine > 0.0 { 1.0 } else { 0.0 };
    }
    let tangent = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
    // tan h - h is lost to rounding where h is small.
    let rest = if half < 0.02 { half.powi(3) / 3.0 * (1.0 + 0.4 * half * half) } else { half.tan() - half };
    ((half.tan() - tangent) / rest).max(0.0)
}

/// What a spot light keeps of light in this direction.
pub(super) fn kept_by_cone(cone: &ConeInput, direction: DVec3) -> f64 {
    let turned = cone.cone_from_world * direction;
    let border = (0.5 * cone.angle).cos();
    let inside = turned.z / turned.length() - border;
    if inside <= 0.0 {
        return 0.0;
    }
    let fade = (1.0 - border) * cone.blend;
    let t = if inside >= fade { 1.0 } else { inside / fade };
    t * t * (3.0 - 2.0 * t)
}

/// Uniform in the unit disc.
pub(super) fn in_disc([u, v]: [f64; 2]) -> [f64; 2] {
    let (sine, cosine) = (TAU * v).sin_cos();
    [u.sqrt() * cosine, u.sqrt() * sine]
}
