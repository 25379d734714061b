//! Where a wedge meets a receiver's plane (§3.2 of the paper: the plane of the element cuts the shadow BSP tree).
//!
//! With `h` the height over the receiver's plane, light from `u` past `l` arrives at `(h_u l - h_l u)/(h_u - h_l)`: no
//! cancellation, whatever the distances. What lies below the plane, or is no lower than the source, throws no line;
//! where both are equally high the line goes to infinity and is cut at a sphere. What touches the plane along its whole
//! length is left to [`super::contact`].

use glam::DVec3;

use super::contact::TOUCHING_WORLD;
use super::wedge::Wedge;

/// Sine of the angle between a wedge and the receiver's plane below which they do not meet in a line. The position of
/// the line is the coordinates' rounding divided by it, so that it would be off by more than 1e-4 of them.
const PARALLEL: f64 = 1e-12;

/// Difference of the heights of source and blocker, relative to the source's, below which light past the blocker
/// arrives nowhere: it would be 1e12 heights away.
const LEVEL: f64 = 1e-12;

/// Distance outside of an edge, as a barycentric weight, up to which a point lies on it: rounding of the weights of
/// points within a few triangles' sizes, with room. A line along the edge of its triangle would otherwise be kept or
/// lost by chance; one that is visibly inside is at 1e-7.
pub(super) const ON_EDGE: f64 = 1e-12;

/// A receiver's plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    /// A point on it, metres: the centre of the part that matters.
    pub(crate) point: DVec3,
    /// Unit normal, to the side from which light arrives.
    pub(crate) normal: DVec3,
}

/// The line in which a wedge's plane meets the receiver's, relative to the plane's point.
struct Line {
    /// Its point nearest to the plane's.
    origin: DVec3,
    /// Unit.
    direction: DVec3,
}

/// Rays past a segment from a point, or past a point from a segment: both ends of both, relative to the plane's point.
#[derive(Clone, Copy)]
struct Fan {
    upper: [DVec3; 2],
    lower: [DVec3; 2],
    /// Height up to which the lower ends touch the plane, metres.
    touching: f64,
}

/// An end of a traced segment: its parameter on the line, and the point where it is finite.
#[derive(Clone, Copy)]
struct End {
    at: f64,
    point: Option<DVec3>,
}

/// The segment in which a wedge meets a receiver's plane, metres: behind the blocker as seen from the source, and
/// within `reach` metres of the plane's point. `None` when there is none.
pub(crate) fn trace(wedge: &Wedge, plane: &Plane, reach: f64) -> Option<[DVec3; 2]> {
    let from = wedge.from.map(|point| point - plane.point);
    let line = Line::new(wedge.normal, from[0], plane.normal)?;
    let half = (reach * reach - line.origin.length_squared()).sqrt();
    if half.is_nan() {
        return None;
    }

    // The union of all fans: for a polygon's plane, of each corner and each edge.
    let through = &wedge.through;
    let mut span: Option<[End; 2]> = None;
    let mut add = |upper: [DVec3; 2], lower: [DVec3; 2]| {
        let touching = lower.iter().fold(plane.point.abs(), |most, end| most.max(end.abs())).max_element();
        let lower = lower.map(|point| point - plane.point);
        let fan = Fan { upper, lower, touching: TOUCHING_WORLD * touching };
        if let Some(new) = fan.span(&line, plane.normal) {
            span = Some(span.map_or(new, |old| {
                [
                    if new[0].at < old[0].at { new[0] } else { old[0] },
                    if new[1].at > old[1].at { new[1] } else { old[1] },
                ]
            }));
        }
    };
    if from[0] != from[1] {
        through.iter().for_each(|&corner| add(from, [corner; 2]));
    }
    let sides = if through.len() < 3 { through.len() - 1 } else { through.len() };
    let ends = if from[0] == from[1] { 1 } else { 2 };
    for side in 0..sides {
        let lower = [through[side], through[(side + 1) % through.len()]];
        from[..ends].iter().for_each(|&vertex| add([vertex; 2], lower));
    }

    // Cut at the sphere
    let [start, end] = span?;
    if start.at >= half || end.at <= -half || start.at >= end.at {
        return None;
    }
    let cut = |end: End| match end.point {
        Some(point) if end.at.abs() <= half => plane.point + point,
        _ => plane.point + line.origin + line.direction * end.at.clamp(-half, half),
    };
    Some([cut(start), cut(end)])
}

impl Line {
    /// `apex`: a point of the wedge's plane.
    fn new(wedge_normal: DVec3, apex: DVec3, normal: DVec3) -> Option<Self> {
        let direction = normal.cross(wedge_normal);
        let sine = direction.length();
        if sine < PARALLEL {
            return None;
        }
        let direction = direction / sine;
        // In the receiver's plane and perpendicular to the line
        let across = direction.cross(normal);
        Some(Self { origin: across * (wedge_normal.dot(apex) / wedge_normal.dot(across)), direction })
    }
}

impl Fan {
    /// Where its rays arrive on the line.
    fn span(&self, line: &Line, normal: DVec3) -> Option<[End; 2]> {
        let heights = |points: [DVec3; 2]| points.map(|point| normal.dot(point));
        let (h_upper, h_lower) = (heights(self.upper), heights(self.lower));

        if h_lower[0] <= self.touching && h_lower[1] <= self.touching {
            return None;
        }

        // Keep the rays that go down: the blocker not below the plane, the source above the blocker
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        for [start, end] in [h_lower, [h_upper[0] - h_lower[0], h_upper[1] - h_lower[1]]] {
            match (start < 0.0, end < 0.0) {
                (true, true) => return None,
                (true, false) => low = low.max(start / (start - end)),
                (false, true) => high = high.min(start / (start - end)),
                (false, false) => {}
            }
        }
        if low > high || (h_upper[0] <= h_lower[0] && h_upper[1] <= h_lower[1]) {
            return None;
        }

        let arrive = |t: f64| {
            let mix = |[a, b]: [DVec3; 2]| if t >= 1.0 { b } else { a + (b - a) * t };
            let mix_height = |[a, b]: [f64; 2]| if t >= 1.0 { b } else { a + (b - a) * t };
            let (upper, lower) = (mix(self.upper), mix(self.lower));
            let (h_upper, h_lower) = (mix_height(h_upper), mix_height(h_lower).max(0.0));
            let fall = h_upper - h_lower;
            let point = (lower * h_upper - upper * h_lower) / fall;
            if fall > LEVEL * h_upper.abs() && point.is_finite() {
                End { at: line.direction.dot(point), point: Some(point) }
            } else {
                End { at: line.direction.dot(lower - upper) * f64::INFINITY, point: None }
            }
        };
        let (a, b) = (arrive(low), arrive(high));
        if a.at.is_nan() || b.at.is_nan() {
            return None;
        }
        Some(if a.at <= b.at { [a, b] } else { [b, a] })
    }
}

/// The part of a segment inside a triangle, as the barycentric weights of its ends: never negative, and exactly 0 for
/// the corner opposite to an edge that the end lies on. `None` when it is no more than a point.
///
/// The segment is in the triangle's plane; what is off it is ignored.
pub(crate) fn clip_to_triangle(ends: [DVec3; 2], triangle: [DVec3; 3]) -> Option<[DVec3; 2]> {
    let [a, b, c] = triangle;
    let normal = (b - a).cross(c - a);
    let scale = 1.0 / normal.length_squared();
    if !scale.is_finite() {
        return None;
    }
    // Each weight from the corner of its edge that is nearer, for the smaller rounding.
    let weights = |point: DVec3| {
        DVec3::from_array(std::array::from_fn(|i| {
            let (from, to) = (triangle[(i + 1) % 3], triangle[(i + 2) % 3]);
            let nearer = if point.distance_squared(from) < point.distance_squared(to) { from } else { to };
            normal.dot((to - from).cross(point - nearer)) * scale
        }))
    };
    let ends = ends.map(weights);

    // Cyrus and Beck (1978): the weight of each corner cuts the segment where it is 0
    let far = ends[0].abs().max_element().max(ends[1].abs().max_element());
    let on_edge = ON_EDGE * far.max(1.0);
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    let (mut entered, mut left) = (None, None);
    for (corner, [start, end]) in (0..3).map(|corner| (corner, ends.map(|weights| weights[corner]))) {
        if start <= on_edge && end <= on_edge && (start < -on_edge || end < -on_edge) {
            return None;
        }
        let t = start / (start - end);
        if start < -on_edge && t > low {
            (low, entered) = (t, Some(corner));
        } else if end < -on_edge && t < high {
            (high, left) = (t, Some(corner));
        }
    }
    if low >= high {
        return None;
    }
    let end_at = |t: f64, on: Option<usize>| {
        let mut weights = if t == 1.0 { ends[1] } else { ends[0] + (ends[1] - ends[0]) * t };
        if let Some(corner) = on {
            weights[corner] = 0.0;
        }
        for corner in 0..3 {
            if weights[corner] <= on_edge {
                weights[corner] = 0.0;
            }
        }
        weights / weights.element_sum()
    };
    let clipped = [end_at(low, entered), end_at(high, left)];
    ((clipped[1] - clipped[0]).abs().max_element() > on_edge).then_some(clipped)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [DVec3; 3] =
        [DVec3::new(1.0, 1.0, 2.0), DVec3::new(4.0, 1.0, 2.0), DVec3::new(1.0, 5.0, 2.0)];

    fn at(x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, 2.0)
    }

    #[test]
    fn a_segment_through_a_triangle_ends_on_its_edges() {
        let [a, b] = clip_to_triangle([at(0.0, 3.0), at(1e6, 3.0)], TRIANGLE).expect("it crosses");
        assert_eq!((a.y, b.x), (0.0, 0.0));
        assert!((a - DVec3::new(0.5, 0.0, 0.5)).length() < 1e-9);
        assert!((b - DVec3::new(0.0, 0.5, 0.5)).length() < 1e-9);
        // Backwards
        let reversed = clip_to_triangle([at(1e6, 3.0), at(0.0, 3.0)], TRIANGLE).expect("it crosses");
        assert!((reversed[0] - b).length() < 1e-9 && (reversed[1] - a).length() < 1e-9);
    }

    #[test]
    fn a_segment_along_an_edge_stays_on_it() {
        let ends = clip_to_triangle([at(0.0, 1.0 - 1e-14), at(9.0, 1.0 + 1e-14)], TRIANGLE);
        let [a, b] = ends.expect("it touches");
        assert_eq!((a.z, b.z), (0.0, 0.0));
        assert!((a - DVec3::X).length() < 1e-12 && (b - DVec3::Y).length() < 1e-12);
    }

    #[test]
    fn a_segment_inside_is_kept_and_one_outside_is_not() {
        let [a, b] = clip_to_triangle([at(1.5, 1.5), at(2.0, 2.0)], TRIANGLE).expect("it is inside");
        let point = |w: DVec3| TRIANGLE[0] * w.x + TRIANGLE[1] * w.y + TRIANGLE[2] * w.z;
        assert!(point(a).distance(at(1.5, 1.5)) < 1e-15 && point(b).distance(at(2.0, 2.0)) < 1e-15);
        assert!(clip_to_triangle([at(3.0, 3.0), at(4.0, 4.0)], TRIANGLE).is_none());
        assert!(clip_to_triangle([at(0.0, 1.0), at(1.0, 0.0)], TRIANGLE).is_none());
        // Through a corner only
        assert!(clip_to_triangle([at(0.0, 2.0), at(2.0, 0.0)], TRIANGLE).is_none());
    }
}
