//! Discs as polygons: the visible part of a polygon is computed, so what is round gets sides.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// Sides of a polygon that stands for a disc. In the middle of a penumbra the visible share of a disc past a straight
/// edge is then off by at most 9e-5 of it (5e-4 with 16 sides, 2e-5 with 64); each side costs time at every receiver.
pub(super) const SIDES: usize = 32;

/// Form factor, from a point one away that faces it, to a regular polygon whose corners are `tangent` from its middle.
fn form_factor(tangent: f64) -> f64 {
    let (sine, cosine) = (TAU / SIDES as f64).sin_cos();
    // The cross product of the ways to two neighbouring corners, of which (tangent, 0, 1) is one
    let cross = DVec3::new(-tangent * sine, -tangent * (1.0 - cosine), tangent * tangent * sine);
    let angle = cross.length().atan2(1.0 + tangent * tangent * cosine);
    if tangent > 0.0 { SIDES as f64 * angle * cross.z / (TAU * cross.length()) } else { 0.0 }
}

/// Distance of the corners from the middle, per distance of the polygon, of the polygon that sends as much straight ahead
/// as a disc which fills this share of the hemisphere, the squared sine of half the angle under which it appears.
///
/// By symmetry it sends as much in any other direction above whose horizon all of it is.
pub(super) fn corner_tangent(share: f64) -> f64 {
    // For a disc share/(1 - share) is the squared tangent; for the polygon it is nearly proportional to it, so that each
    // step leaves a hundredth of the error or less.
    let odds = |share: f64| share / (1.0 - share);
    let wanted = odds(share.min(FULLEST));
    let mut tangent2 = wanted;
    for _ in 0..6 {
        tangent2 *= wanted / odds(form_factor(tangent2.sqrt()).min(FULLEST));
    }
    tangent2.sqrt()
}

/// Share beyond which the border is at the horizon, ten thousand radii out.
const FULLEST: f64 = 1.0 - 1e-8;

/// Unit vectors from the middle of a round polygon to its corners, counter-clockwise about `axis`, a unit vector.
pub(super) fn spokes(axis: DVec3) -> impl Iterator<Item = DVec3> {
    let (u, v) = axis.any_orthonormal_pair();
    (0..SIDES).map(move |k| {
        let (sine, cosine) = (TAU * k as f64 / SIDES as f64).sin_cos();
        cosine * u + sine * v
    })
}

/// Angle between a disc's axis and its border, radians, to the share of the hemisphere that it fills straight ahead.
pub(super) fn share_of_angle(half_angle: f64) -> f64 {
    half_angle.min(0.5 * PI).sin().powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::{ConvexPolygon, Receiver, unoccluded_form_factor};

    #[test]
    fn a_polygon_sends_what_its_disc_sends() {
        for share in [1e-12, 2e-5, 0.01, 0.3, 0.5, 0.9, 0.99] {
            let tangent = corner_tangent(share);
            let ratio = form_factor(tangent) / share;
            assert!((ratio - 1.0).abs() < 1e-13, "{share}: {ratio}");
            for tilt in [0.0, 0.02] {
                let axis = DVec3::new(tilt, -0.5 * tilt, 1.0).normalize();
                let corners: Vec<DVec3> = spokes(axis).map(|spoke| axis + tangent * spoke).collect();
                let corners: Vec<DVec3> = corners.into_iter().rev().collect();
                let disc = ConvexPolygon::new(&corners).expect("it has an area");
                let receiver = Receiver::new(DVec3::ZERO, DVec3::Z);
                let found = unoccluded_form_factor(&receiver, &disc);
                assert!((found / (share * axis.z) - 1.0).abs() < 1e-12, "{share}: {found}");
            }
        }
    }

    /// What is left of the disc past an edge at any place and angle, against the polygon's.
    #[test]
    fn a_penumbra_of_the_polygon_is_that_of_the_disc() {
        let radius = corner_tangent(1e-8) / 1e-4;
        let mut worst = 0.0_f64;
        for turn in 0..20 {
            for place in 0..200 {
                let (turn, at) = (f64::from(turn) * 0.013, f64::from(place) * 0.01 - 1.0);
                let disc = (at.acos() - at * (1.0 - at * at).sqrt()) / PI;
                // The polygon beyond x = at
                let corner = |k: usize| {
                    let (sine, cosine) = (TAU * k as f64 / SIDES as f64 + turn).sin_cos();
                    [radius * cosine, radius * sine]
                };
                let mut area = 0.0;
                for k in 0..SIDES {
                    let ([x0, y0], [x1, y1]) = (corner(k), corner(k + 1));
                    let cut = |x: f64| x.max(at);
                    if x0.max(x1) > at {
                        let t =
                            |x: f64| if x1 == x0 { 0.0 } else { ((cut(x) - x0) / (x1 - x0)).clamp(0.0, 1.0) };
                        let (a, b) = (t(x0), t(x1));
                        let point = |t: f64| [x0 + t * (x1 - x0) - at, y0 + t * (y1 - y0)];
                        let ([xa, ya], [xb, yb]) = (point(a), point(b));
                        area += 0.5 * (xa + xb) * (yb - ya);
                    }
                }
                worst = worst.max((area / PI - disc).abs());
            }
        }
        println!("{worst:e}");
        assert!(worst < 1e-4, "{worst:e}");
    }
}
