//! A face that is searched for lines, and lines as they lie on it.

use glam::DVec3;

use crate::adapt::line_search::LineSearch;
use crate::index::FaceId;
use crate::mesh::arrangement::{Line, LineKind};
use crate::mesh::grid::{GRID, GridPoint};
use crate::scene::world::interpolated;
use crate::shadow::boundary::Plane;
use crate::visibility::Receiver;

/// Parts of a line that are nearer than this, as a weight, continue each other: rounding of their ends.
pub(super) const TOUCHING: f64 = 1e-9;

/// A line that nowhere leaves an edge of its face by more than this, in cells of the grid, is the edge: four times what
/// counts as touching. Walls that meet in the edge throw such lines, by rounding; the strip between would have light of
/// its own.
const ALONG_BORDER: i32 = 268;

/// What `reach` is more than the distance to the farthest corner: lines are clipped at the face's edges, not by this.
const BEYOND: f64 = 1.01;

/// Part of a line on a face: barycentric ends.
pub(super) type Part = [DVec3; 2];

/// A face under search.
pub(super) struct Plate {
    pub(super) corners: [DVec3; 3],
    /// Through its centre.
    pub(super) plane: Plane,
    /// From its centre to its farthest corner and beyond, metres.
    pub(super) reach: f64,
    pub(super) area: f64,
    /// Share of arriving light that is shown, per channel.
    pub(super) shown: DVec3,
}

impl Plate {
    pub(super) fn new(search: &LineSearch, id: FaceId) -> Self {
        let face = &search.world.faces[id.index()];
        let corners = search.world.corners(face);
        let point = (corners[0] + corners[1] + corners[2]) / 3.0;
        Self {
            corners,
            plane: Plane { point, normal: face.normal },
            reach: BEYOND * corners.iter().map(|c| c.distance(point)).fold(0.0, f64::max),
            area: face.area,
            shown: search.shown[face.material as usize],
        }
    }

    pub(super) fn at(&self, weights: DVec3) -> DVec3 {
        interpolated(self.corners, weights)
    }

    pub(super) fn receiver(&self, position: DVec3) -> Receiver {
        Receiver::new(position, self.plane.normal)
    }
}

/// Parts of one line, with those that touch made one.
pub(super) fn joined(mut parts: Vec<Part>) -> Vec<Part> {
    if parts.len() < 2 {
        return parts;
    }
    // Along the weight that changes most
    let change = parts.iter().fold(DVec3::ZERO, |change, [a, b]| change.max((*b - *a).abs()));
    let axis = (1..3).fold(0, |most, axis| if change[axis] > change[most] { axis } else { most });
    for part in &mut parts {
        if part[0][axis] > part[1][axis] {
            part.swap(0, 1);
        }
    }
    parts.sort_by(|a, b| a[0][axis].total_cmp(&b[0][axis]));
    let mut whole: Vec<Part> = Vec::new();
    for part in parts {
        match whole.last_mut() {
            Some(last) if part[0][axis] <= last[1][axis] + TOUCHING => {
                if part[1][axis] > last[1][axis] {
                    last[1] = part[1];
                }
            }
            _ => whole.push(part),
        }
    }
    whole
}

/// A line on the face's grid; none when it is shorter than the grid can hold, or runs along the border.
pub(super) fn line(part: Part, kind: LineKind) -> Option<Line> {
    let ends = part.map(|weights| {
        let on_edge = (0..3).find(|&k| weights[(k + 2) % 3] == 0.0);
        let cells = |weight: f64| ((weight * f64::from(GRID)).round() as i32).clamp(0, GRID);
        if let Some(k) = on_edge {
            return GridPoint::on_edge(k, cells(weights[(k + 1) % 3]));
        }
        let u = cells(weights.y);
        GridPoint { u, v: cells(weights.z).min(GRID - u) }
    });
    let along_border = (0..3).any(|k| ends.iter().all(|end| end.depth(k) <= ALONG_BORDER));
    (ends[0] != ends[1] && !along_border).then_some(Line { ends, kind })
}
