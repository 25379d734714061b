//! Contacts of a whole scene: where things touch, light jumps, so every method that draws lines draws these.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::adapt::line_search::line;
use crate::index::FaceId;
use crate::mesh::arrangement::{Line, LineKind};
use crate::scene::world::World;
use crate::shadow::contact::contact_line;
use crate::visibility::blockers::Blockers;

/// Distance of a polygon from a face's box, relative to the face's size, up to which they are looked at: ten times
/// what counts as touching.
const NEAR: f64 = 1e-5;

/// Where polygons touch or pierce the faces for which `which` holds, in lines longer than `shortest`, metres.
pub(crate) fn contacts(
    world: &World,
    blockers: &Blockers,
    which: impl Fn(FaceId) -> bool + Sync,
    shortest: f64,
) -> FxHashMap<FaceId, Vec<Line>> {
    let faces: Vec<FaceId> = FaceId::range(0..world.faces.len()).filter(|&face| which(face)).collect();
    let lines: Vec<Vec<Line>> = (faces.par_iter())
        .map_init(Vec::new, |found, &id| {
            let face = &world.faces[id.index()];
            let corners = world.corners(face);
            let [a, b, c] = corners;
            let size = a.distance(b).max(b.distance(c)).max(c.distance(a));
            if size < shortest {
                return Vec::new();
            }
            blockers.touching(a.min(b).min(c), a.max(b).max(c), NEAR * size, found);
            let at = |weights: DVec3| weights.x * a + weights.y * b + weights.z * c;
            (found.iter())
                .flat_map(|&blocker| {
                    contact_line(corners, face.normal, &blockers.polygons()[blocker as usize])
                })
                .filter(|part| at(part[0]).distance(at(part[1])) >= shortest)
                .filter_map(|part| line(part, LineKind::Contact))
                .collect()
        })
        .collect();
    faces.into_iter().zip(lines).filter(|(_, lines)| !lines.is_empty()).collect()
}
