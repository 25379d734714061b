//! Rays through everything that blocks light: what they meet first, and what a segment crosses.

use glam::DVec3;
use obvhs::ray::{Ray, RayHit};
use smallvec::SmallVec;

use crate::visibility::blockers::Blockers;
use crate::visibility::{ConvexPolygon, grey};

/// Share of the way between two surfaces that a ray leaves out at each end: far above the rounding of the points and of
/// the planes that they lie in, far below what could stand in between.
pub(super) const OFF_THE_SURFACE: f64 = 1e-9;

/// Where a ray first meets a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    pub(crate) polygon: u32,
    /// Whether it meets the side of the polygon's normal.
    pub(crate) front: bool,
    /// Metres.
    pub(crate) distance: f64,
}

impl Blockers {
    /// Share of light, per channel, that goes from one point to another of surfaces, which block nothing themselves
    /// however their points are rounded.
    pub(crate) fn between(&self, from: DVec3, to: DVec3) -> DVec3 {
        self.along_segment(from, to, |panel, span| panel.stands_between(from, span))
    }

    /// Share of light, per channel, that goes along the open segment between two points.
    pub(crate) fn through_segment(&self, from: DVec3, to: DVec3) -> DVec3 {
        self.along_segment(from, to, |panel, span| panel.is_crossed(from, span))
    }

    /// Share of light, per channel, that passes those polygons on a segment that block, given the whole of it.
    fn along_segment(&self, from: DVec3, to: DVec3, blocks: impl Fn(&Panel, DVec3) -> bool) -> DVec3 {
        if self.blocking().all_opaque() {
            return if self.meets(from, to, blocks) { DVec3::ZERO } else { DVec3::ONE };
        }
        let mut passed: SmallVec<[u32; 8]> = SmallVec::new();
        let stops = |panel: &Panel, span| {
            blocks(panel, span) && {
                passed.push(panel.polygon);
                self.blocking().is_opaque(panel.polygon)
            }
        };
        if self.meets(from, to, stops) {
            return DVec3::ZERO;
        }
        // The tree's order depends on its builder.
        passed.sort_unstable();
        passed.iter().map(|&id| self.blocking().transmittance(id)).product()
    }

    /// Whether what is asked holds for any of the polygons that the open segment between two points crosses.
    pub(crate) fn is_crossed(&self, from: DVec3, to: DVec3, asked: impl Fn(u32) -> bool) -> bool {
        self.meets(from, to, |panel, span| panel.is_crossed(from, span) && asked(panel.polygon))
    }

    /// Whether what is asked of a polygon and the whole segment holds for any that may lie on it.
    fn meets(&self, from: DVec3, to: DVec3, mut asked: impl FnMut(&Panel, DVec3) -> bool) -> bool {
        let Some(tree) = self.tree() else { return false };
        let span = to - from;
        // Of length one: obvhs takes components below f32's epsilon for zero, which all are in a scene of a micrometre.
        let length = span.length();
        let Some(direction) = (span / length).as_vec3a().try_normalize() else { return false };
        let slack = self.slack();
        let ray = Ray::new(from.as_vec3a(), direction, -slack, length as f32 + slack);
        !tree.ray_traverse_miss(
            ray,
            |_, primitive| {
                if asked(self.panel(primitive), span) { 0.0 } else { f32::INFINITY }
            },
        )
    }

    /// The polygon that stops a ray from a surface: of filters as often as they do, over random numbers.
    ///
    /// `chance`: 0 to 1, which filter stops it.
    pub(crate) fn first_stop(&self, from: DVec3, direction: DVec3, mut chance: f64) -> Option<Hit> {
        let mut hit = self.first_hit(from, direction)?;
        let mut travelled = 0.0;
        loop {
            let through = grey(self.blocking().transmittance(hit.polygon));
            if chance >= through {
                break;
            }
            chance /= through;
            travelled += hit.distance;
            hit = self.first_hit(from + travelled * direction, direction)?;
        }
        Some(Hit { distance: travelled + hit.distance, ..hit })
    }

    /// The first polygon that a ray from a surface meets; the surface itself is left out.
    ///
    /// `direction`: of length one.
    pub(crate) fn first_hit(&self, from: DVec3, direction: DVec3) -> Option<Hit> {
        self.first_hit_within(from, direction, f64::INFINITY)
    }

    /// The same where only what is near counts: nearer than `reach`, metres.
    pub(crate) fn first_hit_within(&self, from: DVec3, direction: DVec3, reach: f64) -> Option<Hit> {
        let tree = self.tree()?;
        let slack = self.slack();
        let ray = Ray::new(from.as_vec3a(), direction.as_vec3a(), -slack, reach as f32 + slack);
        let nearest = OFF_THE_SURFACE * self.diagonal();
        let mut first: Option<Hit> = None;
        tree.ray_traverse(ray, &mut RayHit::none(), |_, primitive| {
            let panel = self.panel(primitive);
            let along = panel.normal.dot(direction);
            let distance = panel.height(from) / along;
            let farthest = first.map_or(reach, |hit| hit.distance);
            // A ray along the plane has an infinite distance, or none.
            if !(distance > nearest && distance < farthest && panel.planes(from).enclose(direction)) {
                return f32::INFINITY;
            }
            first = Some(Hit { polygon: panel.polygon, front: along < 0.0, distance });
            self.beyond(distance)
        });
        first
    }

    /// What the f32 tree's rays begin before their start and go on beyond their end: the boxes are grown by their own
    /// rounding, and a ray's origin is rounded the same way.
    pub(super) fn slack(&self) -> f32 {
        (self.diagonal() * f64::from(f32::EPSILON) * 4.0) as f32
    }

    /// A distance at which the f32 tree surely still meets what is at the given one: what it compares with is rounded, and so
    /// are its boxes.
    pub(super) fn beyond(&self, distance: f64) -> f32 {
        distance as f32 * (1.0 + 4.0 * f32::EPSILON) + self.slack()
    }
}

/// A triangle or quadrilateral as rays need it.
pub(super) struct Panel {
    pub(super) normal: DVec3,
    /// A triangle's last corner is there twice: an edge of no length has everything on both sides.
    corners: [DVec3; 4],
    pub(super) polygon: u32,
}

impl Panel {
    pub(super) fn new(index: u32, polygon: &ConvexPolygon) -> Self {
        let vertices = polygon.vertices();
        let last = vertices.len() - 1;
        Self {
            normal: polygon.normal(),
            corners: std::array::from_fn(|k| vertices[k.min(last)]),
            polygon: index,
        }
    }

    /// One that no ray meets.
    pub(super) fn nowhere() -> Self {
        Self { normal: DVec3::ZERO, corners: [DVec3::ZERO; 4], polygon: u32::MAX }
    }

    /// How far its plane is above a point, along its normal, metres.
    pub(super) fn height(&self, from: DVec3) -> f64 {
        self.normal.dot(self.corners[0] - from)
    }

    /// The planes through a point and each of its edges.
    pub(super) fn planes(&self, from: DVec3) -> EdgePlanes {
        let [a, b, c, d] = self.corners.map(|corner| corner - from);
        EdgePlanes([a.cross(b), b.cross(c), c.cross(d), d.cross(a)])
    }

    /// Whether the open segment `from + t·span`, 0 < t < 1, crosses it.
    fn is_crossed(&self, from: DVec3, span: DVec3) -> bool {
        let start = self.height(from);
        let end = self.height(from + span);
        start * end < 0.0 && self.planes(from).enclose(span)
    }

    /// The same for a segment between two surfaces.
    fn stands_between(&self, from: DVec3, span: DVec3) -> bool {
        self.is_passed(self.height(from), span) && self.planes(from).enclose(span)
    }

    /// Whether a segment between two surfaces, from a point so far below its plane, passes the plane between them.
    pub(super) fn is_passed(&self, height: f64, span: DVec3) -> bool {
        let rise = self.normal.dot(span);
        (height - OFF_THE_SURFACE * rise) * (height - (1.0 - OFF_THE_SURFACE) * rise) < 0.0
    }
}

/// Normals of the planes through a point and the edges of a polygon.
pub(super) struct EdgePlanes([DVec3; 4]);

impl EdgePlanes {
    /// Whether the line through the point in this direction passes inside: on the same side of every edge. Signs of volumes,
    /// nothing is projected.
    pub(super) fn enclose(&self, direction: DVec3) -> bool {
        let sides = self.0.map(|normal| normal.dot(direction));
        sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::rays::{splitmix, unit};

    #[test]
    fn segment_is_blocked_by_what_it_crosses_and_by_nothing_else() {
        let square = |z: f64| {
            let corner = |x, y| DVec3::new(x, y, z);
            ConvexPolygon::new(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)])
                .expect("a square has an area")
        };
        let blockers = Blockers::opaque(vec![square(0.0), square(1.0)], 2.0);
        let blocked = |from, to| blockers.through_segment(from, to) == DVec3::ZERO;
        let at = DVec3::new;
        assert!(blocked(at(0.5, 0.5, -1.0), at(0.5, 0.5, 0.5)));
        assert!(!blocked(at(0.5, 0.5, 0.1), at(0.5, 0.5, 0.9)));
        assert!(!blocked(at(1.5, 0.5, -1.0), at(1.5, 0.5, 2.0)));
        // A segment that starts or ends on a polygon does not cross it.
        assert!(!blocked(at(0.5, 0.5, 0.0), at(0.2, 0.3, 1.0)));
    }

    /// Points of a unit cube, one after the other.
    fn points() -> impl FnMut() -> DVec3 {
        let mut random = 0;
        let mut unit = move || {
            random += 1;
            unit(splitmix(random))
        };
        move || DVec3::new(unit(), unit(), unit())
    }

    /// Somewhere in the cube, of edges shorter than `size`.
    fn triangles(mut point: impl FnMut() -> DVec3, count: usize, size: f64) -> Vec<ConvexPolygon> {
        (0..count)
            .filter_map(|_| {
                let [at, along, across] = [point(), point() - 0.5, point() - 0.5];
                ConvexPolygon::triangle(at, at + size * along, at + size * across)
            })
            .collect()
    }

    #[test]
    fn four_rays_together_meet_what_each_meets_alone() {
        let mut point = points();
        let polygons = triangles(&mut point, 2000, 0.1);
        let blockers = Blockers::opaque(polygons, 3.0_f64.sqrt());
        let (mut hits, mut misses) = (0, 0);
        for _ in 0..2000 {
            let from = point();
            let straight = [DVec3::X, DVec3::NEG_Y, DVec3::Z];
            let mut directions = std::array::from_fn(|_| (point() - 0.5).normalize());
            directions[3] = straight[(hits % 3) as usize];
            for (hit, direction) in blockers.first_hits(from, &directions).into_iter().zip(directions) {
                assert_eq!(hit, blockers.first_hit(from, direction));
                *if hit.is_some() { &mut hits } else { &mut misses } += 1;
            }
        }
        assert!(hits > 1000 && misses > 1000, "{hits} hits, {misses} misses");
    }

    #[test]
    fn four_segments_together_are_blocked_where_each_is() {
        let mut point = points();
        let polygons = triangles(&mut point, 500, 0.3);
        let corners: Vec<DVec3> = polygons.iter().map(|polygon| polygon.vertices()[0]).collect();
        let blockers = Blockers::opaque(polygons, 3.0_f64.sqrt());
        let (mut blocked, mut free) = (0, 0);
        for round in 0..2000 {
            let from = if round % 3 == 0 { corners[round % corners.len()] } else { point() };
            // Near each other and far, to corners of what blocks, and along an axis
            let near = point();
            let mut to =
                std::array::from_fn(|k| if k == 0 { near } else { near + 0.01 * k as f64 * point() });
            to[2] = corners[(7 * round) % corners.len()];
            to[3] = if round % 5 == 0 { from } else { from + point() * DVec3::X };
            for (light, to) in blockers.between_all(from, &to).into_iter().zip(to) {
                assert_eq!(light, blockers.between(from, to));
                *if light == DVec3::ZERO { &mut blocked } else { &mut free } += 1;
            }
        }
        assert!(blocked > 1000 && free > 1000, "{blocked} blocked, {free} free");
    }
}
