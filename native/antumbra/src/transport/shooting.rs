//! Progressive refinement: the patch with the most unshot light shoots it to all others, again and again (Cohen, Chen,
//! Wallace, Greenberg 1988; the paper, §1).
//!
//! Emitters have shot before, onto the display mesh, which follows their shadows. Here patches exchange what they
//! reflect: a coarse mesh of their own carries it (§2.1's patches; apart from the display mesh as in Lischinski,
//! Tampieri, Greenberg 1993). Light that is still unshot when shooting ends is spread in proportion to the indirect
//! light so far, so that what is dark stays dark (Cohen et al.'s ambient term lights closed boxes from outside).

mod fitting;

use glam::DVec3;
use rayon::prelude::*;

use crate::error::Error;
use crate::index::ElementId;
use crate::mesh::{Mesh, Side};
use crate::report::TransportSummary;
use crate::settings::Quantity;
use crate::transport::balance::Balance;
use crate::transport::columns::{Column, Receivers, both_sides};
use crate::transport::endless::Endless;
use crate::transport::gather::{Gather, rms};
use crate::transport::last_bounces::last_bounces;
use crate::transport::patches::direct_means;
use crate::transport::problem::Problem;
use crate::transport::secondary::{Reflector, reflectors_of_patches};
use crate::transport::source_tree::SourceTree;
use crate::transport::sources::{PatchId, SourceId, Sources};

/// Bytes of columns that are kept for shooting again.
const KEPT_BYTES: usize = 1 << 30;

/// Share of the tolerance below which light that is still to come is not worth another column.
const NEGLIGIBLE: f64 = 0.05;

/// In a scene of many samples, a source whose share of all light is below this times the tolerance is not worth a
/// column: such light is spread over thousands of small patches, and lands like the indirect light before it. In a
/// scene of few samples, whose columns cost nothing and whose patches are few, the threshold vanishes with the square
/// of the samples: a dim room behind a door gets all of its bounces.
const SMALLEST: f64 = 0.03;

/// What counts as many samples: a column of these costs about a tenth of a second.
const MANY_SAMPLES: f64 = 100_000.0;

/// Unshot share below which even kept columns are done: below what f32 colours can show.
const EXHAUSTED: f64 = 1e-9;

/// Sweeps, of as many shots as there are sources, that must lose something: light goes on by one reflection in each, at least,
/// and by so many it has come out of any white corridor that is worth a picture.
const LOSSLESS_SWEEPS: usize = 32;

/// How much more than at first may wait to be sent. What a source's patches receive sums to what it sent within some per cent,
/// in corners of coarse patches within half of it.
const MOST_GROWTH: f64 = 2.0;

/// What of its light counts as nothing: the rounding of form factors, which are f32.
const LOST_BY_ROUNDING: f64 = 1e-6;

/// The scene cut into patches, before any light.
pub(crate) struct PatchMesh {
    pub(crate) mesh: Mesh,
    /// Elements that send together, before they are paired.
    pub(crate) elements: Vec<ElementId>,
    /// Largest edge of a patch, metres.
    pub(crate) patch_size: f64,
}

/// The state of a solution by shooting.
pub(crate) struct Shooting<'a> {
    problem: Problem<'a>,
    mesh: Mesh,
    patch_elements: Vec<ElementId>,
    patch_size: f64,
    pub(crate) sources: Sources,
    receivers: Receivers,
    balance: Balance,
    /// Power that was unshot when the sweeps began that are under way, W, and the shots before.
    sweeps: (f64, usize),
    /// Power that was unshot at the start, W.
    first_unshot: f64,
    /// Shots from kept columns since one was computed.
    since_column: usize,
    /// Iterations in which kept columns sent all at once.
    settling: usize,
    /// Radiosity that each source has sent so far, W/m².
    sent: Vec<DVec3>,
    /// Per source that shot: its column, as far as memory allows.
    kept: Vec<Option<Column>>,
    kept_bytes: usize,
    /// What the emitters brought to each sample, front and back, W/m².
    direct: Vec<[DVec3; 2]>,
    /// What patches brought to the samples' fronts whose columns were not kept, W/m².
    indirect: Vec<DVec3>,
    pub(crate) shots: usize,
}

impl<'a> Shooting<'a> {
    /// Finds the emitters' light at the patches' corners.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn new(
        problem: Problem<'a>,
        patches: PatchMesh,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, Error> {
        let Problem { world, emitters, .. } = problem;
        let PatchMesh { mesh, elements, patch_size } = patches;
        let sources = Sources::new(world, &mesh, &elements);
        let mut shooting = Self {
            problem,
            patch_elements: elements,
            patch_size,
            receivers: Receivers::default(),
            balance: Balance::default(),
            sweeps: (f64::INFINITY, 0),
            first_unshot: 0.0,
            since_column: 0,
            settling: 0,
            sent: Vec::new(),
            kept: Vec::new(),
            kept_bytes: 0,
            direct: Vec::new(),
            indirect: Vec::new(),
            shots: 0,
            mesh,
            sources,
        };
        let gather = problem.gather_direct(0.0, ends);
        light(&gather, &shooting.mesh, &mut shooting.direct)?;
        let means = direct_means(&shooting.mesh, world, None, &shooting.direct, &shooting.patch_elements);
        shooting.start(means)?;
        if emitters.tree.sky.is_some() {
            // How exactly it must be looked at is known only after a first look
            shooting.direct.clear();
            let gather = problem.gather_direct(shooting.wanted_error(), ends);
            light(&gather, &shooting.mesh, &mut shooting.direct)?;
            let means = direct_means(&shooting.mesh, world, None, &shooting.direct, &shooting.patch_elements);
            shooting.start(means)?;
        }
        Ok(shooting)
    }

    /// Sets all state to what it is when the emitters have shot and nothing else has.
    ///
    /// `direct`: per patch element, front and back, W/m².
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::EndlessLight`] where light can neither leave nor be absorbed.
    fn start(&mut self, direct: Vec<[DVec3; 2]>) -> Result<(), Error> {
        let mut patch_of = vec![None; self.mesh.elements.len()];
        for (index, patch) in self.sources.patches.iter().enumerate() {
            patch.elements.iter().for_each(|e| patch_of[e.index()] = Some(PatchId::new(index)));
        }
        let mut means = vec![[DVec3::ZERO; 2]; self.sources.patches.len()];
        for (&element, direct) in self.patch_elements.iter().zip(direct) {
            let Some(patch) = patch_of[element.index()] else { continue };
            let share = self.mesh.element(element).area / self.sources.patches[patch.index()].polygon.area();
            for (mean, direct) in means[patch.index()].iter_mut().zip(direct) {
                *mean += share * direct;
            }
        }
        let Self { problem: Problem { world, .. }, mesh, sources, .. } = &*self;
        let endless = Endless::new(world, mesh, sources, self.problem.monitor)?;
        endless.refuse(world, mesh, sources, |side| means[side / 2][side % 2])?;
        self.receivers = Receivers::new(&self.mesh, patch_of);
        self.balance = Balance::new(&self.sources, self.problem.emitters.power, means, endless);
        self.sweeps = (f64::INFINITY, self.shots);
        self.first_unshot = self.balance.unshot_power(&self.sources);
        self.since_column = 0;
        self.sent = vec![DVec3::ZERO; self.sources.len()];
        self.kept = vec![None; self.sources.len()];
        self.indirect = vec![DVec3::ZERO; self.mesh.samples.len()];
        Ok(())
    }

    /// Lets the strongest source shoot, or all that have columns at once when nothing else is worth one. Returns whether form
    /// factors had to be computed, or `None` when nothing worth shooting is left.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn shoot(&mut self) -> Result<Option<bool>, Error> {
        let Some(source) = self.balance.strongest(&self.sources) else { return Ok(None) };
        let remaining = self.remaining();
        let known = self.kept[source.index()].is_some();
        let negligible = NEGLIGIBLE * self.problem.settings.tolerance;
        let share = self.balance.share(source, &self.sources);
        if remaining <= EXHAUSTED
            || self.loses_nothing()
            || (!known && (remaining <= negligible || share <= self.smallest_share()))
        {
            return Ok(None);
        }
        if known && self.since_column >= self.sources.len() && self.settle() {
            return Ok(Some(false));
        }
        let column = match self.kept[source.index()].take() {
            Some(column) => column,
            None => self.column(source)?,
        };
        let radiosity = self.balance.unshot[source.index()];
        self.balance.shoot(source, &self.sources, &column.patches);
        self.sent[source.index()] += radiosity;
        self.since_column = if known { self.since_column + 1 } else { 0 };
        let bytes = if known { 0 } else { column.bytes() };
        if self.kept_bytes + bytes <= KEPT_BYTES {
            self.kept_bytes += bytes;
            self.kept[source.index()] = Some(column);
        } else {
            for (light, values) in self.indirect.iter_mut().zip(&column.samples) {
                *light += f64::from(values[0]) * radiosity;
            }
        }
        self.shots += 1;
        Ok(Some(!known))
    }

    /// Sends all that sources with columns have to send, by all bounces; `false` where that cannot be known.
    fn settle(&mut self) -> bool {
        self.since_column = 0;
        if self.problem.world.has_negative_light() {
            return false;
        }
        let areas: Vec<f64> =
            SourceId::range(0..self.sources.len()).map(|source| self.sources.area(source)).collect();
        let reflectances = self.balance.reflectances(&self.sources);
        let Some(last) =
            last_bounces(&self.kept, &areas, &reflectances, &self.balance.unshot, self.problem.monitor)
        else {
            return false;
        };
        self.balance.settle(&last, &reflectances, |source| self.kept[source].is_some(), &self.sources);
        self.sent.iter_mut().zip(&last.radiosity).for_each(|(sent, radiosity)| *sent += *radiosity);
        self.settling += last.iterations;
        true
    }

    /// Whether shots have lost nothing for so long that more would neither: what is left lies between surfaces that absorb
    /// nothing, and leaves by less than form factors are known. Or whether there is more to send than there ever was: faces
    /// that lie in one place each reflect what they get, and among white ones light grows from shot to shot.
    fn loses_nothing(&mut self) -> bool {
        let unshot = self.balance.unshot_power(&self.sources);
        let (before, since) = self.sweeps;
        if unshot > MOST_GROWTH * self.first_unshot {
            return true;
        }
        if self.shots < since + LOSSLESS_SWEEPS * self.sources.len() {
            return false;
        }
        self.sweeps = (unshot, self.shots);
        unshot >= (1.0 - LOST_BY_ROUNDING) * before
    }

    /// The sides of patches that sent light, with all they sent.
    pub(crate) fn lit(&self) -> SourceTree {
        let mut radiosity = vec![None; self.mesh.elements.len()];
        for (index, patch) in self.sources.patches.iter().enumerate() {
            let sides =
                Side::BOTH.map(|side| self.sent[Sources::of_patch(PatchId::new(index), side).index()]);
            patch.elements.iter().for_each(|element| radiosity[element.index()] = Some(sides));
        }
        SourceTree::of_patches(&self.mesh, &radiosity)
    }

    /// For the report.
    pub(crate) fn summary(&self) -> TransportSummary {
        TransportSummary {
            mode: "SHOOTING".to_owned(),
            elements: self.sources.len(),
            links: self.shots * self.sources.len(),
            iterations: self.shots + self.settling,
            imbalance: None,
        }
    }

    /// Share of all light that has not arrived yet.
    pub(crate) fn remaining(&self) -> f64 {
        self.balance.remaining(&self.sources)
    }

    /// What the indirect light must be scaled by to hold the light that was never shot.
    pub(crate) fn closing_factor(&self) -> DVec3 {
        self.balance.closing_factor(&self.sources)
    }

    /// The error that the user wants, W/m².
    pub(crate) fn wanted_error(&self) -> f64 {
        let white = self.problem.settings.quantity == Quantity::Irradiance;
        self.problem.settings.tolerance * self.balance.mean_baked(&self.sources, white)
    }

    /// Whether nothing is known of light on what is baked.
    pub(crate) fn is_dark(&self) -> bool {
        self.wanted_error() == 0.0
    }

    /// What whole faces reflect of the emitters' light, as the patches' corners know it.
    pub(crate) fn reflectors(&self) -> Vec<Reflector> {
        let direct = direct_means(&self.mesh, self.problem.world, None, &self.direct, &self.patch_elements);
        reflectors_of_patches(self.problem.world, &self.mesh, &self.patch_elements, &direct)
    }

    /// Direct light at the first samples, front, W/m².
    pub(crate) fn direct_at(&self, samples: usize) -> Vec<DVec3> {
        self.direct[..samples].iter().map(|sides| sides[0]).collect()
    }

    /// Indirect light at the first samples, front, W/m².
    pub(crate) fn indirect_at(&self, samples: usize) -> Vec<DVec3> {
        let mut irradiance = self.indirect[..samples].to_vec();
        irradiance.par_iter_mut().enumerate().with_min_len(1024).for_each(|(sample, irradiance)| {
            for (column, &radiosity) in self.kept.iter().zip(&self.sent) {
                if let Some(column) = column {
                    *irradiance += f64::from(column.samples[sample][0]) * radiosity;
                }
            }
        });
        irradiance
    }

    /// The share of all light that a source must have to be worth a column.
    fn smallest_share(&self) -> f64 {
        SMALLEST
            * self.problem.settings.tolerance
            * (self.mesh.samples.len() as f64 / MANY_SAMPLES).min(1.0).powi(2)
    }

    /// Computes a source's form factors.
    fn column(&self, source: SourceId) -> Result<Column, Error> {
        let wanted = self.wanted_error();
        let radiosity = self.balance.unshot[source.index()];
        let weight = if wanted > 0.0 { rms(radiosity) / wanted } else { 0.0 };
        let Self { problem: Problem { form_factors, monitor, .. }, mesh, sources, receivers, .. } = self;
        receivers.column(form_factors, monitor, mesh, sources, source, weight)
    }
}

/// Finds the gathered light on both sides of all samples from the `light.len()`th on.
fn light(gather: &Gather, mesh: &Mesh, light: &mut Vec<[DVec3; 2]>) -> Result<(), Error> {
    let first = light.len();
    let receivers = both_sides(&mesh.samples[first..]);
    let seeds: Vec<u64> = (2 * first..2 * mesh.samples.len()).map(|seed| seed as u64).collect();
    let arrived = gather.at(&receivers, &seeds, &[])?;
    light.extend(arrived.chunks_exact(2).map(|sides| [sides[0].irradiance, sides[1].irradiance]));
    Ok(())
}
