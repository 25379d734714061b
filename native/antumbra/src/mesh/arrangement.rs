//! A face cut along lines into triangles: snap rounding of the lines, then a constrained Delaunay triangulation.
//!
//! Lines across a face (shadow boundaries, contacts) cross, overlap and nearly coincide. Iterated snap rounding
//! (Halperin and Packer, *Iterated snap rounding*, 2002) turns them into pieces that meet at grid points only;
//! departures from the paper are in [`snap`].
//!
//! Guarantees: the triangles fill the face without gap or overlap, and each has exactly positive area; on the
//! border are exactly the vertices asked for, so faces that agree about them stay watertight; every piece that is
//! left of a line is made of edges; equal sets of lines give equal partitions, in whatever order they come.
//!
//! Not guaranteed: that a line stays where it was (it moves by some cells of the grid, and its end on the border
//! to the nearest border vertex, however far that is), or that a line shorter than some cells is there at all.

mod quadtree;
mod snap;
#[cfg(test)]
mod tests;
mod vertices;

use glam::DVec2;
use thiserror::Error;

use crate::mesh::grid::{CORNERS, GRID, GridPoint, Step};
use crate::mesh::{edge_key, triangulation};

/// What changes across a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum LineKind {
    /// The slope of light or less.
    Shadow,
    /// Light itself: the shadow of a point or of a direction ends there.
    Sharp,
    /// Light itself: something touches the face there. Where lines coincide, the strongest counts.
    Contact,
}

impl LineKind {
    /// Whether light has a value of its own on each side.
    pub(crate) fn jumps(self) -> bool {
        self != Self::Shadow
    }

    /// What stands for it in a baked mesh; 0 is no line.
    pub(crate) fn number(self) -> i8 {
        match self {
            Self::Shadow => 1,
            Self::Sharp => 2,
            Self::Contact => 3,
        }
    }
}

/// A line across a face, clipped to it; an end where it leaves the face is exactly on the border.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Line {
    pub(crate) ends: [GridPoint; 2],
    pub(crate) kind: LineKind,
}

/// Why lines could not be turned into a partition. A face without its lines always can: [`Partition::plain`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub(crate) enum Unarranged {
    /// Snapping made new crossings for longer than it ever should.
    #[error("the lines on a face did not come to rest")]
    Restless,
    /// Too many pieces, or too many of them side by side, for any reasonable time.
    #[error("the lines on a face are too many or cross too often")]
    TooMany,
    /// The triangulation refused a piece, so the pieces still crossed.
    #[error("the lines on a face could not be triangulated")]
    Rejected,
}

/// Part of a line between two vertices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Piece {
    /// Indices of points, the smaller first.
    pub(crate) ends: [u32; 2],
    pub(crate) kind: LineKind,
}

/// A face cut into triangles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Partition {
    /// The corners 0, 1 and 2, the border vertices along edges 0, 1 and 2, then those inside.
    pub(crate) points: Vec<GridPoint>,
    /// Indices of points, counter-clockwise in (u, v).
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Per triangle and edge, which runs from that corner to the next: the line that it lies on.
    pub(crate) lines: Vec<[Option<LineKind>; 3]>,
}

/// Where line ends split the edges of the face: positions strictly inside each edge, in order.
pub(crate) fn border_crossings(lines: &[Line]) -> [Vec<i32>; 3] {
    std::array::from_fn(|edge| {
        let ends = lines.iter().flat_map(|line| line.ends);
        let mut positions: Vec<i32> = ends
            .filter_map(|end| end.edge_position(edge))
            .filter(|&position| position > 0 && position < GRID)
            .collect();
        positions.sort_unstable();
        positions.dedup();
        positions
    })
}

/// Cuts a face along lines.
///
/// `border` lists all vertices strictly inside each edge, in order along it; `shape` holds the face's corners in
/// its plane, in metres, for triangles that are well shaped there rather than on the grid.
///
/// # Errors
/// [`Unarranged`] when the lines are too many or, as no test has managed so far, too tangled.
pub(crate) fn partition(
    border: [&[i32]; 3],
    lines: &[Line],
    shape: Option<[DVec2; 3]>,
) -> Result<Partition, Unarranged> {
    let (points, pieces) = snap::arrange(border, lines)?;
    let outline = outline(border);
    let (mut triangles, mut lines) = triangulation::triangulate(&points, &outline, &pieces)?;
    if let Some(shape) = shape {
        triangulation::improve(&points, &mut triangles, &mut lines, shape);
    }
    let partition = Partition { points, triangles, lines };
    debug_assert_eq!(partition.check(border), Ok(()));
    Ok(partition)
}

/// Positions of corners and border vertices among the points, once around the face.
pub(super) fn outline(border: [&[i32]; 3]) -> Vec<u32> {
    let mut outline = Vec::new();
    let mut next = 3;
    for (corner, positions) in (0..).zip(border) {
        outline.push(corner);
        let count = positions.len() as u32;
        outline.extend(next..next + count);
        next += count;
    }
    outline
}

/// The corners of a face, then its border vertices.
fn outline_points(border: [&[i32]; 3]) -> Vec<GridPoint> {
    let mut points = CORNERS.to_vec();
    for (edge, positions) in border.into_iter().enumerate() {
        points.extend(positions.iter().map(|&position| GridPoint::on_edge(edge, position)));
    }
    points
}

impl Partition {
    /// A face that only its border vertices divide.
    pub(crate) fn plain(border: [&[i32]; 3], shape: Option<[DVec2; 3]>) -> Self {
        partition(border, &[], shape)
            .expect("a face without lines could not be triangulated; this is a bug in antumbra")
    }

    /// Tests everything that is guaranteed about a partition; the first thing that is wrong, if any.
    pub(crate) fn check(&self, border: [&[i32]; 3]) -> Result<(), String> {
        let outline_points = outline_points(border);
        if !self.points.starts_with(&outline_points) {
            return Err("it does not start with its corners and border vertices".into());
        }
        let inner = &self.points[outline_points.len()..];
        if let Some(point) = inner.iter().find(|point| (0..3).any(|edge| point.depth(edge) <= 0)) {
            return Err(format!("{point:?} is not strictly inside"));
        }
        self.check_areas()?;
        self.check_edges(&outline(border))
    }

    /// Triangles that are positive and sum to the face fill it once, if their edges match.
    fn check_areas(&self) -> Result<(), String> {
        let mut sum = 0;
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|p| self.points[p as usize]);
            let area = Step::between(a, b).cross(Step::between(a, c));
            if area <= 0 {
                return Err(format!("triangle {triangle:?} has the area {area}/2"));
            }
            sum += i128::from(area);
        }
        if sum != i128::from(GRID).pow(2) {
            return Err(format!("the areas sum to {sum}/2"));
        }
        Ok(())
    }

    fn check_edges(&self, outline: &[u32]) -> Result<(), String> {
        if self.lines.len() != self.triangles.len() {
            return Err("there are not as many triangles as lines".into());
        }
        let mut edges = Vec::with_capacity(3 * self.triangles.len() + outline.len());
        for (&[a, b, c], lines) in self.triangles.iter().zip(&self.lines) {
            for ((from, to), line) in [(a, b), (b, c), (c, a)].into_iter().zip(lines) {
                edges.push((edge_key(from, to), from < to, *line));
            }
        }
        // Beyond the border is one more face, around which the outline runs backwards.
        for (&from, &to) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            edges.push((edge_key(from, to), to < from, None));
        }
        edges.sort_unstable();
        let matched = edges
            .chunks(2)
            .all(|pair| matches!(pair, [(p, false, line), (q, true, other)] if p == q && line == other));
        if !matched {
            return Err("an edge does not have exactly two sides with one line on both".into());
        }
        let mut used = vec![false; self.points.len()];
        for &corner in self.triangles.as_flattened() {
            used[corner as usize] = true;
        }
        used.iter().position(|used| !used).map_or(Ok(()), |p| Err(format!("no triangle uses point {p}")))
    }
}
