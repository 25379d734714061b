//! Four rays from one point at a time: they visit the search tree together, and share what a polygon looks like from there.
//!
//! Who looks around sends hundreds of rays from one point. What they cost is memory that has to be fetched, and neighbours
//! on the hemisphere fetch much the same (coherent packets, Wald, Slusallek, Benthin, Wagner 2001).

use glam::{DVec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::ray::safe_inverse;
use smallvec::SmallVec;

use crate::visibility::blockers::Blockers;
use crate::visibility::trace::{Hit, OFF_THE_SURFACE};

/// Rays in a packet.
pub(crate) const PACKET: usize = 4;

/// Rays from one point as the tree meets them: one to a lane.
struct Packet {
    origin: Vec3A,
    /// Per axis.
    inverse_directions: [Vec4; 3],
    /// How far before the point boxes are met, as its rounding asks.
    behind: f32,
    /// Distances beyond which nothing is met.
    reach: Vec4,
}

impl Packet {
    /// Distance at which the first of the rays enters a box; infinite where none does.
    fn enters(&self, aabb: &Aabb) -> f32 {
        let (low, high) = (aabb.min - self.origin, aabb.max - self.origin);
        let [x, y, z] = self.inverse_directions;
        let [x, y, z] = [(x * low.x, x * high.x), (y * low.y, y * high.y), (z * low.z, z * high.z)];
        let enters = x.0.min(x.1).max(y.0.min(y.1)).max(z.0.min(z.1)).max(Vec4::splat(-self.behind));
        let leaves = x.0.max(x.1).min(y.0.max(y.1)).min(z.0.max(z.1)).min(self.reach);
        Vec4::select(enters.cmple(leaves), enters, Vec4::INFINITY).min_element()
    }
}

impl Blockers {
    /// The first polygons that rays from a point of a surface meet, the surface itself left out: what
    /// [`Self::first_hit`] finds for each.
    ///
    /// `directions`: of length one.
    pub(crate) fn first_hits(&self, from: DVec3, directions: &[DVec3; PACKET]) -> [Option<Hit>; PACKET] {
        let mut hits = [None; PACKET];
        self.visit_together(from, directions, Vec4::INFINITY, |primitive, reach| {
            self.meet(primitive, from, directions, &mut hits, reach);
        });
        hits
    }

    /// Share of light, per channel, that goes from one point to others of surfaces: what [`Self::between`] finds for each.
    pub(crate) fn between_all(&self, from: DVec3, to: &[DVec3; PACKET]) -> [DVec3; PACKET] {
        let spans = to.map(|to| to - from);
        let lengths = spans.map(DVec3::length);
        if !self.blocking().all_opaque() || !lengths.iter().all(|length| length.is_normal()) {
            return to.map(|to| self.between(from, to));
        }
        let directions = std::array::from_fn(|k| spans[k] / lengths[k]);
        let mut is_blocked = [false; PACKET];
        let reach = Vec4::from_array(lengths.map(|length| self.beyond(length)));
        self.visit_together(from, &directions, reach, |primitive, reach| {
            let panel = self.panel(primitive);
            let height = panel.height(from);
            let passed: [bool; PACKET] =
                std::array::from_fn(|k| !is_blocked[k] && panel.is_passed(height, spans[k]));
            if passed == [false; PACKET] {
                return;
            }
            let planes = panel.planes(from);
            for k in (0..PACKET).filter(|&k| passed[k]) {
                if planes.enclose(spans[k]) {
                    is_blocked[k] = true;
                    reach[k] = f32::NEG_INFINITY;
                }
            }
        });
        is_blocked.map(|blocked| if blocked { DVec3::ZERO } else { DVec3::ONE })
    }

    /// Visits what may be met by rays from one point, about the nearest first. Who is told of a polygon, by its place in the tree,
    /// may shorten the distances up to which something is looked for.
    fn visit_together(
        &self,
        from: DVec3,
        directions: &[DVec3; PACKET],
        reach: Vec4,
        mut meet: impl FnMut(usize, &mut Vec4),
    ) {
        let Some(tree) = self.tree() else { return };
        let inverses =
            |axis: usize| Vec4::from_array(std::array::from_fn(|k| safe_inverse(directions[k][axis] as f32)));
        let mut packet = Packet {
            origin: from.as_vec3a(),
            inverse_directions: [inverses(0), inverses(1), inverses(2)],
            behind: self.slack(),
            reach,
        };
        let mut open = SmallVec::<[(u32, f32); 96]>::new();
        open.push((0, packet.enters(tree.nodes[0].aabb())));
        while let Some((mut index, entered)) = open.pop() {
            if entered >= packet.reach.max_element() {
                continue;
            }
            // Down to a leaf, the nearer way first
            let node = loop {
                let node = &tree.nodes[index as usize];
                if node.is_leaf() {
                    break Some(node);
                }
                let [left, right] = [node.first_index, node.first_index + 1];
                let [to_left, to_right] = [left, right].map(|k| packet.enters(tree.nodes[k as usize].aabb()));
                let ((near, to_near), (far, to_far)) = if to_left <= to_right {
                    ((left, to_left), (right, to_right))
                } else {
                    ((right, to_right), (left, to_left))
                };
                if to_far < f32::INFINITY {
                    open.push((far, to_far));
                }
                if to_near == f32::INFINITY {
                    break None;
                }
                index = near;
            };
            if let Some(node) = node {
                for primitive in node.first_index..node.first_index + node.prim_count {
                    meet(primitive as usize, &mut packet.reach);
                }
            }
        }
    }

    /// Takes over a polygon for those rays that it is the nearest of so far.
    fn meet(
        &self,
        primitive: usize,
        from: DVec3,
        directions: &[DVec3; PACKET],
        hits: &mut [Option<Hit>; PACKET],
        reach: &mut Vec4,
    ) {
        let nearest = OFF_THE_SURFACE * self.diagonal();
        let panel = self.panel(primitive);
        let height = panel.height(from);
        let distances = directions.map(|direction| height / panel.normal.dot(direction));
        let is_nearer = |k: usize, hits: &[Option<Hit>; PACKET]| {
            distances[k] > nearest && distances[k] < hits[k].map_or(f64::INFINITY, |hit| hit.distance)
        };
        if !(0..PACKET).any(|k| is_nearer(k, hits)) {
            return;
        }
        let planes = panel.planes(from);
        for k in 0..PACKET {
            if is_nearer(k, hits) && planes.enclose(directions[k]) {
                let front = panel.normal.dot(directions[k]) < 0.0;
                hits[k] = Some(Hit { polygon: panel.polygon, front, distance: distances[k] });
                reach[k] = self.beyond(distances[k]);
            }
        }
    }
}
