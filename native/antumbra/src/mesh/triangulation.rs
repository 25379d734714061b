//! Triangles between pieces: the only place that knows spade, with [`grading`](super::grading).
//!
//! spade triangulates the points and takes in the pieces as constraints, by `try_add_constraint` alone: given lines
//! that cross, `add_constraint` panics, and `add_constraint_and_split` panicked on lines along one another and did
//! not return on lines 1e-8 apart. What it builds is Delaunay on the grid, where every face is half a square;
//! [`improve`] flips edges until it is Delaunay in metres. No decision about what lies where uses rounded numbers.

use glam::DVec2;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use crate::mesh::arrangement::{LineKind, Piece, Unarranged};
use crate::mesh::edge_key;
use crate::mesh::grid::{GRID, GridPoint, LineSide, Step, side};

pub(super) type LinedTriangulation = ConstrainedDelaunayTriangulation<Point2<f64>, (), Option<LineKind>>;

/// Triangles, counter-clockwise, and the line on each of their edges.
type LinedTriangles = (Vec<[u32; 3]>, Vec<[Option<LineKind>; 3]>);

/// Triangulates points with given edges: the outline, closed and counter-clockwise, and the pieces.
///
/// # Errors
/// [`Unarranged::Rejected`] when a piece is not an edge of the triangulation.
pub(super) fn triangulate(
    points: &[GridPoint],
    outline: &[u32],
    pieces: &[Piece],
) -> Result<LinedTriangles, Unarranged> {
    let positions = points.iter().map(|point| Point2::new(f64::from(point.u), f64::from(point.v)));
    let grid = constrained(positions.collect(), outline, pieces)?;
    let lined_triangles: LinedTriangles = grid
        .inner_faces()
        .map(|face| {
            let edges = face.adjacent_edges();
            (
                edges.map(|edge| edge.from().index() as u32),
                edges.map(|edge| *edge.as_undirected().data().data()),
            )
        })
        .unzip();
    let on_lines = lined_triangles.1.as_flattened().iter().flatten().count();
    if on_lines != 2 * pieces.len() {
        return Err(Unarranged::Rejected);
    }
    Ok(lined_triangles)
}

/// The Delaunay triangulation of points in any plane with given edges, as for [`triangulate`].
///
/// # Errors
/// [`Unarranged::Rejected`] when two points are one, or something would cross.
pub(super) fn constrained(
    positions: Vec<Point2<f64>>,
    outline: &[u32],
    pieces: &[Piece],
) -> Result<LinedTriangulation, Unarranged> {
    let points = positions.len();
    let mut triangulation =
        LinedTriangulation::bulk_load_cdt(positions, Vec::new()).map_err(|_| Unarranged::Rejected)?;
    if triangulation.num_vertices() != points {
        return Err(Unarranged::Rejected);
    }
    for (&from, &to) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        constrain(&mut triangulation, [from, to], None)?;
    }
    for piece in pieces {
        constrain(&mut triangulation, piece.ends, Some(piece.kind))?;
    }
    Ok(triangulation)
}

fn constrain(
    grid: &mut LinedTriangulation,
    ends: [u32; 2],
    kind: Option<LineKind>,
) -> Result<(), Unarranged> {
    let [from, to] = ends.map(|end| FixedVertexHandle::from_index(end as usize));
    let [edge] = grid.try_add_constraint(from, to)[..] else { return Err(Unarranged::Rejected) };
    *grid.undirected_edge_data_mut(edge.as_undirected()).data_mut() = kind;
    Ok(())
}

/// An edge is flipped when the angles opposite to it exceed 180° by more than this, in radians. Rounding is far
/// below, so that a flip is never taken back; four points on a circle stay as they are.
const FLAT_ANGLE_TOLERANCE: f64 = 1e-9;

/// Flips per edge of a triangle before improvement stops, with triangles that are valid but thinner than need be. Faces
/// of usual shapes take less than 1; of 50,000 hostile cases, some on faces 10,000 times as long as wide, none took
/// more than 35.
const MAX_FLIPS_PER_EDGE: usize = 50;

/// No triangle on the other side.
const BORDER: u32 = u32::MAX;

/// Flips edges that are on no line until the triangles are Delaunay where the face's corners are at `shape`, metres.
pub(super) fn improve(
    points: &[GridPoint],
    triangles: &mut [[u32; 3]],
    lines: &mut [[Option<LineKind>; 3]],
    shape: [DVec2; 3],
) {
    let axes = [shape[1] - shape[0], shape[2] - shape[0]].map(|axis| axis / f64::from(GRID));
    let det = axes[0].perp_dot(axes[1]).abs();
    if !det.is_normal() {
        return;
    }
    let twins = twins(triangles);
    let mut flips = Flips { points, axes, det, triangles, lines, twins };
    let mut suspects: Vec<u32> = (0..flips.twins.len() as u32).rev().collect();
    let mut left = MAX_FLIPS_PER_EDGE * suspects.len();
    while let Some(edge) = suspects.pop() {
        if left > 0 && flips.is_better_flipped(edge) {
            suspects.extend(flips.flip(edge));
            left -= 1;
        }
    }
}

/// Per edge of a triangle (three times the triangle's number, plus its own): the same edge of the triangle beyond.
fn twins(triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut edges: Vec<((u32, u32), u32)> = Vec::with_capacity(3 * triangles.len());
    for (first, &[a, b, c]) in (0..).step_by(3).zip(triangles) {
        edges.extend([(edge_key(a, b), first), (edge_key(b, c), first + 1), (edge_key(c, a), first + 2)]);
    }
    edges.sort_unstable();
    let mut twins = vec![BORDER; edges.len()];
    for pair in edges.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        twins[pair[0].1 as usize] = pair[1].1;
        twins[pair[1].1 as usize] = pair[0].1;
    }
    twins
}

/// A triangulation whose edges are being flipped.
struct Flips<'a> {
    points: &'a [GridPoint],
    /// What a step in u and one in v are in the face's plane, metres.
    axes: [DVec2; 2],
    /// Area of a cell, m².
    det: f64,
    triangles: &'a mut [[u32; 3]],
    lines: &'a mut [[Option<LineKind>; 3]],
    twins: Vec<u32>,
}

/// Triangle of an edge and the corners that it leads from, to, and past.
fn corners_around(edge: u32) -> (usize, [usize; 3]) {
    let k = edge as usize % 3;
    (edge as usize / 3, [k, (k + 1) % 3, (k + 2) % 3])
}

impl Flips<'_> {
    /// An edge's ends and the corners opposite, on its left and on its right.
    fn quad(&self, edge: u32) -> [u32; 4] {
        let (left, [from, to, apex]) = corners_around(edge);
        let (right, [.., other_apex]) = corners_around(self.twins[edge as usize]);
        let triangle = self.triangles[left];
        [triangle[from], triangle[to], triangle[apex], self.triangles[right][other_apex]]
    }

    fn is_better_flipped(&self, edge: u32) -> bool {
        if self.twins[edge as usize] == BORDER || self.lines.as_flattened()[edge as usize].is_some() {
            return false;
        }
        let [a, b, c, d] = self.quad(edge).map(|p| self.points[p as usize]);
        if side(d, b, c) != LineSide::Left || side(c, a, d) != LineSide::Left {
            return false;
        }
        // The sine of the sum of the angles at c and d
        let (sin_c, cos_c) = self.angle(c, a, b);
        let (sin_d, cos_d) = self.angle(d, b, a);
        sin_c * cos_d + cos_c * sin_d < -FLAT_ANGLE_TOLERANCE
    }

    /// Sine and cosine, in the face's plane, of the angle at a corner of a triangle.
    fn angle(&self, corner: GridPoint, from: GridPoint, to: GridPoint) -> (f64, f64) {
        let steps = [Step::between(corner, from), Step::between(corner, to)];
        let [p, q] = steps.map(|step| step.du as f64 * self.axes[0] + step.dv as f64 * self.axes[1]);
        let lengths = p.length() * q.length();
        // Thin angles keep their relative precision: the area is exact on the grid.
        (steps[0].cross(steps[1]) as f64 * self.det / lengths, p.dot(q) / lengths)
    }

    /// Replaces an edge by the other diagonal of the two triangles at it. The four edges around them.
    fn flip(&mut self, edge: u32) -> [u32; 4] {
        let twin = self.twins[edge as usize];
        let [a, b, c, d] = self.quad(edge);
        let (left, [_, bc, ca]) = corners_around(edge);
        let (right, [_, ad, db]) = corners_around(twin);
        let around = [(right, db), (left, bc), (left, ca), (right, ad)];
        let [line_db, line_bc, line_ca, line_ad] = around.map(|(triangle, k)| self.lines[triangle][k]);
        let beyond = around.map(|(triangle, k)| self.twins[3 * triangle + k]);

        self.triangles[left] = [d, b, c];
        self.lines[left] = [line_db, line_bc, None];
        self.triangles[right] = [c, a, d];
        self.lines[right] = [line_ca, line_ad, None];
        let (left, right) = (3 * left as u32, 3 * right as u32);
        let edges = [left, left + 1, right, right + 1];
        for (inner, outer) in edges.into_iter().zip(beyond) {
            self.link(inner, outer);
        }
        self.link(left + 2, right + 2);
        edges
    }

    fn link(&mut self, edge: u32, twin: u32) {
        self.twins[edge as usize] = twin;
        if twin != BORDER {
            self.twins[twin as usize] = edge;
        }
    }
}
