//! The shaft between receivers and a source: the convex hull outside of which nothing can block
//! (Haines and Wallace, *Shaft Culling for Efficient Ray-Traced Radiosity*, 1991).
//!
//! Conservative: what it rejects cannot come between; what it keeps may not come between either.

use glam::DVec3;
use smallvec::SmallVec;

use crate::visibility::ConvexPolygon;

/// Slack of all side tests, relative to the distances in them: rounding of a dot product of f64 differences.
const ROUNDING: f64 = 1e-13;

/// A half-space `normal·p >= offset`.
#[derive(Debug, Clone, Copy)]
struct HalfSpace {
    normal: DVec3,
    offset: f64,
}

impl HalfSpace {
    /// Whether all of a box lies outside.
    fn excludes_box(&self, low: DVec3, high: DVec3) -> bool {
        let farthest = DVec3::select(self.normal.cmpge(DVec3::ZERO), high, low);
        self.normal.dot(farthest) < self.offset
    }
}

/// The hull of a set of receiver points and a source polygon.
#[derive(Debug, Clone)]
pub(crate) struct Shaft {
    low: DVec3,
    high: DVec3,
    sides: SmallVec<[HalfSpace; 24]>,
    /// The planes of the source and of a flat receiver. What lies in them hides nothing.
    caps: SmallVec<[HalfSpace; 2]>,
    slack: f64,
}

impl Shaft {
    /// Between receiver points, given with the edges of their hull, and a source.
    ///
    /// `receiver_plane`: a point on and the normal of a plane in front of which all light arrives, when there is one.
    pub(crate) fn new(
        points: &[DVec3],
        edges: &[[usize; 2]],
        source: &ConvexPolygon,
        receiver_plane: Option<(DVec3, DVec3)>,
    ) -> Self {
        let bounds = source_bounds(source);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in points.iter().chain(source.vertices()) {
            low = low.min(p);
            high = high.max(p);
        }
        let slack = ROUNDING * (high - low).length();
        let mut shaft = Self { low, high, sides: SmallVec::new(), caps: SmallVec::new(), slack };
        // Sides through an edge of the source and a receiver point, then the other way round.
        for i in 0..bounds.len() {
            let (a, b) = (bounds[i], bounds[(i + 1) % bounds.len()]);
            for &p in points {
                shaft.add_if_supporting(a, b, p, points, &bounds);
            }
        }
        for &[i, j] in edges {
            for &q in &bounds {
                shaft.add_if_supporting(points[i], points[j], q, points, &bounds);
            }
        }
        // Blockers behind the source, or behind the receivers' horizon, do not matter.
        let normal = source.normal();
        let source_offset = normal.dot(source.vertices()[0]);
        let in_front = points.iter().all(|&p| normal.dot(p) >= source_offset);
        let behind = points.iter().all(|&p| normal.dot(p) <= source_offset);
        if in_front || behind {
            let normal = if in_front { normal } else { -normal };
            shaft.caps.push(HalfSpace { normal, offset: normal.dot(source.vertices()[0]) + slack });
        }
        if let Some((point, normal)) = receiver_plane {
            shaft.caps.push(HalfSpace { normal, offset: normal.dot(point) + slack });
        }
        shaft
    }

    /// Between receiver points, given with the edges of their hull, and whatever is far away in a cone of directions.
    ///
    /// `cone`: one direction or the corners of a convex polygon of them, in order. `reach`: how far from the points
    /// anything can be, metres. `receiver_plane` as for [`Self::new`].
    pub(crate) fn along(
        points: &[DVec3],
        edges: &[[usize; 2]],
        cone: &[DVec3],
        reach: f64,
        receiver_plane: Option<(DVec3, DVec3)>,
    ) -> Self {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in points {
            low = low.min(p);
            high = high.max(p);
        }
        let [least, most] = cone.iter().fold([DVec3::ZERO; 2], |[least, most], &direction| {
            let far = reach * direction.normalize_or_zero();
            [least.min(far), most.max(far)]
        });
        // Between its corners a cone may reach further along an axis than at them.
        let all = |way: DVec3| if cone.len() > 1 { reach * way.signum() } else { way };
        low += DVec3::select(least.cmplt(DVec3::ZERO), all(least), DVec3::ZERO);
        high += DVec3::select(most.cmpgt(DVec3::ZERO), all(most), DVec3::ZERO);
        let slack = ROUNDING * (high - low).length();
        let mut shaft = Self { low, high, sides: SmallVec::new(), caps: SmallVec::new(), slack };
        // Sides through an edge of the cone, then through an edge of the receivers and a direction: what all directions
        // lie on one side of keeps all rays on that side of where the receivers end.
        let mut add = |normal: DVec3| {
            let Some(normal) = normal.try_normalize() else { return };
            let sides = cone.iter().map(|d| normal.dot(*d) / d.length());
            let (least, most) =
                sides.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), s| (l.min(s), m.max(s)));
            for (normal, inside) in [(normal, least >= -ROUNDING), (-normal, most <= ROUNDING)] {
                if inside {
                    let ends = points.iter().map(|&p| normal.dot(p)).fold(f64::INFINITY, f64::min);
                    // Directions that lie on the plane are off it by rounding, over all of the reach.
                    shaft.sides.push(HalfSpace { normal, offset: ends - 2.0 * slack });
                }
            }
        };
        for (k, &direction) in cone.iter().enumerate() {
            if cone.len() > 2 {
                add(direction.cross(cone[(k + 1) % cone.len()]));
            }
            for &[i, j] in edges {
                add((points[j] - points[i]).cross(direction));
            }
        }
        if points.len() == 1 && cone.len() == 1 {
            let across = cone[0].any_orthogonal_vector();
            add(across);
            add(cone[0].cross(across));
        }
        if let Some((point, normal)) = receiver_plane {
            shaft.caps.push(HalfSpace { normal, offset: normal.dot(point) + slack });
        }
        shaft
    }

    /// Around a box of receivers and the box around a source: looser than [`Self::new`], and a tenth of the work.
    pub(crate) fn of_boxes(receivers: [DVec3; 2], source: &ConvexPolygon) -> Self {
        let vertices = source.vertices();
        let around = [
            vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min),
            vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max),
        ];
        let mut shaft = Self::between_boxes(receivers, around);
        let normal = source.normal();
        let at = normal.dot(vertices[0]);
        let nearest = DVec3::select(normal.cmpge(DVec3::ZERO), receivers[0], receivers[1]);
        if normal.dot(nearest) >= at {
            shaft.caps.push(HalfSpace { normal, offset: at + shaft.slack });
        }
        shaft
    }

    /// The hull of two boxes, given by their lowest and highest corners.
    pub(crate) fn between_boxes(receivers: [DVec3; 2], around: [DVec3; 2]) -> Self {
        let (low, high) = (receivers[0].min(around[0]), receivers[1].max(around[1]));
        let slack = ROUNDING * (high - low).length();
        let mut shaft = Self { low, high, sides: SmallVec::new(), caps: SmallVec::new(), slack };
        // Seen along an axis, the hull of two rectangles bridges each corner whose sides are not of the same rectangle.
        for (u, v) in [(0, 1), (1, 2), (2, 0)] {
            for (upper_u, upper_v) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let reach = |axis: usize, upper: usize| {
                    let sign = [-1.0, 1.0][upper];
                    sign * (receivers[upper][axis] - around[upper][axis])
                };
                if reach(u, upper_u) * reach(v, upper_v) >= 0.0 {
                    continue;
                }
                let corner = |of: [DVec3; 2]| (of[upper_u][u], of[upper_v][v]);
                let ((a, b), (c, d)) = (corner(receivers), corner(around));
                let mut normal = DVec3::ZERO;
                (normal[u], normal[v]) = (d - b, a - c);
                // It points to the inside.
                let outwards = [[-1.0, 1.0][upper_u], [-1.0, 1.0][upper_v]];
                if normal[u] * outwards[0] + normal[v] * outwards[1] > 0.0 {
                    normal = -normal;
                }
                normal = normal.normalize();
                let offset = (normal[u] * a + normal[v] * b).min(normal[u] * c + normal[v] * d) - slack;
                shaft.sides.push(HalfSpace { normal, offset });
            }
        }
        shaft
    }

    /// The same in front of a plane, given by a point on it and its normal: all receivers lie on it, and all light arrives
    /// from there.
    pub(crate) fn capped(mut self, point: DVec3, normal: DVec3) -> Self {
        self.caps.push(HalfSpace { normal, offset: normal.dot(point) + self.slack });
        self
    }

    /// Whether any part of a box may lie inside.
    pub(crate) fn may_touch_box(&self, low: DVec3, high: DVec3) -> bool {
        self.low.cmple(high).all()
            && self.high.cmpge(low).all()
            && !self.sides.iter().chain(&self.caps).any(|side| side.excludes_box(low, high))
    }

    /// Whether a polygon may come between the receivers and the source. A polygon in the plane of the source or of
    /// the receivers hides nothing.
    pub(crate) fn may_block(&self, polygon: &ConvexPolygon) -> bool {
        let vertices = polygon.vertices();
        !self
            .sides
            .iter()
            .chain(&self.caps)
            .any(|side| vertices.iter().all(|&v| side.normal.dot(v) <= side.offset))
            && (0..3).all(|axis| {
                vertices.iter().any(|v| v[axis] >= self.low[axis])
                    && vertices.iter().any(|v| v[axis] <= self.high[axis])
            })
    }

    fn add_if_supporting(&mut self, a: DVec3, b: DVec3, c: DVec3, points: &[DVec3], bounds: &[DVec3]) {
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { return };
        let slack = self.slack;
        let (mut least, mut most) = (0.0_f64, 0.0_f64);
        for &p in points.iter().chain(bounds) {
            let distance = normal.dot(p - a);
            least = least.min(distance);
            most = most.max(distance);
            if least < -slack && most > slack {
                return;
            }
        }
        // All points within the slack: a flat hull, bounded by its box and its other sides.
        if least >= -slack && most > slack {
            self.sides.push(HalfSpace { normal, offset: normal.dot(a) + least - slack });
        } else if most <= slack && least < -slack {
            self.sides.push(HalfSpace { normal: -normal, offset: -normal.dot(a) - most - slack });
        }
    }
}

/// The source's corners, or a rectangle around it when it has many: a looser shaft that is cheaper to build.
fn source_bounds(source: &ConvexPolygon) -> SmallVec<[DVec3; 8]> {
    let vertices = source.vertices();
    if vertices.len() <= 6 {
        return vertices.iter().copied().collect();
    }
    let origin = vertices[0];
    let x = (vertices[1] - origin).normalize();
    let y = source.normal().cross(x);
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &v in vertices {
        for (k, axis) in [x, y].into_iter().enumerate() {
            low[k] = low[k].min(axis.dot(v - origin));
            high[k] = high[k].max(axis.dot(v - origin));
        }
    }
    let corner = |u: f64, v: f64| origin + u * x + v * y;
    [corner(low[0], low[1]), corner(high[0], low[1]), corner(high[0], high[1]), corner(low[0], high[1])]
        .into_iter()
        .collect()
}

/// The twelve edges of a box whose corner `k` takes the high coordinate of axis `a` where bit `a` of `k` is set.
pub(crate) const BOX_EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The corners of a box, in the order of [`BOX_EDGES`].
pub(crate) fn box_corners(low: DVec3, high: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|k| {
        DVec3::new(
            if k & 1 == 0 { low.x } else { high.x },
            if k & 2 == 0 { low.y } else { high.y },
            if k & 4 == 0 { low.z } else { high.z },
        )
    })
}

/// The edges of a triangle.
pub(crate) const TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::rays::{point_on, splitmix, unit};

    /// Whatever cuts a segment from the receivers to the source is kept, by either shaft.
    #[test]
    fn shafts_keep_all_that_comes_between() {
        let mut state = 7;
        let mut random = || {
            state = splitmix(state);
            unit(state)
        };
        let (mut between, mut rejected) = (0, 0);
        for _ in 0..200_000 {
            let mut point = |size: f64| size * DVec3::new(random(), random(), random());
            let (one, other) = (point(1.0), point(1.0));
            let (low, high) = (one.min(other), one.max(other));
            let shift = point(4.0) - 1.5;
            let source = ConvexPolygon::triangle(shift + point(1.0), shift + point(1.0), shift + point(1.0));
            let shift = point(4.0) - 1.5;
            let blocker = ConvexPolygon::triangle(shift + point(1.0), shift + point(1.0), shift + point(1.0));
            let (Some(source), Some(blocker)) = (source, blocker) else { continue };
            let shafts = [
                Shaft::of_boxes([low, high], &source),
                Shaft::new(&box_corners(low, high), &BOX_EDGES, &source, None),
            ];
            let from = low + (high - low) * point(1.0);
            let to = point_on(&source, [random(), random()]);
            // Only what the source sends to counts.
            let sent_to = source.normal().dot(from - source.vertices()[0]) > 0.0;
            let side = |p: DVec3| blocker.normal().dot(p - blocker.vertices()[0]);
            let crossing = from + (to - from) * (side(from) / (side(from) - side(to)));
            let crosses = side(from) * side(to) < 0.0 && {
                let v = blocker.vertices();
                (0..3).all(|k| (v[(k + 1) % 3] - v[k]).cross(crossing - v[k]).dot(blocker.normal()) > 0.0)
            };
            if sent_to && crosses {
                between += 1;
                assert!(shafts.iter().all(|shaft| shaft.may_block(&blocker)));
            }
            rejected += usize::from(!shafts[0].may_block(&blocker));
        }
        assert!(between > 100 && rejected > 5_000, "{between} between, {rejected} rejected");
    }

    /// Whatever a ray from the receivers into the cone meets is kept, for cones of one direction and of several.
    #[test]
    fn shafts_along_directions_keep_all_that_comes_between() {
        let mut state = 11;
        let mut random = || {
            state = splitmix(state);
            unit(state)
        };
        let (mut between, mut rejected) = (0, 0);
        for case in 0..100_000 {
            let mut point = |size: f64| size * DVec3::new(random(), random(), random());
            let (one, other) = (point(1.0), point(1.0));
            let (low, high) = (one.min(other), one.max(other));
            let middle = (point(2.0) - 1.0).normalize();
            let (u, v) = middle.any_orthonormal_pair();
            let corners = [u + v, v - u, -u - v, u - v].map(|corner| middle + 0.3 * corner);
            let cone = if case % 2 == 0 { &corners[..] } else { std::slice::from_ref(&middle) };
            let shift = point(4.0) - 1.5;
            let triangle =
                ConvexPolygon::triangle(shift + point(1.0), shift + point(1.0), shift + point(1.0));
            let Some(blocker) = triangle else { continue };
            let shaft = Shaft::along(&box_corners(low, high), &BOX_EDGES, cone, 20.0, None);
            let from = low + (high - low) * point(1.0);
            let inside = point(2.0) - 1.0;
            let way = if cone.len() > 1 { middle + 0.3 * (inside.x * u + inside.y * v) } else { middle };
            let normal = blocker.normal();
            let at = normal.dot(blocker.vertices()[0] - from) / normal.dot(way);
            let crossing = from + at * way;
            let vertices = blocker.vertices();
            let crosses = at > 0.0
                && (0..3).all(|k| {
                    (vertices[(k + 1) % 3] - vertices[k]).cross(crossing - vertices[k]).dot(normal) > 0.0
                });
            if crosses {
                between += 1;
                assert!(shaft.may_block(&blocker), "{case}");
            }
            rejected += usize::from(!shaft.may_block(&blocker));
        }
        assert!(between > 100 && rejected > 5_000, "{between} between, {rejected} rejected");
    }
}
