//! The driver: the only place that loops over stages.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::adapt::contact_lines::contacts;
use crate::adapt::line_choice::{Lines, WORTH_A_VERTEX};
use crate::adapt::line_search::LineSearch;
use crate::adapt::line_sources::{LineSource, mean_brought, secondary_sources};
use crate::adapt::refinement::{EVEN, Hidden, Refinement};
use crate::display::{Display, DisplayMesh, Light, baked_area};
use crate::error::Error;
use crate::index::FaceId;
use crate::lamps::Lamp;
use crate::mesh::coarse::{Sizes, cut_into_patches, subdivide_to};
use crate::mesh::{Cutting, Grading, Mesh, Quartering, tessellate};
use crate::monitor::{Monitor, Progress, Stage};
use crate::plan::Plan;
use crate::report::{
    Iteration, LineSummary, Memory, Report, ResultSummary, SceneSummary, Timings, TransportSummary,
    VisibilitySummary,
};
use crate::scene::SceneInput;
use crate::scene::world::World;
use crate::settings::{Method, Quantity, Settings, Transport};
use crate::shadow::silhouette::BlockerEdges;
use crate::transport::form_factors::FormFactors;
use crate::transport::gather::{Gather, Lit, Reflected};
use crate::transport::hierarchical::Hierarchical;
use crate::transport::looking::{Looking, patch_size, patches_that_look_around};
use crate::transport::mode::Solution;
use crate::transport::shooting::{PatchMesh, Shooting};
use crate::transport::sources::{Emitters, blockers};
use crate::verify::{Baked, Verifier};
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

/// The part of a bake that shooting is, for the progress bar: about a third of the time in closed rooms, which are the
/// ones that one waits for.
const SHOOTING: [f64; 2] = [0.1, 0.4];

/// Triangles up to which links carry the light unless something else is asked for: on the paper's scene, in the Cornell box
/// and in two rooms they err less than shooting and take 1.0, 0.6 and 0.7 times as long. Pairs that are told apart grow with
/// the square of the triangles, and an interior of ten thousand was not linked in two minutes; beyond, patches look around.
const MOST_LINKED: usize = 2_000;

/// Tolerance below which lines of a scene in which patches look around are not looked for: in an interior of 260,000
/// triangles it took 9 s of processor time at 5 % and 90 s at 1 %, a third of the bake.
const LINES_OF_CROWDS: f64 = 0.03;

/// Contacts shorter than this, in patches, do not divide patches: what leaks under such a thing is a sixteenth of a
/// patch's area.
const SMALL_CONTACT: f64 = 0.25;

/// The same where patches look around, in patches that are smaller: inside the parts of a sofa that are pushed into each other
/// it is dark.
const LEAST_CONTACT: f64 = 1.0 / 64.0;

/// Longest edge of what is shown before it is refined, in patches that look around: the light and the darkness that no
/// corner of a larger element knows of would be looked for in a few places only.
const LONGEST_OF_CROWDS: f64 = 8.0;

/// Work of which a bake that was cut short is verified with as much effort as one that was not: who wants it now waits a
/// second or two for that.
const MOST_WORK_VERIFIED_AT_ONCE: u64 = 4_000_000;

/// Edge to which triangles are graded where patches look around, in patches.
const GRADED_TO: f64 = 0.5;

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
    let form_factors = FormFactors::new(&blockers, plan.shortcuts());
    monitor.check()?;
    let mut solver = Solver {
        input,
        world: &world,
        settings,
        monitor,
        form_factors: &form_factors,
        emitters: &emitters,
        shown: shown(&world, settings.quantity),
        start,
        deadline: (settings.time_limit > 0.0).then(|| start + Duration::from_secs_f64(settings.time_limit)),
        triangle_limit: 0,
        out_of_budget: false,
        cutting: Cutting::default(),
        plan,
        transport_mode,
        transport: TransportSummary::default(),
        iterations: RefCell::default(),
        estimate: Cell::default(),
        mean_shown: Cell::default(),
        warnings: Vec::new(),
        verifier: RefCell::new(Verifier::new(&world, settings.verify_points)),
    };
    let (display, indirect_scale, unshot) = solver.solve()?;
    solver.tell_guesses(&display);

    monitor.report(Progress { stage: Stage::Welding, ..monitor.progress() });
    let errors = solver.relative_errors(&display);
    let meshes = weld(input, &world, &display, &solver.layers(&display, indirect_scale), &errors, settings);
    monitor.check()?;
    let mut iterations = solver.iterations.take();
    let verification = match solver.verifier.take() {
        Some(verifier) => {
            monitor.report(Progress { stage: Stage::Verifying, ..monitor.progress() });
            let work = form_factors.counts()[..3].iter().sum::<u64>() + solver.transport.links as u64;
            let baked = Baked {
                meshes: &meshes,
                shown: &solver.shown,
                emission_is_shown: settings.quantity == Quantity::Radiosity,
                tolerance: settings.tolerance,
                work: if solver.is_cut_short() { work.min(MOST_WORK_VERIFIED_AT_ONCE) } else { work },
            };
            verifier.verify(&blockers, &baked, &mut iterations, monitor)?
        }
        None => None,
    };
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
    let mut report = Report {
        scene: SceneSummary {
            objects: input.objects.len(),
            triangles: input.objects.iter().map(|object| object.triangles.len()).sum(),
            lights: emitters.lights,
        },
        timings: Timings { solve_s: start.elapsed().as_secs_f64() },
        memory: Memory::default(),
        timeline: iterations,
        result,
        warnings: world.warnings.iter().chain(&solver.warnings).cloned().collect(),
    };
    if solver.out_of_budget && settings.triangle_budget == 0 {
        report.warnings.push(format!(
            "the mesh was not refined beyond {} triangles: set triangle_budget for a finer one, or a larger tolerance",
            report.result.triangles
        ));
    }
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
    input: &'a SceneInput,
    world: &'a World,
    settings: &'a Settings,
    monitor: &'a Monitor,
    form_factors: &'a FormFactors<'a>,
    emitters: &'a Emitters,
    /// Per material: the share of arriving light that is shown, per channel.
    shown: Vec<DVec3>,
    start: Instant,
    /// When the user's time is up.
    deadline: Option<Instant>,
    /// Triangles that the display mesh may have.
    triangle_limit: usize,
    out_of_budget: bool,
    cutting: Cutting,
    plan: Plan,
    /// Never left to the solver.
    transport_mode: Transport,
    transport: TransportSummary,
    iterations: RefCell<Vec<Iteration>>,
    /// Per [`Light`]: the integral of the squared error that refinement estimates, W²/m².
    estimate: Cell<[Option<f64>; 2]>,
    /// What errors are relative to, as far as it is known, W/m².
    mean_shown: Cell<f64>,
    /// For the report.
    warnings: Vec<String>,
    /// Where it is wanted.
    verifier: RefCell<Option<Verifier<'a>>>,
}

impl<'a> Solver<'a> {
    /// Emitters shoot and the mesh follows their shadows; patches exchange the rest; the mesh follows that.
    ///
    /// Returns the display, what its indirect light must be scaled by, and the share of light never shot.
    fn solve(&mut self) -> Result<(Display<'a>, DVec3, f64), Error> {
        let (monitor, deadline) = (self.monitor, self.deadline);
        let ends = move || ends(monitor, deadline);

        // Emitters shoot
        let mut sizes = Sizes::new(self.world, self.settings);
        self.begin(Stage::Linking);
        let patches = self.patch_mesh(sizes, &ends);
        self.monitor.check()?;
        if self.transport_mode == Transport::Rays && self.settings.element_size == 0.0 {
            sizes.element = sizes.element.min(LONGEST_OF_CROWDS * patches.patch_size);
            sizes.grading = Some(Grading {
                longest: sizes.element,
                least_area: 0.5 * (GRADED_TO * patches.patch_size).powi(2),
            });
        }
        let coarse = self.starts_coarse().then(|| patches.mesh.clone());
        let mut exchange = self.exchange(patches, &ends)?;
        let wanted_error = exchange.wanted_error();
        self.begin(Stage::Lines);
        let mesh = self.display_mesh(coarse, sizes, &exchange, &ends)?;
        let gather = self.gather(Lit::Sources(&self.emitters.tree), wanted_error, &ends);
        let known = exchange.direct_at(shared_samples(&mesh));
        let mut display = Display::new(mesh, known, &gather, |place| exchange.about(Light::Direct, place))?;
        self.triangle_limit = self.settings.triangle_limit(display.triangle_count());
        self.record(&display, &exchange);

        // Refine the mesh for their light
        if self.settings.method != Method::Uniform {
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
                self.estimate.set([Some(error), None]);
                self.record(display, &exchange);
            })?;
            // What is kept for the patches' light is not out of budget.
            let out_of_budget = held_back && refinement.triangle_budget == self.triangle_limit;
            self.out_of_budget |= out_of_budget;
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
                self.record_at(&display, 0.0, 0);
            }
            Solution::Looking(looking) => {
                looking.solve(&display, &ends);
                self.record_at(&display, 0.0, 0);
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
        let gather = self.gather(reflected.lit(), wanted_error, &ends);
        let patches = exchange.patch_light();
        let mean_radiosity = wanted_error / self.settings.tolerance;
        let hidden =
            patches.as_ref().map_or(Hidden::Nowhere, |patches| Hidden::Crevices { mean_radiosity, patches });
        let known = exchange.indirect_at(shared_samples(&display.mesh));
        let about = |place: &Receiver| exchange.about(Light::Indirect, place);
        let else_at = exchange.knows_all().then_some(&about as &(dyn Fn(&Receiver) -> DVec3 + Sync));
        display.light_indirectly(known, &gather, EVEN * wanted_error / brightest, else_at)?;
        self.record(&display, &exchange);
        if self.settings.method != Method::Uniform && !self.out_of_budget {
            let refinement =
                self.refinement(gather, SHARE_OF_PATCHES * wanted_error, hidden, [SHOOTING[1], 0.99]);
            let held_back = display.refine(Light::Indirect, &refinement, |display, error| {
                self.estimate.set([self.estimate.get()[0], Some(error)]);
                self.record(display, &exchange);
            })?;
            self.out_of_budget |= held_back;
        }
        if let Solution::Hierarchical(hierarchical) = &mut exchange
            && !ends()
        {
            // The mesh now knows more of the light than the links that it came over
            hierarchical.correct(&display);
            let lit = hierarchical.lit();
            display.light_again(&self.gather(Lit::Sources(&lit), hierarchical.wanted_error(), &ends))?;
        }
        self.record(&display, &exchange);
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
        self.estimate.set([self.estimate.get()[0], Some(most * most * baked_area(self.world))]);
        self.record(display, exchange);
        true
    }

    /// Finds a first estimate of all light, in the way that is asked for or suits the scene.
    fn exchange(&self, patches: PatchMesh, ends: &(dyn Fn() -> bool + Sync)) -> Result<Solution<'a>, Error> {
        let Self { world, settings, monitor, form_factors, emitters, .. } = *self;
        Ok(match self.transport_mode {
            Transport::Shooting => {
                let shooting =
                    Shooting::new(world, settings, monitor, form_factors, emitters, patches, ends)?;
                Solution::Shooting(Box::new(shooting))
            }
            Transport::Hierarchical => {
                let hierarchical =
                    Hierarchical::new(world, settings, monitor, form_factors, emitters, &patches, ends)?;
                Solution::Hierarchical(Box::new(hierarchical))
            }
            Transport::Auto | Transport::Rays => {
                let looking = Looking::new(world, settings, monitor, form_factors, emitters, patches, ends)?;
                Solution::Looking(Box::new(looking))
            }
        })
    }

    /// Shoots until the light is distributed, the time is up or the caller wants no more.
    fn shoot(
        &mut self,
        shooting: &mut Shooting,
        display: &Display,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Error> {
        let mut unshot = shooting.remaining();
        self.record_at(display, unshot, shooting.shots);
        while !ends() {
            let Some(computed) = shooting.shoot()? else { break };
            // Shots from kept columns take microseconds; only what changes the picture is an iteration.
            if computed || shooting.remaining() < 0.5 * unshot {
                unshot = shooting.remaining();
                self.record_at(display, unshot, shooting.shots);
            }
        }
        Ok(())
    }

    /// Whether the mesh starts from the patches' elements; the discontinuity methods start from the faces.
    fn starts_coarse(&self) -> bool {
        matches!(self.settings.method, Method::Uniform | Method::As)
    }

    /// Cuts the scene's faces into patches. Where the method knows contacts, no patch reaches under what stands on it:
    /// its mean would carry light there.
    fn patch_mesh(&self, sizes: Sizes, ends: &(dyn Fn() -> bool + Sync)) -> PatchMesh {
        let (world, blockers) = (self.world, self.form_factors.blockers);
        let look_around = self.transport_mode == Transport::Rays;
        let shortest =
            if look_around { patch_size(world) * LEAST_CONTACT } else { sizes.patch * SMALL_CONTACT };
        let mut mesh = match self.settings.method {
            Method::Uniform | Method::As => Mesh::new(world),
            Method::Dm | Method::Adm => {
                let contacts = contacts(world, blockers, |_| true, shortest);
                Mesh::of_tiles(&tessellate(world, &contacts, |_| true, 0, None).0)
            }
        };
        if look_around {
            return patches_that_look_around(world, blockers, mesh, ends);
        }
        let elements = cut_into_patches(&mut mesh, sizes.patch);
        PatchMesh { mesh, elements, patch_size: sizes.patch }
    }

    /// The mesh that the method starts from: `coarse`, or where there is none the faces, cut along lines.
    fn display_mesh(
        &mut self,
        coarse: Option<Mesh>,
        sizes: Sizes,
        exchange: &Solution,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<DisplayMesh<'a>, Error> {
        let limit = u8::try_from(self.settings.max_level).unwrap_or(u8::MAX);
        let world = self.world;
        let Some(mut mesh) = coarse else {
            let lines = self.lines(exchange, ends)?;
            // Bisecting twice does what quartering does once.
            let deepest = limit.saturating_mul(2);
            // A vertex makes two triangles, and its count is a guess; about half of them are left to refinement.
            let lines = lines.worthwhile(self.settings.triangle_limit(world.faces.len()) / 5);
            let (mut mesh, cutting) =
                tessellate(world, &lines, |face| world.receives(face), deepest, sizes.grading);
            self.cutting = cutting;
            mesh.longest_edge = if self.settings.element_size > 0.0 { sizes.element } else { f64::INFINITY };
            mesh.bisect_to(sizes.element, self.settings.triangle_limit(mesh.live), ends);
            return Ok(DisplayMesh::Tessellated(mesh));
        };
        let shared_samples = mesh.samples.len();
        let levels = subdivide_to(&mut mesh, world, sizes.element);
        let deepest = levels.iter().map(|level| level.saturating_add(limit)).collect();
        Ok(DisplayMesh::Quartered(Quartering { world, mesh, deepest, shared_samples }))
    }

    /// Contacts, and the shadow boundaries of emitters and of what reflects their light.
    fn lines(&self, exchange: &Solution, ends: &(dyn Fn() -> bool + Sync)) -> Result<Lines, Error> {
        let (world, blockers) = (self.world, self.form_factors.blockers);
        let worth = (self.settings.method == Method::Adm).then_some(WORTH_A_VERTEX);
        let mut wanted_error = exchange.wanted_error();
        let tolerance = match self.transport_mode {
            Transport::Rays => self.settings.tolerance.max(LINES_OF_CROWDS),
            _ => self.settings.tolerance,
        };
        wanted_error *= tolerance / self.settings.tolerance;
        let edges = BlockerEdges::new(blockers.polygons());
        let search = |wanted_error: f64| {
            let allowed = wanted_error.powi(2) * baked_area(world);
            LineSearch {
                world,
                blockers,
                edges: &edges,
                monitor: self.monitor,
                ends,
                shown: &self.shown,
                allowed,
                max_blockers: self.settings.max_blockers as usize,
                price: worth.map(|worth| worth * allowed),
            }
        };

        // The light jumps by about its mean across a contact, and without the line would be wrong over about its length
        // in square.
        let primary = search(SHARE_OF_EMITTERS * wanted_error);
        let mean_radiosity = wanted_error / tolerance;
        let shortest = primary.price.map_or(0.0, |price| price.sqrt() / mean_radiosity);
        let receives = |face| world.receives(face);
        let mut lines = Lines::new(contacts(world, blockers, receives, shortest), worth);
        if !self.plan.looks_for_shadows() {
            return Ok(lines);
        }
        let panels = self.emitters.tree.lamps.iter().filter_map(Lamp::panel);
        let lit = self.emitters.polygons.iter().cloned().chain(panels);
        let emitters: Vec<LineSource> = lit.map(|lit| LineSource::emitter(&lit)).collect();
        lines.add(primary.find(&emitters)?);
        lines.add(primary.find_of_lamps(&self.emitters.tree.lamps, self.form_factors)?);

        // Where no emitter is seen, all the light there is comes from these.
        let brightest = self.shown.iter().copied().fold(DVec3::ZERO, DVec3::max);
        let faces = FaceId::range(0..world.faces.len()).filter(|&face| receives(face)).count();
        let reflecting = secondary_sources(&exchange.reflectors(), &edges, brightest, faces);
        let mean_radiosity = mean_radiosity.max(mean_brought(world, &self.shown, &reflecting));
        let secondary = search(SHARE_OF_PATCHES * tolerance * mean_radiosity);
        lines.add(secondary.find(&reflecting)?);
        Ok(lines)
    }

    fn gather<'g>(
        &self,
        sources: Lit<'g>,
        wanted_error: f64,
        ends: &'g (dyn Fn() -> bool + Sync),
    ) -> Gather<'g>
    where
        'a: 'g,
    {
        Gather { form_factors: self.form_factors, monitor: self.monitor, sources, wanted_error, ends }
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
            world: self.world,
            gather,
            shown: &self.shown,
            wanted_error,
            allowed: wanted_error * wanted_error * baked_area(self.world),
            triangle_budget: self.triangle_limit,
            hidden,
            progress,
        }
    }

    /// Whether it ended before it was done.
    fn is_cut_short(&self) -> bool {
        ends(self.monitor, self.deadline)
    }

    /// Why it ended.
    fn ended_by(&self) -> &'static str {
        if self.monitor.wants_end() {
            "stopped"
        } else if self.is_cut_short() {
            "time_limit"
        } else if self.out_of_budget && self.settings.triangle_budget == 0 {
            "refinement_limit"
        } else if self.out_of_budget {
            "triangle_budget"
        } else {
            "converged"
        }
    }

    /// Tells the user where light was not looked for.
    fn tell_guesses(&mut self, display: &Display) {
        let shown = if self.transport_mode == Transport::Rays {
            "they show what their patches get, without finer shadows"
        } else {
            "they show none of it"
        };
        for (light, name) in [(Light::Direct, "light of emitters"), (Light::Indirect, "indirect light")] {
            let share = display.guessed(light);
            if share > 0.0 {
                self.warnings.push(format!(
                    "it ended before the {name} was looked for at {:.0} % of the vertices: {shown}",
                    (100.0 * share).max(1.0)
                ));
            }
        }
    }

    /// Says what is being done from now on.
    fn begin(&self, stage: Stage) {
        self.monitor.report(Progress { stage, ..self.monitor.progress() });
    }

    /// Per kind of light what arrives. A solution errs by some billionths, in the dark also downwards: there only a negative
    /// lamp takes light away.
    fn layers(&self, display: &Display, indirect_scale: DVec3) -> [Vec<DVec3>; 2] {
        let mut layers = display.layers(indirect_scale);
        if !self.world.has_negative_light() {
            let lights = layers.iter_mut().flatten();
            lights.for_each(|light| *light = DVec3::select(light.cmplt(DVec3::ZERO), DVec3::ZERO, *light));
        }
        layers
    }

    /// Shows the mesh with the light found so far to a caller who asked for it.
    fn show(&self, display: &Display) {
        let layers = || self.layers(display, DVec3::ONE);
        let welded = || weld(self.input, self.world, display, &layers(), &[], self.settings);
        self.monitor.show(welded);
    }

    /// Records a stage, and keeps its mesh where it is to be verified.
    fn record(&self, display: &Display, exchange: &Solution) {
        self.mean_shown.set(exchange.wanted_error() / self.settings.tolerance);
        self.record_at(display, exchange.remaining(), exchange.shots());
        let mut iterations = self.iterations.borrow_mut();
        if let Some(last) = iterations.last_mut() {
            last.estimated = self.estimated();
        }
        if let Some(verifier) = &mut *self.verifier.borrow_mut() {
            verifier.watch(display, exchange.closing_factor(), iterations.len());
        }
    }

    /// The error by what refinement estimates of all light that is looked at, relative to the mean radiosity.
    fn estimated(&self) -> Option<f64> {
        let [direct, indirect] = self.estimate.get();
        let indirect = if self.plan.exchanges() { indirect } else { Some(0.0) };
        let error = ((direct? + indirect?) / baked_area(self.world)).sqrt() / self.mean_shown.get();
        error.is_finite().then_some(error)
    }

    /// The same per sample, of the elements around it.
    fn relative_errors(&self, display: &Display) -> Vec<f64> {
        let mut errors = display.errors(self.world, &self.shown);
        let scale = if self.mean_shown.get() > 0.0 { 1.0 / self.mean_shown.get() } else { 0.0 };
        for error in &mut errors {
            *error *= scale;
        }
        errors
    }

    fn record_at(&self, display: &Display, unshot: f64, shots: usize) {
        self.show(display);
        let [elements, vertices] = display.counts();
        let iteration = Iteration {
            time_s: self.start.elapsed().as_secs_f64(),
            shots: self.emitters.polygons.len() + shots,
            elements,
            vertices,
            unshot,
            error: None,
            estimated: None,
        };
        // Unshot light falls about exponentially, so its logarithm falls like the work that is left. The estimate of
        // what is still to come may rise; a progress bar must not fall.
        let fraction = unshot.max(f64::MIN_POSITIVE).ln() / (0.05 * self.settings.tolerance).ln();
        self.monitor.report(Progress {
            stage: Stage::Shooting,
            fraction: (SHOOTING[0] + (SHOOTING[1] - SHOOTING[0]) * fraction.clamp(0.0, 1.0))
                .max(self.monitor.progress().fraction),
            shots: iteration.shots,
            elements: iteration.elements,
            unshot,
        });
        self.iterations.borrow_mut().push(iteration);
    }
}

/// How surfaces exchange light in a scene, as asked for or as suits it.
fn transport_for(world: &World, settings: &Settings) -> Transport {
    match settings.transport {
        Transport::Auto if world.faces.len() <= MOST_LINKED => Transport::Hierarchical,
        Transport::Auto => Transport::Rays,
        asked_for => asked_for,
    }
}

/// Samples that the display mesh has in common with the patches.
fn shared_samples(mesh: &DisplayMesh) -> usize {
    match mesh {
        DisplayMesh::Quartered(mesh) => mesh.shared_samples,
        DisplayMesh::Tessellated(mesh) => mesh.shared_samples,
    }
}

/// Whether the caller wants no more, or the time is up.
fn ends(monitor: &Monitor, deadline: Option<Instant>) -> bool {
    monitor.wants_end() || deadline.is_some_and(|deadline| Instant::now() > deadline)
}
