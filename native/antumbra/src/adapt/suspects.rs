//! Which elements are looked at: those that the light could be uneven on.

use glam::DVec3;

use crate::adapt::layer::Layer;
use crate::adapt::refinable::{Leaf, Refinable};
use crate::adapt::refinement::{Hidden, Refinement};
use crate::mesh::Side;
use crate::transport::gather::rms;
use crate::visibility::unoccluded_form_factor;

/// Where the light at the corners of an element differs by less than this, in wanted errors, unblocked light is even:
/// its second difference is smaller still.
pub(crate) const EVEN: f64 = 1.0;

/// A shadow that no corner sees is looked for only where it could make at least this share of the squared error that
/// is allowed over all surfaces. A scene of a hundred thousand small triangles would otherwise spend its time on
/// shadows smaller than they are; missing one costs a thirtieth of the wanted error at most.
const WORTH_SEARCHING: f64 = 1e-3;

/// Elements whose corners' differences, taken for an error, would not make this share of the allowed squared error are
/// left alone. What a linear element errs by is about a seventh of them, a fiftieth in square: even a hundred thousand
/// such elements add up to a fiftieth of what is allowed.
const WORTH_TESTING: f64 = 1e-5;

impl Refinement<'_> {
    /// Whether the group could light an element unevenly.
    pub(super) fn is_suspect(&self, mesh: &impl Refinable, layer: &Layer, leaf: &Leaf) -> bool {
        let light = leaf.samples.map(|s| layer.irradiance[s.index()]);
        let spread =
            (0..3).map(|k| self.in_wanted_errors(leaf, light[k] - light[(k + 1) % 3])).fold(0.0, f64::max);
        let share = |wanted: f64| (wanted * self.wanted_error).powi(2) * leaf.area / self.allowed;
        if spread >= EVEN && share(spread) >= WORTH_TESTING {
            return true;
        }
        // The light that comes to the brightest corner when nothing blocks it may miss all corners.
        let most = match self.hidden {
            Hidden::Nowhere => return false,
            Hidden::Crevices { mean_radiosity, .. } => {
                let brightest = self.in_wanted_errors(leaf, light.into_iter().fold(DVec3::ZERO, DVec3::max));
                return share(brightest.max(mean_radiosity / self.wanted_error)) >= WORTH_SEARCHING
                    || self.squared_error_within(mesh, layer, leaf) >= WORTH_TESTING * self.allowed;
            }
            Hidden::Shadows => {
                let Some(sources) = self.gather.sources.sources() else { return false };
                let receivers = leaf.samples.map(|s| mesh.samples()[s.index()].receiver(Side::Front));
                // Of many lamps, most are too far away.
                let middle = receivers.iter().map(|receiver| receiver.position).sum::<DVec3>() / 3.0;
                let reach = receivers.iter().map(|r| r.position.distance(middle)).fold(0.0, f64::max);
                let from_sky = sources.sky.as_ref().map_or(DVec3::ZERO, |sky| sky.brightest(&receivers));
                let most = sources.most_to(middle, reach) + from_sky;
                if share(self.in_wanted_errors(leaf, most)) < WORTH_SEARCHING {
                    return false;
                }
                let brightest = |polygon| {
                    receivers.iter().map(|r| unoccluded_form_factor(r, polygon)).fold(0.0, f64::max)
                };
                let most: DVec3 = sources.roots().map(|(polygon, sent)| brightest(polygon) * sent).sum();
                most + sources.brightest_beyond(&receivers)
            }
        };
        share(self.in_wanted_errors(leaf, most)) >= WORTH_SEARCHING
    }

    /// The rms over the channels of what irradiance shows on a leaf, in wanted errors. Where nothing is lit there is
    /// nothing to refine for.
    fn in_wanted_errors(&self, leaf: &Leaf, irradiance: DVec3) -> f64 {
        if self.wanted_error > 0.0 { rms(self.shown(leaf, irradiance)) / self.wanted_error } else { 0.0 }
    }
}
