//! Light of patches for the samples of the mesh that is shown: where it is computed, and where it is the mean of others.

use glam::DVec3;
use rayon::prelude::*;

use crate::adapt::layer::Layer;
use crate::display::{Display, Light, samples_of};
use crate::error::Error;
use crate::mesh::{Approach, Sample, Side};
use crate::transport::gather::{Arrived, Gather, Lit, rms};
use crate::visibility::Receiver;

impl Display<'_> {
    /// Gathers the light of patches. A sample that was made for the emitters' sake gets the mean of its parents where
    /// these are lit alike (the paper, §2.2 and §3.3: evenly lit regions are interpolated).
    ///
    /// `known`: indirect irradiance of the first samples, W/m². `even`: what counts as alike, W/m² of irradiance. `else_at`:
    /// about what arrives where it ended before anybody looked; where that is not known, samples without parents are waited
    /// for.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn light_indirectly(
        &mut self,
        known: Vec<DVec3>,
        gather: &Gather,
        even: f64,
        else_at: Option<&(dyn Fn(&Receiver) -> DVec3 + Sync)>,
    ) -> Result<(), Error> {
        let areas = match gather.sources {
            Lit::Sources(_) => Vec::new(),
            Lit::Around(_) => self.sample_areas(),
        };
        let samples = self.samples();
        let mut irradiance = known;
        irradiance.truncate(samples.len());
        let first = irradiance.len();
        irradiance.resize(samples.len(), DVec3::ZERO);
        let mut generation = vec![0_u32; samples.len()];
        let mut interpolated = vec![false; samples.len()];
        for (index, sample) in samples.iter().enumerate().skip(first.max(self.coarse)) {
            if let Some([a, b]) = sample.parents {
                generation[index] = 1 + generation[a.index()].max(generation[b.index()]);
            }
        }
        let last = generation.iter().copied().max().unwrap_or(0);
        let mut by_generation = vec![Vec::new(); last as usize + 1];
        (first..samples.len()).for_each(|index| by_generation[generation[index] as usize].push(index));
        // Where samples without parents have nothing to fall back on, they are waited for even when the time is up, but not
        // by somebody who wants none of it.
        let patient = Gather { ends: &|| gather.monitor.is_cancelled(), ..*gather };
        let mut guessed = 0;
        for (generation, members) in by_generation.into_iter().enumerate() {
            let mut uneven = Vec::new();
            for index in members {
                let parents = samples[index].parents.filter(|_| index >= self.coarse);
                match parents.map(|parents| parents.map(|p| irradiance[p.index()])) {
                    Some([a, b]) if (gather.ends)() || rms(a - b) < even => {
                        irradiance[index] = 0.5 * (a + b);
                        interpolated[index] = true;
                    }
                    _ => uneven.push(index),
                }
            }
            let gather = if generation == 0 && else_at.is_none() { &patient } else { gather };
            let (values, count) = gathered(gather, samples, &uneven, &areas, else_at)?;
            guessed += count;
            for (&index, value) in uneven.iter().zip(values) {
                irradiance[index] = value;
            }
        }
        self.guessed[Light::Indirect as usize] = guessed;
        self.indirect = Layer::new(irradiance);
        self.interpolated = interpolated;
        self.fit(Light::Indirect);
        Ok(())
    }

    /// Gathers the light of patches once more, after it has changed a little: at the samples where it was computed.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn light_again(&mut self, gather: &Gather) -> Result<(), Error> {
        let samples = samples_of(&self.mesh);
        let indirect = &self.indirect;
        let is_mean = |index: usize| match (self.interpolated.get(index), samples[index].parents) {
            (Some(&interpolated), _) => interpolated,
            (None, Some(parents)) => indirect.middle(parents).is_none(),
            (None, None) => false,
        };
        let computed: Vec<usize> = (0..samples.len()).filter(|&index| !is_mean(index)).collect();
        let (arrived, _) = gathered(gather, samples, &computed, &[], None)?;
        if (gather.ends)() {
            // What was not computed must not pass for darkness.
            return Ok(());
        }
        let mut irradiance = vec![None; samples.len()];
        for (&index, value) in computed.iter().zip(arrived) {
            irradiance[index] = Some(value);
        }
        let mut values: Vec<DVec3> = Vec::with_capacity(samples.len());
        for (index, known) in irradiance.into_iter().enumerate() {
            let mean = || samples[index].parents.map(|[a, b]| 0.5 * (values[a.index()] + values[b.index()]));
            values.push(known.or_else(mean).unwrap_or(DVec3::ZERO));
        }
        self.indirect.irradiance = values;
        self.fit(Light::Indirect);
        Ok(())
    }
}

/// The light on the fronts of some samples, and how many of them were not looked at before it ended.
///
/// `areas`: that each of all samples stands for, m²; may be empty. `else_at`: what is taken then; darkness where nothing is.
pub(super) fn gathered(
    gather: &Gather,
    samples: &[Sample],
    wanted: &[usize],
    areas: &[f64],
    else_at: Option<&(dyn Fn(&Receiver) -> DVec3 + Sync)>,
) -> Result<(Vec<DVec3>, usize), Error> {
    let approaches: Vec<_> = wanted.iter().map(|&index| samples[index].approach(Side::Front)).collect();
    let seeds: Vec<u64> = wanted.iter().map(|&index| 2 * index as u64).collect();
    let areas: Vec<f64> = wanted.iter().filter_map(|&index| areas.get(index).copied()).collect();
    let arrived = gather.limits(&approaches, &seeds, &areas)?;
    let unknown = arrived.iter().filter(|arrived| !arrived.is_known()).count();
    let value = |(arrived, approach): (&Arrived, &Approach)| match else_at {
        Some(else_at) if !arrived.is_known() => else_at(&approach.near),
        _ => arrived.irradiance,
    };
    Ok((arrived.par_iter().zip(&approaches).map(value).collect(), unknown))
}
