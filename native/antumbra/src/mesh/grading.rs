//! Well-shaped triangles between lines, by Delaunay refinement (Ruppert 1995).
//!
//! A table's foot on a floor joins points a centimetre apart to corners five metres off. Linear light on such a fan is wrong
//! over little area, and seen all the same: as streaks. Where light is smooth, points are added instead, ever farther apart
//! away from what is small.

use glam::DVec2;
use spade::{AngleLimit, Point2, RefinementParameters, Triangulation};

use crate::mesh::arrangement::{Partition, Piece, outline};
use crate::mesh::grid::{GRID, GridPoint};
use crate::mesh::triangulation::{constrained, improve, triangulate};

/// How faces are cut evenly before any light is known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grading {
    /// Edges between faces get a vertex at least every so many metres.
    pub(crate) longest: f64,
    /// Triangles of less area are left as they are, m².
    pub(crate) least_area: f64,
}

/// Smallest angle that is asked for, degrees: refinement ends for up to 20.7, and with 30 it takes twice the points.
const SMALLEST_ANGLE: f64 = 20.0;

/// Points that are added to a face, at most, per point that it has, and to every face: a watchdog.
const MOST_ADDED: [usize; 2] = [20, 10_000];

/// Points are kept off the borders of a face and off its other points by so many cells of the grid.
const APART: i32 = 1024;

impl Grading {
    /// Where an edge of this length is split: positions strictly inside it.
    pub(super) fn on_edge(self, length: f64) -> impl Iterator<Item = i32> {
        // By halves, so that both ways along an edge give the same positions.
        let halvings = (length / self.longest).log2().ceil().clamp(0.0, 10.0) as u32;
        let parts = 1 << halvings;
        (1..parts).map(move |k| GRID / parts * k)
    }
}

/// A partition with more points inside, so that its triangles are neither thin nor large; nothing where it has them already,
/// or where they could not be added.
///
/// `shape`: the face's corners in its plane, metres.
pub(super) fn graded(
    partition: &Partition,
    border: [&[i32]; 3],
    shape: [DVec2; 3],
    grading: Grading,
) -> Option<Partition> {
    let axes = [shape[1] - shape[0], shape[2] - shape[0]].map(|axis| axis / f64::from(GRID));
    let det = axes[0].perp_dot(axes[1]);
    if !det.is_normal() {
        return None;
    }
    let outline = outline(border);
    let pieces = pieces(partition);
    let place = |point: &GridPoint| {
        let place = f64::from(point.u) * axes[0] + f64::from(point.v) * axes[1];
        Point2::new(place.x, place.y)
    };
    let places = partition.points.iter().map(place).collect();
    let mut plane = constrained(places, &outline, &pieces).ok()?;
    let [per_point, per_face] = MOST_ADDED;
    let parameters = RefinementParameters::new()
        .keep_constraint_edges()
        .with_angle_limit(AngleLimit::from_deg(SMALLEST_ANGLE))
        .with_min_required_area(grading.least_area)
        .with_max_allowed_area((grading.longest * grading.longest).max(2.0 * grading.least_area))
        .with_max_additional_vertices(per_face + per_point * partition.points.len());
    plane.refine(parameters);

    let mut points = partition.points.clone();
    for vertex in plane.vertices().skip(partition.points.len()) {
        let at = DVec2::new(vertex.position().x, vertex.position().y);
        let [u, v] = [at.perp_dot(axes[1]) / det, axes[0].perp_dot(at) / det];
        let point = GridPoint { u: u.round() as i32, v: v.round() as i32 };
        if (0..3).all(|edge| point.depth(edge) > APART) {
            points.push(point);
        }
    }
    if points.len() == partition.points.len() {
        return None;
    }
    let (mut triangles, mut lines) = triangulate(&points, &outline, &pieces).ok()?;
    improve(&points, &mut triangles, &mut lines, shape);
    let graded = Partition { points, triangles, lines };
    debug_assert_eq!(graded.check(border), Ok(()));
    Some(graded)
}

/// The lines of a partition, piece by piece.
fn pieces(partition: &Partition) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    for (triangle, lines) in partition.triangles.iter().zip(&partition.lines) {
        for (k, line) in lines.iter().enumerate() {
            let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
            if let Some(kind) = *line
                && from < to
            {
                pieces.push(Piece { ends: [from, to], kind });
            }
        }
    }
    pieces
}
