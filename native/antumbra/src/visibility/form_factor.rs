//! The form factor of a convex outline that lies above the receiver's horizon.
//!
//! Lambert's contour formula (1760), `F = Σ θ_i (n · c_i/|c_i|) / 2π` with `c_i = v_i × v_{i+1}` and `θ_i` the angle
//! between them, loses all digits where the outline is small: its terms are of the size of the outline, its sum of
//! the size of the area (94 % wrong at a size of 2.4e-9 of the distance). It is therefore summed about the area, and
//! replaced by a quadrature where the outline is smaller still.

use glam::DVec3;

use super::clip::{Fragments, Plane, Vertex, plane_distance};
use super::polygon::{ConvexPolygon, Receiver};

/// Size of an outline, relative to its distance, below which a quadrature of degree 5 replaces the contour.
///
/// The contour about the area keeps all but `1/size` of an epsilon: at least 13 digits above this size. The rule's
/// relative error falls with the sixth power and is below 1e-13 here; at 0.1 it would show in the eighth digit.
const QUADRATURE_SIZE: f64 = 0.01;

/// Radon's rule of degree 5 for a triangle (1948): weight and barycentric coordinates of each point.
/// `a = (6 ∓ √15)/21` has the weight `(155 ∓ √15)/1200`, the centroid 9/40.
const RADON_RULE: [(f64, [f64; 3]); 7] = {
    const A: f64 = 0.101_286_507_323_456_34;
    const B: f64 = 0.470_142_064_105_115_1;
    const WEIGHT_A: f64 = 0.125_939_180_544_827_15;
    const WEIGHT_B: f64 = 0.132_394_152_788_506_2;
    const THIRD: f64 = 1.0 / 3.0;
    [
        (0.225, [THIRD, THIRD, THIRD]),
        (WEIGHT_A, [1.0 - 2.0 * A, A, A]),
        (WEIGHT_A, [A, 1.0 - 2.0 * A, A]),
        (WEIGHT_A, [A, A, 1.0 - 2.0 * A]),
        (WEIGHT_B, [1.0 - 2.0 * B, B, B]),
        (WEIGHT_B, [B, 1.0 - 2.0 * B, B]),
        (WEIGHT_B, [B, B, 1.0 - 2.0 * B]),
    ]
};

/// A source as a receiver sees it: its outline relative to the receiver and cut at the receiver's horizon.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeenSource {
    receiver_normal: DVec3,
    /// Unit normal that points away from the receiver; the outline is counter-clockwise about it, so that the plane
    /// through each edge has the outline to its left.
    normal: DVec3,
    /// Distance of the source's plane from the receiver, above 0.
    distance: f64,
    /// The largest coordinate of source and receiver.
    world: f64,
}

impl SeenSource {
    /// Looks at `source` and leaves its outline above the horizon as the only fragment in `fragments`; `None` when nothing
    /// of it is above the horizon or the receiver lies in its plane.
    pub(super) fn look(
        receiver: &Receiver,
        source: &ConvexPolygon,
        fragments: &mut Fragments,
    ) -> Option<Self> {
        let world = source.extent().max(receiver.position.abs().max_element());
        let seen_from = |vertex: &DVec3| Vertex::new(*vertex - receiver.position);
        let distance = plane_distance(source.normal(), source.vertices()[0] - receiver.position, world);
        if distance > 0.0 {
            fragments.restart(source.vertices().iter().map(seen_from));
        } else if distance < 0.0 {
            fragments.restart(source.vertices().iter().rev().map(seen_from));
        } else {
            return None;
        }
        fragments.keep_inside(&Plane::through_receiver(receiver.normal)).then(|| Self {
            receiver_normal: receiver.normal,
            normal: source.normal() * distance.signum(),
            distance: distance.abs(),
            world,
        })
    }

    /// The half-space on the receiver's side of the source's plane.
    pub(super) fn nearer(&self) -> Plane {
        Plane::beyond(self.normal, self.distance, self.world).flipped()
    }

    /// Form factor from the receiver to a fragment of the source.
    pub(super) fn form_factor(&self, outline: &[Vertex]) -> f64 {
        let origin = outline[0].point;
        let size2 = outline.iter().map(|v| v.point.distance_squared(origin)).fold(0.0, f64::max);
        if size2 < QUADRATURE_SIZE * QUADRATURE_SIZE * origin.length_squared() {
            self.by_quadrature(outline)
        } else {
            self.by_contour(outline)
        }
    }

    /// The contour formula, summed about the outline's area.
    ///
    /// With `w_i = θ_i/|c_i|` and `S = Σ c_i`, twice the area vector, the sum `Σ w_i c_i` is `w S + Σ (w_i - w) c_i`
    /// for any `w`. `S` is computed from differences of vertices, which cancel nothing. The smallest `w_i` is taken
    /// for `w`: it keeps every term below an angle, also where the receiver nearly touches an edge.
    fn by_contour(&self, outline: &[Vertex]) -> f64 {
        let origin = outline[0].point;
        let edges =
            || outline.iter().zip(outline.iter().cycle().skip(1)).map(|(from, to)| (from.point, to.point));
        let smallest = edges().map(|(from, to)| angle_ratio(from, to)).fold(f64::INFINITY, f64::min);
        let mut area_vector = DVec3::ZERO;
        let mut rest = 0.0;
        for (from, to) in edges() {
            area_vector += (from - origin).cross(to - origin);
            let normal = from.cross(to - from);
            rest += (angle_ratio(from, to) - smallest) * self.receiver_normal.dot(normal);
        }
        (smallest * self.receiver_normal.dot(area_vector) + rest) / std::f64::consts::TAU
    }

    /// Radon's rule on the fan of triangles about the first vertex.
    fn by_quadrature(&self, outline: &[Vertex]) -> f64 {
        let a = outline[0].point;
        let mut sum = 0.0;
        for edge in outline.windows(2).skip(1) {
            let (b, c) = (edge[0].point, edge[1].point);
            let area = 0.5 * self.normal.dot((b - a).cross(c - a));
            let mut mean = 0.0;
            for (weight, [u, v, w]) in RADON_RULE {
                let point = a * u + b * v + c * w;
                let distance2 = point.length_squared();
                mean += weight * self.receiver_normal.dot(point) / (distance2 * distance2);
            }
            sum += area * mean;
        }
        sum * self.distance / std::f64::consts::PI
    }
}

/// Angle between two directions divided by the length of their cross product.
fn angle_ratio(from: DVec3, to: DVec3) -> f64 {
    let sine = from.cross(to - from).length();
    let cosine = from.dot(to);
    // The limit for parallel directions; opposite ones would put the receiver on the edge, thus in the plane.
    if sine > 0.0 { sine.atan2(cosine) / sine } else { 1.0 / cosine }
}

/// Share of the receiver's cosine-weighted hemisphere that `source` fills, if nothing blocks it.
///
/// Whichever way the source faces: whether it sends light to that side is for the caller to decide. Exactly 0 when
/// the receiver lies in the source's plane or the source is below the receiver's horizon.
pub fn unoccluded_form_factor(receiver: &Receiver, source: &ConvexPolygon) -> f64 {
    let mut fragments = Fragments::default();
    SeenSource::look(receiver, source, &mut fragments)
        .map_or(0.0, |seen| seen.form_factor(fragments.outline(0)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radons_rule_follows_from_its_roots() {
        let root = 15.0_f64.sqrt();
        let (weight, [_, a, _]) = RADON_RULE[1];
        assert!((a - (6.0 - root) / 21.0).abs() < 1e-16);
        assert!((weight - (155.0 - root) / 1200.0).abs() < 1e-16);
        let (weight, [_, b, _]) = RADON_RULE[4];
        assert!((b - (6.0 + root) / 21.0).abs() < 1e-16);
        assert!((weight - (155.0 + root) / 1200.0).abs() < 1e-16);
    }

    #[test]
    fn radons_rule_is_exact_to_degree_5() {
        // The mean of u^i v^j over a triangle is 2 i! j! / (i + j + 2)!
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for i in 0..=5 {
            for j in 0..=5 - i {
                let rule: f64 = RADON_RULE.iter().map(|(w, [u, v, _])| w * u.powi(i) * v.powi(j)).sum();
                let exact = 2.0 * factorial(i) * factorial(j) / factorial(i + j + 2);
                assert!((rule - exact).abs() < 1e-15, "u^{i} v^{j}: {rule} instead of {exact}");
            }
        }
    }
}
