//! Light that arrives at points from a set of sources (the paper, §3.2: "the illumination for a regular grid of
//! sampling points is computed"). Points that lie near each other share their shafts.

use glam::DVec3;
use rayon::prelude::*;

use crate::error::Error;
use crate::monitor::Monitor;
use crate::transport::form_factors::{CLUSTER_SIZE, FormFactors, Seeded, Workspace, clusters};
use crate::transport::source_tree::SourceTree;
use crate::visibility::Receiver;

/// Parts of a source are told apart where taking their mean could be wrong by this, in wanted errors. Signs differ from
/// source to source, and the bound is several times what it is wrong by.
const NEGLIGIBLE: f64 = 1.0;

/// What arrives at a point.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Arrived {
    /// Irradiance, W/m².
    pub(crate) irradiance: DVec3,
    /// Variance that rays left in it, summed over the channels, W²/m⁴.
    pub(crate) variance: f64,
}

/// Sources, and all that it takes to find their light.
pub(crate) struct Gather<'a> {
    pub(crate) form_factors: &'a FormFactors<'a>,
    pub(crate) monitor: &'a Monitor,
    pub(crate) sources: &'a SourceTree,
    /// The rms error that the user wants, W/m²; infinite sources of rays where nothing is known yet (0).
    pub(crate) wanted_error: f64,
    /// When to leave it at what is known: the caller stops, or the time is up.
    pub(crate) ends: &'a (dyn Fn() -> bool + Sync),
}

impl Gather<'_> {
    /// What arrives at each receiver; nothing where it ended before its turn.
    ///
    /// `seeds`: per receiver, what fixes its rays.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn at(&self, receivers: &[Receiver], seeds: &[u64]) -> Result<Vec<Arrived>, Error> {
        let mut arrived = vec![Arrived::default(); receivers.len()];
        if receivers.is_empty() || self.sources.is_empty() {
            return Ok(arrived);
        }
        let clusters = clusters(receivers, CLUSTER_SIZE);
        let found: Vec<Vec<Arrived>> = (clusters.par_iter())
            .map_init(Workspace::default, |workspace, cluster| {
                let mut sums = vec![Arrived::default(); cluster.members.len()];
                if (self.ends)() {
                    return sums;
                }
                let (low, high) = cluster.bounds();
                self.sources.visit(low, high, NEGLIGIBLE * self.wanted_error, |lit| {
                    let weight = self.weight(lit.radiosity);
                    self.form_factors.of_cluster(
                        cluster,
                        Seeded { receivers, seeds },
                        &lit.polygon,
                        weight,
                        workspace,
                        |k, found| {
                            sums[k].irradiance += found.value * lit.radiosity;
                            sums[k].variance += (found.noise * lit.radiosity).length_squared();
                        },
                    );
                });
                sums
            })
            .collect();
        self.monitor.check()?;
        for (cluster, sums) in clusters.iter().zip(found) {
            for (&member, sum) in cluster.members.iter().zip(sums) {
                arrived[member as usize] = sum;
            }
        }
        Ok(arrived)
    }

    /// What a source could bring, in wanted errors; before anything is known, every ray is worth it.
    fn weight(&self, radiosity: DVec3) -> f64 {
        if self.wanted_error > 0.0 { rms(radiosity) / self.wanted_error } else { f64::INFINITY }
    }
}

/// The root mean square of a colour over its channels.
pub(crate) fn rms(colour: DVec3) -> f64 {
    (colour.length_squared() / 3.0).sqrt()
}
