//! Iterated snap rounding: lines become pieces that meet only where both end.
//!
//! Each round splits pieces at the vertices that they pass too closely; when there are none, at the grid points
//! nearest to where they cross. A split bends a piece a little, which may bring it near the next vertex or across
//! the next piece: hence the rounds, until nothing is left to split.
//!
//! Departures from Halperin and Packer: vertices keep a distance of √2 radii from each other instead
//! of being centres of pixels, and new crossings become vertices in later rounds too. Both make thin triangles
//! rarer; the price is that termination is not proven for crossings (it is for splits at vertices, see
//! [`passes_closely`]), so there are limits.

use smallvec::SmallVec;

use super::quadtree::{Quadtree, Segment};
use super::vertices::Vertices;
use super::{Line, LineKind, Piece, Unarranged};
use crate::mesh::edge_key;
use crate::mesh::grid::{GridPoint, Step, cross_properly, rounded_crossing};

/// Pieces end at vertices that they pass within so many cells, and nothing is nearer to the border than that.
///
/// A crossing is rounded by up to √½ cells and then moved by up to √2 radii to a vertex nearby. When that is at
/// most two radii, that is, when the radius is at least 1.21, a piece cannot be bent around its own end, which
/// would bring back the crossing: 2 is the smallest whole radius that cannot. It is 3e-8 of the face's edge.
pub(super) const SNAP_RADIUS: i32 = 2;

/// Rounds before giving up. The most that any of 50,000 hostile cases took is 20.
const MAX_ROUNDS: usize = 100;

/// Pieces before giving up: 2,000 lines right across a face cross 440,000 times and have 900,000.
const MAX_PIECES: usize = 1 << 21;

/// Pairs to be tested before giving up, after some seconds. Those 2,000 lines take a tenth of it. As many in a bundle
/// ten thousand times as long as wide, which squares do not part, would take a minute.
const MAX_TESTS: usize = 1 << 28;

/// Points (corners and border vertices first, then every other that ends a piece) and the pieces of all lines.
pub(super) fn arrange(
    border: [&[i32]; 3],
    lines: &[Line],
) -> Result<(Vec<GridPoint>, Vec<Piece>), Unarranged> {
    let mut vertices = Vertices::new(border);
    let pieces = vertices.place_lines(border, lines);
    let mut arrangement = Arrangement { vertices, pieces, fresh: Vec::new(), first_fresh: 0, tests: 0 };
    arrangement.fresh = vec![Fresh::ALL; arrangement.pieces.len()];
    for _ in 0..MAX_ROUNDS {
        if arrangement.pieces.len() > MAX_PIECES {
            return Err(Unarranged::TooMany);
        }
        if arrangement.split_at_vertices()? {
            continue;
        }
        if !arrangement.split_at_crossings()? {
            return Ok(arrangement.without_loose_vertices());
        }
    }
    Err(Unarranged::Restless)
}

/// Which searches a piece is new to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Fresh {
    vertices: bool,
    crossings: bool,
}

impl Fresh {
    const ALL: Self = Self { vertices: true, crossings: true };
}

struct Arrangement {
    vertices: Vertices,
    /// Sorted by their ends, which are unique.
    pieces: Vec<Piece>,
    fresh: Vec<Fresh>,
    /// Vertices from here on are new since the last search for vertices.
    first_fresh: usize,
    /// Pairs tested so far.
    tests: usize,
}

impl Arrangement {
    /// Splits pieces at the vertices that they pass too closely. Whether there were any.
    fn split_at_vertices(&mut self) -> Result<bool, Unarranged> {
        let points = &self.vertices.points;
        let segments = self.segments(|fresh| fresh.vertices);
        let (mut splits, mut tests) = (Vec::new(), self.tests);
        self.quadtree(&segments, self.first_fresh).visit_squares(&mut |_, vertices, pieces| {
            tests += pieces.len() * vertices.len();
            if tests > MAX_TESTS {
                return;
            }
            for segment in pieces {
                let ends = self.pieces[segment.index as usize].ends;
                // Vertices are in order.
                let first = if segment.fresh {
                    0
                } else {
                    vertices.partition_point(|&v| (v as usize) < self.first_fresh)
                };
                for &vertex in &vertices[first..] {
                    if !ends.contains(&vertex) && passes_closely(segment.ends, points[vertex as usize]) {
                        splits.push((segment.index, vertex));
                    }
                }
            }
        });
        self.spend(tests)?;
        self.fresh.iter_mut().for_each(|fresh| fresh.vertices = false);
        self.first_fresh = self.vertices.points.len();
        let found = !splits.is_empty();
        self.split(splits);
        Ok(found)
    }

    /// Splits pieces where they cross. Whether any did.
    fn split_at_crossings(&mut self) -> Result<bool, Unarranged> {
        let segments = self.segments(|fresh| fresh.crossings);
        let (mut crossings, mut tests) = (Vec::new(), self.tests);
        self.quadtree(&segments, usize::MAX).visit_squares(&mut |square, _, pieces| {
            tests += pieces.len().pow(2) / 2;
            if tests > MAX_TESTS || crossings.len() > MAX_PIECES {
                return;
            }
            for (k, a) in pieces.iter().enumerate() {
                for b in &pieces[k + 1..] {
                    if !(a.fresh || b.fresh) || !cross_properly(a.ends, b.ends) {
                        continue;
                    }
                    let crossing = rounded_crossing(a.ends, b.ends);
                    // Other squares see the same pair.
                    if square.contains(crossing) {
                        crossings.push(([a.index, b.index], crossing));
                    }
                }
            }
        });
        self.spend(tests)?;
        if crossings.len() > MAX_PIECES {
            return Err(Unarranged::TooMany);
        }
        self.fresh.iter_mut().for_each(|fresh| fresh.crossings = false);

        // New vertices are numbered in an order that does not depend on the search
        crossings.sort_unstable();
        let mut splits = Vec::new();
        for (pair, crossing) in crossings {
            let vertex = self.vertices.place(crossing);
            for piece in pair {
                if !self.pieces[piece as usize].ends.contains(&vertex) {
                    splits.push((piece, vertex));
                }
            }
        }
        let found = !splits.is_empty();
        self.split(splits);
        Ok(found)
    }

    fn spend(&mut self, tests: usize) -> Result<(), Unarranged> {
        self.tests = tests;
        if tests > MAX_TESTS { Err(Unarranged::TooMany) } else { Ok(()) }
    }

    fn segments(&self, is_fresh: impl Fn(Fresh) -> bool) -> Vec<Segment> {
        let pieces = (0..).zip(&self.pieces).zip(&self.fresh);
        let segment = |((index, piece), &fresh): ((u32, &Piece), &Fresh)| {
            let ends = piece.ends.map(|end| self.vertices.points[end as usize]);
            Segment { index, ends, fresh: is_fresh(fresh) }
        };
        pieces.map(segment).collect()
    }

    fn quadtree<'a>(&'a self, segments: &'a [Segment], first_fresh: usize) -> Quadtree<'a> {
        // A vertex within the radius, and a crossing with its rounding, share a square with their pieces.
        let margin = SNAP_RADIUS + 1;
        Quadtree { vertices: &self.vertices.points, first_fresh, segments, margin }
    }

    /// Replaces pieces by chains through vertices: pairs of a piece and a vertex.
    fn split(&mut self, mut splits: Vec<(u32, u32)>) {
        if splits.is_empty() {
            return;
        }
        splits.sort_unstable();
        splits.dedup();
        let points = &self.vertices.points;
        let mut pieces = Vec::with_capacity(self.pieces.len() + splits.len());
        let mut rest = &splits[..];
        for ((index, &piece), &fresh) in (0..).zip(&self.pieces).zip(&self.fresh) {
            let count = rest.partition_point(|&(split, _)| split == index);
            let (own, others) = rest.split_at(count);
            rest = others;
            if own.is_empty() {
                pieces.push((piece, fresh));
                continue;
            }
            let [a, b] = piece.ends.map(|end| points[end as usize]);
            let mut via: SmallVec<[u32; 8]> = own.iter().map(|&(_, vertex)| vertex).collect();
            via.sort_by_key(|&v| (Step::between(a, b).dot(Step::between(a, points[v as usize])), v));
            via.push(piece.ends[1]);
            let mut from = piece.ends[0];
            for to in via {
                pieces.extend(piece_between(points, from, to, piece.kind).map(|piece| (piece, Fresh::ALL)));
                from = to;
            }
        }
        // Of equal pieces the strongest remains; where one was searched before, so were all.
        pieces.sort_unstable_by_key(|&(piece, fresh)| (piece.ends, std::cmp::Reverse(piece.kind), fresh));
        pieces.dedup_by(|next, kept| {
            let equal = next.0.ends == kept.0.ends;
            if equal {
                kept.1.vertices &= next.1.vertices;
                kept.1.crossings &= next.1.crossings;
            }
            equal
        });
        (self.pieces, self.fresh) = pieces.into_iter().unzip();
    }

    /// Only the points that pieces end at, and those of the border.
    fn without_loose_vertices(self) -> (Vec<GridPoint>, Vec<Piece>) {
        let Self { vertices: Vertices { points, border, .. }, mut pieces, .. } = self;
        let mut used = vec![false; points.len()];
        used[..border].fill(true);
        for end in pieces.iter().flat_map(|piece| piece.ends) {
            used[end as usize] = true;
        }
        let mut kept = Vec::new();
        let mut renumbered = vec![0; points.len()];
        for (old, point) in points.into_iter().enumerate().filter(|&(old, _)| used[old]) {
            renumbered[old] = kept.len() as u32;
            kept.push(point);
        }
        for piece in &mut pieces {
            piece.ends = piece.ends.map(|end| renumbered[end as usize]);
        }
        (kept, pieces)
    }
}

/// A piece, unless it would be nothing or run along the border.
pub(super) fn piece_between(points: &[GridPoint], from: u32, to: u32, kind: LineKind) -> Option<Piece> {
    let (first, last) = edge_key(from, to);
    let along_border = GridPoint::common_edge(points[first as usize], points[last as usize]).is_some();
    (first != last && !along_border).then_some(Piece { ends: [first, last], kind })
}

/// Whether a segment is to be split at a point: the point is within the radius, and both parts are shorter than the
/// whole. The second condition ends the splitting, also between border vertices that are one cell apart.
fn passes_closely([a, b]: [GridPoint; 2], point: GridPoint) -> bool {
    let (along, to_point) = (Step::between(a, b), Step::between(a, point));
    let area = along.cross(to_point).abs();
    // Most vertices are ruled out without long arithmetic.
    if area > i64::from(SNAP_RADIUS) * (along.du.abs() + along.dv.abs()) {
        return false;
    }
    let whole = along.length_squared();
    to_point.length_squared() < whole
        && Step::between(point, b).length_squared() < whole
        && i128::from(area).pow(2) <= i128::from(SNAP_RADIUS).pow(2) * i128::from(whole)
}
