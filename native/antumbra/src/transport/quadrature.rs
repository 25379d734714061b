//! Means over polygons from a few of their points.

use glam::DVec3;
use smallvec::SmallVec;

use crate::visibility::ConvexPolygon;

/// Points of a triangle or quadrilateral with their shares of its area, which add up to 1: Gauss and Legendre's rule of so
/// many points along each side, or the rules of 1, 3 and 7 points in a triangle.
pub(crate) fn quadrature(polygon: &ConvexPolygon, order: usize) -> SmallVec<[(DVec3, f64); 16]> {
    let mut points = SmallVec::new();
    match *polygon.vertices() {
        [a, b, c, d] => {
            let rule = GAUSS[order - 1];
            for &(u, weight) in rule {
                for &(v, other) in rule {
                    let (low, high) = (a.lerp(b, u), d.lerp(c, u));
                    // Bilinear: the area per du·dv is that of the parallelogram of the two tangents.
                    let (along, across) = ((b - a).lerp(c - d, v), high - low);
                    points.push((low.lerp(high, v), weight * other * along.cross(across).length()));
                }
            }
            let total: f64 = points.iter().map(|(_, weight)| weight).sum();
            points.iter_mut().for_each(|(_, weight)| *weight /= total);
        }
        [a, b, c] => {
            let at = |[u, v, w]: [f64; 3]| u * a + v * b + w * c;
            match order {
                1 => points.push((polygon.centroid(), 1.0)),
                2 => points.extend((0..3).map(|k| {
                    let mut weights = [1.0 / 6.0; 3];
                    weights[k] = 2.0 / 3.0;
                    (at(weights), 1.0 / 3.0)
                })),
                _ => points.extend(
                    crate::visibility::RADON_RULE.iter().map(|&(weight, places)| (at(places), weight)),
                ),
            }
        }
        _ => points.push((polygon.centroid(), 1.0)),
    }
    points
}

/// Nodes on 0..1 and weights with one, two and three points.
const GAUSS: [&[(f64, f64)]; 3] = {
    const TWO: f64 = 0.288_675_134_594_812_9; // √(1/3)/2
    const THREE: f64 = 0.387_298_334_620_741_7; // √(3/5)/2
    [
        &[(0.5, 1.0)],
        &[(0.5 - TWO, 0.5), (0.5 + TWO, 0.5)],
        &[(0.5 - THREE, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + THREE, 5.0 / 18.0)],
    ]
};
