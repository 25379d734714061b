//! Where a blocking polygon touches or pierces a receiver: the value of the light itself may jump there (D0 lines,
//! §2.3 of the paper; Lischinski, Tampieri and Greenberg 1992 resolve them with a value on each side).

use glam::DVec3;
use smallvec::SmallVec;

use super::boundary::clip_to_triangle;
use crate::visibility::ConvexPolygon;

/// Height over the receiver's plane, relative to the size of the larger of the two, up to which a polygon touches it.
///
/// Objects that were modelled flush are off by 1e-8 to 1e-7 of their size once they are rotated in f32. With 1e-8 the
/// shadow of such a block would start beside it, and light would leak under its edge; with 1e-4 a sheet of paper
/// on a table would count as part of it, where elements of its thickness can still resolve its penumbra.
const TOUCHING: f64 = 1e-6;

/// The same relative to the largest coordinate: positions in a large world are rounded to f32 wherever an object's
/// transform was, once for the receiver and once for the blocker.
pub(super) const TOUCHING_WORLD: f64 = 2.0 * f32::EPSILON as f64;

/// Where a polygon meets a receiver triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    /// Barycentric weights of the ends in the receiver.
    pub(crate) ends: [DVec3; 2],
    /// Whether the polygon lies on the receiver to the left of the way from end to end, seen from its front, and to the right.
    pub(crate) covers: [bool; 2],
}

/// Up to as many segments as the polygon has edges.
pub(crate) type Contacts = SmallVec<[Contact; 4]>;

/// The segments in which a blocking polygon meets a receiver triangle: where it pierces the triangle's plane, the
/// edge with which it stands on it, or all edges of a polygon that lies in it.
///
/// The weights are those of [`clip_to_triangle`]. What only touches in a point, hangs below the plane or runs along
/// the triangle's own border is left out. An edge shared by two polygons gives the same segment for both.
pub(crate) fn contact_line(triangle: [DVec3; 3], normal: DVec3, blocker: &ConvexPolygon) -> Contacts {
    let corners = blocker.vertices();
    let mut contacts = Contacts::new();
    let extent = |points: &[DVec3]| points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let size = diameter(&triangle).max(diameter(corners));
    let touching = TOUCHING * size + TOUCHING_WORLD * extent(&triangle).max(extent(corners));
    let heights: SmallVec<[f64; 4]> = corners
        .iter()
        .map(|&corner| {
            let height = normal.dot(corner - triangle[0]);
            if height.abs() <= touching { 0.0 } else { height }
        })
        .collect();
    let is_flat = heights.iter().all(|&height| height == 0.0);
    let middle = blocker.centroid();
    let mut add = |a: DVec3, b: DVec3| {
        // In one order, so that polygons that share the edge give the same ends to the bit.
        let [a, b] = if (a.x, a.y, a.z) < (b.x, b.y, b.z) { [a, b] } else { [b, a] };
        if let Some(ends) = clip_to_triangle([a, b], triangle)
            && !on_border(ends, triangle, touching)
        {
            let is_left = normal.dot((b - a).cross(middle - a)) > 0.0;
            contacts.push(Contact { ends, covers: [is_flat && is_left, is_flat && !is_left] });
        }
    };
    let edges = || (0..corners.len()).map(|i| [i, (i + 1) % corners.len()]);

    // A polygon in the plane
    if is_flat {
        edges().for_each(|[i, j]| add(corners[i], corners[j]));
        return contacts;
    }
    if heights.iter().all(|&height| height <= 0.0) {
        return contacts;
    }

    // The points of its outline that are in the plane, of which the farthest two are the ends
    let mut points = SmallVec::<[DVec3; 4]>::new();
    for [i, j] in edges() {
        if heights[i] == 0.0 {
            points.push(corners[i]);
        } else if heights[i] * heights[j] < 0.0 {
            // From the higher end, so that both polygons at the edge get the same point.
            let (high, low) = if heights[i] > heights[j] { (i, j) } else { (j, i) };
            let at = heights[high] / (heights[high] - heights[low]);
            points.push(corners[high] + (corners[low] - corners[high]) * at);
        }
    }
    let mut farthest = (0.0, None);
    for (i, &a) in points.iter().enumerate() {
        for &b in &points[i + 1..] {
            if a.distance_squared(b) > farthest.0 {
                farthest = (a.distance_squared(b), Some((a, b)));
            }
        }
    }
    if let (_, Some((a, b))) = farthest {
        add(a, b);
    }
    contacts
}

fn diameter(points: &[DVec3]) -> f64 {
    let pairs = points.iter().enumerate().flat_map(|(i, a)| points[..i].iter().map(move |b| a.distance(*b)));
    pairs.fold(0.0, f64::max)
}

/// Whether both ends are within a distance, metres, of the same edge of the triangle.
fn on_border(segment: [DVec3; 2], triangle: [DVec3; 3], distance: f64) -> bool {
    let [a, b, c] = triangle;
    let double_area = (b - a).cross(c - a).length();
    (0..3).any(|corner| {
        let altitude = double_area / triangle[(corner + 1) % 3].distance(triangle[(corner + 2) % 3]);
        segment.iter().all(|weights| weights[corner] * altitude <= distance)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shadow::tests::{cuboid, polygon};

    const FLOOR: [DVec3; 3] =
        [DVec3::new(-5.0, -5.0, 0.0), DVec3::new(15.0, -5.0, 0.0), DVec3::new(-5.0, 15.0, 0.0)];

    /// The contacts of all polygons with the floor, in the world, without repetitions.
    fn on_floor(polygons: &[ConvexPolygon]) -> Vec<[DVec3; 2]> {
        let world = |w: DVec3| FLOOR[0] * w.x + FLOOR[1] * w.y + FLOOR[2] * w.z;
        let mut lines: Vec<[DVec3; 2]> = Vec::new();
        for polygon in polygons {
            for contact in contact_line(FLOOR, DVec3::Z, polygon) {
                let segment = contact.ends.map(world);
                if !lines.contains(&segment) {
                    lines.push(segment);
                }
            }
        }
        lines
    }

    fn total_length(lines: &[[DVec3; 2]]) -> f64 {
        lines.iter().map(|[a, b]| a.distance(*b)).sum()
    }

    #[test]
    fn a_cube_stands_on_the_floor_with_four_edges() {
        for hover in [0.0, 1e-7, -1e-7] {
            let lines = on_floor(&cuboid(DVec3::new(0.0, 0.0, 0.5 + hover), DVec3::splat(0.5)));
            assert_eq!(lines.len(), 4);
            assert!((total_length(&lines) - 4.0).abs() < 1e-12);
            for point in lines.iter().flatten() {
                assert!((point.x.abs() - 0.5).abs() < 1e-12 && (point.y.abs() - 0.5).abs() < 1e-12);
            }
        }
        // What hovers visibly does not touch, nor does what hangs below
        assert!(on_floor(&cuboid(DVec3::new(0.0, 0.0, 0.51), DVec3::splat(0.5))).is_empty());
        let below = cuboid(DVec3::new(0.0, 0.0, -0.5), DVec3::splat(0.5));
        let sides: Vec<_> = below.into_iter().filter(|side| side.normal().z == 0.0).collect();
        assert!(on_floor(&sides).is_empty());
    }

    #[test]
    fn a_box_pierces_the_floor_in_its_cross_section() {
        let lines = on_floor(&cuboid(DVec3::new(1.0, 0.5, 0.2), DVec3::new(0.5, 0.25, 0.6)));
        assert_eq!(lines.len(), 4);
        assert!((total_length(&lines) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn contacts_are_clipped_and_the_border_is_left_out() {
        let wall = |x: f64| {
            polygon(&[
                DVec3::new(x, -9.0, -1.0),
                DVec3::new(x, 99.0, -1.0),
                DVec3::new(x, 99.0, 2.0),
                DVec3::new(x, -9.0, 2.0),
            ])
        };
        let [Contact { ends, .. }] = contact_line(FLOOR, DVec3::Z, &wall(5.0))[..] else {
            panic!("one line")
        };
        assert_eq!((ends[0].z, ends[1].x), (0.0, 0.0));
        // Along the border of the floor
        assert!(contact_line(FLOOR, DVec3::Z, &wall(-5.0)).is_empty());
        assert!(contact_line(FLOOR, DVec3::Z, &wall(-5.0 + 1e-7)).is_empty());
        assert_eq!(contact_line(FLOOR, DVec3::Z, &wall(-4.9)).len(), 1);
        // Touching in a point only
        let tip = polygon(&[DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 1.0)]);
        assert!(contact_line(FLOOR, DVec3::Z, &tip).is_empty());
    }
    #[test]
    fn intersecting_boxes_meet_in_the_outline_of_their_overlap() {
        // Turned together; the second is sunk 0.1 into the top of the first, over its corner
        let turn = crate::shadow::tests::Random(9).rotation();
        let top =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| turn * DVec3::new(x, y, 1.0));
        let second = crate::shadow::tests::cube(|p| turn * (DVec3::new(0.9, 0.8, 1.2) + 0.3 * p));
        let mut length = 0.0;
        for triangle in [[top[0], top[1], top[2]], [top[0], top[2], top[3]]] {
            for side in &second {
                for Contact { ends: segment, .. } in contact_line(triangle, turn * DVec3::Z, side) {
                    let world = |w: DVec3| triangle[0] * w.x + triangle[1] * w.y + triangle[2] * w.z;
                    length += world(segment[0]).distance(world(segment[1]));
                }
            }
        }
        // Two sides of the outline from 0.6 and 0.5 to the edges at 1
        assert!((length - 0.9).abs() < 1e-12, "{length}");
    }
}
