//! Scenes and differences for the tests of the shadow boundaries.

mod completeness;
mod lines;
mod strength;

use glam::{DMat3, DQuat, DVec3, EulerRot};
use rustc_hash::FxHashSet;

use super::boundary::{Plane, trace};
use super::silhouette::BlockerEdges;
use super::wedge::{Wedge, WedgeCache};
use crate::visibility::{ConvexPolygon, Receiver, Scratch, visible_form_factor};

/// The same numbers on every machine: `SplitMix64` (Steele, Lea, Flood 2014).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        low + (high - low) * ((z >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    pub(super) fn rotation(&mut self) -> DMat3 {
        let mut angle = || self.between(0.0, std::f64::consts::TAU);
        DMat3::from_quat(DQuat::from_euler(EulerRot::ZXZ, angle(), angle(), angle()))
    }
}

pub(super) fn polygon(outline: &[DVec3]) -> ConvexPolygon {
    ConvexPolygon::new(outline).expect("test polygons have area")
}

/// Polygons of faces that index corners, after a map of the corners.
pub(super) fn solid<const N: usize>(
    corners: &[DVec3],
    faces: &[[usize; N]],
    place: impl Fn(DVec3) -> DVec3,
) -> Vec<ConvexPolygon> {
    let corners: Vec<DVec3> = corners.iter().map(|&corner| place(corner)).collect();
    faces.iter().map(|face| polygon(&face.map(|corner| corners[corner]))).collect()
}

/// The cube from -1 to 1, facing outwards.
pub(super) fn cube(place: impl Fn(DVec3) -> DVec3) -> Vec<ConvexPolygon> {
    let side = |bit: usize| if bit == 0 { -1.0 } else { 1.0 };
    let corners: [DVec3; 8] =
        std::array::from_fn(|i| DVec3::new(side(i & 1), side(i >> 1 & 1), side(i >> 2 & 1)));
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    solid(&corners, &faces, place)
}

pub(super) fn cuboid(center: DVec3, half: DVec3) -> Vec<ConvexPolygon> {
    cube(|corner| center + half * corner)
}

pub(super) fn tetrahedron(place: impl Fn(DVec3) -> DVec3) -> Vec<ConvexPolygon> {
    let corners = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]].map(DVec3::from);
    solid(&corners, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], place)
}

/// The square from -1 to 1 in x and y.
pub(super) fn card(place: impl Fn(DVec3) -> DVec3) -> Vec<ConvexPolygon> {
    let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]].map(DVec3::from);
    solid(&corners, &[[0, 1, 2, 3]], place)
}

/// A square that sends down.
pub(super) fn light(center: DVec3, half: f64) -> ConvexPolygon {
    let corner = |x, y| center + DVec3::new(x, y, 0.0) * half;
    polygon(&[corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)])
}

/// A line on the floor, and the wedge that throws it.
pub(super) struct Line {
    pub(super) wedge: Wedge,
    pub(super) ends: [DVec3; 2],
}

/// Where a scan of the floor from `x` along `direction` crosses a segment.
pub(super) fn crossing([a, b]: [DVec3; 2], x: DVec3, direction: DVec3) -> Option<f64> {
    let side = |end: DVec3| direction.cross(end - x).z;
    let (s_a, s_b) = (side(a), side(b));
    (s_a * s_b <= 0.0 && s_a != s_b).then(|| direction.dot(a + (b - a) * (s_a / (s_a - s_b)) - x))
}

/// A source and blockers over the floor z = 0, which is lit from above.
pub(super) struct Scene {
    pub(super) source: ConvexPolygon,
    pub(super) blockers: Vec<ConvexPolygon>,
    pub(super) edges: BlockerEdges,
    scratch: Scratch,
}

/// Metres around the origin of the floor.
pub(super) const REACH: f64 = 20.0;

impl Scene {
    pub(super) fn new(source: ConvexPolygon, blockers: Vec<ConvexPolygon>) -> Self {
        Self { edges: BlockerEdges::new(&blockers), source, blockers, scratch: Scratch::new() }
    }

    pub(super) fn wedges(&self) -> Vec<Wedge> {
        let cache = WedgeCache::new(&self.source, &self.edges, &self.blockers);
        let mut known = FxHashSet::default();
        (0..self.blockers.len() as u32)
            .flat_map(|blocker| cache.wedges(blocker).to_vec())
            .filter(|wedge| known.insert(wedge.id))
            .collect()
    }

    pub(super) fn lines(&self) -> Vec<Line> {
        let floor = Plane { point: DVec3::ZERO, normal: DVec3::Z };
        (self.wedges().into_iter())
            .filter_map(|wedge| trace(&wedge, &floor, REACH).map(|ends| Line { wedge, ends }))
            .collect()
    }

    /// The visible form factor of the source, if it sends to the point.
    pub(super) fn light_at(&mut self, x: DVec3) -> f64 {
        if self.source.normal().dot(x - self.source.vertices()[0]) <= 0.0 {
            return 0.0;
        }
        let candidates: Vec<u32> = (0..self.blockers.len() as u32).collect();
        let receiver = Receiver::new(x, DVec3::Z);
        visible_form_factor(&receiver, &self.source, &self.blockers, &candidates, &mut self.scratch)
            .expect("test scenes are simple")
            .value
    }
}
