//! Progressive refinement: the source with the most unshot light shoots it to everything, again and again (Cohen,
//! Chen, Wallace, Greenberg 1988; the paper, §1).
//!
//! The first shot of a source computes its column, the visible form factors of all samples, and may refine the mesh.
//! Columns are kept while memory allows; a kept column's source shoots again at the price of a sum over patches.
//! Light that is still unshot when shooting ends is spread in proportion to the indirect light so far, so that what
//! is dark stays dark (Cohen et al.'s ambient term lights closed boxes from outside).

use glam::DVec3;
use rayon::prelude::*;

use crate::adapt::adaptive_subdivision::{Column, Refinement};
use crate::error::Error;
use crate::index::ElementId;
use crate::mesh::Mesh;
use crate::monitor::Monitor;
use crate::scene::world::World;
use crate::settings::{Method, Quantity, Settings};
use crate::transport::balance::Balance;
use crate::transport::form_factors::{Cluster, FormFactorPair, FormFactors, Workspace, clusters};
use crate::transport::sources::{PatchId, SourceId, Sources};
use crate::visibility::ConvexPolygon;

/// Bytes of columns that are kept for shooting again.
const KEPT_BYTES: usize = 1 << 30;

/// Share of the tolerance below which light that is still to come is not worth another column.
const NEGLIGIBLE: f64 = 0.05;

/// Unshot share below which even kept columns are done: below what f32 colours can show.
const EXHAUSTED: f64 = 1e-9;

/// A source that became this much stronger since it last refined the mesh refines it again.
const REFINE_AGAIN: f64 = 2.0;

/// A source's form factors, kept for its next shot.
struct KeptColumn {
    samples: Column,
    patches: Vec<FormFactorPair>,
}

impl KeptColumn {
    fn bytes(&self) -> usize {
        size_of::<FormFactorPair>() * (self.samples.values.len() + self.patches.len()) + self.samples.values.len()
    }
}

/// What a source has sent so far, W/m².
#[derive(Debug, Clone, Copy, Default)]
struct Sent {
    total: DVec3,
    /// Of the total: what has not been added to the samples yet.
    pending: DVec3,
    /// The total when the mesh was last refined for this source.
    refined_for: DVec3,
}

/// Irradiance of one side of a sample, W/m².
#[derive(Debug, Clone, Copy, Default)]
struct Light {
    direct: DVec3,
    indirect: DVec3,
}

/// What shooting starts from.
pub(crate) struct CoarseMesh {
    pub(crate) mesh: Mesh,
    /// Elements that send together, before they are paired.
    pub(crate) patch_elements: Vec<ElementId>,
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
    /// Per element: the patch that it belongs to.
    patch_of: Vec<Option<PatchId>>,
    balance: Balance,
    sent: Vec<Sent>,
    columns: Vec<Option<KeptColumn>>,
    kept_bytes: usize,
    /// Per sample and side: what columns that were not kept have brought.
    light: Vec<[Light; 2]>,
    pub(crate) shots: usize,
    pub(crate) out_of_budget: bool,
}

impl<'a> Shooting<'a> {
    pub(crate) fn new(
        world: &'a World,
        settings: &'a Settings,
        monitor: &'a Monitor,
        form_factors: FormFactors<'a>,
        coarse: CoarseMesh,
    ) -> Self {
        let CoarseMesh { mesh, patch_elements, coarse_elements, deepest } = coarse;
        let sources = Sources::new(world, &mesh, &patch_elements);
        let mut patch_of = vec![None; mesh.elements.len()];
        for (index, patch) in sources.patches.iter().enumerate() {
            patch.elements.iter().for_each(|e| patch_of[e.index()] = Some(PatchId::new(index)));
        }
        let coarse_samples = mesh.samples.len();
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
            patch_of,
            kept_bytes: 0,
            light: vec![[Light::default(); 2]; coarse_samples],
            shots: 0,
            out_of_budget: false,
        };
        shooting.inherit_patches();
        shooting
    }

    /// Lets the strongest source shoot. Returns whether its column had to be computed, or `None` when nothing worth
    /// shooting is left.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn shoot(&mut self) -> Result<Option<bool>, Error> {
        let Some(source) = self.balance.strongest(&self.sources) else { return Ok(None) };
        let remaining = self.remaining();
        let kept = self.columns[source.index()].take();
        if remaining <= EXHAUSTED || (remaining <= NEGLIGIBLE * self.settings.tolerance && kept.is_none()) {
            self.columns[source.index()] = kept;
            return Ok(None);
        }
        let radiosity = self.balance.unshot[source.index()];
        let sent = self.sent[source.index()];
        let stronger = (sent.total + radiosity).length() > REFINE_AGAIN * sent.refined_for.length();
        let (column, computed) = match kept {
            Some(kept) if !(stronger && self.refines()) => {
                self.balance.shoot(source, &self.sources, &kept.patches);
                (kept, false)
            }
            kept => (self.shoot_and_refine(source, radiosity, kept)?, true),
        };
        let sent = &mut self.sent[source.index()];
        sent.total += radiosity;
        sent.pending += radiosity;
        self.keep_or_add(source, column, computed);
        self.shots += 1;
        Ok(Some(computed))
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
        let irradiance = (self.light.iter())
            .map(|sides| sides.map(|light| light.direct + closing * light.indirect))
            .collect();
        (self.mesh, irradiance)
    }

    fn refines(&self) -> bool {
        self.settings.method == Method::As && !self.out_of_budget
    }

    /// Computes a source's column, shoots, and refines the mesh for it.
    fn shoot_and_refine(
        &mut self,
        source: SourceId,
        radiosity: DVec3,
        kept: Option<KeptColumn>,
    ) -> Result<KeptColumn, Error> {
        let polygon = self.sources.polygon(source);
        let mut samples = if let Some(kept) = kept {
            self.kept_bytes -= kept.bytes();
            kept.samples
        } else {
            Column::new(self.coarse_column(&polygon, radiosity)?, &self.mesh)
        };
        samples.interpolate_new(&self.mesh);
        let mut patches = self.patch_means(&samples);
        if !self.refines() {
            self.balance.shoot(source, &self.sources, &patches);
            return Ok(KeptColumn { samples, patches });
        }
        // Refine for the final mean, of which this shot is a part.
        let before = self.balance.clone();
        self.balance.shoot(source, &self.sources, &patches);
        let wanted = self.wanted_error();
        self.balance = before;
        let total = self.sent[source.index()].total + radiosity;
        let weights: Vec<f64> = (self.world.materials.iter())
            .map(|material| in_wanted_errors(self.shown(material.reflectance_rgb) * total, wanted))
            .collect();
        let refinement = Refinement {
            world: self.world,
            form_factors: &self.form_factors,
            monitor: self.monitor,
            source: &polygon,
            weights: &weights,
            deepest: &self.deepest,
            triangle_budget: self.settings.triangle_limit(),
        };
        self.out_of_budget |= refinement.refine(&mut self.mesh, &mut samples, &self.coarse_elements)?;
        self.inherit_patches();
        patches = self.patch_means(&samples);
        self.sent[source.index()].refined_for = total;
        self.balance.shoot(source, &self.sources, &patches);
        Ok(KeptColumn { samples, patches })
    }

    /// The error that one source may make anywhere, W/m².
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
        let weight = if self.shots == 0 { f64::INFINITY } else { in_wanted_errors(radiosity, self.wanted_error()) };
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
            let third = self.mesh.area(element, self.world) / 3.0;
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

    /// Elements belong to the patch of the element that they are a part of.
    fn inherit_patches(&mut self) {
        self.patch_of.resize(self.mesh.elements.len(), None);
        for (index, element) in self.mesh.elements.iter().enumerate() {
            if let (Some(patch), Some(children)) = (self.patch_of[index], element.children()) {
                children.iter().for_each(|child| self.patch_of[child.index()] = Some(patch));
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
        self.grow_light();
        column.interpolate_new(&self.mesh);
        let direct = self.sources.is_emitter(source);
        self.light.par_iter_mut().zip(&column.values).with_min_len(4096).for_each(|(sides, values)| {
            for (light, &value) in sides.iter_mut().zip(values) {
                let sum = if direct { &mut light.direct } else { &mut light.indirect };
                *sum += f64::from(value) * radiosity;
            }
        });
    }

    /// Samples that came after a column was added hold the mean of their parents.
    fn grow_light(&mut self) {
        for sample in &self.mesh.samples[self.light.len()..] {
            let [a, b] = sample.parents.expect("samples added by subdivision have parents; this is a bug in antumbra");
            let [a, b] = [a, b].map(|s| self.light[s.index()]);
            self.light.push(std::array::from_fn(|side| Light {
                direct: 0.5 * (a[side].direct + b[side].direct),
                indirect: 0.5 * (a[side].indirect + b[side].indirect),
            }));
        }
    }
}

/// The rms of a colour over its channels, in wanted errors. Where nothing is lit there is nothing to refine for.
fn in_wanted_errors(colour: DVec3, wanted: f64) -> f64 {
    if wanted > 0.0 { (colour.length_squared() / 3.0).sqrt() / wanted } else { 0.0 }
}
