//! Patches that reach under something: behind a picture, below a cupboard, into a joint.
//!
//! A patch sends its mean, so that one which lies half in the open would light the crevice that its other half lies in, from
//! a hair's breadth away. Rays tell: some of them meet something at once, others do not. Most patches have nothing that near,
//! which a look at what reaches into a box around them tells.

use rayon::prelude::*;

use crate::index::ElementId;
use crate::mesh::Mesh;
use crate::threads::AT_A_TIME;
use crate::transport::hemisphere::Directions;
use crate::visibility::ConvexPolygon;
use crate::visibility::blockers::Blockers;
use crate::visibility::rays::{point_on, splitmix, spread, unit};
use crate::visibility::shaft::Shaft;

/// Rays from each side, as a square of so many.
const RAYS: usize = 8;

/// A patch lies half in the open where more than some share of the rays, but not all but that share, meet something within some
/// distance, in edges of a square of its area: of a wide gap and of a narrow one, under a narrow strip maybe. Where two walls
/// meet it is less, on patches that touch the other wall.
const GAPS: [(f64, f64); 2] = [(0.125, 0.125), (0.03, 0.03)];

/// What is looked at around a patch, in what its rays reach: more than their rounding.
const WIDER: f64 = 1.001;

/// Quarters patches until none lies half in a crevice, they are smaller than a square of `smallest` metres, there would be more
/// than `most` of them, or it has to end. In order.
///
/// The largest go first: behind a picture a wall loses more than do a million small faces in the seams of furniture, which
/// would use up all there may be.
pub(crate) fn cut_at_crevices(
    mesh: &mut Mesh,
    blockers: &Blockers,
    patches: Vec<ElementId>,
    smallest: f64,
    most: usize,
    ends: &(dyn Fn() -> bool + Sync),
) -> Vec<ElementId> {
    let directions = Directions::square(RAYS);
    let (mut fitting, mut open) = (Vec::new(), patches);
    loop {
        let largest = open.iter().map(|&id| size(mesh, id)).fold(0.0, f64::max);
        if largest <= smallest || ends() {
            break;
        }
        let least = smallest.max(0.5 * largest);
        let (now, later) = open.into_iter().partition::<Vec<_>, _>(|&id| size(mesh, id) > least);
        open = later;
        let is_cut: Vec<bool> = (now.par_iter().with_max_len(AT_A_TIME))
            .map(|&id| !ends() && is_half_covered(mesh, blockers, id, &directions))
            .collect();
        let mut cut = Vec::new();
        for (id, is_cut) in now.into_iter().zip(is_cut) {
            if is_cut { &mut cut } else { &mut fitting }.push(id);
        }
        cut.sort_by(|&a, &b| size(mesh, b).total_cmp(&size(mesh, a)).then(a.cmp(&b)));
        let possible = most.saturating_sub(fitting.len() + open.len() + cut.len()) / 3;
        let uncut = cut.split_off(possible.min(cut.len()));
        for id in cut {
            if mesh.element(id).is_leaf() {
                mesh.subdivide(id, &mut Vec::new());
            }
            open.extend(mesh.element(id).children().expect("it is subdivided; this is a bug in antumbra"));
        }
        if !uncut.is_empty() {
            fitting.extend(uncut);
            break;
        }
    }
    fitting.extend(open);
    fitting.sort_unstable();
    fitting
}

/// Edge of a square of an element's area, metres.
fn size(mesh: &Mesh, id: ElementId) -> f64 {
    mesh.element(id).area.sqrt()
}

fn is_half_covered(mesh: &Mesh, blockers: &Blockers, id: ElementId, directions: &Directions) -> bool {
    let size = size(mesh, id);
    let [a, b, c] = mesh.positions(mesh.element(id));
    let Some(polygon) = ConvexPolygon::triangle(a, b, c) else { return false };
    let seed = splitmix(id.index() as u64);
    let shift = [0, 1].map(|axis| unit(splitmix(seed ^ axis)));
    let reach = size * GAPS.iter().map(|(within, _)| *within).fold(0.0, f64::max);
    let around = [a.min(b).min(c) - WIDER * reach, a.max(b).max(c) + WIDER * reach];
    [1.0, -1.0].into_iter().any(|side| {
        let near = Shaft::between_boxes(around, around).capped(a, side * polygon.normal());
        if blockers.candidates(&near, 0, &mut Vec::new()).is_ok() {
            return false;
        }
        let distances: Vec<f64> = (directions.about(side * polygon.normal(), unit(seed)).enumerate())
            .map(|(k, direction)| {
                let start = point_on(&polygon, spread(shift, k as u32));
                let hit = blockers.first_hit_within(start, direction, reach);
                hit.map_or(f64::INFINITY, |hit| hit.distance / size)
            })
            .collect();
        GAPS.iter().any(|(within, share)| {
            let close = distances.iter().filter(|distance| *distance < within).count() as f64;
            let some = share * distances.len() as f64;
            close > some && distances.len() as f64 - close > some
        })
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::display::tests::{object, scene};
    use crate::index::FaceId;
    use crate::scene::ObjectInput;
    use crate::scene::world::World;
    use crate::transport::sources::blockers;

    /// Horizontal rectangles: their lowest corner, and their sizes along x and y.
    fn rectangles(all: &[(DVec3, f64, f64)]) -> ObjectInput {
        let corners = |&(at, x, y): &(DVec3, f64, f64)| {
            [at, at + x * DVec3::X, at + x * DVec3::X + y * DVec3::Y, at + y * DVec3::Y]
        };
        let halves = |k: u32| [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]];
        object(all.iter().flat_map(corners).collect(), (0..all.len() as u32).flat_map(halves).collect())
    }

    /// A wall of a metre, two thirds of it behind a picture, beside a thousand tiles of two centimetres, each half under a strip.
    #[test]
    fn the_largest_patches_have_their_share_first() {
        let tile = |k: u32| DVec3::new(2.0 + 0.03 * f64::from(k / 40), 0.03 * f64::from(k % 40), 0.0);
        let mut below = vec![(DVec3::ZERO, 1.0, 1.0)];
        below.extend((0..1000).map(|k| (tile(k), 0.02, 0.02)));
        let mut above = vec![(DVec3::new(0.0, 0.0, 1e-4), 0.64, 1.0)];
        above.extend((0..1000).map(|k| (tile(k) + 1e-4 * DVec3::Z, 0.01, 0.02)));
        let world =
            World::new(&scene(vec![rectangles(&below), rectangles(&above)], None)).expect("it is valid");
        let mut mesh = Mesh::new(&world);
        let faces: Vec<ElementId> = ElementId::range(0..mesh.roots.len()).collect();
        let most = faces.len() + 300;
        let patches = cut_at_crevices(&mut mesh, &blockers(&world), faces, 0.005, most, &|| false);
        assert!(patches.len() <= most);
        let on_wall: Vec<ElementId> =
            patches.into_iter().filter(|&id| mesh.element(id).face < FaceId::new(2)).collect();
        let half_covered = |&&id: &&ElementId| {
            let middle = mesh.positions(mesh.element(id)).into_iter().sum::<DVec3>() / 3.0 + world.origin;
            (middle.x - 0.64).abs() < 0.2 * size(&mesh, id)
        };
        let largest = on_wall.iter().filter(half_covered).map(|&id| size(&mesh, id)).fold(0.0, f64::max);
        assert!(largest < 0.03, "{largest} m of the wall lie half behind the picture");
    }
}
