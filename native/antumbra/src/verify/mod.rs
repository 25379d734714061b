//! How wrong a bake is, by means that the bake does not use: light found along random paths.
//!
//! At random points of what was baked, two estimates A and B of the light are made, independent of each other and of
//! the bake: paths with all their bounces, ended by chance (Kajiya 1986; Arvo, Kirk 1990). They share the tree of blockers
//! with the solver and nothing else: no form factor, no patch, no sample, and lights by formulas of their own. With I the
//! light that is shown, the mean of (I - A)(I - B) is the squared error, without the noise of either estimate in it.
//!
//! ```text
//! points ► (light ► lights ► paths) ► statistics
//! ```

mod beams;
mod light;
mod lights;
mod paths;
mod points;
mod sky;
mod statistics;

use std::time::{Duration, Instant};

use glam::DVec3;
use rayon::prelude::*;

use crate::display::Display;
use crate::error::Error;
use crate::monitor::Monitor;
use crate::report::{Iteration, Verification};
use crate::scene::world::World;
use crate::threads::AT_A_TIME;
use crate::verify::lights::Lights;
use crate::verify::paths::{Paths, Traced};
use crate::verify::points::Points;
use crate::verify::statistics::{Compared, Observed};
use crate::visibility::blockers::Blockers;
use crate::weld::BakedMesh;

/// Rays for each thing that the solver counts, at the default number of points: a ray and what it takes to shade costs about
/// as much as a form factor, and the bake is to take a tenth longer.
const RAYS_PER_WORK: f64 = 0.25;

/// Rays that are spent however small the bake was: some hundredths of a second.
const FEWEST_RAYS: f64 = 50_000.0;

/// The number of points by default, for which the shares above are meant.
pub(crate) const POINTS: u32 = 1_000;

/// Noise of an estimate that is aimed at, in wanted errors. The noise of the squared error falls with the paths at a point and
/// only with the root of the points, so that fewer points are better where rays are few; but errors sit in few places, and
/// fewer points miss them. Both weigh about the same at this.
const NOISE: f64 = 2.0;

/// Paths of one estimate, at least: fewer are not spread evenly.
const FEWEST_PATHS: f64 = 32.0;

/// Points below which their choice says more than the light.
const FEWEST_POINTS: usize = 250;

/// Paths of an estimate beyond which more of them tell nothing new: what they err by is below a thousandth.
const MOST_PATHS: usize = 4_096;

/// Points, and paths of each of their two estimates, that tell how many rays a path has and how noisy it is.
const PILOT: [usize; 2] = [64, 8];

/// What is shown at random points, over the course of a bake.
pub(crate) struct Verifier<'a> {
    world: &'a World,
    points: Points,
    /// What arrives at the points, W/m², when so many iterations were noted.
    course: Vec<(usize, Vec<DVec3>)>,
    /// What watching took.
    watched: Duration,
}

/// What came out, and what it was made for and with.
pub(crate) struct Baked<'a> {
    pub(crate) meshes: &'a [BakedMesh],
    /// Per material: the share of arriving light that is shown.
    pub(crate) shown: &'a [DVec3],
    /// Whether what surfaces emit themselves is shown too.
    pub(crate) emission_is_shown: bool,
    /// What the user wants.
    pub(crate) tolerance: f64,
    /// Form factors, rays and links that it took.
    pub(crate) work: u64,
}

impl<'a> Verifier<'a> {
    /// Points on everything that is baked; `None` where none are wanted.
    pub(crate) fn new(world: &'a World, points: u32) -> Option<Self> {
        let points = Points::new(world, points as usize)?;
        Some(Self { world, points, course: Vec::new(), watched: Duration::ZERO })
    }

    /// Remembers what is shown now, with the indirect light scaled.
    pub(crate) fn watch(&mut self, display: &Display, indirect_scale: DVec3, iterations: usize) {
        let start = Instant::now();
        self.course.push((iterations, self.points.arriving(display, indirect_scale)));
        self.watched += start.elapsed();
    }

    /// Finds the light at the points along paths, and what the bake differs from it by, at the end and on the way there.
    ///
    /// `None` where no light is shown that anything could be relative to.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn verify(
        self,
        blockers: &Blockers,
        baked: &Baked,
        timeline: &mut [Iteration],
        monitor: &Monitor,
    ) -> Result<Option<Verification>, Error> {
        let start = Instant::now();
        let lights = Lights::new(self.world);
        let paths = Paths::new(self.world, blockers, &lights);
        let wanted = self.points.len();

        // As many paths as the bake was worth
        let share = |index: usize| baked.shown[self.points.material(index, self.world)];
        let budget = wanted as f64 / f64::from(POINTS) * (RAYS_PER_WORK * baked.work as f64).max(FEWEST_RAYS);
        let [points, count] = effort(budget, wanted, &self.pilot(&paths, share), baked.tolerance);
        let chosen: Vec<usize> = (0..points).map(|k| (2 * k + 1) * wanted / (2 * points)).collect();

        // Two estimates each
        let estimates = (chosen.par_iter().with_max_len(AT_A_TIME))
            .map(|&index| {
                monitor.check()?;
                let receiver = self.points.receiver(index);
                Ok([0, 1].map(|which| paths.irradiance(&receiver, 2 * index as u64 + which, count)))
            })
            .collect::<Result<Vec<[Traced; 2]>, Error>>()?;
        let rays: u64 = estimates.iter().flatten().map(|traced| traced.rays).sum();

        // What is shown, against them
        let light = self.points.shown(self.world, baked.meshes, baked.emission_is_shown);
        let observed = |values: &[DVec3], share: &dyn Fn(usize) -> DVec3| -> Vec<Observed> {
            (chosen.iter().zip(&estimates))
                .map(|(&index, [a, b])| {
                    let share = share(index);
                    Observed { shown: values[index], estimates: [share * a.irradiance, share * b.irradiance] }
                })
                .collect()
        };
        let Some(end) = Compared::new(&observed(&light, &share)) else { return Ok(None) };
        for (iterations, arriving) in &self.course {
            let sent: Vec<DVec3> = arriving.iter().enumerate().map(|(k, &light)| share(k) * light).collect();
            if let Some(then) = Compared::new(&observed(&sent, &share))
                && let Some(iteration) = timeline.get_mut(iterations - 1)
            {
                iteration.error = Some(then.error);
            }
        }
        let energy_defect = self.course.last().map(|(_, arriving)| {
            Compared::new(&observed(arriving, &|_| DVec3::ONE)).map_or(0.0, |power| power.bias[0])
        });
        let mean = end.mean;
        let places = (chosen.iter().zip(observed(&light, &share)))
            .map(|(&index, point)| {
                let at = self.points.receiver(index).position + self.world.origin;
                let error = (point.shown - point.truth()).element_sum() / 3.0 / mean;
                [at.x, at.y, at.z, error].map(|value| value as f32)
            })
            .collect();
        Ok(Some(Verification {
            points,
            paths: count,
            rays,
            time_s: (self.watched + start.elapsed()).as_secs_f64(),
            error: end.error,
            bias: end.bias,
            p99: end.p99,
            energy_defect: energy_defect.unwrap_or(0.0),
            noise: end.noise,
            places,
        }))
    }

    /// Looks along a few paths, to know what more will take and bring.
    fn pilot(&self, paths: &Paths, share: impl Fn(usize) -> DVec3) -> Pilot {
        let [points, count] = PILOT;
        let points = points.min(self.points.len());
        let (mut rays, mut squares, mut sum) = (0, 0.0, 0.0);
        for index in (0..points).map(|k| (2 * k + 1) * self.points.len() / (2 * points)) {
            let seed = u64::MAX - 2 * index as u64;
            let [a, b] =
                [seed, seed - 1].map(|seed| paths.irradiance(&self.points.receiver(index), seed, count));
            rays += a.rays + b.rays;
            squares += (share(index) * (a.irradiance - b.irradiance)).length_squared() / 6.0;
            sum += (share(index) * (a.irradiance + b.irradiance)).element_sum() / 6.0;
        }
        let mean = sum / points as f64;
        let variance = if mean > 0.0 { squares / points as f64 / (mean * mean) } else { 0.0 };
        let rays_per_path = (rays as f64 / (2 * points * count) as f64).max(1.0);
        Pilot { rays_per_path, variance_of_path: variance * count as f64 }
    }
}

/// What a path is like.
struct Pilot {
    /// Looks at lights included.
    rays_per_path: f64,
    /// Relative to the square of the mean light.
    variance_of_path: f64,
}

/// Points, and paths of each of their two estimates, for so many rays.
fn effort(rays: f64, wanted: usize, pilot: &Pilot, tolerance: f64) -> [usize; 2] {
    let pairs = 0.5 * rays / pilot.rays_per_path;
    let enough =
        (pilot.variance_of_path / (NOISE * tolerance).powi(2)).clamp(FEWEST_PATHS, MOST_PATHS as f64);
    let points = ((pairs / enough) as usize).clamp(FEWEST_POINTS.min(wanted), wanted);
    let paths = ((pairs / points as f64) as usize).clamp(1, MOST_PATHS);
    [points, paths]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_rays_are_spent_on_few_points_and_many_on_all() {
        // 10 rays a path, and noise of 0.02 with a hundred of them
        let pilot = Pilot { rays_per_path: 10.0, variance_of_path: 0.04 };
        let effort = |rays: f64, wanted: usize| effort(rays, wanted, &pilot, 0.01);
        assert_eq!(effort(1e2, 1_000), [250, 1]);
        assert_eq!(effort(1e6, 1_000), [500, 100]);
        assert_eq!(effort(6.4e6, 1_000), [1_000, 320]);
        assert_eq!(effort(1e12, 1_000), [1_000, MOST_PATHS]);
        assert_eq!(effort(1e6, 10), [10, MOST_PATHS]);
    }
}
