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
    /// From whole faces to the finest cells.
    levels: Vec<Level>,
    /// Its mean over all directions and the channels, W/m².
    brightness: f64,
    /// How far away it is taken to be, metres.
    reach: f64,
}

/// Cells of one size: face by face, row by row.
#[derive(Debug)]
struct Level {
    /// pi times the mean radiance, W/m².
    exitance: Vec<DVec3>,
    /// The root mean square of what its parts differ from it by, over the channels, W/m².
    spread: Vec<f64>,
}

/// A square on a face of the cube.
#[derive(Debug, Clone, Copy)]
struct Cell {
    face: usize,
    level: u32,
    /// From -1 on, along the two axes that follow the face's.
    column: usize,
    row: usize,
}

impl Cell {
    fn per_side(self) -> usize {
        1 << self.level
    }

    /// The direction of a point of it, 0 to 1 along both axes: one where the cube's half side is one.
    fn direction(self, across: f64, along: f64) -> DVec3 {
        let size = 2.0 / self.per_side() as f64;
        let axis = self.face / 2;
        let mut direction = DVec3::ZERO;
        direction[axis] = [1.0, -1.0][self.face % 2];
        direction[(axis + 1) % 3] = (self.column as f64 + across) * size - 1.0;
        direction[(axis + 2) % 3] = (self.row as f64 + along) * size - 1.0;
        direction
    }

    /// Counter-clockwise seen from the middle of the cube.
    fn corners(self) -> [DVec3; 4] {
        let mut corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| self.direction(u, v));
        if self.face.is_multiple_of(2) {
            corners.reverse();
        }
        corners
    }

    /// No form factor of it is larger, about: its solid angle over pi, taken from its middle.
    fn most(self) -> f64 {
        let size = 2.0 / self.per_side() as f64;
        let distance = self.direction(0.5, 0.5).length();
        (size * size / (std::f64::consts::PI * distance.powi(3))).min(1.0)
    }

    fn parts(self) -> [Self; 4] {
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(column, row)| Self {
            level: self.level + 1,
            column: 2 * self.column + column,
            row: 2 * self.row + row,
            ..self
        })
    }

    /// A number of its own, for rays.
    fn seed(self) -> u64 {
        ((self.face as u64) << 56)
            | (u64::from(self.level) << 48)
            | ((self.column as u64) << 24)
            | self.row as u64
    }
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
        let finest = Level { spread: vec![0.0; exitance.len()], exitance };
        let mut levels = vec![finest];
        let mut level = input.cells_per_side.trailing_zeros();
        while level > 0 {
            level -= 1;
            let coarser = Level::of_parts(levels.last().expect("one is there"), level);
            levels.push(coarser);
        }
        levels.reverse();
        let mut sky = Self { levels, brightness: 0.0, reach: BEYOND * world.diagonal };
        sky.brightness = rms(sky.mean());
        Some(sky)
    }

    /// What a cell sends, and how much that differs within it. Cells finer than those known are as these.
    fn sends(&self, cell: Cell) -> (DVec3, f64) {
        let depth = (self.levels.len() - 1).min(cell.level as usize);
        let finer = cell.level as usize - depth;
        let per_side = 1 << depth;
        let index = (cell.face * per_side + (cell.row >> finer)) * per_side + (cell.column >> finer);
        let Level { exitance, spread } = &self.levels[depth];
        (exitance[index], spread[index])
    }

    /// What it sends from a direction, W/m²: pi times its radiance there.
    pub(crate) fn towards(&self, direction: DVec3) -> DVec3 {
        let size = direction.abs();
        let axis = (1..3).fold(0, |largest, axis| if size[axis] > size[largest] { axis } else { largest });
        let away = size[axis];
        let level = self.levels.len() as u32 - 1;
        let per_side = 1_usize << level;
        let place = |axis: usize| {
            let across = 0.5 * (direction[axis % 3] / away + 1.0);
            ((across * per_side as f64) as usize).min(per_side - 1)
        };
        let face = 2 * axis + usize::from(direction[axis] < 0.0);
        self.sends(Cell { face, level, column: place(axis + 1), row: place(axis + 2) }).0
    }

    /// The polygon of a cell around a place.
    fn polygon(&self, cell: Cell) -> ConvexPolygon {
        let corners = cell.corners().map(|direction| self.reach * direction);
        ConvexPolygon::new(&corners).expect("a square has an area; this is a bug in antumbra")
    }

    /// The mean of what it sends and takes away, W/m².
    fn mean(&self) -> DVec3 {
        let finest = &self.levels[self.levels.len() - 1].exitance;
        finest.iter().map(|exitance| exitance.abs()).sum::<DVec3>() / finest.len() as f64
    }

    /// Power that it sends into a scene of this surface area, about, W: as if each surface saw half of it.
    pub(crate) fn power(&self, surface_area: f64) -> DVec3 {
        0.5 * surface_area * self.mean()
    }

    /// What it brings to any of some receivers if nothing blocks, about and at most, per channel, W/m².
    pub(crate) fn brightest(&self, receivers: &[Receiver]) -> DVec3 {
        receivers.iter().fold(DVec3::ZERO, |most, receiver| {
            let of_face = |cell: Cell| {
                let polygon = self.polygon(cell).moved(receiver.position);
                unoccluded_form_factor(receiver, &polygon) * self.sends(cell).0.abs()
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
            let (exitance, spread) = self.sends(cell);
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

/// The whole faces of the cube.
fn faces() -> impl Iterator<Item = Cell> {
    (0..6).map(|face| Cell { face, level: 0, column: 0, row: 0 })
}

impl Level {
    /// The cells that are twice as large as those of a level, at the level above it.
    fn of_parts(finer: &Self, level: u32) -> Self {
        let per_side = 1 << level;
        let mut this = Self { exitance: Vec::new(), spread: Vec::new() };
        for face in 0..6 {
            for row in 0..per_side {
                for column in 0..per_side {
                    let parts = Cell { face, level, column, row }.parts();
                    let index = |part: &Cell| (face * 2 * per_side + part.row) * 2 * per_side + part.column;
                    // By solid angle
                    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
                    for part in &parts {
                        let weight = part.direction(0.5, 0.5).length().powi(-3);
                        sum += weight * finer.exitance[index(part)];
                        weights += weight;
                    }
                    let mean = sum / weights;
                    let squared = |part: &Cell| {
                        let deviation = (finer.exitance[index(part)] - mean).abs().max_element();
                        let weight = part.direction(0.5, 0.5).length().powi(-3);
                        weight * (deviation * deviation + finer.spread[index(part)].powi(2))
                    };
                    let spread = (parts.iter().map(squared).sum::<f64>() / weights).sqrt();
                    this.exitance.push(mean);
                    this.spread.push(spread);
                }
            }
        }
        this
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SkyInput;

    fn sky(cells_per_side: usize, sends: impl Fn(DVec3) -> f64) -> Sky {
        let level = cells_per_side.trailing_zeros();
        let mut exitance_rgb = Vec::new();
        for face in 0..6 {
            for row in 0..cells_per_side {
                for column in 0..cells_per_side {
                    let cell = Cell { face, level, column, row };
                    exitance_rgb.push([sends(cell.direction(0.5, 0.5).normalize()); 3]);
                }
            }
        }
        let input = SkyInput { name: "sky".into(), cells_per_side, exitance_rgb };
        let world = World::new(&crate::scene::SceneInput {
            materials: Vec::new(),
            sky: Some(input),
            ..Default::default()
        });
        let mut sky = Sky::of_world(&world.expect("it is valid")).expect("it sends");
        sky.reach = 1.0;
        sky
    }

    #[test]
    fn cells_tile_the_sphere_and_face_its_middle() {
        let sky = sky(1, |_| 1.0);
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

    #[test]
    fn a_direction_sees_the_cell_that_it_points_to() {
        let sends = |direction: DVec3| 2.0 + direction.x + 0.3 * direction.y - 0.5 * direction.z;
        let sky = sky(4, sends);
        for face in faces() {
            for cell in face.parts().into_iter().flat_map(Cell::parts) {
                assert_eq!(sky.towards(cell.direction(0.4, 0.7)), sky.sends(cell).0);
            }
        }
    }

    #[test]
    fn means_and_spreads_of_cells_hold_their_parts() {
        let sky = sky(8, |d| if d.z > 0.9 && d.x > 0.2 { 100.0 } else { 1.0 + d.z });
        // A whole face's spread is the deviation of its finest cells from its mean.
        let finest = &sky.levels[3].exitance;
        for face in 0..6 {
            let (mean, spread) = sky.sends(Cell { face, level: 0, column: 0, row: 0 });
            let (mut squared, mut weights) = (0.0, 0.0);
            for (index, exitance) in finest.iter().enumerate().skip(64 * face).take(64) {
                let cell = Cell { face, level: 3, column: index % 8, row: index / 8 % 8 };
                let weight = cell.direction(0.5, 0.5).length().powi(-3);
                squared += weight * (exitance.x - mean.x).powi(2);
                weights += weight;
            }
            // Weights of coarser cells are not quite the sums of those of their parts.
            assert!((spread / f64::sqrt(squared / weights) - 1.0).abs() < 0.05, "{spread}");
        }
        let whole: f64 = sky.levels[0].exitance.iter().map(|e| e.x).sum::<f64>() / 6.0;
        assert!((1.0..20.0).contains(&whole));
    }
}
