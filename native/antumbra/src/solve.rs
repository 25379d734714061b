//! The driver: the only place that loops over stages.

use std::time::Instant;

use crate::error::Error;
use crate::mesh::Mesh;
use crate::mesh::coarse::{Sizes, subdivide_coarsely};
use crate::monitor::{Monitor, Progress, Stage};
use crate::report::{Iteration, Report, ResultSummary, SceneSummary, Timings, VisibilitySummary};
use crate::scene::SceneInput;
use crate::scene::world::World;
use crate::settings::Settings;
use crate::transport::form_factors::FormFactors;
use crate::transport::shooting::{CoarseMesh, Shooting, Which};
use crate::transport::sources::blocking_polygons;
use crate::visibility::blockers::Blockers;
use crate::weld::{Bake, weld};

/// Bakes a scene. The result does not depend on the number of threads.
///
/// # Errors
/// [`Error`] names what is wrong with the scene or the settings; [`Error::Cancelled`] after [`Monitor::cancel`].
pub fn bake(input: &SceneInput, settings: &Settings, monitor: &Monitor) -> Result<Bake, Error> {
    settings.validate()?;
    let threads = rayon::ThreadPoolBuilder::new().num_threads(settings.threads);
    let pool = threads.build().map_err(|error| Error::Threads { reason: error.to_string() })?;
    pool.install(|| bake_here(input, settings, monitor))
}

fn bake_here(input: &SceneInput, settings: &Settings, monitor: &Monitor) -> Result<Bake, Error> {
    let start = Instant::now();
    monitor.report(Progress { unshot: 1.0, ..Progress::default() });
    let world = World::new(input)?;
    if !world.objects.iter().any(|object| object.receives && !object.faces.is_empty()) {
        return Err(Error::NoReceiver);
    }
    let blockers = Blockers::new(blocking_polygons(&world), world.diagonal);
    monitor.check()?;
    let coarse = coarse_mesh(&world, settings);
    monitor.check()?;
    let mut shooting = Shooting::new(&world, settings, monitor, FormFactors::new(&blockers), coarse);
    if shooting.sources.lights == 0 {
        return Err(Error::NoLight);
    }
    let mut timeline = Timeline { start, settings, monitor, iterations: Vec::new() };
    let ended_by = timeline.solve(&mut shooting)?;

    let (lights, out_of_budget, visibility) =
        (shooting.sources.lights, shooting.out_of_budget, shooting.counts());
    monitor.report(Progress { stage: Stage::Welding, ..monitor.progress() });
    let unshot = shooting.remaining();
    let (mesh, irradiance) = shooting.finish();
    let meshes = weld(input, &world, &mesh, &irradiance, settings.quantity);
    monitor.check()?;
    let ended_by = match ended_by {
        "converged" if out_of_budget && settings.triangle_budget == 0 => "refinement_limit",
        "converged" if out_of_budget => "triangle_budget",
        ended => ended,
    };
    let mut report = Report {
        scene: SceneSummary {
            objects: input.objects.len(),
            triangles: input.objects.iter().map(|object| object.triangles.len()).sum(),
            lights,
        },
        timings: Timings { solve_s: start.elapsed().as_secs_f64() },
        timeline: timeline.iterations,
        result: ResultSummary {
            triangles: meshes.iter().map(|mesh| mesh.triangles.len()).sum(),
            vertices: meshes.iter().map(|mesh| mesh.positions.len()).sum(),
            ended_by: ended_by.to_owned(),
            unshot,
            visibility: VisibilitySummary::from(visibility),
        },
        warnings: world.warnings.clone(),
    };
    if out_of_budget && settings.triangle_budget == 0 {
        report.warnings.push(format!(
            "the mesh was not refined beyond {} triangles: set triangle_budget for a finer one, or a larger tolerance",
            report.result.triangles
        ));
    }
    monitor.report(Progress { stage: Stage::Done, fraction: 1.0, ..monitor.progress() });
    Ok(Bake { meshes, report })
}

/// Cuts the scene's faces into patches and elements.
fn coarse_mesh(world: &World, settings: &Settings) -> CoarseMesh {
    let mut mesh = Mesh::new(world);
    let sizes = Sizes::new(world, settings);
    let coarse = subdivide_coarsely(&mut mesh, world, sizes);
    let limit = u8::try_from(settings.max_level).unwrap_or(u8::MAX);
    CoarseMesh {
        mesh,
        patch_elements: coarse.patches,
        patch_size: sizes.patch,
        coarse_elements: coarse.receiving,
        deepest: coarse.levels.iter().map(|level| level.saturating_add(limit)).collect(),
    }
}

/// Runs the shots and keeps the report's timeline.
struct Timeline<'a> {
    start: Instant,
    settings: &'a Settings,
    monitor: &'a Monitor,
    iterations: Vec<Iteration>,
}

impl Timeline<'_> {
    /// Shoots until the light is distributed, the time is up or the caller wants no more, and refines the mesh for
    /// the light. Returns why it ended.
    fn solve(&mut self, shooting: &mut Shooting) -> Result<&'static str, Error> {
        for which in [Which::Emitters, Which::Patches] {
            let ended = self.shoot(shooting, which)?;
            shooting.refine(which)?;
            self.record(shooting, shooting.remaining());
            // The time may have run out while the mesh was refined.
            if let Some(reason) = ended.or(self.wants_end()?) {
                return Ok(reason);
            }
            if which == Which::Emitters {
                shooting.fit_patches();
            }
        }
        shooting.shoot_again();
        Ok("converged")
    }

    fn shoot(&mut self, shooting: &mut Shooting, which: Which) -> Result<Option<&'static str>, Error> {
        let mut unshot = 1.0;
        loop {
            if let Some(reason) = self.wants_end()? {
                return Ok(Some(reason));
            }
            let Some(computed) = shooting.shoot(which)? else { return Ok(None) };
            // Shots from kept columns take microseconds; only what changes the picture is an iteration.
            if computed || shooting.remaining() < 0.5 * unshot {
                unshot = shooting.remaining();
                self.record(shooting, unshot);
            }
        }
    }

    /// Why the user wants it to end now, if so.
    fn wants_end(&self) -> Result<Option<&'static str>, Error> {
        self.monitor.check()?;
        if self.monitor.wants_end() {
            return Ok(Some("stopped"));
        }
        let limit = self.settings.time_limit;
        Ok((limit > 0.0 && self.start.elapsed().as_secs_f64() > limit).then_some("time_limit"))
    }

    fn record(&mut self, shooting: &Shooting, unshot: f64) {
        let iteration = Iteration {
            time_s: self.start.elapsed().as_secs_f64(),
            shots: shooting.shots,
            elements: shooting.mesh.leaves,
            vertices: shooting.mesh.vertices.len(),
            unshot,
        };
        // Unshot light falls about exponentially, so its logarithm falls like the work that is left. The estimate of
        // what is still to come may rise; a progress bar must not fall.
        let fraction = unshot.max(f64::MIN_POSITIVE).ln() / (0.05 * self.settings.tolerance).ln();
        self.monitor.report(Progress {
            stage: Stage::Shooting,
            fraction: fraction.clamp(0.0, 0.99).max(self.monitor.progress().fraction),
            shots: iteration.shots,
            elements: iteration.elements,
            unshot,
        });
        self.iterations.push(iteration);
    }
}
