//! The light that samples have received, direct and indirect apart.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::Mesh;
use crate::transport::column::Column;

/// Irradiance of one side of a sample, W/m².
#[derive(Debug, Clone, Copy, Default)]
struct Light {
    direct: DVec3,
    indirect: DVec3,
}

/// Irradiance per sample, front and back.
#[derive(Debug)]
pub(crate) struct SampleLight(Vec<[Light; 2]>);

impl SampleLight {
    /// Darkness at so many samples.
    pub(crate) fn new(samples: usize) -> Self {
        Self(vec![[Light::default(); 2]; samples])
    }

    /// Adds a source of this radiosity (W/m²) by its form factors, which must hold every sample of the mesh.
    pub(crate) fn add(&mut self, mesh: &Mesh, column: &Column, radiosity: DVec3, direct: bool) {
        self.interpolate_new(mesh);
        self.0.par_iter_mut().zip(&column.values).with_min_len(4096).for_each(|(sides, values)| {
            for (light, &value) in sides.iter_mut().zip(values) {
                let sum = if direct { &mut light.direct } else { &mut light.indirect };
                *sum += f64::from(value) * radiosity;
            }
        });
    }

    /// The sum for every sample of the mesh, with the indirect light scaled per channel.
    pub(crate) fn total(mut self, mesh: &Mesh, indirect_scale: DVec3) -> Vec<[DVec3; 2]> {
        self.interpolate_new(mesh);
        self.0.iter().map(|sides| sides.map(|light| light.direct + indirect_scale * light.indirect)).collect()
    }

    /// Samples that came after light was added hold the mean of their parents.
    fn interpolate_new(&mut self, mesh: &Mesh) {
        for sample in &mesh.samples[self.0.len()..] {
            let [a, b] =
                sample.parents.expect("samples added by subdivision have parents; this is a bug in antumbra");
            let [a, b] = [a, b].map(|s| self.0[s.index()]);
            self.0.push(std::array::from_fn(|side| Light {
                direct: 0.5 * (a[side].direct + b[side].direct),
                indirect: 0.5 * (a[side].indirect + b[side].indirect),
            }));
        }
    }
}
