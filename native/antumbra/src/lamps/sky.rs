//! Light from all around: the background of the world, on a cube of directions.
//!
//! Each face of the cube is divided into cells, and those into four, down to what its radiance is known for. A cell is a
//! polygon of directions beyond everything, so that its visible part is computed like any other source's; from where
//! nothing blocks, a whole face of even light is one polygon, and all of an even sky exactly pi·L.
//!
//! Cells are divided further, for receivers that share a shaft, where their light is uneven or much stands before them.
//! One blocker that hides a cell from the corners of a box of receivers hides it from all in it: both are convex.

use glam::DVec3;

use crate::lamps::BEYOND;
use crate::lamps::cube_map::{Cell, CubeMap, faces};
use crate::scene::world::World;
use crate::transport::clusters::Clustered;
use crate::transport::form_factors::{Candidates, FormFactors, Workspace};
use crate::transport::gather::{Arrived, rms};
use crate::visibility::blockers::Blockers;
use crate::visibility::rays::splitmix;
use crate::visibility::shaft::{BOX_EDGES, Shaft, box_corners};
use crate::visibility::{ConvexPolygon, Receiver, hides, unoccluded_form_factor};

/// What a cell may be wrong by when its mean stands for its parts, in wanted errors: the root mean square of what they
/// differ by, seen as large as the whole cell. Signs differ from cell to cell.
const NEGLIGIBLE: f64 = 0.25;

/// The same as a share of all that the sky sends, below which no cell is divided whatever is wanted: a dark room in bright
/// weather, or a sky that sends and takes away as much, would else be lit cell by cell.
const LEAST: f64 = 1e-4;

/// The error that is wanted where nothing is known yet, as a share of all that the sky sends: a first look.
const FIRST_LOOK: f64 = 0.02;

/// Candidates up to which a cell is looked at whole. A furnished room with a window was lit in 5.6 s of
/// processor time with 32 and three divisions, in 3.6 s with 32 and two, and in 2.3 s with 64 and one, with 0.80, 0.44 and
/// 0.23 million exact form factors; what is not exact is rays within the same noise.
const FEW_CANDIDATES: usize = 32;

/// Candidates that are handed down to the parts of a cell; of more, the tree finds those of each part sooner.
const MOST_HANDED_DOWN: usize = 256;

/// Times that a cube's face is quartered because of what stands before it: cells of 22 degrees. What is then still
/// crowded is left to the receivers, and to rays.
const MOST_DIVISIONS: u32 = 2;

/// What a cell could bring, in wanted errors, below which it is not divided for what stands before it: a ray or two tell
/// enough of it.
const FAINT: f64 = 0.3;

/// Form factor of what rounding may leave of a cell that is hidden, where several blockers meet: all of a closed space adds
/// up to 1 within 1.4e-14, and a room without windows must stay dark.
const ROUNDING: f64 = 1e-14;

/// Light from all around.
#[derive(Debug)]
pub(crate) struct Sky {
    map: CubeMap,
    /// Its mean over all directions and the channels, W/m².
    brightness: f64,
    /// How far away it is taken to be, metres.
    reach: f64,
}

/// What may stand before a cell: some of a list, or unknown.
#[derive(Debug, Clone, Copy)]
struct Before(Option<(usize, usize)>);

impl Sky {
    /// The world's, if it sends anything.
    pub(crate) fn of_world(world: &World) -> Option<Self> {
        let input = world.sky.as_ref()?;
        if input.exitance_rgb.as_flattened().iter().all(|&v| v == 0.0) {
            return None;
        }
        let exitance: Vec<DVec3> = input.exitance_rgb.iter().map(|&rgb| DVec3::from_array(rgb)).collect();
        let map = CubeMap::new(input.cells_per_side, exitance);
        let brightness = rms(map.mean());
        Some(Self { map, brightness, reach: BEYOND * world.diagonal })
    }

    /// What it sends from a direction, W/m²: pi times its radiance there.
    pub(crate) fn towards(&self, direction: DVec3) -> DVec3 {
        self.map.towards(direction)
    }

    /// The polygon of a cell around a place.
    fn polygon(&self, cell: Cell) -> ConvexPolygon {
        let corners = cell.corners().map(|direction| self.reach * direction);
        ConvexPolygon::new(&corners).expect("a square has an area; this is a bug in antumbra")
    }

    /// Power that it sends into a scene of this surface area, about, W: as if each surface saw half of it.
    pub(crate) fn power(&self, surface_area: f64) -> DVec3 {
        0.5 * surface_area * self.map.mean()
    }

    /// What it brings to any of some receivers if nothing blocks, about and at most, per channel, W/m².
    pub(crate) fn brightest(&self, receivers: &[Receiver]) -> DVec3 {
        receivers.iter().fold(DVec3::ZERO, |most, receiver| {
            let of_face = |cell: Cell| {
                let polygon = self.polygon(cell).moved(receiver.position);
                unoccluded_form_factor(receiver, &polygon) * self.map.sends(cell).0.abs()
            };
            most.max(faces().map(of_face).sum())
        })
    }

    /// What it brings to the receivers of a cluster.
    ///
    /// `wanted_error`: W/m², or 0 where nothing is known yet. `found`: gets the receiver's number in the cluster.
    pub(crate) fn light_cluster(
        &self,
        at: Clustered,
        form_factors: &FormFactors,
        wanted_error: f64,
        workspace: &mut Workspace,
        mut found: impl FnMut(usize, Arrived),
    ) {
        let (low, high) = at.cluster.bounds();
        let box_corners = box_corners(low, high);
        let wanted_error = if wanted_error > 0.0 { wanted_error } else { FIRST_LOOK * self.brightness };
        let negligible = (NEGLIGIBLE * wanted_error).max(LEAST * self.brightness);
        let worth = 1.0 / wanted_error;
        let mut lists: Vec<u32> = Vec::new();
        let mut open: Vec<(Cell, Before)> = faces().map(|cell| (cell, Before(None))).collect();
        while let Some((cell, before)) = open.pop() {
            let corners = cell.corners();
            let above = |k: usize| corners.iter().any(|&d| at.receiver(k).normal.dot(d) > 0.0);
            let (exitance, spread) = self.map.sends(cell);
            if (exitance == DVec3::ZERO && spread == 0.0) || !(0..at.cluster.members.len()).any(above) {
                continue;
            }
            // A wall may hide it whole, however much else stands there.
            let polygons = form_factors.blockers.polygons();
            let hides_all = |id: u32| {
                let opaque = form_factors.blockers.blocking().is_opaque(id);
                let hides_from = |&from: &DVec3| {
                    corners.iter().all(|&to| hides(&polygons[id as usize], from, self.reach * to))
                };
                opaque && box_corners.iter().all(hides_from)
            };
            if form_factors.blockers.large().iter().any(|&id| hides_all(id)) {
                continue;
            }
            let shaft = Shaft::along(&box_corners, &BOX_EDGES, &corners, self.reach, None);
            let start = lists.len();
            let known = narrow(form_factors.blockers, &shaft, before, &mut lists, &mut workspace.shared);
            let candidates = known.then_some(start..lists.len());
            if let Some(candidates) = candidates.clone()
                && lists[candidates].iter().any(|&id| hides_all(id))
            {
                continue;
            }
            let uneven = spread * cell.most() > negligible;
            let crowded = candidates.as_ref().is_none_or(|list| list.len() > FEW_CANDIDATES)
                && cell.level < MOST_DIVISIONS
                && worth * rms(exitance) * cell.most() > FAINT;
            if uneven || crowded {
                let before = Before(candidates.map(|list| (list.start, list.end)));
                open.extend(cell.parts().map(|part| (part, before)));
                continue;
            }
            let candidates = match &candidates {
                Some(list) => Candidates::Shared(&lists[list.clone()]),
                None => Candidates::Crowd,
            };
            let polygon = self.polygon(cell);
            for k in (0..at.cluster.members.len()).filter(|&k| above(k)) {
                let receiver = at.receiver(k);
                let seed = at.seed(k) ^ splitmix(cell.seed());
                let polygon = polygon.moved(receiver.position);
                let worth = worth * rms(exitance);
                let seen = form_factors.visible(receiver, &polygon, candidates, worth, seed, workspace);
                if seen.value < ROUNDING {
                    continue;
                }
                found(
                    k,
                    Arrived {
                        irradiance: seen.coloured() * exitance,
                        variance: (seen.noise * exitance).length_squared(),
                    },
                );
            }
        }
    }
}

/// Appends what may stand in a shaft to a list; `false` when it is too much to be one.
fn narrow(
    blockers: &Blockers,
    shaft: &Shaft,
    before: Before,
    lists: &mut Vec<u32>,
    scratch: &mut Vec<u32>,
) -> bool {
    if let Before(Some((start, end))) = before {
        for index in start..end {
            let candidate = lists[index];
            if shaft.may_block(&blockers.polygons()[candidate as usize]) {
                lists.push(candidate);
            }
        }
        return true;
    }
    let found = blockers.candidates(shaft, MOST_HANDED_DOWN, scratch).is_ok();
    if found {
        lists.extend_from_slice(scratch);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_tile_the_sphere_and_face_its_middle() {
        let map = CubeMap::new(1, vec![DVec3::ONE; 6]);
        let sky = Sky { map, brightness: 1.0, reach: 1.0 };
        let mut cells: Vec<Cell> = faces().collect();
        for _ in 0..4 {
            for normal in [DVec3::Z, DVec3::new(0.3, -0.5, 0.7).normalize(), DVec3::NEG_X] {
                let receiver = Receiver::new(DVec3::ZERO, normal);
                let sum: f64 =
                    cells.iter().map(|&c| unoccluded_form_factor(&receiver, &sky.polygon(c))).sum();
                assert!((sum - 1.0).abs() < 1e-13, "{sum}");
            }
            for cell in &cells {
                let polygon = sky.polygon(*cell);
                assert!(polygon.normal().dot(polygon.centroid()) < 0.0);
                let receiver = Receiver::new(DVec3::ZERO, polygon.centroid().normalize());
                assert!(unoccluded_form_factor(&receiver, &polygon) < 1.2 * cell.most());
            }
            cells = cells.into_iter().flat_map(Cell::parts).collect();
        }
    }
}
