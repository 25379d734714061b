//! The two parts of an exchange of light: a receiver point and a convex polygon, which is source or blocker.

use glam::DVec3;
use smallvec::SmallVec;

use super::clip::SNAP_WORLD;

/// A point that receives light, and the side from which it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// World space, metres.
    pub position: DVec3,
    /// Unit normal; light from below the plane that it spans does not arrive.
    pub normal: DVec3,
    /// The number of the object that it lies on, where that matters; [`ANY_OBJECT`] else.
    pub(crate) object: u32,
}

/// No object in particular.
pub(crate) const ANY_OBJECT: u32 = u32::MAX;

impl Receiver {
    /// A point in world space, metres, with a unit normal.
    pub fn new(position: DVec3, normal: DVec3) -> Self {
        Self { position, normal, object: ANY_OBJECT }
    }

    /// The same as a point of an object.
    pub(crate) fn of(self, object: u32) -> Self {
        Self { object, ..self }
    }
}

/// A convex planar polygon, counter-clockwise about its normal, in world space, metres.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvexPolygon {
    vertices: SmallVec<[DVec3; 4]>,
    normal: DVec3,
    centroid: DVec3,
    area: f64,
    /// Largest absolute coordinate: the scale of the rounding that the vertices carry.
    extent: f64,
    /// Largest distance of a vertex from the centroid.
    radius: f64,
    /// Largest distance of a vertex from the plane through the first: of a sliver, whose vertices' rounding turns the
    /// normal, more than rounding.
    unevenness: f64,
}

impl ConvexPolygon {
    /// A polygon with this outline, which must be convex and planar to within its own rounding.
    ///
    /// `None` when it has no area: fewer than three distinct finite vertices, or an outline thinner than the
    /// rounding of its coordinates, which has no normal. Vertices that coincide to that rounding become one.
    pub fn new(vertices: &[DVec3]) -> Option<Self> {
        if vertices.iter().any(|vertex| !vertex.is_finite()) {
            return None;
        }
        let extent = vertices.iter().map(|vertex| vertex.abs().max_element()).fold(0.0, f64::max);
        let rounding = SNAP_WORLD * extent;

        // An edge as short as its rounding has an arbitrary direction, and so would the plane through it.
        let mut distinct = SmallVec::<[DVec3; 4]>::new();
        for &vertex in vertices {
            if distinct.last().is_none_or(|last| last.distance(vertex) > rounding) {
                distinct.push(vertex);
            }
        }
        while distinct.len() > 1 && distinct[0].distance(distinct[distinct.len() - 1]) <= rounding {
            distinct.pop();
        }
        if distinct.len() < 3 {
            return None;
        }

        // Sum the fan of triangles about the first vertex
        let origin = distinct[0];
        let fan = || distinct.windows(2).skip(1).map(|edge| (edge[0] - origin, edge[1] - origin));
        let area_vector = 0.5 * fan().map(|(a, b)| a.cross(b)).sum::<DVec3>();
        let area = area_vector.length();
        let diameter = fan().map(|(a, b)| a.length().max(b.length())).fold(0.0, f64::max);
        if area <= rounding * diameter {
            return None;
        }
        let normal = area_vector / area;
        let first_moment: DVec3 = fan().map(|(a, b)| (a + b) * (normal.dot(a.cross(b)) / 6.0)).sum();

        let centroid = origin + first_moment / area;
        let radius = distinct.iter().map(|vertex| vertex.distance(centroid)).fold(0.0, f64::max);
        let heights = distinct.iter().map(|vertex| normal.dot(vertex - origin).abs());
        let unevenness = heights.fold(0.0, f64::max);

        Some(Self { vertices: distinct, normal, centroid, area, extent, radius, unevenness })
    }

    /// The triangle `abc`; `None` when it has no area.
    pub fn triangle(a: DVec3, b: DVec3, c: DVec3) -> Option<Self> {
        Self::new(&[a, b, c])
    }

    /// The same polygon seen from its other side.
    #[must_use]
    pub fn flipped(&self) -> Self {
        let mut flipped = self.clone();
        flipped.vertices.reverse();
        flipped.normal = -self.normal;
        flipped
    }

    /// The same polygon in another place.
    pub(crate) fn moved(&self, by: DVec3) -> Self {
        let vertices: SmallVec<[DVec3; 4]> = self.vertices.iter().map(|&vertex| vertex + by).collect();
        let extent = vertices.iter().map(|vertex| vertex.abs().max_element()).fold(0.0, f64::max);
        Self { vertices, centroid: self.centroid + by, extent, ..*self }
    }

    /// The outline, counter-clockwise about [`Self::normal`], metres.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Unit normal.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Centre of area, metres.
    pub fn centroid(&self) -> DVec3 {
        self.centroid
    }

    /// Largest absolute coordinate, metres.
    pub(super) fn extent(&self) -> f64 {
        self.extent
    }

    /// Largest distance of a vertex from the centroid, metres.
    pub(super) fn radius(&self) -> f64 {
        self.radius
    }

    /// Largest distance of a vertex from the plane through the first, metres.
    pub(super) fn unevenness(&self) -> f64 {
        self.unevenness
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trapezoid_knows_its_area_normal_and_centroid() {
        let trapezoid = ConvexPolygon::new(&[
            DVec3::new(0.0, 0.0, 5.0),
            DVec3::new(3.0, 0.0, 5.0),
            DVec3::new(1.0, 2.0, 5.0),
            DVec3::new(0.0, 2.0, 5.0),
        ])
        .expect("it has area");
        assert_eq!(trapezoid.area(), 4.0);
        assert_eq!(trapezoid.normal(), DVec3::Z);
        // A 1×2 rectangle with its centre at (1/2, 1) and a triangle of area 2 with its centre at (5/3, 2/3)
        assert!(trapezoid.centroid().distance(DVec3::new(13.0 / 12.0, 5.0 / 6.0, 5.0)) < 1e-15);
    }

    #[test]
    fn what_has_no_area_is_no_polygon() {
        let (a, b) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.7, 0.5, 0.9));
        assert!(ConvexPolygon::new(&[a, b]).is_none());
        assert!(ConvexPolygon::triangle(a, b, a).is_none());
        assert!(ConvexPolygon::triangle(a, b, a.lerp(b, 0.3)).is_none());
        assert!(ConvexPolygon::triangle(a, b, DVec3::NAN).is_none());
        // A sliver far above the rounding of its coordinates is one.
        assert!(ConvexPolygon::triangle(a, b, a + DVec3::X * 1e-9).is_some());
    }

    #[test]
    fn repeated_vertices_become_one() {
        let outline = [DVec3::ZERO, DVec3::X, DVec3::X, DVec3::Y, DVec3::ZERO];
        let polygon = ConvexPolygon::new(&outline).expect("it has area");
        assert_eq!(polygon.vertices(), [DVec3::ZERO, DVec3::X, DVec3::Y]);
    }
}
