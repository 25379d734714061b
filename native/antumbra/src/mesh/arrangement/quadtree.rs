//! Which vertices and segments of a face are near one another.
//!
//! A square around the face is quartered until few things are left in each quarter. Unlike a regular grid this is
//! quick for a thousand lines in one corner of a large face as well. Quarters where nothing is new are left alone:
//! a round that changes a handful of pieces among a million visits a handful of places.

use crate::mesh::grid::{GRID, GridPoint, Step};

/// A segment to be found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    /// What the searcher calls it.
    pub(super) index: u32,
    pub(super) ends: [GridPoint; 2],
    pub(super) fresh: bool,
}

/// A square of the grid, without its upper and right sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Square {
    low: GridPoint,
    size: i32,
}

impl Square {
    /// All of the face with its border.
    const FACE: Self = Self { low: GridPoint { u: 0, v: 0 }, size: 2 * GRID };

    pub(super) fn contains(self, point: GridPoint) -> bool {
        let inside = |x, low| x >= low && x < low + self.size;
        inside(point.u, self.low.u) && inside(point.v, self.low.v)
    }

    fn quarters(self) -> [Self; 4] {
        let size = self.size / 2;
        [(0, 0), (size, 0), (0, size), (size, size)]
            .map(|(u, v)| Self { low: GridPoint { u: self.low.u + u, v: self.low.v + v }, size })
    }

    /// Whether a segment comes within `margin` of the square. Says yes a little too often.
    fn is_near(self, [a, b]: [GridPoint; 2], margin: i32) -> bool {
        let overlaps =
            |p: i32, q: i32, low: i32| p.max(q) >= low - margin && p.min(q) < low + self.size + margin;
        if !overlaps(a.u, b.u, self.low.u) || !overlaps(a.v, b.v, self.low.v) {
            return false;
        }
        let half = self.size / 2;
        let centre = GridPoint { u: self.low.u + half, v: self.low.v + half };
        let along = Step::between(a, b);
        let reach = i64::from(half + margin) * (along.du.abs() + along.dv.abs());
        along.cross(Step::between(a, centre)).abs() <= reach
    }
}

/// Squares with at most so many vertices or segments are not divided further.
///
/// Vertices count because dividing does not part segments that run side by side: along a hundred lines a few cells
/// apart it would go on down to single cells. Everywhere else, where there are segments there are their ends. 8 and
/// 16 take the same time on 2,000 random lines.
const FEW: usize = 8;

/// Nor are squares of so few cells: what is still together there is about to be merged.
const SMALLEST_SIZE: i32 = 16;

/// Everything to be searched.
pub(super) struct Quadtree<'a> {
    pub(super) vertices: &'a [GridPoint],
    /// Vertices from here on are new.
    pub(super) first_fresh: usize,
    pub(super) segments: &'a [Segment],
    /// Segments also count as inside squares that they miss by this much.
    pub(super) margin: i32,
}

impl Quadtree<'_> {
    /// Calls `visit` with the vertices and segments of every smallest square that has something new in it. Every
    /// vertex is in one square, a segment in all those that it is near.
    pub(super) fn visit_squares(&self, visit: &mut impl FnMut(Square, &[u32], &[Segment])) {
        let vertices: Vec<u32> = (0..self.vertices.len() as u32).collect();
        self.visit(Square::FACE, &vertices, self.segments, visit);
    }

    fn visit(
        &self,
        square: Square,
        vertices: &[u32],
        segments: &[Segment],
        visit: &mut impl FnMut(Square, &[u32], &[Segment]),
    ) {
        let fresh = segments.iter().any(|segment| segment.fresh)
            || vertices.last().is_some_and(|&last| last as usize >= self.first_fresh);
        if !fresh || segments.is_empty() {
            return;
        }
        if vertices.len().min(segments.len()) <= FEW || square.size <= SMALLEST_SIZE {
            visit(square, vertices, segments);
            return;
        }
        for quarter in square.quarters() {
            let inside = |&v: &u32| quarter.contains(self.vertices[v as usize]);
            let near = |segment: &Segment| quarter.is_near(segment.ends, self.margin);
            let vertices: Vec<u32> = vertices.iter().copied().filter(inside).collect();
            let segments: Vec<Segment> = segments.iter().copied().filter(near).collect();
            self.visit(quarter, &vertices, &segments, visit);
        }
    }
}
