//! The integer grid of a face: where lines across it meet, decided without rounding.
//!
//! A point of a face is given by the weights of the face's corners, in units of 1/[`GRID`]. Which side of a line a
//! point is on, whether a point is on an edge of the face and whether two lines cross are then questions about
//! integers, with one answer each, the same for every face shape and size.

use glam::DVec3;

/// Grid cells along an edge of a face: 2^26.
///
/// Differences of coordinates fit 27 bits with their sign, so the orientation of three points fits 54 bits and is
/// computed in `i64`; coordinates and weights are exact in `f64`. On a wall of 10 m a cell is 0.15 µm. Many fewer
/// cells and rounding would show at the scale of a large floor; 2^31 would push orientations out of `i64`.
pub(crate) const GRID: i32 = 1 << 26;

/// A point of a face: corner 1 weighs `u`, corner 2 weighs `v` and corner 0 the rest, in units of 1/[`GRID`].
///
/// Inside the face `u >= 0`, `v >= 0` and `u + v <= GRID`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct GridPoint {
    pub(crate) u: i32,
    pub(crate) v: i32,
}

/// The face's own corners.
pub(crate) const CORNERS: [GridPoint; 3] =
    [GridPoint { u: 0, v: 0 }, GridPoint { u: GRID, v: 0 }, GridPoint { u: 0, v: GRID }];

impl GridPoint {
    /// Weights of the face's corners 0, 1 and 2. They are exact and sum to one exactly.
    pub(crate) fn barycentric(self) -> DVec3 {
        DVec3::new(f64::from(self.weights()[0]), f64::from(self.u), f64::from(self.v)) / f64::from(GRID)
    }

    fn weights(self) -> [i32; 3] {
        [GRID - self.u - self.v, self.u, self.v]
    }

    /// Distance from edge `edge`, which runs from that corner to the next, as the weight of the corner opposite.
    pub(crate) fn depth(self, edge: usize) -> i32 {
        self.weights()[(edge + 2) % 3]
    }

    /// Where on edge `edge` the point lies: 0 at the corner of that number, [`GRID`] at the next.
    pub(crate) fn edge_position(self, edge: usize) -> Option<i32> {
        (self.depth(edge) == 0).then(|| self.weights()[(edge + 1) % 3])
    }

    /// The point on an edge at a position as [`Self::edge_position`] gives it.
    pub(crate) fn on_edge(edge: usize, position: i32) -> Self {
        let mut weights = [0; 3];
        weights[edge] = GRID - position;
        weights[(edge + 1) % 3] = position;
        Self { u: weights[1], v: weights[2] }
    }

    /// Halfway between two points, whichever comes first.
    ///
    /// Rounding one coordinate down and the other up keeps the middle of two points of an edge on that edge: on
    /// edge 1 the sums of the coordinates are both even or both odd. A face on the other side of an edge would
    /// round the other way, so who needs one middle for both faces has to halve positions instead.
    pub(crate) fn middle(a: Self, b: Self) -> Self {
        Self { u: (a.u + b.u) >> 1, v: (a.v + b.v + 1) >> 1 }
    }

    #[cfg(test)]
    pub(crate) fn is_inside_or_on_border(self) -> bool {
        self.weights().iter().all(|&weight| weight >= 0)
    }

    /// The edge of the face that both points are on.
    pub(crate) fn common_edge(a: Self, b: Self) -> Option<usize> {
        (0..3).find(|&edge| a.depth(edge) == 0 && b.depth(edge) == 0)
    }
}

/// A step between two points of the grid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    pub(crate) du: i64,
    pub(crate) dv: i64,
}

impl Step {
    pub(crate) fn between(from: GridPoint, to: GridPoint) -> Self {
        Self { du: i64::from(to.u) - i64::from(from.u), dv: i64::from(to.v) - i64::from(from.v) }
    }

    /// Twice the area of the triangle of two steps; below 2^54.
    pub(crate) fn cross(self, other: Self) -> i64 {
        self.du * other.dv - self.dv * other.du
    }

    pub(crate) fn dot(self, other: Self) -> i64 {
        self.du * other.du + self.dv * other.dv
    }

    pub(crate) fn length_squared(self) -> i64 {
        self.dot(self)
    }
}

/// Where a point is, seen along a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LineSide {
    Left,
    On,
    Right,
}

/// On which side of the line from `a` to `b` the point `p` is. Exact.
pub(crate) fn side(a: GridPoint, b: GridPoint, p: GridPoint) -> LineSide {
    match Step::between(a, b).cross(Step::between(a, p)) {
        1.. => LineSide::Left,
        0 => LineSide::On,
        _ => LineSide::Right,
    }
}

/// Whether two segments cross at a point inside both.
pub(crate) fn cross_properly([a, b]: [GridPoint; 2], [c, d]: [GridPoint; 2]) -> bool {
    let apart =
        |p, q| matches!((p, q), (LineSide::Left, LineSide::Right) | (LineSide::Right, LineSide::Left));
    apart(side(a, b, c), side(a, b, d)) && apart(side(c, d, a), side(c, d, b))
}

/// The point of the grid nearest to where two properly crossing segments meet, at most √½ cells away from it.
pub(crate) fn rounded_crossing([a, b]: [GridPoint; 2], [c, d]: [GridPoint; 2]) -> GridPoint {
    let (along, other) = (Step::between(a, b), Step::between(c, d));
    // The crossing is a + along·above/below. The products with `along` have 81 bits.
    let (above, below) = (i128::from(Step::between(a, c).cross(other)), i128::from(along.cross(other)));
    let (above, below) = if below < 0 { (-above, -below) } else { (above, below) };
    let rounded =
        |from: i32, by: i64| from + (2 * i128::from(by) * above + below).div_euclid(2 * below) as i32;
    GridPoint { u: rounded(a.u, along.du), v: rounded(a.v, along.dv) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn at(u: i32, v: i32) -> GridPoint {
        GridPoint { u, v }
    }

    #[test]
    fn every_edge_runs_from_its_corner_to_the_next() {
        for edge in 0..3 {
            assert_eq!(GridPoint::on_edge(edge, 0), CORNERS[edge]);
            assert_eq!(GridPoint::on_edge(edge, GRID), CORNERS[(edge + 1) % 3]);
            for position in [0, 1, 12_345, GRID / 2, GRID - 1, GRID] {
                let point = GridPoint::on_edge(edge, position);
                assert_eq!(point.edge_position(edge), Some(position));
                assert!(point.is_inside_or_on_border());
            }
        }
        assert!((0..3).all(|edge| at(1, 1).edge_position(edge).is_none()));
        assert_eq!(at(5, 0).edge_position(1), None);
    }

    #[test]
    fn weights_are_exact() {
        let weights = at(3, 5).barycentric();
        assert_eq!(weights * f64::from(GRID), DVec3::new(f64::from(GRID - 8), 3.0, 5.0));
        assert_eq!(weights.x + weights.y + weights.z, 1.0);
        for (k, corner) in CORNERS.iter().enumerate() {
            assert_eq!(corner.barycentric(), DVec3::AXES[k]);
        }
    }

    #[test]
    fn the_middle_of_two_points_of_an_edge_is_on_that_edge() {
        for edge in 0..3 {
            for (p, q) in [(0, 1), (1, 2), (7, 12), (8, 12), (GRID - 1, GRID), (3, GRID)] {
                let (a, b) = (GridPoint::on_edge(edge, p), GridPoint::on_edge(edge, q));
                let middle = GridPoint::middle(a, b);
                assert_eq!(middle, GridPoint::middle(b, a));
                let position = middle.edge_position(edge).expect("it is on the edge");
                assert!((2 * position - p - q).abs() <= 1);
            }
        }
    }

    #[test]
    fn the_side_of_a_point_one_cell_off_the_longest_line_is_known() {
        let (a, b) = (at(0, GRID), at(GRID, 0));
        assert_eq!(side(a, b, at(GRID / 2, GRID / 2)), LineSide::On);
        assert_eq!(side(a, b, at(GRID / 2, GRID / 2 + 1)), LineSide::Left);
        assert_eq!(side(a, b, at(GRID / 2, GRID / 2 - 1)), LineSide::Right);
    }

    #[test]
    fn lines_cross_at_the_nearest_grid_point() {
        let (flat, steep) = ([at(0, 10), at(30, 10)], [at(10, 0), at(10, 30)]);
        assert!(cross_properly(flat, steep));
        assert_eq!(rounded_crossing(flat, steep), at(10, 10));
        assert_eq!(rounded_crossing(steep, flat), at(10, 10));
        // They meet at (2/3, 2/3).
        assert_eq!(rounded_crossing([at(0, 0), at(1, 1)], [at(0, 1), at(2, 0)]), at(1, 1));
        let touching = [at(10, 10), at(20, 20)];
        assert!(!cross_properly(flat, touching), "an end on a line does not cross it");
        assert!(!cross_properly(flat, [at(5, 10), at(50, 10)]), "nor does a line along it");
    }
}
