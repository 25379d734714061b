//! Rows of the exchange by rays: what the rays of each side of a patch meet, found once.

use glam::DVec3;
use rayon::prelude::*;

use crate::error::Error;
use crate::lamps::Sky;
use crate::monitor::{Monitor, Progress};
use crate::threads::AT_A_TIME;
use crate::transport::hemisphere::{Directions, POWER};
use crate::transport::patch_tree::{PatchHit, PatchTree};
use crate::transport::sources::{SourceId, Sources};
use crate::visibility::ConvexPolygon;
use crate::visibility::rays::{point_on, splitmix, spread, unit};

/// Strata along each side of a patch's hemisphere, at least and at most: its error averages out over those who look at it. In the
/// Cornell box and in an interior of 10,000 triangles 32 left no smaller errors than 16.
const FEWEST: usize = 4;
const MOST: usize = 16;

/// Sides that look around between two looks at what the user wants: some milliseconds.
const AT_ONCE: usize = 4096;

/// The part of a bake that looking around is, for the progress bar.
const LOOKING: f64 = 0.08;

/// A ray that meets nothing.
const NOTHING: u32 = u32::MAX;

/// What there is to see.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    pub(super) patches: &'a Sources,
    /// Patches that block.
    pub(super) tree: &'a PatchTree,
    pub(super) sky: Option<&'a Sky>,
}

/// What the rays of each side of a patch meet: rows of the exchange.
pub(super) struct Rows {
    /// Where in `seen` the row of each side begins and ends.
    ranges: Vec<(u32, u32)>,
    /// Numbers of sides.
    seen: Vec<u32>,
    /// Per side: irradiance that comes from beyond all surfaces, W/m².
    pub(super) from_sky: Vec<DVec3>,
    /// Per side: mean over its rays of the square of what each brings from there, W²/m⁴.
    sky_squared: Vec<DVec3>,
}

impl Rows {
    /// Sends rays from all that is shown, then from all that these meet, and so on, or until it ends.
    ///
    /// `rays`: that leave all patches together, about.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(super) fn look_around(
        around: Around,
        rays: f64,
        monitor: &Monitor,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, Error> {
        let patches = around.patches;
        let area = |side: usize| patches.area(SourceId::new(side));
        let hemispheres: Vec<Directions> = (FEWEST..=MOST).map(Directions::square).collect();
        let weights: f64 = (0..patches.len()).map(|side| area(side).powf(POWER)).sum();
        let directions = |side: usize| {
            let strata = (rays / weights * area(side).powf(POWER)).sqrt() as usize;
            &hemispheres[strata.clamp(FEWEST, MOST) - FEWEST]
        };
        // What is black sends nothing on, whatever it gets; but what it gets may be shown.
        let matters = |side: usize| patches.patches[side / 2].reflectance != DVec3::ZERO;
        let mut known = vec![false; patches.len()];
        let mut wave: Vec<u32> = Vec::new();
        for index in (0..patches.patches.len()).filter(|&index| patches.patches[index].receives) {
            known[2 * index] = true;
            wave.push(2 * index as u32);
        }
        let mut rows = Self {
            ranges: vec![(0, 0); patches.len()],
            seen: Vec::new(),
            from_sky: vec![DVec3::ZERO; patches.len()],
            sky_squared: vec![DVec3::ZERO; patches.len()],
        };
        let mut looked = 0;
        while !wave.is_empty() {
            let mut next = Vec::new();
            for part in wave.chunks(AT_ONCE) {
                monitor.check()?;
                if ends() {
                    return Ok(rows);
                }
                let met: Vec<(Vec<u32>, [DVec3; 2])> = (part.par_iter().with_max_len(AT_A_TIME))
                    .map(|&side| look(around, side as usize, directions(side as usize)))
                    .collect();
                for (&side, (met, [from_sky, squared])) in part.iter().zip(met) {
                    let start = rows.seen.len() as u32;
                    for &other in met.iter().filter(|&&other| other != NOTHING) {
                        let is_new = !std::mem::replace(&mut known[other as usize], true);
                        if is_new && matters(other as usize) {
                            next.push(other);
                        }
                    }
                    rows.seen.extend(met);
                    rows.ranges[side as usize] = (start, rows.seen.len() as u32);
                    rows.from_sky[side as usize] = from_sky;
                    rows.sky_squared[side as usize] = squared;
                }
                looked += part.len();
                let fraction = LOOKING * looked as f64 / patches.len() as f64;
                monitor.report(Progress { fraction, ..monitor.progress() });
            }
            wave = next;
        }
        Ok(rows)
    }

    pub(super) fn of(&self, side: usize) -> &[u32] {
        let (start, end) = self.ranges[side];
        &self.seen[start as usize..end as usize]
    }

    /// The sides that the rays of one met; none where one of them left, or where it did not look.
    pub(super) fn enclosed(&self, side: usize) -> Option<&[u32]> {
        Some(self.of(side)).filter(|met| !met.is_empty() && !met.contains(&NOTHING))
    }

    /// The sides that rays of one met, one for each that met something.
    fn met(&self, side: usize) -> impl Iterator<Item = usize> {
        self.of(side).iter().filter(|&&met| met != NOTHING).map(|&met| met as usize)
    }

    /// Irradiance of a side by what others reflect, W/m².
    pub(super) fn reflected(&self, side: usize, radiosity: &[DVec3]) -> DVec3 {
        let sum: DVec3 = self.met(side).map(|met| radiosity[met]).sum();
        sum / self.of(side).len().max(1) as f64
    }

    /// The same of one number for all channels.
    pub(super) fn reflected_grey(&self, side: usize, radiosity: &[f32]) -> f32 {
        let sum: f32 = self.met(side).map(|met| radiosity[met]).sum();
        sum / self.of(side).len().max(1) as f32
    }

    /// Irradiance of a side by what others reflect and by what is beyond them, W/m², and per channel the variance that rays
    /// leave in it; nothing for a side that did not look.
    pub(super) fn arrived(&self, side: usize, radiosity: &[DVec3]) -> Option<[DVec3; 2]> {
        let count = self.of(side).len() as f64;
        let squared = self.met(side).map(|met| radiosity[met] * radiosity[met]).sum::<DVec3>() / count;
        let mean = self.reflected(side, radiosity) + self.from_sky[side];
        let variance = (squared + self.sky_squared[side] - mean * mean) / (count - 1.0);
        (count > 1.0).then_some([mean, variance.max(DVec3::ZERO)])
    }

    /// Rays that met something.
    pub(super) fn hits(&self) -> usize {
        self.seen.iter().filter(|&&seen| seen != NOTHING).count()
    }
}

/// What the rays of one side meet, and what they bring from beyond all surfaces: the mean, W/m², and that of the squares.
fn look(around: Around, side: usize, directions: &Directions) -> (Vec<u32>, [DVec3; 2]) {
    let mut from_sky = [DVec3::ZERO; 2];
    let met = rays_from(&around.patches.patches[side / 2].polygon, side, directions)
        .map(|ray| {
            let Some(hit) = ray.first_stop(around.tree) else {
                let light = around.sky.map_or(DVec3::ZERO, |sky| sky.towards(ray.direction));
                from_sky[0] += light;
                from_sky[1] += light * light;
                return NOTHING;
            };
            hit.side
        })
        .collect();
    (met, from_sky.map(|sum| sum / directions.len() as f64))
}

/// A ray that leaves a side of a patch.
pub(super) struct Leaving {
    start: DVec3,
    direction: DVec3,
    /// Which filters stop it.
    chance: f64,
}

impl Leaving {
    /// The patch that stops it.
    pub(super) fn first_stop(&self, tree: &PatchTree) -> Option<PatchHit> {
        tree.first_stop(self.start, self.direction, self.chance)
    }
}

/// Rays that leave a side like light arrives there, from all over it.
pub(super) fn rays_from<'a>(
    polygon: &'a ConvexPolygon,
    side: usize,
    directions: &'a Directions,
) -> impl Iterator<Item = Leaving> + 'a {
    let seed = splitmix(side as u64);
    let shift = [1, 2].map(|k| unit(splitmix(seed ^ k)));
    directions.about(normal(polygon, side), unit(seed)).enumerate().map(move |(k, direction)| Leaving {
        // Points in an order of their own: neighbouring directions leave from all over the patch.
        start: point_on(polygon, spread(shift, k as u32 + 1)),
        direction,
        chance: unit(splitmix(seed ^ (k as u64 + 3))),
    })
}

/// Of a side of a patch, away from it.
pub(super) fn normal(polygon: &ConvexPolygon, side: usize) -> DVec3 {
    if side.is_multiple_of(2) { polygon.normal() } else { -polygon.normal() }
}
