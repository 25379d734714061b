//! What the caller gets back: the refined meshes, anchored (the paper, §3.3), with a colour per corner.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::display::{Display, Light, Shown};
use crate::index::VertexId;
use crate::mesh::Corner;
use crate::mesh::arrangement::LineKind;
use crate::report::Report;
use crate::scene::world::{World, interpolated};
use crate::scene::{MaterialInput, ObjectInput, SceneInput};
use crate::settings::{Quantity, Settings};

/// The refined meshes with their light, and what it took to make them.
#[derive(Debug, Clone)]
pub struct Bake {
    /// One mesh per receiving object, in the order of the input.
    pub meshes: Vec<BakedMesh>,
    /// Timeline, result and warnings.
    pub report: Report,
}

/// A refined triangle mesh. Every attribute of the source can be carried over: each vertex and each corner knows
/// its source triangle and its place in it.
#[derive(Debug, Clone, Default)]
pub struct BakedMesh {
    /// Index into [`crate::scene::SceneInput::objects`].
    pub object: usize,
    /// Vertices in object space; source vertices keep their exact coordinates.
    pub positions: Vec<DVec3>,
    /// Per vertex: a source triangle that holds it.
    pub vertex_source_triangle: Vec<u32>,
    /// Per vertex: its barycentric coordinates in that triangle; exactly a unit vector at a source vertex.
    pub vertex_barycentric: Vec<[f64; 3]>,
    /// Corner vertices, wound like the source triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Per triangle: the source triangle it is a part of.
    pub source_triangle: Vec<u32>,
    /// Per triangle and corner: barycentric coordinates in the source triangle.
    pub corner_barycentric: Vec<[[f64; 3]; 3]>,
    /// Per triangle and edge (corner k to k+1): the source triangle's edge it lies on (0, 1, 2), or -1.
    pub source_edge: Vec<[i8; 3]>,
    /// Per triangle and edge: the line it lies on. 0 none, 1 where the slope of light changes, 2 where a sharp shadow
    /// ends, 3 where something touches the face.
    pub edge_line: Vec<[i8; 3]>,
    /// Per triangle and corner: scene-linear `B/pi` or `H/pi`, rgb, never clipped.
    pub corner_radiance: Vec<[[f32; 3]; 3]>,
    /// Per triangle and corner: the rms error that the solver estimates around it, relative to the mean that the tolerance is
    /// relative to; 0 where the light is even, and where nothing was refined. Empty while the bake goes on.
    pub corner_error: Vec<[f32; 3]>,
    /// Direct and indirect light apart, each like `corner_radiance`, whose parts they are; `None` unless asked for.
    pub corner_layers: Option<CornerLayers>,
}

/// The two parts of the light of the corners.
#[derive(Debug, Clone, Default)]
pub struct CornerLayers {
    /// What comes from emitters, and what the surface emits itself where emission counts.
    pub direct: Vec<[[f32; 3]; 3]>,
    /// What other surfaces reflected before.
    pub indirect: Vec<[[f32; 3]; 3]>,
}

/// Collects the refined meshes of all baked objects, anchored, with their light.
///
/// `layers`: per [`Light`] and sample, W/m². `errors`: per sample, or none.
pub(crate) fn weld(
    input: &SceneInput,
    world: &World,
    display: &Display,
    layers: &[Vec<DVec3>; 2],
    errors: &[f64],
    settings: &Settings,
) -> Vec<BakedMesh> {
    let triangles = display.triangles();
    (0..input.objects.len())
        .into_par_iter()
        .filter(|&object| world.objects[object].receives && !world.objects[object].faces.is_empty())
        .map(|object| {
            let faces = &world.objects[object].faces;
            let [first, end] = [faces.start, faces.end]
                .map(|face| triangles.partition_point(|shown| shown.face.index() < face));
            Welder::new(input, world, layers, errors, settings, object).weld(&triangles[first..end])
        })
        .collect()
}

/// The welding of one object.
struct Welder<'a> {
    source: &'a ObjectInput,
    world: &'a World,
    object: usize,
    layers: &'a [Vec<DVec3>; 2],
    errors: &'a [f64],
    quantity: Quantity,
    baked: BakedMesh,
    /// Mesh vertices that are baked vertices already.
    numbers: FxHashMap<VertexId, u32>,
}

impl<'a> Welder<'a> {
    fn new(
        input: &'a SceneInput,
        world: &'a World,
        layers: &'a [Vec<DVec3>; 2],
        errors: &'a [f64],
        settings: &Settings,
        object: usize,
    ) -> Self {
        let source = &input.objects[object];
        let corner_layers = settings.separate_layers.then(CornerLayers::default);
        let baked = BakedMesh { object, corner_layers, ..BakedMesh::default() };
        let quantity = settings.quantity;
        Self { source, world, object, layers, errors, quantity, baked, numbers: FxHashMap::default() }
    }

    fn weld(mut self, triangles: &[Shown]) -> BakedMesh {
        let mut next_triangle = 0;
        // Light at source vertices, for faces that have no area and so no light of their own.
        let mut at_vertex: FxHashMap<VertexId, Arriving> = FxHashMap::default();
        let mut flat: Vec<u32> = Vec::new();
        for Shown { face, corners, lines } in triangles {
            let source_triangle = self.world.faces[face.index()].source_triangle;
            flat.extend(next_triangle..source_triangle);
            next_triangle = source_triangle + 1;
            let material = self.world.shown_material(*face);
            let arriving = corners.each_ref().map(|corner| self.arriving_at(corner));
            for (corner, &arriving) in corners.iter().zip(&arriving) {
                at_vertex.entry(corner.vertex).or_insert(arriving);
            }
            self.push(source_triangle, corners.each_ref().map(|c| (c.vertex, c.barycentric)), *lines);
            self.push_light(&arriving, material);
            let errors = self.errors;
            self.push_errors(|k| corners[k].samples.map(|s| errors[s.index()]));
        }
        flat.extend(next_triangle..self.source.triangles.len() as u32);
        for triangle in flat {
            self.push_flat(triangle, &at_vertex);
        }
        self.baked
    }

    /// A face without area keeps its place, so that what was watertight stays so; it shows its neighbours' light.
    fn push_flat(&mut self, triangle: u32, at_vertex: &FxHashMap<VertexId, Arriving>) {
        let first = self.world.objects[self.object].first_vertex;
        let vertices = self.source.triangles[triangle as usize].map(|v| VertexId::new((first + v) as usize));
        let material =
            &self.world.shown_materials[self.source.triangle_materials[triangle as usize] as usize];
        let arriving = vertices.map(|v| at_vertex.get(&v).copied().unwrap_or_default());
        let units = [DVec3::X, DVec3::Y, DVec3::Z];
        let corners = std::array::from_fn(|k| (vertices[k], units[k]));
        self.push(triangle, corners, [None; 3]);
        self.push_light(&arriving, material);
        self.push_errors(|_| [0.0; 2]);
    }

    /// `at`: a corner's two samples.
    fn push_errors(&mut self, at: impl Fn(usize) -> [f64; 2]) {
        if !self.errors.is_empty() {
            self.baked.corner_error.push([0, 1, 2].map(|k| {
                let [a, b] = at(k);
                (0.5 * (a + b)) as f32
            }));
        }
    }

    fn push(&mut self, source_triangle: u32, corners: [(VertexId, DVec3); 3], lines: [Option<LineKind>; 3]) {
        let triangle = corners.map(|(vertex, barycentric)| self.number(vertex, source_triangle, barycentric));
        let barycentric = corners.map(|(_, barycentric)| barycentric);
        let edge = |k: usize| {
            let (from, to) = (barycentric[k], barycentric[(k + 1) % 3]);
            // On edge 0 the third coordinate is 0, on edge 1 the first, on edge 2 the second.
            (0..3_i8).find(|&e| {
                let opposite = (e as usize + 2) % 3;
                from[opposite] == 0.0 && to[opposite] == 0.0
            })
        };
        self.baked.triangles.push(triangle);
        self.baked.source_triangle.push(source_triangle);
        self.baked.corner_barycentric.push(barycentric.map(|b| b.to_array()));
        self.baked.edge_line.push(lines.map(|line| line.map_or(0, LineKind::number)));
        self.baked.source_edge.push(std::array::from_fn(|k| edge(k).unwrap_or(-1)));
    }

    fn push_light(&mut self, arriving: &[Arriving; 3], material: &MaterialInput) {
        let (emitted, reflected) = match self.quantity {
            Quantity::Radiosity => (material.exitance_rgb, material.reflectance_rgb),
            Quantity::Irradiance => ([0.0; 3], [1.0; 3]),
        };
        let [emitted, reflected] = [emitted, reflected].map(DVec3::from_array);
        let sent = |own: DVec3, light: fn(&Arriving) -> DVec3| {
            arriving.each_ref().map(|a| ((own + reflected * light(a)) / PI).to_array().map(|v| v as f32))
        };
        self.baked.corner_radiance.push(sent(emitted, |a| a.direct + a.indirect));
        if let Some(layers) = &mut self.baked.corner_layers {
            layers.direct.push(sent(emitted, |a| a.direct));
            layers.indirect.push(sent(DVec3::ZERO, |a| a.indirect));
        }
    }

    fn number(&mut self, vertex: VertexId, source_triangle: u32, barycentric: DVec3) -> u32 {
        let (baked, source, next) = (&mut self.baked, self.source, self.numbers.len() as u32);
        *self.numbers.entry(vertex).or_insert_with(|| {
            let corners = source.triangles[source_triangle as usize].map(|v| source.positions[v as usize]);
            // A unit vector picks a corner without rounding.
            let position = (0..3)
                .find(|&k| barycentric[k] == 1.0)
                .map_or_else(|| interpolated(corners, barycentric), |k| corners[k]);
            baked.positions.push(position);
            baked.vertex_source_triangle.push(source_triangle);
            baked.vertex_barycentric.push(barycentric.to_array());
            next
        })
    }

    fn arriving_at(&self, corner: &Corner) -> Arriving {
        let mean = |light: Light| {
            let [a, b] = corner.samples.map(|s| self.layers[light as usize][s.index()]);
            0.5 * (a + b)
        };
        Arriving { direct: mean(Light::Direct), indirect: mean(Light::Indirect) }
    }
}

/// Irradiance of a corner, W/m².
#[derive(Debug, Clone, Copy, Default)]
struct Arriving {
    direct: DVec3,
    indirect: DVec3,
}
