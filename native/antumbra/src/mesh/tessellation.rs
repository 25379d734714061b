//! A flat mesh of triangles that is bisected and flipped instead of quartered: elements of any shape.
//!
//! Along a penumbra light changes only across it, so elements should be long and thin there (DESIGN: triangles are
//! judged by their error, never by their angle). Faces are first cut along shadow lines, then edges are split in half
//! where the light in their middle is wrong, for all triangles that share the edge, so the mesh conforms at every
//! moment: no T-vertices and nothing to anchor (the paper, §3.3). Edges inside a face that lie on no line may be
//! flipped.
//!
//! Guarantees: every triangle has a positive area on its face's integer grid, exactly; the triangles of a face tile
//! it; a vertex on an edge between faces is one vertex for all of them.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::index::{ElementId, FaceId, SampleId, VertexId};
use crate::mesh::arrangement::LineKind;
use crate::mesh::grid::{GRID, GridPoint};
use crate::mesh::{Corner, Sample, edge_key, longest_edge, relative_step};
use crate::scene::world::{World, interpolated};

/// A triangle of a face.
#[derive(Debug, Clone)]
pub(crate) struct Tile {
    pub(crate) face: FaceId,
    pub(crate) vertices: [VertexId; 3],
    /// Where its corners are on the face's grid.
    pub(crate) points: [GridPoint; 3],
    pub(crate) samples: [SampleId; 3],
    /// Per edge (corner k to k + 1): the line it lies on.
    pub(crate) lines: [Option<LineKind>; 3],
    /// How many times it was bisected.
    pub(crate) level: u8,
    /// Replaced tiles stay in the list, so that numbers stay what they are.
    pub(crate) live: bool,
}

/// The display mesh of the discontinuity methods.
#[derive(Debug)]
pub(crate) struct Tessellation<'a> {
    pub(crate) world: &'a World,
    pub(crate) tiles: Vec<Tile>,
    pub(crate) positions: Vec<DVec3>,
    pub(crate) samples: Vec<Sample>,
    /// Live tiles.
    pub(crate) live: usize,
    /// Deepest level that tiles may reach.
    pub(crate) deepest: u8,
    /// The first samples, which are those of the faces' corners.
    pub(crate) shared_samples: usize,
    /// No edge is flipped into one longer than this, metres.
    pub(crate) longest_edge: f64,
    /// No flip makes a triangle of less height than this share of its longest edge.
    pub(crate) flattest: f64,
    edges: FxHashMap<(VertexId, VertexId), SmallVec<[ElementId; 2]>>,
}

/// Edges shorter than this on the grid are not split: their middle would be rounded by more than a hundredth of them.
const SHORTEST: i32 = 128;

/// No flip makes a triangle of less height than this share of its longest edge: a thousand times what single precision rounds
/// coordinates of its size to. Below a lamp a chain of flips once ended in one without area, over which nothing is
/// interpolated.
const FLATTEST: f64 = 1e-4;

impl<'a> Tessellation<'a> {
    pub(crate) fn empty(world: &'a World, deepest: u8) -> Self {
        Self {
            world,
            tiles: Vec::new(),
            positions: Vec::new(),
            samples: Vec::new(),
            live: 0,
            deepest,
            shared_samples: 0,
            longest_edge: f64::INFINITY,
            flattest: FLATTEST,
            edges: FxHashMap::default(),
        }
    }

    pub(crate) fn tile(&self, id: ElementId) -> &Tile {
        &self.tiles[id.index()]
    }

    /// Adds a tile.
    pub(crate) fn push(&mut self, tile: Tile) -> ElementId {
        let id = ElementId::new(self.tiles.len());
        for k in 0..3 {
            let key = edge_key(tile.vertices[k], tile.vertices[(k + 1) % 3]);
            self.edges.entry(key).or_default().push(id);
        }
        self.tiles.push(tile);
        self.live += 1;
        id
    }

    fn remove(&mut self, id: ElementId) {
        let Tile { vertices, .. } = self.tiles[id.index()];
        for k in 0..3 {
            let key = edge_key(vertices[k], vertices[(k + 1) % 3]);
            if let Some(around) = self.edges.get_mut(&key) {
                around.retain(|&mut other| other != id);
                if around.is_empty() {
                    self.edges.remove(&key);
                }
            }
        }
        self.tiles[id.index()].live = false;
        self.live -= 1;
    }

    /// The tiles on an edge.
    pub(crate) fn around(&self, edge: (VertexId, VertexId)) -> &[ElementId] {
        self.edges.get(&edge).map_or(&[], |around| around.as_slice())
    }

    /// Area of a tile, m²: its share of the grid times its face's.
    pub(crate) fn area(&self, tile: &Tile) -> f64 {
        let share = double_area(tile.points) as f64 / (f64::from(GRID) * f64::from(GRID));
        share * self.world.faces[tile.face.index()].area
    }

    /// The sample in the middle of an edge of a tile, made or not.
    pub(crate) fn middle_sample(&self, id: ElementId, k: usize) -> Sample {
        let tile = self.tile(id);
        let [from, to] = [k, (k + 1) % 3];
        let [a, b] = [tile.samples[from], tile.samples[to]];
        let ends = [from, to].map(|k| tile.vertices[k]);
        let length = self.positions[ends[0].index()].distance(self.positions[ends[1].index()]);
        // All tiles on this side of a crease or contact share the sample, so it must be the same seen from each.
        let mut step = DVec3::ZERO;
        let around = self.around(edge_key(ends[0], ends[1]));
        let position = self.middle_position(around[0], ends);
        let sharing =
            around.iter().filter_map(|&other| Some((self.tile(other), self.edge_with(other, a, b)?)));
        for (other, k) in sharing.clone() {
            let way = 0.5 * (self.positions[other.vertices[(k + 2) % 3].index()] - position);
            let inside = self.area(other) / length;
            let face = &self.world.faces[other.face.index()];
            step += way * relative_step(inside, longest_edge(self.world.corners(face)));
        }
        let sides = sharing.count();
        let one_sided = sides < 2 || tile.lines[k].is_some_and(LineKind::jumps);
        let needs_step = tile.lines[k].is_some()
            || GridPoint::common_edge(tile.points[from], tile.points[to]).is_some()
            || self.world.faces[tile.face.index()].corner_normals.is_some();
        let inward = if needs_step { step / sides.max(1) as f64 } else { DVec3::ZERO };
        let (a, b) = edge_key(a, b);
        let sum = self.samples[a.index()].normal + self.samples[b.index()].normal;
        Sample {
            position,
            normal: sum.try_normalize().unwrap_or(self.samples[a.index()].normal),
            inward,
            one_sided,
            in_plane: tile.lines[k] == Some(LineKind::Sharp)
                && self.world.faces[tile.face.index()].corner_normals.is_none(),
            object: self.samples[a.index()].object,
            parents: Some([a, b]),
        }
    }

    /// A sample inside a face, where no step to any side is needed.
    pub(crate) fn inner_sample(&self, position: DVec3, normal: DVec3, parents: [SampleId; 2]) -> Sample {
        Sample {
            position,
            normal: normal.try_normalize().unwrap_or(self.samples[parents[0].index()].normal),
            inward: DVec3::ZERO,
            one_sided: false,
            in_plane: false,
            object: self.samples[parents[0].index()].object,
            parents: Some(parents),
        }
    }

    /// The edge of a tile that joins two samples.
    fn edge_with(&self, id: ElementId, a: SampleId, b: SampleId) -> Option<usize> {
        let samples = self.tile(id).samples;
        (0..3).find(|&k| edge_key(samples[k], samples[(k + 1) % 3]) == edge_key(a, b))
    }

    /// Splits an edge in half for all tiles on it. New tiles are appended. `false` when the grid is too coarse for it.
    pub(crate) fn bisect(&mut self, id: ElementId, k: usize, fresh: &mut Vec<ElementId>) -> bool {
        let tile = self.tile(id);
        let edge = edge_key(tile.vertices[k], tile.vertices[(k + 1) % 3]);
        let around: SmallVec<[ElementId; 4]> = self.around(edge).iter().copied().collect();
        let halves: SmallVec<[(usize, GridPoint); 4]> = (around.iter())
            .map(|&other| {
                let tile = self.tile(other);
                let k = (0..3)
                    .find(|&k| edge_key(tile.vertices[k], tile.vertices[(k + 1) % 3]) == edge)
                    .expect("a tile is listed at its own edges; this is a bug in antumbra");
                (k, self.middle_point(tile, k))
            })
            .collect();
        let splits_well = |&other: &ElementId, &(k, middle): &(usize, GridPoint)| {
            let points = self.tile(other).points;
            let [a, b, c] = [k, k + 1, k + 2].map(|i| points[i % 3]);
            let length = (a.u - b.u).abs().max((a.v - b.v).abs());
            length >= SHORTEST && double_area([a, middle, c]) > 0 && double_area([middle, b, c]) > 0
        };
        if !around.iter().zip(&halves).all(|(other, half)| splits_well(other, half)) {
            return false;
        }
        let middle = VertexId::new(self.positions.len());
        self.positions.push(self.middle_position(around[0], [edge.0, edge.1]));
        // One sample per side of a crease or contact
        let mut made: SmallVec<[((SampleId, SampleId), SampleId); 2]> = SmallVec::new();
        let samples: SmallVec<[SampleId; 4]> = (around.iter().zip(&halves))
            .map(|(&other, &(k, _))| {
                let samples = self.tile(other).samples;
                let key = edge_key(samples[k], samples[(k + 1) % 3]);
                if let Some((_, sample)) = made.iter().find(|(known, _)| *known == key) {
                    return *sample;
                }
                let sample = self.middle_sample(other, k);
                self.samples.push(sample);
                let sample = SampleId::new(self.samples.len() - 1);
                made.push((key, sample));
                sample
            })
            .collect();
        for ((&other, &(k, point)), &sample) in around.iter().zip(&halves).zip(&samples) {
            let tile = self.tile(other).clone();
            self.remove(other);
            let [a, b, c] = [k, (k + 1) % 3, (k + 2) % 3];
            let half = |corners: [(VertexId, GridPoint, SampleId); 3], lines| Tile {
                vertices: corners.map(|corner| corner.0),
                points: corners.map(|corner| corner.1),
                samples: corners.map(|corner| corner.2),
                lines,
                level: tile.level + 1,
                ..tile.clone()
            };
            let at = |i: usize| (tile.vertices[i], tile.points[i], tile.samples[i]);
            let at_middle = (middle, point, sample);
            fresh.push(self.push(half([at(a), at_middle, at(c)], [tile.lines[a], None, tile.lines[c]])));
            fresh.push(self.push(half([at_middle, at(b), at(c)], [tile.lines[a], tile.lines[b], None])));
        }
        true
    }

    /// Bisects the longest edges until none is longer than `size`, metres, or there are `most` tiles, or it ends.
    ///
    /// The longest of all come first, so that they are the longest of every tile beside them as well (Rivara 1984): in
    /// any other order neighbours that are split along their short edges become fans of slivers without end.
    pub(crate) fn bisect_to(&mut self, size: f64, most: usize, ends: &dyn Fn() -> bool) {
        let mut open = BinaryHeap::new();
        let mut fresh: Vec<ElementId> = ElementId::range(0..self.tiles.len()).collect();
        loop {
            for id in fresh.drain(..).filter(|&id| self.tile(id).live) {
                let corners = self.tile(id).vertices.map(|v| self.positions[v.index()]);
                let length = |k: usize| corners[k].distance_squared(corners[(k + 1) % 3]);
                let longest = (1..3).fold(0, |most, k| if length(k) > length(most) { k } else { most });
                if length(longest) > size * size {
                    // The bits of positive numbers are in the order of their values.
                    open.push((length(longest).to_bits(), Reverse(id), longest));
                }
            }
            let Some((_, Reverse(id), longest)) = open.pop().filter(|_| self.live < most && !ends()) else {
                break;
            };
            if self.tile(id).live {
                self.bisect(id, longest, &mut fresh);
            }
        }
        self.tiles.iter_mut().for_each(|tile| tile.level = 0);
    }

    /// The middle of an edge on the grid. On an edge between faces it is rounded in the direction of the edge's
    /// vertices, so that all faces get the same point.
    fn middle_point(&self, tile: &Tile, k: usize) -> GridPoint {
        let [a, b] = [k, (k + 1) % 3].map(|i| tile.points[i]);
        let Some(edge) = (0..3).find(|&e| a.edge_position(e).is_some() && b.edge_position(e).is_some())
        else {
            return GridPoint::middle(a, b);
        };
        let vertices = self.world.faces[tile.face.index()].vertices;
        let forwards = vertices[edge] < vertices[(edge + 1) % 3];
        let [p, q] = [a, b].map(|point| {
            let position = point.edge_position(edge).expect("it lies on the edge; this is a bug in antumbra");
            if forwards { position } else { GRID - position }
        });
        let middle = i32::midpoint(p, q);
        GridPoint::on_edge(edge, if forwards { middle } else { GRID - middle })
    }

    /// Where the middle of a tile's edge is on the grid, in the world: light is known there, not half a cell beside it.
    fn middle_position(&self, id: ElementId, ends: [VertexId; 2]) -> DVec3 {
        let tile = self.tile(id);
        let k = (0..3)
            .find(|&k| edge_key(tile.vertices[k], tile.vertices[(k + 1) % 3]) == edge_key(ends[0], ends[1]))
            .expect("a tile is listed at its own edges; this is a bug in antumbra");
        let weights = self.middle_point(tile, k).barycentric();
        interpolated(self.world.corners(&self.world.faces[tile.face.index()]), weights)
    }

    /// Whether a tile still has an area once its corners are rounded to single precision.
    fn is_wide_enough(&self, tile: &Tile) -> bool {
        let [a, b, c] = tile.vertices.map(|v| self.positions[v.index()]);
        let longest = longest_edge([a, b, c]);
        double_area(tile.points) > 0 && (b - a).cross(c - a).length() >= self.flattest * longest * longest
    }

    /// The two tiles on an edge as they would be after a flip, if that is possible: same face, same samples, no line,
    /// and strictly convex.
    pub(crate) fn flipped(&self, id: ElementId, k: usize) -> Option<(ElementId, [Tile; 2])> {
        let one = self.tile(id);
        if one.lines[k].is_some() {
            return None;
        }
        let [a, b, c] = [k, (k + 1) % 3, (k + 2) % 3];
        let &[first, second] = self.around(edge_key(one.vertices[a], one.vertices[b])) else { return None };
        let other_id = if first == id { second } else { first };
        let other = self.tile(other_id);
        // The other tile runs the edge from b to a.
        let j = (0..3).find(|&j| other.vertices[j] == one.vertices[b])?;
        let [ob, oa, od] = [j, (j + 1) % 3, (j + 2) % 3];
        let same = other.face == one.face
            && other.vertices[oa] == one.vertices[a]
            && other.samples[oa] == one.samples[a]
            && other.samples[ob] == one.samples[b]
            && one.vertices[c] != other.vertices[od];
        let [from, to] = [one.vertices[c], other.vertices[od]].map(|v| self.positions[v.index()]);
        if !same || from.distance(to) > self.longest_edge {
            return None;
        }
        let build = |corners: [(&Tile, usize); 3], lines| Tile {
            face: one.face,
            vertices: corners.map(|(tile, i)| tile.vertices[i]),
            points: corners.map(|(tile, i)| tile.points[i]),
            samples: corners.map(|(tile, i)| tile.samples[i]),
            lines,
            level: one.level.max(other.level),
            live: true,
        };
        // Around the quadrilateral a, d, b, c
        let then = [
            build([(one, a), (other, od), (one, c)], [other.lines[oa], None, one.lines[c]]),
            build([(other, od), (one, b), (one, c)], [other.lines[od], one.lines[b], None]),
        ];
        then.iter().all(|tile| self.is_wide_enough(tile)).then_some((other_id, then))
    }

    /// Replaces two tiles by two others over the same area. New tiles are appended.
    pub(crate) fn replace(&mut self, old: [ElementId; 2], new: [Tile; 2], fresh: &mut Vec<ElementId>) {
        for id in old {
            self.remove(id);
        }
        fresh.extend(new.into_iter().map(|tile| self.push(tile)));
    }

    /// The triangles of a face.
    pub(crate) fn corners(tile: &Tile) -> [Corner; 3] {
        std::array::from_fn(|k| Corner {
            vertex: tile.vertices[k],
            samples: [tile.samples[k]; 2],
            barycentric: tile.points[k].barycentric(),
        })
    }
}

/// Twice the area of a triangle on the grid, exact; positive when it runs like its face.
fn double_area([a, b, c]: [GridPoint; 3]) -> i64 {
    let [bu, bv] = [b.u - a.u, b.v - a.v].map(i64::from);
    let [cu, cv] = [c.u - a.u, c.v - a.v].map(i64::from);
    bu * cv - bv * cu
}
