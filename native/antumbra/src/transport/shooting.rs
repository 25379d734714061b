//! Progressive refinement: the source with the most unshot light shoots it to everything, again and again (Cohen,
//! Chen, Wallace, Greenberg 1988; the paper, §1).
//!
//! The first shot of a source computes its column, the visible form factors of all samples. Columns are kept while
//! memory allows; a kept column's source shoots again at the price of a sum over patches. Emitters shoot first, and
//! the mesh is refined for their light; then patches, and it is refined for what they reflect.
//! Light that is still unshot when shooting ends is spread in proportion to the indirect light so far, so that what
//! is dark stays dark (Cohen et al.'s ambient term lights closed boxes from outside).

use std::time::{Duration, Instant};

use glam::DVec3;
use rayon::prelude::*;

use crate::adapt::adaptive_subdivision::{GroupSource, Refinement};
use crate::error::Error;
use crate::index::{ElementId, FaceId};
use crate::mesh::{Mesh, area};
use crate::monitor::Monitor;
use crate::scene::world::World;
use crate::settings::{Method, Quantity, Settings};
use crate::transport::balance::Balance;
use crate::transport::column::Column;
use crate::transport::form_factors::{Cluster, FormFactorPair, FormFactors, Workspace, clusters};
use crate::transport::patches::fit_to_light;
use crate::transport::sample_light::SampleLight;
use crate::transport::sources::{PatchId, SourceId, Sources};
use crate::visibility::ConvexPolygon;

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

/// A source's form factors, kept for its next shot.
struct KeptColumn {
    samples: Column,
    patches: Vec<FormFactorPair>,
}

impl KeptColumn {
    fn bytes(&self) -> usize {
        self.samples.bytes() + size_of::<FormFactorPair>() * self.patches.len()
    }
}

/// What a source has sent so far, W/m².
#[derive(Debug, Clone, Copy, Default)]
struct Sent {
    total: DVec3,
    /// Of the total: what has not been added to the samples yet.
    pending: DVec3,
}

/// Which sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Which {
    Emitters,
    Patches,
}

impl Which {
    /// The share of the wanted error that refinement for these sources may leave; errors add up in quadrature, and
    /// the patches' own, that they send a mean, is not estimated.
    fn share(self) -> f64 {
        match self {
            Self::Emitters => 0.75,
            Self::Patches => 0.5,
        }
    }
}

/// What shooting starts from.
pub(crate) struct CoarseMesh {
    pub(crate) mesh: Mesh,
    /// Elements that send together, before they are paired.
    pub(crate) patch_elements: Vec<ElementId>,
    /// Largest edge of a patch, metres.
    pub(crate) patch_size: f64,
    /// The leaves of baked objects: every shot looks at them, and may refine below them.
    pub(crate) coarse_elements: Vec<ElementId>,
    /// Per face: the deepest level that light may refine to.
    pub(crate) deepest: Vec<u8>,
}

/// The state of a solution by shooting.
pub(crate) struct Shooting<'a> {
    world: &'a World,
    settings: &'a Settings,
    monitor: &'a Monitor,
    form_factors: FormFactors<'a>,
    pub(crate) mesh: Mesh,
    pub(crate) sources: Sources,
    coarse_elements: Vec<ElementId>,
    deepest: Vec<u8>,
    clusters: Vec<Cluster>,
    coarse_samples: usize,
    /// Elements that send together, before they are paired.
    patch_elements: Vec<ElementId>,
    /// Metres.
    patch_size: f64,
    /// Per element: the patch that it belongs to.
    patch_of: Vec<Option<PatchId>>,
    balance: Balance,
    sent: Vec<Sent>,
    columns: Vec<Option<KeptColumn>>,
    kept_bytes: usize,
    /// Per sample and side: what columns that were not kept have brought.
    light: SampleLight,
    /// Triangles that the whole mesh may have after refinement.
    triangle_limit: usize,
    /// When the user's time is up.
    deadline: Option<Instant>,
    pub(crate) shots: usize,
    pub(crate) out_of_budget: bool,
}

/// Whether the caller wants no more, or the time is up.
fn ends(monitor: &Monitor, deadline: Option<Instant>) -> bool {
    monitor.wants_end() || deadline.is_some_and(|deadline| Instant::now() > deadline)
}

impl<'a> Shooting<'a> {
    pub(crate) fn new(
        world: &'a World,
        settings: &'a Settings,
        monitor: &'a Monitor,
        form_factors: FormFactors<'a>,
        coarse: CoarseMesh,
    ) -> Self {
        let CoarseMesh { mesh, patch_elements, patch_size, coarse_elements, deepest } = coarse;
        let sources = Sources::new(world, &mesh, &patch_elements);
        let coarse_samples = mesh.samples.len();
        // The budget is for what is baked; objects that are not stay as coarse as they are.
        let receives = |face: FaceId| world.receives(face);
        let others = mesh.elements.iter().filter(|e| e.is_leaf() && !receives(e.face)).count();
        let limit = settings.triangle_limit(mesh.triangles - others);
        let triangle_limit = limit.saturating_add(others);
        let mut shooting = Self {
            world,
            settings,
            monitor,
            form_factors,
            clusters: clusters(&mesh, coarse_samples),
            balance: Balance::new(&sources),
            sent: vec![Sent::default(); sources.len()],
            columns: (0..sources.len()).map(|_| None).collect(),
            mesh,
            sources,
            coarse_elements,
            deepest,
            coarse_samples,
            patch_elements,
            patch_size,
            patch_of: Vec::new(),
            kept_bytes: 0,
            light: SampleLight::new(coarse_samples),
            triangle_limit,
            deadline: (settings.time_limit > 0.0)
                .then(|| Instant::now() + Duration::from_secs_f64(settings.time_limit)),
            shots: 0,
            out_of_budget: false,
        };
        shooting.find_patches();
        shooting
    }

    /// Once the emitters have shot: cuts patches that are lit too unevenly to send their mean.
    pub(crate) fn fit_patches(&mut self) {
        if self.settings.method == Method::Uniform {
            return;
        }
        let emitters = self.sources.emitters.len();
        // The light that every patch has received must be known anew.
        if SourceId::range(0..emitters)
            .any(|id| self.sent[id.index()].total != DVec3::ZERO && self.columns[id.index()].is_none())
        {
            return;
        }
        let mut irradiance = vec![[DVec3::ZERO; 2]; self.mesh.samples.len()];
        for id in SourceId::range(0..emitters) {
            let Some(column) = &mut self.columns[id.index()] else { continue };
            column.samples.interpolate_new(&self.mesh);
            for (light, values) in irradiance.iter_mut().zip(&column.samples.values) {
                for (light, &value) in light.iter_mut().zip(values) {
                    *light += f64::from(value) * self.sent[id.index()].total;
                }
            }
        }
        // Where the baked surfaces are dark, the light is elsewhere, and patches there need not be finer for it.
        let mean =
            self.balance.mean_baked(&self.sources, false).max(self.balance.mean_reflected(&self.sources));
        self.patch_elements = fit_to_light(
            &mut self.mesh,
            self.world,
            &self.patch_elements,
            &irradiance,
            mean,
            // A column of many samples costs more, so patches may be larger.
            self.patch_size * (self.coarse_samples as f64 / MANY_SAMPLES).max(1.0).sqrt(),
            self.triangle_limit,
        );
        self.sources = Sources::new(self.world, &self.mesh, &self.patch_elements);
        self.find_patches();
        self.balance = Balance::new(&self.sources);
        self.sent.resize(self.sources.len(), Sent::default());
        self.columns.resize_with(self.sources.len(), || None);
        for id in SourceId::range(0..emitters) {
            let Some(mut column) = self.columns[id.index()].take() else { continue };
            self.kept_bytes -= column.bytes();
            column.samples.interpolate_new(&self.mesh);
            column.patches = self.patch_means(&column.samples);
            self.kept_bytes += column.bytes();
            self.balance.shoot(id, &self.sources, &column.patches);
            self.columns[id.index()] = Some(column);
        }
    }

    /// Lets the strongest source shoot. Returns whether its column had to be computed, or `None` when nothing worth
    /// shooting is left among `which`.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn shoot(&mut self, which: Which) -> Result<Option<bool>, Error> {
        let emitters = SourceId::range(0..self.sources.emitters.len());
        let all = SourceId::range(0..self.sources.len());
        let range = if which == Which::Emitters { emitters } else { all };
        let Some(source) = self.balance.strongest(&self.sources, range) else { return Ok(None) };
        let remaining = self.remaining();
        let kept = self.columns[source.index()].is_some();
        let negligible = NEGLIGIBLE * self.settings.tolerance;
        let share = self.balance.share(source, &self.sources);
        // A lamp that is nothing beside the others may be all the light there is in its own room.
        let owed = self.sources.is_emitter(source) && !kept;
        let finished =
            remaining <= EXHAUSTED || (!kept && (remaining <= negligible || share <= self.smallest_share()));
        if finished && !owed {
            return Ok(None);
        }
        let radiosity = self.balance.unshot[source.index()];
        let column = match self.columns[source.index()].take() {
            Some(column) => column,
            None => self.compute_column(source, radiosity)?,
        };
        self.balance.shoot(source, &self.sources, &column.patches);
        let sent = &mut self.sent[source.index()];
        sent.total += radiosity;
        sent.pending += radiosity;
        self.keep_or_add(source, column, !kept);
        self.shots += 1;
        Ok(Some(!kept))
    }

    /// Refines the mesh for the light that the emitters, or the patches, have sent so far.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn refine(&mut self, which: Which) -> Result<(), Error> {
        let range = match which {
            Which::Emitters => 0..self.sources.emitters.len(),
            Which::Patches => self.sources.emitters.len()..self.sources.len(),
        };
        if self.settings.method != Method::As || self.out_of_budget {
            return Ok(());
        }
        // Refine for what is kept; a column that memory had no room for stays coarse.
        let (ids, mut group): (Vec<_>, Vec<_>) = SourceId::range(range)
            .filter_map(|id| {
                let kept = self.columns[id.index()].take()?;
                self.kept_bytes -= kept.bytes();
                let (polygon, radiosity) = (self.sources.polygon(id), self.sent[id.index()].total);
                let mut column = kept.samples;
                column.interpolate_new(&self.mesh);
                Some((id, GroupSource { polygon, radiosity, column }))
            })
            .unzip();
        let shown: Vec<DVec3> =
            self.world.materials.iter().map(|material| self.shown(material.reflectance_rgb)).collect();
        let wanted_error = which.share() * self.wanted_error();
        let baked_area: f64 =
            (self.coarse_elements.iter()).map(|&element| area(self.mesh.element(element), self.world)).sum();
        let deadline = self.deadline;
        let monitor = self.monitor;
        let refinement = Refinement {
            world: self.world,
            form_factors: &self.form_factors,
            monitor: self.monitor,
            shown: &shown,
            wanted_error,
            allowed: wanted_error * wanted_error * baked_area,
            ends: &|| ends(monitor, deadline),
            deepest: &self.deepest,
            triangle_budget: self.triangle_limit,
            hidden_shadows: which == Which::Emitters,
        };
        self.out_of_budget |= refinement.refine(&mut self.mesh, &mut group, &self.coarse_elements)?;
        self.inherit_patches();
        for (id, source) in ids.into_iter().zip(group) {
            let patches = self.patch_means(&source.column);
            let column = KeptColumn { samples: source.column, patches };
            self.kept_bytes += column.bytes();
            self.columns[id.index()] = Some(column);
        }
        Ok(())
    }

    /// Shoots everything again with the means of the refined mesh, if every source that shot can: patches know their
    /// light better now.
    pub(crate) fn shoot_again(&mut self) {
        let shot = |id: &SourceId| self.sent[id.index()].total != DVec3::ZERO;
        if SourceId::range(0..self.sources.len()).filter(shot).any(|id| self.columns[id.index()].is_none()) {
            return;
        }
        self.balance = Balance::new(&self.sources);
        self.sent.fill(Sent::default());
        let all = || SourceId::range(0..self.sources.len());
        while let Some(source) = self.balance.strongest(&self.sources, all()) {
            let Some(column) = &self.columns[source.index()] else { break };
            if self.remaining() <= EXHAUSTED && !self.sources.is_emitter(source) {
                break;
            }
            let radiosity = self.balance.unshot[source.index()];
            self.balance.shoot(source, &self.sources, &column.patches);
            let sent = &mut self.sent[source.index()];
            sent.total += radiosity;
            sent.pending += radiosity;
        }
    }

    /// The share of all light that a source must have to be worth a column.
    fn smallest_share(&self) -> f64 {
        SMALLEST * self.settings.tolerance * (self.coarse_samples as f64 / MANY_SAMPLES).min(1.0).powi(2)
    }

    /// Share of all light that has not arrived yet.
    pub(crate) fn remaining(&self) -> f64 {
        self.balance.remaining(&self.sources)
    }

    /// How many form factors were computed exactly, how many were sampled, and with how many rays.
    pub(crate) fn counts(&self) -> [u64; 3] {
        self.form_factors.counts()
    }

    /// The refined mesh, with irradiance per sample and side in W/m².
    pub(crate) fn finish(mut self) -> (Mesh, Vec<[DVec3; 2]>) {
        let closing = self.balance.closing_factor(&self.sources);
        for (index, column) in std::mem::take(&mut self.columns).into_iter().enumerate() {
            if let Some(column) = column {
                self.add(SourceId::new(index), column.samples);
            }
        }
        let irradiance = self.light.total(&self.mesh, closing);
        (self.mesh, irradiance)
    }

    /// Computes a source's form factors on the coarse mesh.
    fn compute_column(&self, source: SourceId, radiosity: DVec3) -> Result<KeptColumn, Error> {
        let polygon = self.sources.polygon(source);
        let samples = Column::new(self.coarse_column(&polygon, radiosity)?, &self.mesh);
        let patches = self.patch_means(&samples);
        Ok(KeptColumn { samples, patches })
    }

    /// The error that the user wants, W/m².
    fn wanted_error(&self) -> f64 {
        let white = self.settings.quantity == Quantity::Irradiance;
        self.settings.tolerance * self.balance.mean_baked(&self.sources, white)
    }

    /// The share of arriving light that the user will see.
    fn shown(&self, reflectance_rgb: [f64; 3]) -> DVec3 {
        match self.settings.quantity {
            Quantity::Radiosity => DVec3::from_array(reflectance_rgb),
            Quantity::Irradiance => DVec3::ONE,
        }
    }

    /// Form factors of the coarse mesh's samples, in their order.
    fn coarse_column(&self, polygon: &ConvexPolygon, radiosity: DVec3) -> Result<Vec<FormFactorPair>, Error> {
        // Before the first shot nothing is known of the mean, and the strongest source deserves every ray.
        let weight =
            if self.shots == 0 { f64::INFINITY } else { in_wanted_errors(radiosity, self.wanted_error()) };
        let pairs: Vec<Vec<FormFactorPair>> = (self.clusters.par_iter())
            .map_init(Workspace::default, |workspace, cluster| {
                if self.monitor.is_cancelled() {
                    return Vec::new();
                }
                self.form_factors.of_cluster(&self.mesh, cluster, polygon, weight, workspace)
            })
            .collect();
        self.monitor.check()?;
        let mut column = vec![[0.0; 2]; self.coarse_samples];
        for (cluster, pairs) in self.clusters.iter().zip(pairs) {
            for (sample, pair) in cluster.samples.iter().zip(pairs) {
                column[sample.index()] = pair;
            }
        }
        Ok(column)
    }

    /// Mean form factors of the patches, linear over their elements (the paper, §2.1).
    fn patch_means(&self, column: &Column) -> Vec<FormFactorPair> {
        let mut sums = vec![[0.0_f64; 2]; self.sources.patches.len()];
        for (element, patch) in self.mesh.elements.iter().zip(&self.patch_of) {
            let (true, Some(patch)) = (element.is_leaf(), patch) else { continue };
            let third = area(element, self.world) / 3.0;
            for sample in element.samples {
                let values = column.values[sample.index()];
                sums[patch.index()][0] += third * f64::from(values[0]);
                sums[patch.index()][1] += third * f64::from(values[1]);
            }
        }
        (sums.iter().zip(&self.sources.patches))
            .map(|(sum, patch)| sum.map(|sum| (sum / patch.polygon.area()) as f32))
            .collect()
    }

    /// Finds the patch of every element.
    fn find_patches(&mut self) {
        self.patch_of = vec![None; self.mesh.elements.len()];
        for (index, patch) in self.sources.patches.iter().enumerate() {
            patch.elements.iter().for_each(|e| self.patch_of[e.index()] = Some(PatchId::new(index)));
        }
        self.inherit_patches();
    }

    /// Elements belong to the patch of the element that they are a part of.
    fn inherit_patches(&mut self) {
        self.patch_of.resize(self.mesh.elements.len(), None);
        for (index, element) in self.mesh.elements.iter().enumerate() {
            if let (Some(patch), Some(children)) = (self.patch_of[index], element.children()) {
                for child in children {
                    self.patch_of[child.index()] = Some(patch);
                }
            }
        }
    }

    /// Keeps a column for the next shot, or adds its light to the samples when memory is short.
    fn keep_or_add(&mut self, source: SourceId, column: KeptColumn, computed: bool) {
        let bytes = if computed { column.bytes() } else { 0 };
        if self.kept_bytes + bytes <= KEPT_BYTES {
            self.kept_bytes += bytes;
            self.columns[source.index()] = Some(column);
        } else {
            self.add(source, column.samples);
        }
    }

    /// Adds the pending light of a source to the samples.
    fn add(&mut self, source: SourceId, mut column: Column) {
        let radiosity = std::mem::take(&mut self.sent[source.index()].pending);
        column.interpolate_new(&self.mesh);
        self.light.add(&self.mesh, &column, radiosity, self.sources.is_emitter(source));
    }
}

/// The rms of a colour over its channels, in wanted errors. Where nothing is lit there is nothing to refine for.
fn in_wanted_errors(colour: DVec3, wanted: f64) -> f64 {
    if wanted > 0.0 { (colour.length_squared() / 3.0).sqrt() / wanted } else { 0.0 }
}
