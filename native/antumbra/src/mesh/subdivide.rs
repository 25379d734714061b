//! Regular four-to-one subdivision with the restriction of the paper's §3.3: where levels of neighbours would differ
//! by more than one, the coarser neighbour is subdivided first.

use glam::DVec3;

use crate::index::{ElementId, SampleId, VertexId};
use crate::mesh::{Element, Mesh, ONE_SIDED_STEP, Sample, Vertex, edge_key};

impl Mesh {
    /// Subdivides a leaf, and before it every leaf that would otherwise be more than one level coarser than its
    /// neighbour. All elements that were subdivided are appended to `subdivided`, neighbours first.
    pub(crate) fn subdivide(&mut self, element: ElementId, subdivided: &mut Vec<ElementId>) {
        let mut pending = vec![element];
        while let Some(&next) = pending.last() {
            if !self.element(next).is_leaf() {
                pending.pop();
                continue;
            }
            let before = pending.len();
            let [a, b, c] = self.element(next).vertices;
            for (from, to) in [(a, b), (b, c), (c, a)] {
                self.push_coarser_neighbours(from, to, &mut pending);
            }
            if pending.len() == before {
                self.quarter(next);
                subdivided.push(next);
                pending.pop();
            }
        }
    }

    /// If the edge is one half of a longer edge, the leaves on the longer edge.
    fn push_coarser_neighbours(&self, a: VertexId, b: VertexId, pending: &mut Vec<ElementId>) {
        for (end, middle) in [(a, b), (b, a)] {
            let Some([p, q]) = self.vertices[middle.index()].parents else { continue };
            if end != p && end != q {
                continue;
            }
            if let Some(neighbours) = self.edge_elements.get(&edge_key(p, q)) {
                pending.extend(neighbours.iter().copied().filter(|&n| self.element(n).is_leaf()));
            }
        }
    }

    fn quarter(&mut self, id: ElementId) {
        let parent = self.element(id).clone();
        let [a, b, c] = parent.vertices;
        let [sa, sb, sc] = parent.samples;
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| self.split_edge(p, q));
        let [sab, sbc, sca] = [(sa, sb, ab, c), (sb, sc, bc, a), (sc, sa, ca, b)]
            .map(|(p, q, middle, opposite)| self.split_sample_edge(p, q, middle, opposite));
        let child = |vertices, samples| Element {
            face: parent.face,
            vertices,
            samples,
            first_child: None,
            level: parent.level + 1,
            area: 0.25 * parent.area,
        };
        let first = self.push(child([a, ab, ca], [sa, sab, sca]));
        self.push(child([ab, b, bc], [sab, sb, sbc]));
        self.push(child([ca, bc, c], [sca, sbc, sc]));
        self.push(child([ab, bc, ca], [sab, sbc, sca]));
        self.elements[id.index()].first_child = Some(first);
        self.leaves += 3;
        self.triangles += 3;
    }

    fn split_edge(&mut self, a: VertexId, b: VertexId) -> VertexId {
        let (a, b) = edge_key(a, b);
        // A leaf whose edge is split on the other side only is anchored, which costs it one triangle.
        let leaves = self.edge_elements[&(a, b)].iter().filter(|&&e| self.element(e).is_leaf()).count();
        if let Some(&existing) = self.vertex_midpoints.get(&(a, b)) {
            self.triangles -= 1;
            return existing;
        }
        self.triangles += leaves - 1;
        let position = 0.5 * (self.vertices[a.index()].position + self.vertices[b.index()].position);
        let middle = VertexId::new(self.vertices.len());
        self.vertices.push(Vertex { position, parents: Some([a, b]) });
        self.vertex_midpoints.insert((a, b), middle);
        middle
    }

    fn split_sample_edge(
        &mut self,
        a: SampleId,
        b: SampleId,
        middle: VertexId,
        opposite: VertexId,
    ) -> SampleId {
        let key = edge_key(a, b);
        if let Some(&existing) = self.sample_midpoints.get(&key) {
            return existing;
        }
        let [position, opposite] = [middle, opposite].map(|v| self.vertices[v.index()].position);
        let sample = self.middle_sample([a, b], position, opposite);
        self.samples.push(sample);
        let id = SampleId::new(self.samples.len() - 1);
        self.sample_midpoints.insert(key, id);
        id
    }

    /// The sample in the middle of an edge of an element, whose third corner is `opposite`.
    pub(crate) fn middle_sample(&self, ends: [SampleId; 2], position: DVec3, opposite: DVec3) -> Sample {
        let (a, b) = edge_key(ends[0], ends[1]);
        let sum = self.sample(a).normal + self.sample(b).normal;
        Sample {
            position,
            // Opposite normals have no mean; either is as good.
            normal: sum.try_normalize().unwrap_or(self.sample(a).normal),
            inward: (opposite - position) * (0.5 * ONE_SIDED_STEP),
            parents: Some([a, b]),
        }
    }
}
