//! The shadow's border of a point or of a direction: the light itself jumps there (D0 lines, §2.3 of the paper).
//!
//! The plane through a blocker's silhouette edge and the point meets the receiver's plane in a line. With `h` the height
//! over that plane, light from `u` past `l` arrives at `(h_u l - h_l u)/(h_u - h_l)`; numerator and denominator are linear
//! along the edge, so that the line is cut where it ends without ever dividing by what is nearly 0.

use glam::DVec3;

use super::boundary::Plane;
use super::contact::TOUCHING_WORLD;

/// Where all light comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Apex {
    /// A place, metres.
    Point(DVec3),
    /// Far away: the unit vector towards it.
    Direction(DVec3),
}

/// The segment in which the shadow of an edge ends on a receiver's plane, within a square of half a side of `reach` metres
/// about the plane's point; `None` when it has none there. What lies below the plane, or touches it along its whole
/// length, throws no line: that is left to [`super::contact`].
pub(crate) fn shadow_of_edge(apex: Apex, ends: [DVec3; 2], plane: &Plane, reach: f64) -> Option<[DVec3; 2]> {
    let normal = plane.normal;
    let touching =
        TOUCHING_WORLD * ends.iter().fold(plane.point.abs(), |m, end| m.max(end.abs())).max_element();
    let lower = ends.map(|end| end - plane.point);
    let heights = lower.map(|end| normal.dot(end));
    if heights.iter().all(|&height| height <= touching) {
        return None;
    }
    // Where light past each end arrives, as a numerator and a denominator
    let arriving = match apex {
        Apex::Point(point) => {
            let upper = point - plane.point;
            let height = normal.dot(upper);
            [0, 1].map(|k| (height * lower[k] - heights[k] * upper, height - heights[k]))
        }
        Apex::Direction(towards) => {
            let rise = normal.dot(towards);
            [0, 1].map(|k| (rise * lower[k] - heights[k] * towards, rise))
        }
    };
    // Keep what is not below the plane, then what arrives in the square: which, being in front of the denominator's zero,
    // leaves out what is as high as the source
    let (u, v) = normal.any_orthonormal_pair();
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    let mut keep = |[start, end]: [f64; 2]| match (start < 0.0, end < 0.0) {
        (true, true) => high = -1.0,
        (true, false) => low = low.max(start / (start - end)),
        (false, true) => high = high.min(start / (start - end)),
        (false, false) => {}
    };
    keep(heights);
    for axis in [u, v, -u, -v] {
        keep(arriving.map(|(numerator, denominator)| reach * denominator - axis.dot(numerator)));
    }
    if low >= high {
        return None;
    }
    let at = |t: f64| {
        let [(n0, d0), (n1, d1)] = arriving;
        plane.point + n0.lerp(n1, t) / (d0 + t * (d1 - d0))
    };
    let traced = [at(low), at(high)];
    traced.iter().all(|point| point.is_finite()).then_some(traced)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: Plane = Plane { point: DVec3::ZERO, normal: DVec3::Z };

    #[test]
    fn a_point_throws_an_edge_by_similar_triangles() {
        let edge = [DVec3::new(0.1, -0.2, 1.0), DVec3::new(0.1, 0.3, 1.0)];
        let found = shadow_of_edge(Apex::Point(DVec3::Z * 3.0), edge, &FLOOR, 10.0).expect("it is there");
        for (found, end) in found.into_iter().zip(edge) {
            assert!(found.distance(DVec3::new(1.5 * end.x, 1.5 * end.y, 0.0)) < 1e-15);
        }
    }

    #[test]
    fn a_direction_throws_an_edge_as_it_is() {
        let edge = [DVec3::new(0.1, -0.2, 1.0), DVec3::new(0.1, 0.3, 2.0)];
        let towards = DVec3::new(1.0, 0.0, 2.0).normalize();
        let found = shadow_of_edge(Apex::Direction(towards), edge, &FLOOR, 10.0).expect("it is there");
        assert!(found[0].distance(DVec3::new(-0.4, -0.2, 0.0)) < 1e-15);
        assert!(found[1].distance(DVec3::new(-0.9, 0.3, 0.0)) < 1e-15);
    }

    #[test]
    fn a_line_to_infinity_ends_with_the_square() {
        // Upright, from the floor to above the light
        let edge = [DVec3::new(1.0, 0.0, -1.0), DVec3::new(1.0, 0.0, 9.0)];
        let found = shadow_of_edge(Apex::Point(DVec3::Z * 3.0), edge, &FLOOR, 10.0).expect("it is there");
        assert!(found[0].distance(DVec3::X) < 1e-15 && found[1].distance(DVec3::X * 10.0) < 1e-13);
    }

    #[test]
    fn what_is_higher_than_the_light_or_below_the_floor_throws_nothing() {
        let point = Apex::Point(DVec3::Z * 3.0);
        for z in [-1.0, 0.0, 3.0, 4.0] {
            let edge = [DVec3::new(1.0, -1.0, z), DVec3::new(1.0, 1.0, z)];
            assert_eq!(shadow_of_edge(point, edge, &FLOOR, 10.0), None, "{z}");
        }
        let below = Apex::Direction(DVec3::new(1.0, 0.0, -1.0));
        assert_eq!(shadow_of_edge(below, [DVec3::Z, DVec3::Z + DVec3::Y], &FLOOR, 10.0), None);
    }
}
