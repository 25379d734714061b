//! The form factor of a convex outline that lies above the receiver's horizon.
//!
//! Lambert's contour formula (1760), `F = Σ θ_i (n · c_i/|c_i|) / 2π` with `c_i = v_i × v_{i+1}` and `θ_i` the angle
//! between them, loses all digits where the outline is small: its terms are of the size of the outline, its sum of
//! the size of the area (94 % wrong at a size of 2.4e-9 of the distance). It is therefore summed about the area, and
//! replaced by a quadrature where the outline is smaller still.

use glam::DVec3;

use super::clip::{Outline, Plane, Vertex, keep_inside, plane_distance};
use super::polygon::{ConvexPolygon, Receiver};

/// Size of an outline, relative to its distance, below which a quadrature of degree 5 replaces the contour.
///
/// The contour about the area loses `1/size` epsilons, the rule's error grows with the sixth power of the size.
/// Measured on squares turned and tilted, they differ by 3e-14 here and by more on either side: 3e-13 at 0.001 (the
/// contour's error), 5e-10 at 0.1 (the rule's).
const QUADRATURE_SIZE: f64 = 0.01;

/// Radon's rule of degree 5 for a triangle (1948): weight and barycentric coordinates of each point.
/// `a = (6 ∓ √15)/21` has the weight `(155 ∓ √15)/1200`, the centroid 9/40.
pub(crate) const RADON_RULE: [(f64, [f64; 3]); 7] = {
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

/// What directions from the receiver, of any length, are worth: 0 to a few.
pub(crate) type Weight<'a> = &'a (dyn Fn(DVec3) -> f64 + 'a);

/// Share of a source's form factor up to which a weighted part may be wrong before it is quartered. Such weights fade
/// to 0 with a bend, behind which no rule is exact: 1e-5 of a source is a thousandth of the default tolerance.
const WEIGHTED_ERROR: f64 = 1e-5;

/// Times that a part is quartered for its weight: a weight that jumps is then resolved to a thousandth of the area.
const MOST_QUARTERINGS: u32 = 5;

/// A source as a receiver sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeenSource {
    receiver_normal: DVec3,
    /// Unit normal that points away from the receiver; the outline is counter-clockwise about it, so that the plane
    /// through each edge has the outline to its left.
    normal: DVec3,
    /// Distance of the source's plane from the receiver, above 0.
    distance: f64,
    /// The half-space on the receiver's side of the source's plane.
    nearer: Plane,
}

impl SeenSource {
    /// Looks at `source` and puts what is above the receiver's horizon into `outline`, relative to the receiver.
    /// `None` when that is nothing or the receiver lies in the source's plane.
    pub(super) fn look(receiver: &Receiver, source: &ConvexPolygon, outline: &mut Outline) -> Option<Self> {
        let world = source.extent().max(receiver.position.abs().max_element());
        let distance = plane_distance(source, receiver.position, world);
        if distance == 0.0 {
            return None;
        }
        outline.clear();
        for &vertex in source.vertices() {
            outline.push(Vertex::new(vertex - receiver.position));
        }
        if distance < 0.0 {
            outline.reverse();
        }
        keep_inside(outline, &Plane::through_receiver(receiver.normal)).then(|| Self {
            receiver_normal: receiver.normal,
            normal: source.normal() * distance.signum(),
            distance: distance.abs(),
            nearer: Plane::beyond(source, distance, world).flipped(),
        })
    }

    /// The half-space on the receiver's side of the source's plane.
    pub(super) fn nearer(&self) -> Plane {
        self.nearer
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
    /// for any `w`. `S` is computed from differences of vertices, which cancel nothing. With `w = 1/max |v_i|²`,
    /// which no `w_i` is below, every term stays below an angle, also where the receiver nearly touches an edge.
    fn by_contour(&self, outline: &[Vertex]) -> f64 {
        let origin = outline[0].point;
        let farthest2 = outline.iter().map(|v| v.point.length_squared()).fold(0.0, f64::max);
        let common = 1.0 / farthest2;
        let mut area_vector = DVec3::ZERO;
        let mut rest = 0.0;
        let mut from = outline[outline.len() - 1].point;
        let mut from2 = from.length_squared();
        for to in outline.iter().map(|vertex| vertex.point) {
            let (edge, to2) = (to - from, to.length_squared());
            // From the nearer end, or an edge that passes beside the receiver loses its direction.
            let normal = if from2 < to2 { from.cross(edge) } else { to.cross(edge) };
            area_vector += (from - origin).cross(edge);
            rest += (angle_ratio(normal, from.dot(to)) - common) * self.receiver_normal.dot(normal);
            (from, from2) = (to, to2);
        }
        (common * self.receiver_normal.dot(area_vector) + rest) / std::f64::consts::TAU
    }

    /// Radon's rule on the fan of triangles about the first vertex.
    fn by_quadrature(&self, outline: &[Vertex]) -> f64 {
        let a = outline[0].point;
        let triangles = outline.windows(2).skip(1).map(|edge| [a, edge[0].point, edge[1].point]);
        triangles.map(|triangle| self.of_triangle(triangle, |_| 1.0)).sum::<f64>() * self.distance
            / std::f64::consts::PI
    }

    /// Radon's rule on one triangle, with each direction times its weight: the form factor times `pi/distance`.
    fn of_triangle(&self, [a, b, c]: [DVec3; 3], weight: impl Fn(DVec3) -> f64) -> f64 {
        let area = 0.5 * self.normal.dot((b - a).cross(c - a));
        let mut mean = 0.0;
        for (share, [u, v, w]) in RADON_RULE {
            let point = a * u + b * v + c * w;
            let distance2 = point.length_squared();
            mean += share * weight(point) * self.receiver_normal.dot(point) / (distance2 * distance2);
        }
        area * mean
    }

    /// Form factor from the receiver to a fragment of the source with every direction times its weight: the rule on
    /// triangles that are quartered until halving them changes nothing that matters beside `whole`, the source's.
    pub(super) fn weighted_form_factor(&self, outline: &[Vertex], weight: Weight, whole: f64) -> f64 {
        let scale = self.distance / std::f64::consts::PI;
        let error = WEIGHTED_ERROR * whole / scale;
        let a = outline[0].point;
        let sum: f64 = (outline.windows(2).skip(1))
            .map(|edge| {
                let triangle = [a, edge[0].point, edge[1].point];
                self.quartered(triangle, weight, self.of_triangle(triangle, weight), error, MOST_QUARTERINGS)
            })
            .sum();
        sum * scale
    }

    fn quartered(&self, [a, b, c]: [DVec3; 3], weight: Weight, coarse: f64, error: f64, left: u32) -> f64 {
        let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        let values = quarters.map(|quarter| self.of_triangle(quarter, weight));
        let fine: f64 = values.iter().sum();
        if left == 0 || (fine - coarse).abs() <= error {
            return fine;
        }
        // Errors of the parts have signs of their own: half of it for each adds up to less.
        (quarters.into_iter().zip(values))
            .map(|(quarter, value)| self.quartered(quarter, weight, value, 0.5 * error, left - 1))
            .sum()
    }
}

/// Angle between two directions divided by the length of their cross product; `cosine` is their dot product.
///
/// Up to 33 degrees it is a function of the squared tangent alone, which needs neither a root nor `atan2` and is the
/// same on every platform.
fn angle_ratio(cross: DVec3, cosine: f64) -> f64 {
    let (sine2, cosine2) = (cross.length_squared(), cosine * cosine);
    if cosine > 0.0 && sine2 < ATAN_RANGE * ATAN_RANGE * cosine2 {
        return atan_ratio(sine2 / cosine2) / cosine;
    }
    let sine = sine2.sqrt();
    // On the edge itself, which a sliver's plane may miss by its own rounding, the edge spans no plane with the receiver.
    if sine == 0.0 { 0.0 } else { sine.atan2(cosine) / sine }
}

/// The tangent up to which [`atan_ratio`] holds.
const ATAN_RANGE: f64 = 0.66;

/// `atan(t)/t` from `t²`, for `t` up to [`ATAN_RANGE`]: the rational approximation of Cephes (Moshier 1989), whose
/// relative error is below an epsilon.
fn atan_ratio(t2: f64) -> f64 {
    const P: [f64; 5] = [
        -8.750_608_600_031_904e-1,
        -1.615_753_718_733_365e1,
        -7.500_855_792_314_705e1,
        -1.228_866_684_490_136_1e2,
        -6.485_021_904_942_025e1,
    ];
    const Q: [f64; 5] = [
        2.485_846_490_142_306_3e1,
        1.650_270_098_316_988_6e2,
        4.328_810_604_912_902_7e2,
        4.853_903_996_359_137e2,
        1.945_506_571_482_614e2,
    ];
    let p = (((P[0] * t2 + P[1]) * t2 + P[2]) * t2 + P[3]) * t2 + P[4];
    let q = ((((t2 + Q[0]) * t2 + Q[1]) * t2 + Q[2]) * t2 + Q[3]) * t2 + Q[4];
    1.0 + t2 * p / q
}

/// Share of the receiver's cosine-weighted hemisphere that `source` fills, if nothing blocks it.
///
/// Whichever way the source faces: whether it sends light to that side is for the caller to decide. Exactly 0 when
/// the receiver lies in the source's plane or the source is below the receiver's horizon.
pub fn unoccluded_form_factor(receiver: &Receiver, source: &ConvexPolygon) -> f64 {
    unoccluded_weighted(receiver, source, None)
}

/// The same, with every direction times its weight.
pub(crate) fn unoccluded_weighted(
    receiver: &Receiver,
    source: &ConvexPolygon,
    weight: Option<Weight>,
) -> f64 {
    let mut outline = Outline::new();
    SeenSource::look(receiver, source, &mut outline).map_or(0.0, |seen| {
        let whole = seen.form_factor(&outline);
        match weight {
            None => whole.clamp(0.0, 1.0),
            Some(weight) => seen.weighted_form_factor(&outline, weight, whole).max(0.0),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn atan_ratio_is_the_arc_tangent() {
        for i in 1..=66_000 {
            let t = f64::from(i) * 1e-5;
            let error = atan_ratio(t * t) * t / t.atan() - 1.0;
            assert!(error.abs() <= 2.0 * f64::EPSILON, "atan {t}: relative error {error:e}");
        }
        assert_eq!(atan_ratio(0.0), 1.0);
    }

    /// Worst relative difference between the two methods over squares of this size at distance 1, turned and tilted.
    fn worst_disagreement(size: f64) -> f64 {
        let mut worst = 0.0_f64;
        for i in 0..1000 {
            let (turn, tilt) = (0.1 * f64::from(i), 1.2 * (f64::from(i) * 0.7).sin());
            let u = DVec3::new(turn.cos(), turn.sin(), 0.0);
            let v = DVec3::new(-turn.sin() * tilt.cos(), turn.cos() * tilt.cos(), tilt.sin());
            let side = size * std::f64::consts::FRAC_1_SQRT_2;
            let corner = DVec3::new(0.0, 0.0, 1.0);
            let corners = [corner, corner + side * u, corner + side * (u + v), corner + side * v];
            let source = ConvexPolygon::new(&corners).expect("it has area");
            let receiver = Receiver::new(DVec3::ZERO, DVec3::new(0.6, 0.0, 0.8));
            let mut outline = Outline::new();
            let seen = SeenSource::look(&receiver, &source, &mut outline).expect("it is above");
            worst = worst.max((seen.by_quadrature(&outline) / seen.by_contour(&outline) - 1.0).abs());
        }
        worst
    }

    #[test]
    fn both_methods_agree_where_they_meet() {
        let worst = worst_disagreement(QUADRATURE_SIZE);
        assert!(worst < 1e-13, "{worst:e}");
    }

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
