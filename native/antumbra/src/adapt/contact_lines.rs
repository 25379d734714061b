//! Contacts of a whole scene: where things touch, light jumps, so every method that draws lines draws these.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::adapt::contact_outlines::outlines;
use crate::adapt::plate::line;
use crate::index::FaceId;
use crate::mesh::arrangement::{Line, LineKind};
use crate::mesh::grid::GridPoint;
use crate::scene::world::{World, interpolated};
use crate::shadow::contact::contact_line;
use crate::threads::AT_A_TIME;
use crate::visibility::blockers::Blockers;

/// Distance of a polygon from a face's box, relative to the face's size, up to which they are looked at: ten times
/// what counts as touching.
const NEAR: f64 = 1e-5;

/// Weight of a corner below which a point lies on the opposite edge: clipping leaves some rounding.
const ON_BORDER: f64 = 1e-9;

/// Lines of an outline that cost no more than what is inside is worth. Each more makes two triangles.
const RECTANGLE: f64 = 4.0;

/// What a line parts, in squares of its length, where a face is so slender that short lines count: a rod. In folds of cloth
/// that touch, such lines without their neighbours left faces dark of which only a corner is.
const SLENDER: f64 = 16.0;

/// Where polygons touch or pierce the faces for which `which` holds: in outlines larger than `shortest`, metres, and in those
/// with a line that parts at least an area of `least_parted`, m², from the rest of a face, as across a rod that passes through a
/// wall.
///
/// What counts is the outline, not its lines: the back of a picture frame lies on the wall in hundreds of small faces, and
/// each of their edges is worth nothing, but all of them together part the dark from the light.
pub(crate) fn contacts(
    world: &World,
    blockers: &Blockers,
    which: impl Fn(FaceId) -> bool + Sync,
    shortest: f64,
    least_parted: f64,
) -> FxHashMap<FaceId, Vec<Line>> {
    let faces: Vec<FaceId> = FaceId::range(0..world.faces.len()).filter(|&face| which(face)).collect();
    let lines: Vec<Vec<Line>> = (faces.par_iter().with_max_len(AT_A_TIME))
        .map_init(Vec::new, |found, &id| {
            let face = &world.faces[id.index()];
            let corners = world.corners(face);
            let [a, b, c] = corners;
            let size = a.distance(b).max(b.distance(c)).max(c.distance(a));
            if size < shortest {
                return Vec::new();
            }
            blockers.touching(a.min(b).min(c), a.max(b).max(c), NEAR * size, found);
            let touched = (found.iter())
                .flat_map(|&blocker| {
                    contact_line(corners, face.normal, &blockers.polygons()[blocker as usize])
                })
                .filter_map(|contact| Some((line(contact.ends, LineKind::Contact)?.ends, contact.covers)));
            let at = |point: GridPoint| interpolated(corners, point.barycentric());
            let counts = |outline: &Vec<[GridPoint; 2]>| {
                let ends = || outline.iter().flatten().map(|&end| at(end));
                let least = ends().fold(DVec3::INFINITY, DVec3::min);
                let most = ends().fold(DVec3::NEG_INFINITY, DVec3::max);
                let lines = (outline.len() as f64 / RECTANGLE).max(1.0);
                least.distance_squared(most) >= lines * shortest * shortest
                    || outline.iter().any(|&[from, to]| {
                        let squared = at(from).distance_squared(at(to));
                        face.area * parted([from, to].map(GridPoint::barycentric))
                            >= least_parted.max(SLENDER * squared)
                    })
            };
            (outlines(touched).into_iter().filter(counts).flatten())
                .map(|ends| Line { ends, kind: LineKind::Contact })
                .collect()
        })
        .collect();
    faces.into_iter().zip(lines).filter(|(_, lines)| !lines.is_empty()).collect()
}

/// Share of a triangle that is in the smaller of two parts, when a line parts it: when it goes from one edge to another.
fn parted(ends: [DVec3; 2]) -> f64 {
    let is_on = |end: DVec3, corner: usize| end[corner] < ON_BORDER;
    // The edges that meet in a corner are opposite to the two others.
    let corner = (0..3).find(|&corner| {
        let [other, third] = [(corner + 1) % 3, (corner + 2) % 3];
        (is_on(ends[0], other) && is_on(ends[1], third)) || (is_on(ends[0], third) && is_on(ends[1], other))
    });
    let at_corner = corner.map_or(0.0, |corner| (1.0 - ends[0][corner]) * (1.0 - ends[1][corner]));
    at_corner.min(1.0 - at_corner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_parts_a_triangle_when_it_goes_from_edge_to_edge() {
        let middle = |a: DVec3, b: DVec3| 0.5 * (a + b);
        let [ab, bc, ca] =
            [middle(DVec3::X, DVec3::Y), middle(DVec3::Y, DVec3::Z), middle(DVec3::Z, DVec3::X)];
        for (ends, share) in [
            ([ab, ca], 0.25),
            ([bc, ab], 0.25),
            ([DVec3::Y, ca], 0.5),
            ([DVec3::X + 0.1 * (DVec3::Y - DVec3::X), DVec3::X + 0.2 * (DVec3::Z - DVec3::X)], 0.02),
            ([ab, DVec3::splat(1.0 / 3.0)], 0.0),
            ([DVec3::X, DVec3::Y], 0.0),
        ] {
            assert!((parted(ends) - share).abs() < 1e-15, "{ends:?}: {}", parted(ends));
        }
    }
}
