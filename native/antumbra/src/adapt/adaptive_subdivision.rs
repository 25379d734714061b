//! Adaptive subdivision, "AS" (the paper, §2.2): an element is quartered where the current shot lights it unevenly,
//! and each quarter is looked at in turn. Where the shot is even, only the coarse elements are evaluated and the
//! finer samples of earlier shots are interpolated.
//!
//! Departures from the paper. Uneven means that the light in the middle of an edge differs from the mean of its ends
//! by more than the tolerance: a steady gradient costs nothing, since a linear element holds it exactly. And equal
//! values at the vertices do not make an element even while something may block the source: a shadow can lie
//! inside.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::error::Error;
use crate::index::{ElementId, SampleId};
use crate::mesh::{Mesh, Sample, Side, edge_key};
use crate::monitor::Monitor;
use crate::scene::world::World;
use crate::transport::form_factors::{Candidates, FormFactorPair, FormFactors, Workspace, faces};
use crate::visibility::shaft::{Shaft, TRIANGLE_EDGES};
use crate::visibility::{ConvexPolygon, unoccluded_form_factor};

/// Deviation at the middle of an edge that makes an element uneven, in wanted errors. Linear interpolation's rms
/// error over a triangle is a third to a half of the largest deviation at its edges' middles, and most elements stay
/// far below the largest: one wanted error here gives a mesh whose rms error is below the wanted one.
const UNEVEN: f64 = 1.0;

/// What one shot needs for refining the mesh.
pub(crate) struct Refinement<'a> {
    pub(crate) world: &'a World,
    pub(crate) form_factors: &'a FormFactors<'a>,
    pub(crate) monitor: &'a Monitor,
    pub(crate) source: &'a ConvexPolygon,
    /// Per material: radiosity that a form factor of one would bring, in wanted errors.
    pub(crate) weights: &'a [f64],
    /// Per face: the deepest level its elements may reach.
    pub(crate) deepest: &'a [u8],
    /// Triangles that the anchored mesh may have.
    pub(crate) triangle_budget: usize,
}

/// The form factors of all samples to one source, while they are being found.
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

    /// Interpolates what was not computed, from sample `first` on: where light is even, the mean of an edge's ends
    /// (the paper, §2.2). The back is never refined for, so it is always interpolated.
    fn interpolate_from(&mut self, mesh: &Mesh, first: usize) {
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

    /// Interpolates samples that were made since the column was computed.
    pub(crate) fn interpolate_new(&mut self, mesh: &Mesh) {
        self.interpolate_from(mesh, self.values.len());
    }

    fn set_front(&mut self, sample: SampleId, value: f32) {
        self.values[sample.index()][0] = value;
        self.computed[sample.index()] = true;
    }

    fn front(&self, sample: SampleId) -> f64 {
        f64::from(self.values[sample.index()][0])
    }
}

/// An element under test.
struct Suspect {
    element: ElementId,
    was_leaf: bool,
    candidates: Option<Vec<u32>>,
}

impl Refinement<'_> {
    /// Refines the mesh below the given elements until the shot lights every leaf evenly.
    ///
    /// Returns whether the triangle budget held it back.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn refine(&self, mesh: &mut Mesh, column: &mut Column, elements: &[ElementId]) -> Result<bool, Error> {
        let mut frontier = elements.to_vec();
        let mut out_of_budget = false;
        while !frontier.is_empty() {
            let suspects = self.suspects(mesh, column, &frontier)?;
            let middles = self.compute_middles(mesh, &suspects)?;
            let mut next = Vec::new();
            for suspect in &suspects {
                if !self.is_uneven(mesh, column, suspect, &middles) {
                    continue;
                }
                if !suspect.was_leaf {
                    next.extend(mesh.element(suspect.element).children().into_iter().flatten());
                } else if mesh.triangles >= self.triangle_budget {
                    out_of_budget = true;
                } else {
                    let mut subdivided = Vec::new();
                    mesh.subdivide(suspect.element, &mut subdivided);
                    next.extend(subdivided.iter().filter_map(|&e| mesh.element(e).children()).flatten());
                }
            }
            let first_new = column.values.len();
            column.interpolate_from(mesh, first_new);
            keep_middles(mesh, column, &suspects, &middles);
            // Samples that only the restriction asked for keep their interpolated values.
            column.interpolate_from(mesh, first_new);
            frontier = next;
        }
        // What was computed at one element changes what is interpolated from it at another.
        column.interpolate_from(mesh, 0);
        Ok(out_of_budget)
    }

    /// The elements that this shot could light unevenly.
    fn suspects(&self, mesh: &Mesh, column: &Column, frontier: &[ElementId]) -> Result<Vec<Suspect>, Error> {
        let suspects: Vec<Option<Suspect>> = frontier
            .par_iter()
            .map_init(Vec::new, |found, &id| {
                if self.monitor.is_cancelled() { None } else { self.suspect(mesh, column, id, found) }
            })
            .collect();
        self.monitor.check()?;
        Ok(suspects.into_iter().flatten().collect())
    }

    fn suspect(&self, mesh: &Mesh, column: &Column, id: ElementId, found: &mut Vec<u32>) -> Option<Suspect> {
        let element = mesh.element(id);
        let was_leaf = element.is_leaf();
        let face = element.face.index();
        if was_leaf && element.level >= self.deepest[face] {
            return None;
        }
        // Light that cannot reach the tolerance cannot be uneven by it.
        let weight = self.weights[self.world.faces[face].material as usize];
        let receivers = element.samples.map(|s| mesh.sample(s).receiver(Side::Front));
        let brightest = (receivers.iter())
            .filter(|receiver| faces(receiver, self.source))
            .map(|receiver| unoccluded_form_factor(receiver, self.source))
            .fold(0.0, f64::max);
        if weight * brightest < UNEVEN {
            return None;
        }
        let flat = self.world.faces[face].corner_normals.is_none();
        let plane = flat.then_some((receivers[0].position, receivers[0].normal));
        let shaft = Shaft::new(&receivers.each_ref().map(|r| r.position), &TRIANGLE_EDGES, self.source, plane);
        let candidates = match self.form_factors.candidates(&shaft, found) {
            Candidates::Shared(list) => Some(list.to_vec()),
            Candidates::Crowd => None,
        };
        let values = element.samples.map(|s| column.front(s));
        let spread = values.iter().copied().fold(0.0, f64::max) - values.iter().copied().fold(f64::INFINITY, f64::min);
        let unblocked = candidates.as_ref().is_some_and(Vec::is_empty);
        if unblocked && weight * spread < UNEVEN {
            return None;
        }
        Some(Suspect { element: id, was_leaf, candidates })
    }

    /// Exact values in the middle of every edge of the suspects, each edge once.
    fn compute_middles(
        &self,
        mesh: &Mesh,
        suspects: &[Suspect],
    ) -> Result<FxHashMap<(SampleId, SampleId), f32>, Error> {
        let mut seen = FxHashMap::default();
        let mut wanted = Vec::new();
        for suspect in suspects {
            let element = mesh.element(suspect.element);
            for k in 0..3 {
                let key = edge_key(element.samples[k], element.samples[(k + 1) % 3]);
                seen.entry(key).or_insert_with(|| {
                    wanted.push((key, suspect, k));
                    0.0
                });
            }
        }
        let values: Vec<f32> = wanted
            .par_iter()
            .map_init(Workspace::default, |workspace, &((a, b), suspect, k)| {
                if self.monitor.is_cancelled() {
                    return 0.0;
                }
                let element = mesh.element(suspect.element);
                let sample = match mesh.sample_midpoint(a, b) {
                    Some(existing) => mesh.sample(existing).clone(),
                    None => self.middle(mesh, element.vertices, [a, b], k),
                };
                let candidates = suspect.candidates.as_deref().map_or(Candidates::Crowd, Candidates::Shared);
                let weight = self.weights[self.world.faces[element.face.index()].material as usize];
                let seed = (a.index() as u64) << 32 | b.index() as u64;
                let receiver = sample.receiver(Side::Front);
                self.form_factors.visible(&receiver, self.source, candidates, weight, seed, workspace) as f32
            })
            .collect();
        self.monitor.check()?;
        for ((key, ..), value) in wanted.iter().zip(values) {
            seen.insert(*key, value);
        }
        Ok(seen)
    }

    fn middle(
        &self,
        mesh: &Mesh,
        vertices: [crate::index::VertexId; 3],
        samples: [SampleId; 2],
        k: usize,
    ) -> Sample {
        let [from, to, opposite] = [k, (k + 1) % 3, (k + 2) % 3].map(|i| mesh.vertices[vertices[i].index()].position);
        mesh.middle_sample(samples, 0.5 * (from + to), opposite)
    }

    fn is_uneven(
        &self,
        mesh: &Mesh,
        column: &Column,
        suspect: &Suspect,
        middles: &FxHashMap<(SampleId, SampleId), f32>,
    ) -> bool {
        let element = mesh.element(suspect.element);
        let weight = self.weights[self.world.faces[element.face.index()].material as usize];
        (0..3).any(|k| {
            let (a, b) = edge_key(element.samples[k], element.samples[(k + 1) % 3]);
            let deviation = f64::from(middles[&(a, b)]) - 0.5 * (column.front(a) + column.front(b));
            weight * deviation.abs() > UNEVEN
        })
    }

}

/// Keeps the computed values of all middles that have become samples.
fn keep_middles(
    mesh: &Mesh,
    column: &mut Column,
    suspects: &[Suspect],
    middles: &FxHashMap<(SampleId, SampleId), f32>,
) {
    for suspect in suspects {
        let samples = mesh.element(suspect.element).samples;
        for k in 0..3 {
            let (a, b) = edge_key(samples[k], samples[(k + 1) % 3]);
            if let Some(middle) = mesh.sample_midpoint(a, b) {
                column.set_front(middle, middles[&(a, b)]);
            }
        }
    }
}
