//! The form factors of all samples to one source.

use crate::index::SampleId;
use crate::mesh::Mesh;
use crate::transport::form_factors::FormFactorPair;

/// A source's form factors: computed where the light is uneven, interpolated elsewhere (the paper, §2.2).
#[derive(Debug)]
pub(crate) struct Column {
    /// Front and back, per sample.
    pub(crate) values: Vec<FormFactorPair>,
    /// Whether a sample's front value was computed for this source; the others are interpolated.
    computed: Vec<bool>,
    /// The samples of the coarse mesh come first: both their sides were computed.
    coarse: usize,
}

impl Column {
    /// Starts from the values of the coarse mesh.
    pub(crate) fn new(coarse: Vec<FormFactorPair>, mesh: &Mesh) -> Self {
        let count = coarse.len();
        let mut column = Self { values: coarse, computed: vec![true; count], coarse: count };
        column.interpolate_new(mesh);
        column
    }

    /// Memory that the column takes.
    pub(crate) fn bytes(&self) -> usize {
        self.values.len() * (size_of::<FormFactorPair>() + size_of::<bool>())
    }

    /// Interpolates samples that were made since the column was computed.
    pub(crate) fn interpolate_new(&mut self, mesh: &Mesh) {
        self.interpolate_from(mesh, self.values.len());
    }

    /// Interpolates everything again that was not computed.
    pub(crate) fn interpolate_all(&mut self, mesh: &Mesh) {
        self.interpolate_from(mesh, 0);
    }

    /// Keeps a computed front value. The back is never refined for, so it is always interpolated.
    pub(crate) fn set_front(&mut self, sample: SampleId, value: f32) {
        self.values[sample.index()][0] = value;
        self.computed[sample.index()] = true;
    }

    pub(crate) fn front(&self, sample: SampleId) -> f64 {
        f64::from(self.values[sample.index()][0])
    }

    pub(crate) fn interpolate_from(&mut self, mesh: &Mesh, first: usize) {
        self.values.resize(mesh.samples.len(), [0.0; 2]);
        self.computed.resize(mesh.samples.len(), false);
        for index in first.max(self.coarse)..mesh.samples.len() {
            // Parents are older than their children, so their values are final.
            let Some([a, b]) = mesh.samples[index].parents else { continue };
            let [a, b] = [a, b].map(|s| self.values[s.index()]);
            let mean: FormFactorPair = std::array::from_fn(|k| 0.5 * (a[k] + b[k]));
            self.values[index][1] = mean[1];
            if !self.computed[index] {
                self.values[index][0] = mean[0];
            }
        }
    }
}
