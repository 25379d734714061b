//! The fallback for crowds of blockers: stratified shadow rays to points on the source (the paper's visibility test,
//! after Wallace, Elmquist and Haines 1989).
//!
//! Used only where the exact test would cost more than it is worth; every use is counted and reported. The rays of a
//! receiver depend on its number alone, so the result is the same on any number of threads.

use glam::DVec3;

use crate::visibility::blockers::Blockers;
use crate::visibility::packet::PACKET;
use crate::visibility::{ConvexPolygon, Receiver};

/// Generators of the R2 sequence (Roberts 2018): the two-dimensional golden ratio's inverse powers.
const R2: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Rays from a receiver to a source, as many as were sent so far.
pub(crate) struct ShadowRays<'a> {
    receiver: &'a Receiver,
    source: &'a ConvexPolygon,
    blockers: &'a Blockers,
    shift: [f64; 2],
    sent: u32,
    /// Sums of the form factor's kernel: of what arrives, per channel, and of all.
    visible: DVec3,
    total: f64,
}

impl<'a> ShadowRays<'a> {
    /// None yet. `seed`: where they go.
    pub(crate) fn new(
        receiver: &'a Receiver,
        source: &'a ConvexPolygon,
        blockers: &'a Blockers,
        seed: u64,
    ) -> Self {
        let shift = [unit(splitmix(seed)), unit(splitmix(seed ^ 0x9E37_79B9_7F4A_7C15))];
        Self { receiver, source, blockers, shift, sent: 0, visible: DVec3::ZERO, total: 0.0 }
    }

    /// Sends more, until there are so many.
    pub(crate) fn send(&mut self, count: u32) {
        let rays = self.sent..count;
        self.sent = count;
        let mut weighed = rays.filter_map(|i| {
            let point = point_on(self.source, spread(self.shift, i + 1));
            let to = point - self.receiver.position;
            let distance_squared = to.length_squared();
            let weight = self.receiver.normal.dot(to) * self.source.normal().dot(to).abs()
                / (distance_squared * distance_squared);
            (weight > 0.0).then_some((point, weight))
        });
        while let Some((first, weight)) = weighed.next() {
            let (mut points, mut weights, mut packed) = ([first; PACKET], [weight; PACKET], 1);
            for (point, weight) in weighed.by_ref().take(PACKET - 1) {
                (points[packed], weights[packed]) = (point, weight);
                packed += 1;
            }
            // The source may be a surface, which does not block its own light however the point on it is rounded.
            let light = self.blockers.between_all(self.receiver.position, &points);
            for (light, weight) in light.into_iter().zip(weights).take(packed) {
                self.total += weight;
                self.visible += weight * light;
            }
        }
    }

    /// How many were sent.
    pub(crate) fn sent(&self) -> u32 {
        self.sent
    }

    /// The visible share of the source's light, per channel: the unblocked share of the form factor's kernel. Times the exact
    /// unblocked form factor it is exact where all rays rightly agree.
    pub(crate) fn share(&self) -> DVec3 {
        if self.total > 0.0 { self.visible / self.total } else { DVec3::ZERO }
    }
}

/// The k-th of points that cover a unit square evenly, however many there are; `shift` moves them all.
pub(crate) fn spread(shift: [f64; 2], k: u32) -> [f64; 2] {
    std::array::from_fn(|axis| (shift[axis] + R2[axis] * f64::from(k)).fract())
}

/// A point of the polygon, uniform in area: `u` picks a triangle of its fan, then both fold into the triangle.
pub(crate) fn point_on(polygon: &ConvexPolygon, [u, v]: [f64; 2]) -> DVec3 {
    let vertices = polygon.vertices();
    let apex = vertices[0];
    let double_area = |i: usize| (vertices[i] - apex).cross(vertices[i + 1] - apex).dot(polygon.normal());
    let mut at = u * (1..vertices.len() - 1).map(double_area).sum::<f64>();
    for i in 1..vertices.len() - 1 {
        let area = double_area(i);
        if at < area || i == vertices.len() - 2 {
            let s = (at / area).clamp(0.0, 1.0).sqrt();
            return apex + s * (1.0 - v) * (vertices[i] - apex) + s * v * (vertices[i + 1] - apex);
        }
        at -= area;
    }
    apex
}

/// Steele, Lea and Flood's splitmix64: neighbouring seeds give unrelated values.
pub(crate) fn splitmix(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// From 64 random bits to a number in 0..1.
pub(crate) fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}
