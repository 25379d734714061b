//! Bisection of the edges whose middle is wrong, with flips that lower the error: how the discontinuity methods refine
//! what their lines have left.
//!
//! Goes beyond the paper, which subdivides regularly between its lines. Edges along a penumbra have no error and are
//! never split, so elements become long and thin there by themselves.

use glam::DVec3;

use crate::adapt::refinable::{Flip, Leaf, Refinable};
use crate::index::ElementId;
use crate::mesh::{Sample, Tessellation, Tile, edge_key};
use crate::visibility::Receiver;

fn leaf(mesh: &Tessellation, tile: &Tile) -> Leaf {
    Leaf { face: tile.face, samples: tile.samples, area: mesh.area(tile) }
}

fn centroid(mesh: &Tessellation, tile: &Tile) -> Receiver {
    let normals: DVec3 = tile.samples.iter().map(|s| mesh.samples[s.index()].normal).sum();
    let positions: DVec3 = tile.vertices.iter().map(|v| mesh.positions[v.index()]).sum();
    let face = &mesh.world.faces[tile.face.index()];
    let normal = normals.try_normalize().unwrap_or(face.normal);
    Receiver::new(positions / 3.0, normal).of(face.object.index() as u32)
}

impl Refinable for Tessellation<'_> {
    fn samples(&self) -> &[Sample] {
        &self.samples
    }

    fn leaves(&self) -> Vec<ElementId> {
        ElementId::range(0..self.tiles.len()).filter(|&id| self.tile(id).live).collect()
    }

    fn leaf(&self, id: ElementId) -> Option<Leaf> {
        let tile = self.tile(id);
        tile.live.then(|| leaf(self, tile))
    }

    fn may_refine(&self, id: ElementId) -> bool {
        self.tile(id).live && self.tile(id).level < self.deepest
    }

    fn middle(&self, id: ElementId, edge: usize) -> Sample {
        self.middle_sample(id, edge)
    }

    fn centroid(&self, id: ElementId) -> Receiver {
        centroid(self, self.tile(id))
    }

    fn refine(&mut self, id: ElementId, squared_deviations: [f64; 3], fresh: &mut Vec<ElementId>) {
        let mut edges = [0, 1, 2];
        edges.sort_by(|&i, &j| squared_deviations[j].total_cmp(&squared_deviations[i]));
        if squared_deviations == [0.0; 3] {
            // Only the middle is wrong.
            let tile = self.tile(id);
            let corners = tile.vertices.map(|v| self.positions[v.index()]);
            let length = |k: usize| corners[k].distance_squared(corners[(k + 1) % 3]);
            edges.sort_by(|&i, &j| length(j).total_cmp(&length(i)));
        }
        for edge in edges {
            if self.bisect(id, edge, fresh) {
                return;
            }
        }
        // The grid holds nothing finer.
        let deepest = self.deepest;
        self.tiles[id.index()].level = deepest;
    }

    fn removes(&self) -> f64 {
        // Bisecting an edge leaves a sixteenth of its own squared error, and that of the other edges.
        0.5
    }

    fn adds(&self) -> usize {
        2
    }

    fn triangles(&self) -> usize {
        self.live
    }

    fn flips(&self, fresh: &[ElementId]) -> Vec<Flip> {
        let mut flips: Vec<Flip> = Vec::new();
        for &id in fresh {
            let tile = self.tile(id);
            if !tile.live {
                continue;
            }
            for k in 0..3 {
                let Some((other, then)) = self.flipped(id, k) else { continue };
                let [c, d] = [then[0].samples[2], then[0].samples[1]];
                let middle_position = 0.5
                    * (self.positions[then[0].vertices[2].index()]
                        + self.positions[then[0].vertices[1].index()]);
                let normal = self.samples[c.index()].normal + self.samples[d.index()].normal;
                let (a, b) = edge_key(c, d);
                flips.push(Flip {
                    now: [leaf(self, tile), leaf(self, self.tile(other))],
                    then: [leaf(self, &then[0]), leaf(self, &then[1])],
                    elements: [id, other],
                    centroids: [centroid(self, &then[0]), centroid(self, &then[1])],
                    edge: (a, b),
                    middle: self.inner_sample(middle_position, normal, [a, b]),
                });
            }
        }
        flips
    }

    fn flip(&mut self, flip: &Flip, fresh: &mut Vec<ElementId>) {
        let [id, other] = flip.elements;
        if !self.tile(id).live || !self.tile(other).live {
            return;
        }
        let edge = (0..3).find(|&k| self.flipped(id, k).is_some_and(|(found, _)| found == other));
        if let Some((_, then)) = edge.and_then(|k| self.flipped(id, k)) {
            self.replace([id, other], then, fresh);
        }
    }
}
