//! Regular four-to-one subdivision with the restriction of the paper's §3.3: where levels of neighbours would differ
//! by more than one, the coarser neighbour is subdivided first.

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
        let [sab, sbc, sca] = [([sa, sb], [a, b, c]), ([sb, sc], [b, c, a]), ([sc, sa], [c, a, b])]
            .map(|(ends, vertices)| self.split_sample_edge(ends, vertices));
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

    fn split_sample_edge(&mut self, ends: [SampleId; 2], vertices: [VertexId; 3]) -> SampleId {
        let key = edge_key(ends[0], ends[1]);
        if let Some(&existing) = self.sample_midpoints.get(&key) {
            return existing;
        }
        let sample = self.middle_sample(ends, vertices);
        self.samples.push(sample);
        let id = SampleId::new(self.samples.len() - 1);
        self.sample_midpoints.insert(key, id);
        id
    }

    /// The sample in the middle of an edge of an element.
    ///
    /// `vertices`: the edge's ends, then the element's third corner.
    pub(crate) fn middle_sample(&self, ends: [SampleId; 2], vertices: [VertexId; 3]) -> Sample {
        let [from, to, opposite] = vertices.map(|v| self.vertices[v.index()].position);
        let position = 0.5 * (from + to);
        let (a, b) = edge_key(ends[0], ends[1]);
        let sum = self.sample(a).normal + self.sample(b).normal;
        Sample {
            position,
            // Opposite normals have no mean; either is as good.
            normal: sum.try_normalize().unwrap_or(self.sample(a).normal),
            inward: (opposite - position) * (0.5 * ONE_SIDED_STEP),
            one_sided: !self.has_both_sides([vertices[0], vertices[1]], ends),
            in_plane: false,
            object: self.sample(a).object,
            parents: Some([a, b]),
        }
    }

    /// Whether elements on both sides of an edge share its samples.
    fn has_both_sides(&self, mut vertices: [VertexId; 2], mut ends: [SampleId; 2]) -> bool {
        // A coarser neighbour has a longer edge that this one is a half of.
        while let Some((whole, samples)) = [0, 1].into_iter().find_map(|k| {
            let whole = self.vertices[vertices[k].index()].parents?;
            let samples = self.sample(ends[k]).parents?;
            whole.contains(&vertices[1 - k]).then_some((whole, samples))
        }) {
            (vertices, ends) = (whole, samples);
        }
        self.edge_elements.get(&edge_key(vertices[0], vertices[1])).is_some_and(|around| {
            let shares = |&&id: &&ElementId| ends.iter().all(|end| self.element(id).samples.contains(end));
            around.iter().filter(shares).count() > 1
        })
    }
}
