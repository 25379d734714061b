//! Where the light is: sent, arrived, waiting to be sent, and what is still to come.

use glam::DVec3;

use crate::mesh::Side;
use crate::transport::endless::Endless;
use crate::transport::last_bounces::LastBounces;
use crate::transport::sources::{PatchId, SourceId, Sources};

/// The light that was never shot may scale the indirect light by this much at most. It would be blotchy long before:
/// a few first bounces do not tell where the last ones go.
const MOST_CLOSING: f64 = 2.0;

/// The power balance of a solution by shooting, per colour channel.
#[derive(Default)]
pub(crate) struct Balance {
    /// Radiosity that each source has not sent yet, W/m².
    pub(crate) unshot: Vec<DVec3>,
    /// What would go on for ever, and is left out.
    endless: Endless,
    /// Irradiance of each patch, front and back, W/m².
    patch_irradiance: Vec<[DVec3; 2]>,
    /// Power sent, and power that arrived anywhere, W.
    shot: DVec3,
    landed: DVec3,
    landed_indirect: DVec3,
}

impl Balance {
    /// The emitters have shot; what they brought is unshot reflected light.
    ///
    /// `emitted`: their power, W. `direct`: mean irradiance of every patch, front and back, W/m².
    pub(crate) fn new(sources: &Sources, emitted: DVec3, direct: Vec<[DVec3; 2]>, endless: Endless) -> Self {
        let mut unshot = vec![DVec3::ZERO; sources.len()];
        let mut landed = DVec3::ZERO;
        for (index, (irradiance, patch)) in direct.iter().zip(&sources.patches).enumerate() {
            for side in Side::BOTH {
                let irradiance = irradiance[side as usize];
                landed += irradiance * patch.polygon.area();
                let source = Sources::of_patch(PatchId::new(index), side).index();
                unshot[source] = endless.without(source, patch.reflectance * irradiance);
            }
        }
        Self {
            unshot,
            endless,
            patch_irradiance: direct,
            shot: emitted,
            landed,
            landed_indirect: DVec3::ZERO,
        }
    }

    /// The source with the most unshot power; none when none has any.
    pub(crate) fn strongest(&self, sources: &Sources) -> Option<SourceId> {
        let mut strongest = (0.0, None);
        for source in SourceId::range(0..sources.len()) {
            let power = self.unshot[source.index()].abs().element_sum() * sources.area(source);
            if power > strongest.0 {
                strongest = (power, Some(source));
            }
        }
        strongest.1
    }

    /// A source's unshot power against all power that has arrived.
    pub(crate) fn share(&self, source: SourceId, sources: &Sources) -> f64 {
        let unshot = self.unshot[source.index()].abs().element_sum() * sources.area(source);
        unshot / (unshot + self.landed.abs().element_sum())
    }

    /// Moves a source's unshot light to the patches that see it, by their mean form factors.
    pub(crate) fn shoot(&mut self, source: SourceId, sources: &Sources, means: &[[f64; 2]]) {
        let radiosity = std::mem::take(&mut self.unshot[source.index()]);
        self.shot += radiosity * sources.area(source);
        let mut landed = DVec3::ZERO;
        for (index, (means, patch)) in means.iter().zip(&sources.patches).enumerate() {
            for side in Side::BOTH {
                let mean = means[side as usize];
                if mean != 0.0 {
                    self.patch_irradiance[index][side as usize] += mean * radiosity;
                    landed += mean * patch.polygon.area() * radiosity;
                    let reflected = Sources::of_patch(PatchId::new(index), side).index();
                    let reflects = patch.reflectance * mean * radiosity;
                    self.unshot[reflected] += self.endless.without(reflected, reflects);
                }
            }
        }
        self.landed += landed;
        self.landed_indirect += landed;
    }

    /// What each source reflects for good of what it receives.
    pub(crate) fn reflectances(&self, sources: &Sources) -> Vec<DVec3> {
        (0..sources.len())
            .map(|source| self.endless.without(source, sources.patches[source / 2].reflectance))
            .collect()
    }

    /// Takes over what all bounces send that sources with columns take part in.
    ///
    /// `reflectances`: as [`Self::reflectances`] tells them.
    pub(super) fn settle(
        &mut self,
        last: &LastBounces,
        reflectances: &[DVec3],
        is_known: impl Fn(usize) -> bool,
        sources: &Sources,
    ) {
        let mut landed = DVec3::ZERO;
        for (index, (radiosity, arrived)) in last.radiosity.iter().zip(&last.arrived).enumerate() {
            let area = sources.area(SourceId::new(index));
            self.shot += area * *radiosity;
            landed += area * *arrived;
            self.patch_irradiance[index / 2][index % 2] += *arrived;
            if is_known(index) {
                self.unshot[index] = DVec3::ZERO;
            } else {
                self.unshot[index] += reflectances[index] * *arrived;
            }
        }
        self.landed += landed;
        self.landed_indirect += landed;
    }

    /// Power that waits to be sent, over the channels, W.
    pub(crate) fn unshot_power(&self, sources: &Sources) -> f64 {
        let power = |(index, unshot): (usize, &DVec3)| {
            unshot.abs().element_sum() * sources.area(SourceId::new(index))
        };
        self.unshot.iter().enumerate().map(power).sum()
    }

    /// Share of all light that has not arrived yet: 1 at first, towards 0.
    pub(crate) fn remaining(&self, sources: &Sources) -> f64 {
        let future = self.future(sources).abs().element_sum();
        if future == 0.0 { 0.0 } else { future / (future + self.landed.abs().element_sum()) }
    }

    /// What the indirect light must be scaled by to hold the light that was never shot, as if it went where the
    /// indirect light so far went.
    pub(crate) fn closing_factor(&self, sources: &Sources) -> DVec3 {
        let (future, landed) = (self.future(sources), self.landed_indirect);
        let channel = |k: usize| {
            if landed[k] > 0.0 { (1.0 + future[k] / landed[k]).clamp(1.0, MOST_CLOSING) } else { 1.0 }
        };
        DVec3::new(channel(0), channel(1), channel(2))
    }

    /// Mean radiosity that the baked surfaces will reflect in the end, over the channels; `white` takes every
    /// surface as white.
    pub(crate) fn mean_baked(&self, sources: &Sources, white: bool) -> f64 {
        let (mut reflected, mut area) = (DVec3::ZERO, 0.0);
        for (irradiance, patch) in self.patch_irradiance.iter().zip(&sources.patches) {
            if patch.receives {
                let reflectance = if white { DVec3::ONE } else { patch.shown };
                reflected += patch.polygon.area() * reflectance * irradiance[Side::Front as usize];
                area += patch.polygon.area();
            }
        }
        let future = self.future(sources);
        let growth = |k: usize| if self.landed[k] > 0.0 { 1.0 + future[k] / self.landed[k] } else { 1.0 };
        let mean = reflected * DVec3::new(growth(0), growth(1), growth(2)) / area;
        if area > 0.0 { mean.element_sum() / 3.0 } else { 0.0 }
    }

    /// Mean radiosity that all surfaces reflect so far, on both sides and over the channels.
    pub(crate) fn mean_reflected(&self, sources: &Sources) -> f64 {
        let (mut reflected, mut area) = (DVec3::ZERO, 0.0);
        for (irradiance, patch) in self.patch_irradiance.iter().zip(&sources.patches) {
            reflected += patch.polygon.area() * patch.reflectance * (irradiance[0] + irradiance[1]);
            area += 2.0 * patch.polygon.area();
        }
        if area > 0.0 { reflected.element_sum() / (3.0 * area) } else { 0.0 }
    }

    /// Power that will still arrive, counting all bounces: what is unshot lands like what was shot, and is reflected
    /// by what it lands on.
    fn future(&self, sources: &Sources) -> DVec3 {
        let unshot: DVec3 = (self.unshot.iter().enumerate())
            .map(|(index, radiosity)| *radiosity * sources.area(SourceId::new(index)))
            .sum();
        let (mut reflected, mut arrived) = (DVec3::ZERO, DVec3::ZERO);
        for (irradiance, patch) in self.patch_irradiance.iter().zip(&sources.patches) {
            let power = (irradiance[0] + irradiance[1]) * patch.polygon.area();
            reflected += patch.reflectance * power;
            arrived += power;
        }
        let channel = |k: usize| {
            let landing =
                if self.landed[k] == 0.0 { 1.0 } else { (self.landed[k] / self.shot[k]).clamp(0.0, 1.0) };
            let reflectance =
                if arrived[k] == 0.0 { 0.0 } else { (reflected[k] / arrived[k]).clamp(0.0, 1.0) };
            // A closed white room never gets dark; its factor is bounded like its reflectance by rounding.
            unshot[k] * landing / (1.0 - reflectance * landing).max(1e-9)
        };
        DVec3::new(channel(0), channel(1), channel(2))
    }
}
