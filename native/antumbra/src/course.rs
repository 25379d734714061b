//! The course of a bake: what is told of it while it runs, kept for the report, and compared with the truth at its end.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::display::{Display, baked_area};
use crate::error::Error;
use crate::monitor::{Monitor, Progress, Stage};
use crate::report::{Iteration, Verification};
use crate::scene::SceneInput;
use crate::scene::world::World;
use crate::settings::{Quantity, Settings};
use crate::transport::mode::Solution;
use crate::verify::{Baked, Verifier};
use crate::visibility::blockers::Blockers;
use crate::weld::{BakedMesh, weld};

/// The part of a bake that shooting is, for the progress bar: about a third of the time in closed rooms, which are the
/// ones that one waits for.
pub(crate) const SHOOTING: [f64; 2] = [0.1, 0.4];

/// Work of which a bake that was cut short is verified with as much effort as one that was not: who wants it now waits a
/// second or two for that.
const MOST_WORK_VERIFIED_AT_ONCE: u64 = 4_000_000;

/// A bake on its way.
pub(crate) struct Course<'a> {
    input: &'a SceneInput,
    world: &'a World,
    settings: &'a Settings,
    monitor: &'a Monitor,
    start: Instant,
    /// When the user's time is up.
    deadline: Option<Instant>,
    /// Shots of emitters.
    emitters: usize,
    /// Whether surfaces exchange light.
    exchanges: bool,
    iterations: RefCell<Vec<Iteration>>,
    /// Per [`Light`](crate::display::Light): the integral of the squared error that refinement estimates, W²/m².
    pub(crate) estimate: Cell<[Option<f64>; 2]>,
    /// What errors are relative to, as far as it is known, W/m².
    mean_shown: Cell<f64>,
    /// Where it is wanted.
    verifier: RefCell<Option<Verifier<'a>>>,
}

impl<'a> Course<'a> {
    /// `emitters`: their shots. `exchanges`: whether surfaces exchange light.
    pub(crate) fn new(
        input: &'a SceneInput,
        world: &'a World,
        settings: &'a Settings,
        monitor: &'a Monitor,
        start: Instant,
        emitters: usize,
        exchanges: bool,
    ) -> Self {
        Self {
            input,
            world,
            settings,
            monitor,
            start,
            deadline: (settings.time_limit > 0.0)
                .then(|| start + Duration::from_secs_f64(settings.time_limit)),
            emitters,
            exchanges,
            iterations: RefCell::default(),
            estimate: Cell::default(),
            mean_shown: Cell::default(),
            verifier: RefCell::new(Verifier::new(world, settings.verify_points)),
        }
    }

    /// Tells whether the caller wants no more, or the time is up.
    pub(crate) fn ends(&self) -> impl Fn() -> bool + Sync + Copy + use<'a> {
        let (monitor, deadline) = (self.monitor, self.deadline);
        move || monitor.wants_end() || deadline.is_some_and(|deadline| Instant::now() > deadline)
    }

    /// Compares the result, and what it was on the way, with light along random paths, where that is wanted. Returns all that
    /// was recorded, and what was found.
    ///
    /// `shown`: per material, the share of arriving light. `work`: that the bake took, in form factors.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn verify(
        &self,
        blockers: &Blockers,
        meshes: &[BakedMesh],
        shown: &[DVec3],
        work: u64,
    ) -> Result<(Vec<Iteration>, Option<Verification>), Error> {
        let mut iterations = self.iterations.take();
        let Some(verifier) = self.verifier.take() else { return Ok((iterations, None)) };
        self.begin(Stage::Verifying);
        let baked = Baked {
            meshes,
            shown,
            emission_is_shown: self.settings.quantity == Quantity::Radiosity,
            tolerance: self.settings.tolerance,
            work: if self.ends()() { work.min(MOST_WORK_VERIFIED_AT_ONCE) } else { work },
        };
        let verification = verifier.verify(blockers, &baked, &mut iterations, self.monitor)?;
        Ok((iterations, verification))
    }

    /// Says what is being done from now on.
    pub(crate) fn begin(&self, stage: Stage) {
        self.monitor.report(Progress { stage, ..self.monitor.progress() });
    }

    /// Per kind of light what arrives. A solution errs by some billionths, in the dark also downwards: there only a negative
    /// lamp takes light away.
    pub(crate) fn layers(&self, display: &Display, indirect_scale: DVec3) -> [Vec<DVec3>; 2] {
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
    pub(crate) fn record(&self, display: &Display, exchange: &Solution) {
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

    /// Records how far it has come.
    ///
    /// `unshot`: share of the light that has not arrived yet. `shots`: besides those of emitters.
    pub(crate) fn record_at(&self, display: &Display, unshot: f64, shots: usize) {
        self.show(display);
        let [elements, vertices] = display.counts();
        let iteration = Iteration {
            time_s: self.start.elapsed().as_secs_f64(),
            shots: self.emitters + shots,
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

    /// The error by what refinement estimates of all light that is looked at, relative to the mean radiosity.
    fn estimated(&self) -> Option<f64> {
        let [direct, indirect] = self.estimate.get();
        let indirect = if self.exchanges { indirect } else { Some(0.0) };
        let error = ((direct? + indirect?) / baked_area(self.world)).sqrt() / self.mean_shown.get();
        error.is_finite().then_some(error)
    }

    /// The same per sample, of the elements around it.
    pub(crate) fn relative_errors(&self, display: &Display, shown: &[DVec3]) -> Vec<f64> {
        let mut errors = display.errors(self.world, shown);
        let scale = if self.mean_shown.get() > 0.0 { 1.0 / self.mean_shown.get() } else { 0.0 };
        for error in &mut errors {
            *error *= scale;
        }
        errors
    }
}
