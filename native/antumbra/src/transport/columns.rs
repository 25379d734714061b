//! Columns of the exchange: what of a source's light arrives where, kept for its next shot.

use rayon::prelude::*;

use crate::error::Error;
use crate::mesh::{Mesh, Sample, Side};
use crate::monitor::Monitor;
use crate::transport::clusters::{CLUSTER_SIZE, Cluster, Clustered, Seeded, clusters};
use crate::transport::form_factors::{FormFactorPair, FormFactors, Narrowed, Workspace};
use crate::transport::sources::{PatchId, SourceId, Sources};
use crate::visibility::Receiver;

/// A source's form factors.
#[derive(Clone)]
pub(super) struct Column {
    /// Of all samples, front and back.
    pub(super) samples: Vec<FormFactorPair>,
    /// Means over the patches, in full: what is reflected a million times must not gain or lose a millionth each time.
    pub(super) patches: Vec<[f64; 2]>,
}

impl Column {
    pub(super) fn bytes(&self) -> usize {
        size_of::<FormFactorPair>() * (self.samples.len() + 2 * self.patches.len())
    }
}

/// All samples of a mesh of patches, as they receive.
#[derive(Default)]
pub(super) struct Receivers {
    /// Front and back of every sample, one after the other.
    sides: Vec<Receiver>,
    seeds: Vec<u64>,
    clusters: Vec<Cluster>,
    /// Per element: the patch that it belongs to.
    patch_of: Vec<Option<PatchId>>,
}

impl Receivers {
    /// `patch_of`: per element, the patch that it is, or half of.
    pub(super) fn new(mesh: &Mesh, mut patch_of: Vec<Option<PatchId>>) -> Self {
        inherit(mesh, &mut patch_of);
        let sides = both_sides(&mesh.samples);
        Self {
            seeds: (0..sides.len() as u64).collect(),
            clusters: clusters(&sides, 2 * CLUSTER_SIZE),
            sides,
            patch_of,
        }
    }

    /// Computes a source's form factors.
    ///
    /// `weight`: its light in wanted errors.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(super) fn column(
        &self,
        form_factors: &FormFactors,
        monitor: &Monitor,
        mesh: &Mesh,
        sources: &Sources,
        source: SourceId,
        weight: f64,
    ) -> Result<Column, Error> {
        let polygon = sources.polygon(source);
        let of = Seeded { receivers: &self.sides, seeds: &self.seeds };
        let found: Vec<Vec<(u32, f64)>> = (self.clusters.par_iter())
            .map_init(Workspace::default, |workspace, cluster| {
                let mut values = Vec::new();
                if !monitor.is_cancelled() {
                    form_factors.of_cluster(
                        Clustered { cluster, of },
                        &polygon,
                        weight,
                        Narrowed::Unknown,
                        workspace,
                        |k, found| values.push((cluster.members[k], found.grey())),
                    );
                    form_factors.count_pairs(workspace);
                }
                values
            })
            .collect();
        monitor.check()?;
        let mut samples = vec![[0.0_f64; 2]; mesh.samples.len()];
        for (receiver, value) in found.into_iter().flatten() {
            samples[receiver as usize / 2][receiver as usize % 2] = value;
        }
        let patches = self.patch_means(mesh, sources, &samples);
        Ok(Column {
            samples: samples.into_iter().map(|sides| sides.map(|value| value as f32)).collect(),
            patches,
        })
    }

    /// Mean form factors of the patches, linear over their elements (the paper, §2.1).
    fn patch_means(&self, mesh: &Mesh, sources: &Sources, samples: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut sums = vec![[0.0_f64; 2]; sources.patches.len()];
        for (element, patch) in mesh.elements.iter().zip(&self.patch_of) {
            let (true, Some(patch)) = (element.is_leaf(), patch) else { continue };
            let third = element.area / 3.0;
            for sample in element.samples {
                let values = samples[sample.index()];
                sums[patch.index()][0] += third * values[0];
                sums[patch.index()][1] += third * values[1];
            }
        }
        (sums.iter().zip(&sources.patches))
            .map(|(sum, patch)| sum.map(|sum| sum / patch.polygon.area()))
            .collect()
    }
}

/// Parts of a patch belong to it as well.
fn inherit(mesh: &Mesh, patch_of: &mut [Option<PatchId>]) {
    for (index, element) in mesh.elements.iter().enumerate() {
        if let (Some(patch), Some(children)) = (patch_of[index], element.children()) {
            for child in children {
                patch_of[child.index()] = Some(patch);
            }
        }
    }
}

/// Front and back of every sample, one after the other.
pub(super) fn both_sides(samples: &[Sample]) -> Vec<Receiver> {
    samples.iter().flat_map(|sample| Side::BOTH.map(|side| sample.receiver(side))).collect()
}
