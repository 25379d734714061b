//! The vertices of an arrangement, which keep apart from each other and from the border.

use std::collections::hash_map::Entry;

use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use super::snap::{SNAP_RADIUS, piece_between};
use super::{Line, Piece, outline_points};
use crate::mesh::grid::{GRID, GridPoint, Step};

/// Vertices at most √2 radii apart become one. Farther apart, and a piece split at a vertex within the radius has
/// two shorter parts.
const MERGE_RADIUS_SQUARED: i64 = 2 * (SNAP_RADIUS as i64).pow(2);

/// √2 radii, rounded up.
const MERGE_REACH: i32 = 3;

/// Depths below edges 0, 1 and 2 at which a point is a radius away from the edge: edge 1 is oblique on the grid.
const INSET: [i32; 3] = [SNAP_RADIUS, 3, SNAP_RADIUS];

/// Points with a table of who is where.
pub(super) struct Vertices {
    pub(super) points: Vec<GridPoint>,
    /// So many of them are corners and border vertices, which never move.
    pub(super) border: usize,
    /// Points by the square of 2^[`PLACE_BITS`] cells that they are in. Asked, never iterated.
    places: FxHashMap<(i32, i32), SmallVec<[u32; 3]>>,
}

/// Squares much larger than the radius let most questions about a neighbourhood end in one of them.
const PLACE_BITS: u32 = 6;

impl Vertices {
    pub(super) fn new(border: [&[i32]; 3]) -> Self {
        for positions in border {
            let strictly_inside = positions.iter().all(|&position| position > 0 && position < GRID);
            assert!(
                strictly_inside && positions.is_sorted_by(|p, q| p < q),
                "border vertices are not in order inside their edge; this is a bug in antumbra"
            );
        }
        let mut vertices = Self { points: Vec::new(), border: 0, places: FxHashMap::default() };
        for point in outline_points(border) {
            vertices.push(point);
        }
        vertices.border = vertices.points.len();
        vertices
    }

    fn push(&mut self, point: GridPoint) -> u32 {
        let index = self.points.len() as u32;
        self.points.push(point);
        match self.places.entry((point.u >> PLACE_BITS, point.v >> PLACE_BITS)) {
            Entry::Occupied(mut entry) => entry.get_mut().push(index),
            Entry::Vacant(entry) => {
                entry.insert(SmallVec::from_slice(&[index]));
            }
        }
        index
    }

    /// The vertex that stands for a point inside: one nearby or a new one.
    pub(super) fn place(&mut self, point: GridPoint) -> u32 {
        let inset = inset(point);
        self.nearby(point).or_else(|| self.nearby(inset)).unwrap_or_else(|| self.push(inset))
    }

    /// The nearest vertex that is near enough to merge with.
    fn nearby(&self, point: GridPoint) -> Option<u32> {
        let range = |x: i32| (x - MERGE_REACH) >> PLACE_BITS..=(x + MERGE_REACH) >> PLACE_BITS;
        let squares = range(point.u).flat_map(|u| range(point.v).map(move |v| (u, v)));
        let candidates = squares.filter_map(|square| self.places.get(&square)).flatten();
        candidates
            .map(|&v| (Step::between(point, self.points[v as usize]).length_squared(), v))
            .filter(|&(distance_squared, _)| distance_squared <= MERGE_RADIUS_SQUARED)
            .min()
            .map(|(_, vertex)| vertex)
    }

    pub(super) fn place_lines(&mut self, border: [&[i32]; 3], lines: &[Line]) -> Vec<Piece> {
        let mut lines: Vec<Line> = lines.iter().filter(|line| !runs_along_border(line)).copied().collect();
        for line in &mut lines {
            line.ends.sort_unstable();
        }
        lines.sort_unstable();
        let mut pieces = Vec::with_capacity(lines.len());
        for line in lines {
            let [from, to] =
                line.ends.map(|end| self.nearest_on_border(border, end).unwrap_or_else(|| self.place(end)));
            pieces.extend(piece_between(&self.points, from, to, line.kind));
        }
        pieces.sort_unstable_by_key(|piece| (piece.ends, std::cmp::Reverse(piece.kind)));
        pieces.dedup_by_key(|piece| piece.ends);
        pieces
    }

    /// The border vertex or corner nearest to a point of the border, along the edge that it is on.
    fn nearest_on_border(&self, border: [&[i32]; 3], point: GridPoint) -> Option<u32> {
        let (edge, position) = (0..3).find_map(|edge| Some((edge, point.edge_position(edge)?)))?;
        let first = 3 + border[..edge].iter().map(|positions| positions.len()).sum::<usize>();
        let after = border[edge].partition_point(|&p| p < position);
        let vertex_before = if after == 0 { edge } else { first + after - 1 };
        let vertex_after = if after == border[edge].len() { (edge + 1) % 3 } else { first + after };
        let distance = |&v: &usize| Step::between(point, self.points[v]).length_squared();
        [vertex_before, vertex_after].into_iter().min_by_key(distance).map(|vertex| vertex as u32)
    }
}

/// Whether a line is nowhere more than a radius away from one edge of the face.
fn runs_along_border(line: &Line) -> bool {
    (0..3).any(|edge| line.ends.iter().all(|end| end.depth(edge) < INSET[edge]))
}

/// The nearest point, or nearly, that is a radius away from the border.
fn inset(point: GridPoint) -> GridPoint {
    let GridPoint { u, v } = GridPoint { u: point.u.max(INSET[2]), v: point.v.max(INSET[0]) };
    let excess = (u + v - (GRID - INSET[1])).max(0);
    let from_u = (excess / 2).clamp(excess - (v - INSET[0]).min(excess), (u - INSET[2]).min(excess));
    GridPoint { u: u - from_u, v: v - (excess - from_u) }
}
