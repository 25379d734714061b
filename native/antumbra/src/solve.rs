//! The driver: the only place that loops over stages.

mod ending;
mod start;

use std::time::Instant;

use glam::DVec3;

use crate::adapt::refinement::{Hidden, Refinement};
use crate::adapt::suspects::EVEN;
use crate::course::{Course, SHOOTING};
use crate::display::{Display, DisplayMesh, Light, baked_area};
use crate::error::Error;
use crate::mesh::Cutting;
use crate::mesh::coarse::Sizes;
use crate::monitor::{Monitor, Progress, Stage};
use crate::plan::Plan;
use crate::report::{
    LineSummary, Memory, Report, ResultSummary, SceneSummary, Timings, TransportSummary, VisibilitySummary,
};
use crate::scene::SceneInput;
use crate::scene::world::World;
use crate::settings::{Method, Quantity, Settings, Transport};
use crate::solve::start::transport_for;
use crate::threads;
use crate::transport::form_factors::FormFactors;
use crate::transport::gather::{Gather, Lit, Reflected};
use crate::transport::mode::Solution;
use crate::transport::problem::Problem;
use crate::transport::shooting::Shooting;
use crate::transport::sources::{Emitters, blockers};
use crate::visibility::Receiver;
use crate::weld::{Bake, weld};

/// Share of the wanted error that refinement for the emitters may leave by its own estimate. Errors add up in quadrature,
/// and what the elements err by that carry the exchange is not estimated: in the Cornell box and in two rooms all of it
/// together is then what was wanted (0.75 and 0.5 left 1.2 and 1.5 times as much).
const SHARE_OF_EMITTERS: f64 = 0.4;

/// The same for refinement for what patches reflect.
const SHARE_OF_PATCHES: f64 = 0.4;

/// The same for the noise of rays.
const SHARE_OF_RAYS: f64 = 0.4;

/// What a ray or a link costs, in form factors: rays go through the tree four at a time, those that verify one by one. At 1
/// verification took 11 to 13 % of the bakes of an interior.
const OF_A_RAY: f64 = 0.6;

/// Bakes a scene. The result does not depend on the number of threads.
///
/// # Errors
/// [`Error`] names what is wrong with the scene or the settings; [`Error::Cancelled`] after [`Monitor::cancel`].
pub fn bake(input: &SceneInput, settings: &Settings, monitor: &Monitor) -> Result<Bake, Error> {
    settings.validate()?;
    threads::pool(settings.threads)?.install(|| bake_here(input, settings, monitor))
}

fn bake_here(input: &SceneInput, settings: &Settings, monitor: &Monitor) -> Result<Bake, Error> {
    let start = Instant::now();
    monitor.report(Progress { unshot: 1.0, ..Progress::default() });
    let world = World::new(input)?;
    if !world.objects.iter().any(|object| object.receives && !object.faces.is_empty()) {
        return Err(Error::NoReceiver);
    }
    let mut emitters = Emitters::new(&world);
    let transport_mode = transport_for(&world, settings);
    if transport_mode == Transport::Rays {
        emitters.look_around_for_the_sky();
    }
    if emitters.lights == 0 {
        return Err(Error::NoLight);
    }
    let mut blockers = blockers(&world);
    let plan = Plan::new(&world, &emitters, blockers.polygons(), settings.anyway);
    blockers.hide_nothing(plan.hide_nothing());
    if settings.anyway.open_visibility {
        blockers.take_everything();
    }
    if settings.anyway.screens {
        blockers.look_behind_screens();
    }
    let form_factors = FormFactors::new(&blockers, plan.shortcuts());
    monitor.check()?;
    let mut solver = Solver {
        problem: Problem {
            world: &world,
            settings,
            monitor,
            form_factors: &form_factors,
            emitters: &emitters,
        },
        shown: shown(&world, settings.quantity),
        course: Course::new(
            input,
            &world,
            settings,
            monitor,
            start,
            emitters.polygons.len(),
            plan.exchanges(),
        ),
        triangle_limit: 0,
        out_of_budget: false,
        cutting: Cutting::default(),
        plan,
        transport_mode,
        transport: TransportSummary::default(),
    };
    let (display, indirect_scale, unshot) = solver.solve()?;

    monitor.report(Progress { stage: Stage::Welding, ..monitor.progress() });
    let course = &solver.course;
    let errors = course.relative_errors(&display, &solver.shown);
    let meshes = weld(input, &world, &display, &course.layers(&display, indirect_scale), &errors, settings);
    monitor.check()?;
    let [exact, sampled, rays, _] = form_factors.counts();
    let work = exact + sampled + (OF_A_RAY * (rays + solver.transport.links as u64) as f64) as u64;
    let (iterations, verification) = course.verify(&blockers, &meshes, &solver.shown, work)?;
    let visibility = VisibilitySummary::from(form_factors.counts());
    let result = ResultSummary {
        triangles: meshes.iter().map(|mesh| mesh.triangles.len()).sum(),
        vertices: meshes.iter().map(|mesh| mesh.positions.len()).sum(),
        ended_by: solver.ended_by().to_owned(),
        unshot,
        lines: LineSummary { drawn: solver.cutting.lines, plain_faces: solver.cutting.plain_faces },
        transport: solver.transport.clone(),
        plan: solver.plan.left_out(&visibility, &form_factors),
        visibility,
        estimated_error: iterations.last().and_then(|last| last.estimated),
        verification,
    };
    let report = Report {
        scene: SceneSummary {
            objects: input.objects.len(),
            triangles: input.objects.iter().map(|object| object.triangles.len()).sum(),
            lights: emitters.lights,
        },
        timings: Timings { solve_s: start.elapsed().as_secs_f64() },
        memory: Memory::default(),
        timeline: iterations,
        warnings: world.warnings.iter().cloned().chain(solver.warnings(&display, &result)).collect(),
        result,
    };
    monitor.report(Progress { stage: Stage::Done, fraction: 1.0, ..monitor.progress() });
    Ok(Bake { meshes, report })
}

/// Per material: the share of arriving light that the user will see.
fn shown(world: &World, quantity: Quantity) -> Vec<DVec3> {
    let shown = |reflectance_rgb| match quantity {
        Quantity::Radiosity => DVec3::from_array(reflectance_rgb),
        Quantity::Irradiance => DVec3::ONE,
    };
    world.shown_materials.iter().map(|material| shown(material.reflectance_rgb)).collect()
}

/// One solution on its way.
struct Solver<'a> {
    problem: Problem<'a>,
    /// Per material: the share of arriving light that is shown, per channel.
    shown: Vec<DVec3>,
    course: Course<'a>,
    /// Triangles that the display mesh may have.
    triangle_limit: usize,
    out_of_budget: bool,
    cutting: Cutting,
    plan: Plan,
    /// Never left to the solver.
    transport_mode: Transport,
    transport: TransportSummary,
}

impl<'a> Solver<'a> {
    /// Emitters shoot and the mesh follows their shadows; patches exchange the rest; the mesh follows that.
    ///
    /// Returns the display, what its indirect light must be scaled by, and the share of light never shot.
    fn solve(&mut self) -> Result<(Display<'a>, DVec3, f64), Error> {
        let Problem { world, settings, .. } = self.problem;
        let ends = self.course.ends();

        // Emitters shoot
        let mut sizes = Sizes::new(world, settings);
        self.course.begin(Stage::Linking);
        let patches = self.patch_mesh(sizes, &ends);
        self.problem.monitor.check()?;
        sizes = self.sizes_beside(sizes, &patches);
        let coarse = self.starts_coarse().then(|| patches.mesh.clone());
        let mut exchange = self.exchange(patches, &ends)?;
        let wanted_error = exchange.wanted_error();
        self.course.begin(Stage::Lines);
        let mesh = self.display_mesh(coarse, sizes, &exchange, &ends)?;
        let gather = self.problem.gather_direct(wanted_error, &ends);
        let known = exchange.direct_at(shared_samples(&mesh));
        let mut display = Display::new(mesh, known, &gather, |place| exchange.about(Light::Direct, place))?;
        self.triangle_limit = settings.triangle_limit(display.triangle_count());
        self.course.record(&display, &exchange);

        // Refine the mesh for their light
        let mut full = false;
        if settings.method != Method::Uniform {
            let mut refinement = self.refinement(
                gather,
                SHARE_OF_EMITTERS * wanted_error,
                Hidden::Shadows,
                [0.0, SHOOTING[0]],
            );
            if self.transport_mode == Transport::Rays {
                // In so large a scene the shadows of the emitters alone could use up all triangles.
                refinement.triangle_budget -=
                    (self.triangle_limit - display.triangle_count().min(self.triangle_limit)) / 2;
            }
            let held_back = display.refine(Light::Direct, &refinement, |display, error| {
                self.course.estimate.set([Some(error), None]);
                self.course.record(display, &exchange);
            })?;
            // What is kept for the patches' light is theirs.
            full = held_back && refinement.triangle_budget == self.triangle_limit;
            self.out_of_budget = held_back;
        }

        if !self.plan.exchanges() || self.leaves_out_second_bounce(&display, &exchange) {
            let unshot = if self.plan.exchanges() { exchange.remaining() } else { 0.0 };
            self.transport = exchange.summary();
            return Ok((display, DVec3::ONE, unshot));
        }

        // Patches exchange what they reflect
        match &mut exchange {
            Solution::Hierarchical(hierarchical) => {
                hierarchical.solve(&display, &ends)?;
                self.course.record_at(&display, 0.0, 0);
            }
            Solution::Looking(looking) => {
                looking.solve(&display, &ends);
                self.course.record_at(&display, 0.0, 0);
            }
            Solution::Shooting(shooting) => {
                shooting.fit_to_direct_light(&display, &ends)?;
                self.shoot(shooting, &display, &ends)?;
                if shooting.fit_to_indirect_light(&display, &ends)? {
                    self.shoot(shooting, &display, &ends)?;
                }
            }
        }

        // Refine the mesh for their light
        let mut reflected = exchange.lit();
        let wanted_error = exchange.wanted_error();
        let brightest = self.shown.iter().map(|shown| shown.max_element()).fold(0.0, f64::max);
        if let Reflected::Around(surroundings) = &mut reflected {
            let wanted = SHARE_OF_RAYS * wanted_error / brightest;
            surroundings.aim_at(wanted, &display.receivers(), &display.sample_areas());
        }
        let gather = self.problem.gather(reflected.lit(), wanted_error, &ends);
        let patches = exchange.patch_light();
        let mean_radiosity = wanted_error / settings.tolerance;
        let hidden =
            patches.as_ref().map_or(Hidden::Nowhere, |patches| Hidden::Crevices { mean_radiosity, patches });
        let known = exchange.indirect_at(shared_samples(&display.mesh));
        let about = |place: &Receiver| exchange.about(Light::Indirect, place);
        let else_at = exchange.knows_all().then_some(&about as &(dyn Fn(&Receiver) -> DVec3 + Sync));
        display.light_indirectly(known, &gather, EVEN * wanted_error / brightest, else_at)?;
        self.course.record(&display, &exchange);
        if settings.method != Method::Uniform && !full {
            let refinement =
                self.refinement(gather, SHARE_OF_PATCHES * wanted_error, hidden, [SHOOTING[1], 0.99]);
            let held_back = display.refine(Light::Indirect, &refinement, |display, error| {
                self.course.estimate.set([self.course.estimate.get()[0], Some(error)]);
                self.course.record(display, &exchange);
            })?;
            self.out_of_budget |= held_back;
        }
        if let Solution::Hierarchical(hierarchical) = &mut exchange
            && !ends()
        {
            // The mesh now knows more of the light than the links that it came over
            hierarchical.correct(&display);
            let lit = hierarchical.lit();
            let gather = self.problem.gather(Lit::Sources(&lit), hierarchical.wanted_error(), &ends);
            display.light_again(&gather)?;
        }
        self.course.record(&display, &exchange);
        self.transport = exchange.summary();
        Ok((display, exchange.closing_factor(), exchange.remaining()))
    }

    /// Whether what surfaces reflect is too little to be exchanged. Its bound then counts as the error that is left.
    fn leaves_out_second_bounce(&mut self, display: &Display, exchange: &Solution) -> bool {
        let Solution::Hierarchical(hierarchical) = exchange else { return false };
        let most = hierarchical.most_reflected(display);
        if !self.plan.leaves_out_second_bounce(most / exchange.wanted_error()) {
            return false;
        }
        self.course
            .estimate
            .set([self.course.estimate.get()[0], Some(most * most * baked_area(self.problem.world))]);
        self.course.record(display, exchange);
        true
    }

    /// Shoots until the light is distributed, the time is up or the caller wants no more.
    fn shoot(
        &mut self,
        shooting: &mut Shooting,
        display: &Display,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Error> {
        let mut unshot = shooting.remaining();
        self.course.record_at(display, unshot, shooting.shots);
        while !ends() {
            let Some(computed) = shooting.shoot()? else { break };
            // Shots from kept columns take microseconds; only what changes the picture is an iteration.
            if computed || shooting.remaining() < 0.5 * unshot {
                unshot = shooting.remaining();
                self.course.record_at(display, unshot, shooting.shots);
            }
        }
        Ok(())
    }

    /// `wanted_error`: rms over everything that is baked, W/m².
    fn refinement<'g>(
        &'g self,
        gather: Gather<'g>,
        wanted_error: f64,
        hidden: Hidden<'g>,
        progress: [f64; 2],
    ) -> Refinement<'g> {
        Refinement {
            world: self.problem.world,
            gather,
            shown: &self.shown,
            wanted_error,
            allowed: wanted_error * wanted_error * baked_area(self.problem.world),
            triangle_budget: self.triangle_limit,
            hidden,
            progress,
        }
    }
}

/// Samples that the display mesh has in common with the patches.
fn shared_samples(mesh: &DisplayMesh) -> usize {
    match mesh {
        DisplayMesh::Quartered(mesh) => mesh.shared_samples,
        DisplayMesh::Tessellated(mesh) => mesh.shared_samples,
    }
}
