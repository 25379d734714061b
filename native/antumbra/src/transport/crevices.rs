//! Patches that reach under something: behind a picture, below a cupboard, into a joint.
//!
//! A patch sends its mean, so that one which lies half in the open would light the crevice that its other half lies in, from
//! a hair's breadth away. Rays tell: some of them meet something at once, others do not. Most patches have nothing that near,
//! which a look at what reaches into a box around them tells.

use rayon::prelude::*;

use crate::index::ElementId;
use crate::mesh::Mesh;
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
pub(crate) fn cut_at_crevices(
    mesh: &mut Mesh,
    blockers: &Blockers,
    patches: Vec<ElementId>,
    smallest: f64,
    most: usize,
    ends: &(dyn Fn() -> bool + Sync),
) -> Vec<ElementId> {
    let directions = Directions::square(RAYS);
    let mut fitting = Vec::with_capacity(patches.len());
    let mut open = patches;
    while !open.is_empty() {
        let cut: Vec<bool> = (open.par_iter())
            .map(|&id| !ends() && is_half_covered(mesh, blockers, id, smallest, &directions))
            .collect();
        if fitting.len() + open.len() + 3 * cut.iter().filter(|&&cut| cut).count() > most {
            fitting.extend(open);
            break;
        }
        let mut parts = Vec::new();
        for (id, cut) in open.into_iter().zip(cut) {
            if !cut {
                fitting.push(id);
                continue;
            }
            if mesh.element(id).is_leaf() {
                mesh.subdivide(id, &mut Vec::new());
            }
            parts.extend(mesh.element(id).children().expect("it is subdivided; this is a bug in antumbra"));
        }
        open = parts;
    }
    fitting.sort_unstable();
    fitting
}

fn is_half_covered(
    mesh: &Mesh,
    blockers: &Blockers,
    id: ElementId,
    smallest: f64,
    directions: &Directions,
) -> bool {
    let element = mesh.element(id);
    let size = element.area.sqrt();
    let [a, b, c] = mesh.positions(element);
    let Some(polygon) = ConvexPolygon::triangle(a, b, c).filter(|_| size > smallest) else { return false };
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
