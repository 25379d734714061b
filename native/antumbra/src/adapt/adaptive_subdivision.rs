//! Adaptive subdivision, "AS" (the paper, §2.2): an element is quartered where it is lit unevenly, and each quarter is
//! looked at in turn.

use glam::DVec3;

use crate::adapt::refinable::{Leaf, Refinable};
use crate::index::ElementId;
use crate::mesh::{Quartering, Sample};
use crate::visibility::Receiver;

impl Refinable for Quartering<'_> {
    fn samples(&self) -> &[Sample] {
        &self.mesh.samples
    }

    fn leaves(&self) -> Vec<ElementId> {
        self.mesh.leaves_of_baked(self.world)
    }

    fn is_anchored(&self, id: ElementId, edge: usize) -> bool {
        let samples = self.mesh.element(id).samples;
        self.mesh.sample_midpoint(samples[edge], samples[(edge + 1) % 3]).is_some()
    }

    fn leaf(&self, id: ElementId) -> Option<Leaf> {
        let element = self.mesh.element(id);
        let leaf = Leaf { face: element.face, samples: element.samples, area: element.area };
        element.is_leaf().then_some(leaf)
    }

    fn may_refine(&self, id: ElementId) -> bool {
        let element = self.mesh.element(id);
        element.level < self.deepest[element.face.index()]
    }

    fn middle(&self, id: ElementId, edge: usize) -> Sample {
        let element = self.mesh.element(id);
        let [from, to, opposite] = [edge, (edge + 1) % 3, (edge + 2) % 3];
        let ends = [element.samples[from], element.samples[to]];
        if let Some(existing) = self.mesh.sample_midpoint(ends[0], ends[1]) {
            return self.mesh.sample(existing).clone();
        }
        self.mesh.middle_sample(ends, [from, to, opposite].map(|k| element.vertices[k]))
    }

    fn centroid(&self, id: ElementId) -> Receiver {
        let element = self.mesh.element(id);
        let normals: DVec3 = element.samples.iter().map(|&s| self.mesh.sample(s).normal).sum();
        let positions = self.mesh.positions(element);
        let face = &self.world.faces[element.face.index()];
        let normal = normals.try_normalize().unwrap_or(face.normal);
        let middle = (positions[0] + positions[1] + positions[2]) / 3.0;
        Receiver::new(middle, normal).of(face.object.index() as u32)
    }

    fn refine(&mut self, id: ElementId, _: [f64; 3], fresh: &mut Vec<ElementId>) {
        let mut subdivided = Vec::new();
        self.mesh.subdivide(id, &mut subdivided);
        fresh
            .extend(subdivided.iter().filter_map(|&element| self.mesh.element(element).children()).flatten());
    }

    fn removes(&self) -> f64 {
        // The error of a linear interpolant falls with the square of the size.
        15.0 / 16.0
    }

    fn adds(&self) -> usize {
        1
    }

    fn triangles(&self) -> usize {
        self.mesh.triangles
    }
}
