//! The tessellation before any refinement: faces cut along their lines (the paper, §3.2 case 5b: "the element is
//! subdivided accordingly").
//!
//! Lines end on the edges of faces; a point on an edge is made once, from its position along the edge's own
//! direction, for all faces that share it. Where a line is a contact, light has one value on each side: corners
//! around a vertex are told apart by the contacts that leave it, each sector with a sample of its own.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::index::{ElementId, FaceId, SampleId, VertexId};
use crate::mesh::arrangement::{Line, LineKind, Partition, border_crossings, partition};
use crate::mesh::corner_groups::{Rim, group_corners};
use crate::mesh::grading::{Grading, graded};
use crate::mesh::grid::GRID;
use crate::mesh::tessellation::{Tessellation, Tile};
use crate::mesh::{Sample, edge_key, longest_edge, relative_step};
use crate::scene::world::{Face, World, interpolated};
use crate::threads::AT_A_TIME;

/// Ends of lines on an edge that are nearer to each other or to its ends than this, in cells of the grid, become one:
/// the two faces beside an edge round the same point differently. A ten-millionth of the edge.
const SAME_POINT: i32 = 8;

/// What was made of the lines.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Cutting {
    /// Lines that went into the mesh.
    pub(crate) lines: usize,
    /// Faces whose lines could not be arranged, and which are refined without.
    pub(crate) plain_faces: usize,
}

/// Cuts the faces for which `which` holds.
///
/// `lines`: per face. `deepest`: how often tiles may be bisected. `grading`: how evenly faces are cut besides; only as the
/// lines have it where there is none.
pub(crate) fn tessellate<'a>(
    world: &'a World,
    lines: &FxHashMap<FaceId, Vec<Line>>,
    which: impl Fn(FaceId) -> bool,
    deepest: u8,
    grading: Option<Grading>,
) -> (Tessellation<'a>, Cutting) {
    let (samples, corner_samples) = group_corners(world);
    let mut mesh = Tessellation::empty(world, deepest);
    mesh.positions.clone_from(&world.vertices);
    mesh.shared_samples = samples.len();
    mesh.samples = samples;
    let mut builder = Builder {
        border: border_points(world, lines, &which, grading),
        grading,
        corner_samples,
        mesh,
        edge_samples: FxHashMap::default(),
    };

    let faces: Vec<FaceId> = FaceId::range(0..world.faces.len()).filter(|&face| which(face)).collect();
    let partitions: Vec<(Partition, bool)> =
        (faces.par_iter().with_max_len(AT_A_TIME)).map(|&face| builder.cut(face, lines.get(&face))).collect();
    let mut cutting = Cutting::default();
    for (&face, (partition, arranged)) in faces.iter().zip(&partitions) {
        builder.add(face, partition);
        cutting.plain_faces += usize::from(!arranged);
        if *arranged {
            cutting.lines += lines.get(&face).map_or(0, Vec::len);
        }
    }
    builder.separate_sides();
    builder.step_inwards();
    (builder.mesh, cutting)
}

type WorldEdge = (u32, u32);

/// A point of an edge of the scene, as seen from one side of a crease: the samples at the edge's ends tell the sides.
type EdgePlace = (WorldEdge, i32, (SampleId, SampleId));

/// Vertices and positions, in the direction from the smaller vertex, of the points on every edge.
fn border_points(
    world: &World,
    lines: &FxHashMap<FaceId, Vec<Line>>,
    which: impl Fn(FaceId) -> bool,
    grading: Option<Grading>,
) -> FxHashMap<WorldEdge, Vec<i32>> {
    let mut border: FxHashMap<WorldEdge, Vec<i32>> = FxHashMap::default();
    if let Some(grading) = grading {
        for id in FaceId::range(0..world.faces.len()).filter(|&face| which(face)) {
            let face = &world.faces[id.index()];
            let corners = world.corners(face);
            for k in 0..3 {
                let edge = edge_key(face.vertices[k], face.vertices[(k + 1) % 3]);
                border
                    .entry(edge)
                    .or_insert_with(|| grading.on_edge(corners[k].distance(corners[(k + 1) % 3])).collect());
            }
        }
    }
    for (face, lines) in lines {
        let vertices = world.faces[face.index()].vertices;
        for (k, positions) in border_crossings(lines).into_iter().enumerate() {
            let [from, to] = [vertices[k], vertices[(k + 1) % 3]];
            let forwards = positions.into_iter().map(|p| if from < to { p } else { GRID - p });
            border.entry(edge_key(from, to)).or_default().extend(forwards);
        }
    }
    for positions in border.values_mut() {
        positions.sort_unstable();
        let mut last = 0;
        positions.retain(|&position| {
            let apart = position - last > SAME_POINT && GRID - position > SAME_POINT;
            if apart {
                last = position;
            }
            apart
        });
    }
    border
}

struct Builder<'a> {
    mesh: Tessellation<'a>,
    corner_samples: Vec<[SampleId; 3]>,
    /// Per edge of the scene: positions of points on it, and, once made, the first one's vertex.
    border: FxHashMap<WorldEdge, Vec<i32>>,
    grading: Option<Grading>,
    /// Samples of points on edges: for the edge's two samples, on each side of a crease.
    edge_samples: FxHashMap<EdgePlace, (VertexId, SampleId)>,
}

impl Builder<'_> {
    fn face(&self, face: FaceId) -> &Face {
        &self.mesh.world.faces[face.index()]
    }

    /// A face's border points along each of its edges, in its own direction.
    fn border_of(&self, face: FaceId) -> [Vec<i32>; 3] {
        let vertices = self.face(face).vertices;
        std::array::from_fn(|k| {
            let [from, to] = [vertices[k], vertices[(k + 1) % 3]];
            let Some(positions) = self.border.get(&edge_key(from, to)) else { return Vec::new() };
            if from < to { positions.clone() } else { positions.iter().rev().map(|&p| GRID - p).collect() }
        })
    }

    /// Cuts one face; `false` when it had to do without its lines.
    fn cut(&self, face: FaceId, lines: Option<&Vec<Line>>) -> (Partition, bool) {
        let border = self.border_of(face);
        let border = border.each_ref().map(Vec::as_slice);
        let shape = flattened(self.mesh.world.corners(self.face(face)));
        let (partition, arranged) = match partition(border, lines.map_or(&[], Vec::as_slice), Some(shape)) {
            Ok(partition) => (partition, true),
            Err(_) => (Partition::plain(border, Some(shape)), false),
        };
        let graded = self.grading.and_then(|grading| graded(&partition, border, shape, grading));
        (graded.unwrap_or(partition), arranged)
    }

    /// Makes the vertices, samples and tiles of a face.
    fn add(&mut self, id: FaceId, partition: &Partition) {
        let face = self.face(id).clone();
        let corners = self.mesh.world.corners(&face);
        let at_corners = self.corner_samples[id.index()];
        let made: Vec<(VertexId, SampleId)> = (partition.points.iter().enumerate())
            .map(|(index, &point)| {
                if index < 3 {
                    return (VertexId::new(face.vertices[index] as usize), at_corners[index]);
                }
                let weights = point.barycentric();
                let position = interpolated(corners, weights);
                if let Some((k, along)) = (0..3).find_map(|k| Some((k, point.edge_position(k)?))) {
                    self.on_edge(&face, at_corners, k, along, position)
                } else {
                    let normal = face.corner_normals.map_or(face.normal, |normals| {
                        interpolated(normals, weights).try_normalize().unwrap_or(face.normal)
                    });
                    let vertex = VertexId::new(self.mesh.positions.len());
                    self.mesh.positions.push(position);
                    (vertex, self.push_sample(position, normal, face.object.index() as u32))
                }
            })
            .collect();
        for (triangle, lines) in partition.triangles.iter().zip(&partition.lines) {
            let at = triangle.map(|point| made[point as usize]);
            self.mesh.push(Tile {
                face: id,
                vertices: at.map(|(vertex, _)| vertex),
                points: triangle.map(|point| partition.points[point as usize]),
                samples: at.map(|(_, sample)| sample),
                lines: *lines,
                level: 0,
                live: true,
            });
        }
    }

    /// The vertex and sample at a point of a face's edge: one vertex for all faces, one sample for each side of a
    /// crease.
    fn on_edge(
        &mut self,
        face: &Face,
        at_corners: [SampleId; 3],
        k: usize,
        along: i32,
        position: DVec3,
    ) -> (VertexId, SampleId) {
        let [from, to] = [k, (k + 1) % 3];
        let [v, w] = [face.vertices[from], face.vertices[to]];
        let [a, b] = [at_corners[from], at_corners[to]];
        let (edge, along) = if v < w { ((v, w), along) } else { ((w, v), GRID - along) };
        let place = |pair| (edge, along, pair);
        if let Some(&known) = self.edge_samples.get(&place(edge_key(a, b))) {
            return known;
        }
        // The vertex is filed under the same place, with a pair that no samples have.
        let no_pair = (SampleId::new(0), SampleId::new(0));
        let vertex = if let Some(&(vertex, _)) = self.edge_samples.get(&place(no_pair)) {
            vertex
        } else {
            let vertex = VertexId::new(self.mesh.positions.len());
            self.mesh.positions.push(position);
            self.edge_samples.insert(place(no_pair), (vertex, no_pair.0));
            vertex
        };
        let normal = self.mesh.samples[a.index()].normal + self.mesh.samples[b.index()].normal;
        let position = self.mesh.positions[vertex.index()];
        let object = face.object.index() as u32;
        let sample = self.push_sample(position, normal.try_normalize().unwrap_or(face.normal), object);
        self.edge_samples.insert(place(edge_key(a, b)), (vertex, sample));
        (vertex, sample)
    }

    fn push_sample(&mut self, position: DVec3, normal: DVec3, object: u32) -> SampleId {
        let inward = DVec3::ZERO;
        self.mesh.samples.push(Sample {
            position,
            normal,
            inward,
            one_sided: false,
            in_plane: false,
            object,
            parents: None,
        });
        SampleId::new(self.mesh.samples.len() - 1)
    }

    /// Gives corners on different sides of a contact samples of their own.
    fn separate_sides(&mut self) {
        let touches = |tile: &Tile, k: usize| {
            [k, (k + 2) % 3].into_iter().any(|edge| tile.lines[edge].is_some_and(LineKind::jumps))
        };
        let mut around: FxHashMap<VertexId, SmallVec<[(ElementId, usize); 8]>> = FxHashMap::default();
        for tile in &self.mesh.tiles {
            for k in (0..3).filter(|&k| touches(tile, k)) {
                around.entry(tile.vertices[k]).or_default();
            }
        }
        for (index, tile) in self.mesh.tiles.iter().enumerate() {
            for k in 0..3 {
                if let Some(corners) = around.get_mut(&tile.vertices[k]) {
                    corners.push((ElementId::new(index), k));
                }
            }
        }
        let mut vertices: Vec<_> = around.into_iter().collect();
        vertices.sort_unstable_by_key(|(vertex, _)| *vertex);
        for (_, corners) in vertices {
            self.separate_sectors(&corners);
        }
    }

    /// Splits the samples of the corners around one vertex into sectors between contacts.
    fn separate_sectors(&mut self, corners: &[(ElementId, usize)]) {
        // Sectors grow over edges that are no contact, between corners that had one sample.
        let mut sector: SmallVec<[usize; 8]> = (0..corners.len()).collect();
        let spokes = |&(id, k): &(ElementId, usize)| {
            let tile = self.mesh.tile(id);
            [(k, (k + 1) % 3), ((k + 2) % 3, (k + 2) % 3)].map(|(edge, end)| {
                (
                    tile.vertices[end],
                    tile.lines[edge].is_some_and(LineKind::jumps),
                    tile.samples[k],
                    tile.samples[end],
                )
            })
        };
        loop {
            let mut grew = false;
            for i in 0..corners.len() {
                for j in 0..corners.len() {
                    let joined = sector[i] > sector[j]
                        && spokes(&corners[i]).iter().any(|one| {
                            spokes(&corners[j])
                                .iter()
                                .any(|other| one.0 == other.0 && !one.1 && !other.1 && one.2 == other.2)
                        });
                    if joined {
                        sector[i] = sector[j];
                        grew = true;
                    }
                }
            }
            if !grew {
                break;
            }
        }
        let mut made: SmallVec<[(usize, SampleId); 4]> = SmallVec::new();
        for (i, &(id, k)) in corners.iter().enumerate() {
            let known = made.iter().find(|(root, _)| *root == sector[i]).map(|(_, sample)| *sample);
            let sample = known.unwrap_or_else(|| {
                let old = &self.mesh.samples[self.mesh.tiles[id.index()].samples[k].index()];
                let (position, normal, object) = (old.position, old.normal, old.object);
                let sample = self.push_sample(position, normal, object);
                made.push((sector[i], sample));
                sample
            });
            self.mesh.tiles[id.index()].samples[k] = sample;
        }
    }

    /// Steps from new samples into their tiles, so that values on edges are limits from inside.
    fn step_inwards(&mut self) {
        let first = self.mesh.shared_samples;
        let mut around = vec![Around::default(); self.mesh.samples.len()];
        for tile in &self.mesh.tiles {
            let face = self.face(tile.face);
            let longest = longest_edge(self.mesh.world.corners(face));
            let corners = tile.vertices.map(|v| self.mesh.positions[v.index()]);
            let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
            let inside = self.mesh.area(tile) / (1.5 * longest_edge(corners));
            for k in 0..3 {
                let [next, previous] = [(k + 1) % 3, (k + 2) % 3];
                let step = (centroid - corners[k]) * relative_step(inside, longest);
                let around = &mut around[tile.samples[k].index()];
                around.steps += step;
                around.tiles += 1;
                around.rim.add([next, previous].map(|k| tile.vertices[k].index() as u32));
                let lines = [k, previous].map(|edge| tile.lines[edge]);
                around.strongest = around.strongest.max(lines[0]).max(lines[1]);
                around.is_curved |= face.corner_normals.is_some();
                let on_border = (0..3).any(|edge| tile.points[k].depth(edge) == 0);
                around.needs_step |=
                    on_border || lines.iter().any(Option::is_some) || face.corner_normals.is_some();
                let angle = (corners[next] - corners[k]).angle_between(corners[previous] - corners[k]);
                if face.corner_normals.is_none() && angle > around.widest.0 {
                    around.widest = (angle, step);
                }
            }
        }
        for (sample, around) in self.mesh.samples.iter_mut().zip(around).skip(first) {
            sample.one_sided = around.strongest.is_some_and(LineKind::jumps) || around.rim.is_open();
            // What touches may do so from a little above or below; there it is better to be above.
            sample.in_plane = around.strongest == Some(LineKind::Sharp) && !around.is_curved;
            sample.inward = if sample.one_sided && around.widest.0 > 0.0 {
                // The mean may point out of a sector that is wider than half a turn.
                around.widest.1
            } else if around.needs_step {
                around.steps / f64::from(around.tiles)
            } else {
                DVec3::ZERO
            };
        }
    }
}

/// The tiles around a sample.
#[derive(Debug, Clone, Default)]
struct Around {
    /// Sum of the steps into them.
    steps: DVec3,
    tiles: u32,
    rim: Rim,
    /// Of the lines that they have it on.
    strongest: Option<LineKind>,
    is_curved: bool,
    /// Whether any of them is curved, or has the sample on its face's border or on a line.
    needs_step: bool,
    /// The widest angle of a flat one, radians, and the step into it.
    widest: (f64, DVec3),
}

/// The corners of a triangle in its own plane, metres.
fn flattened([a, b, c]: [DVec3; 3]) -> [DVec2; 3] {
    let x = (b - a).normalize_or_zero();
    let along = (c - a).dot(x);
    [DVec2::ZERO, DVec2::new((b - a).length(), 0.0), DVec2::new(along, ((c - a) - along * x).length())]
}
