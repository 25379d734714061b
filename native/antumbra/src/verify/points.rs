//! Random points of the baked surfaces, and the light that a mesh shows there.

use std::f64::consts::PI;
use std::ops::Range;

use glam::DVec3;

use crate::display::{Display, Shown};
use crate::index::FaceId;
use crate::scene::world::{World, interpolated};
use crate::verify::paths::Surface;
use crate::visibility::rays::{splitmix, unit};
use crate::weld::BakedMesh;

/// Random points, alike in every bake of a scene.
pub(super) struct Points {
    /// Ordered by face.
    points: Vec<Point>,
    /// Per face: its points, ordered by their first coordinate.
    of_face: Vec<Range<usize>>,
}

struct Point {
    face: FaceId,
    /// In its face.
    barycentric: DVec3,
    surface: Surface,
}

impl Points {
    /// So many points, each in its own share of the area that is baked.
    pub(super) fn new(world: &World, count: usize) -> Option<Self> {
        let area = |face: FaceId| if world.receives(face) { world.faces[face.index()].area } else { 0.0 };
        let total: f64 = FaceId::range(0..world.faces.len()).map(area).sum();
        if count == 0 || total <= 0.0 {
            return None;
        }
        let mut points = Vec::with_capacity(count);
        let mut of_face = Vec::with_capacity(world.faces.len());
        let mut before = 0.0;
        for face in FaceId::range(0..world.faces.len()) {
            let first = points.len();
            before += area(face);
            // Rounding must lose no point at the end.
            while area(face) > 0.0 && points.len() < count {
                let k = points.len() as u64;
                if (k as f64 + random(k, 0)) / count as f64 * total >= before {
                    break;
                }
                points.push(Point::new(world, face, [random(k, 1), random(k, 2)]));
            }
            points[first..].sort_by(|a, b| a.barycentric.x.total_cmp(&b.barycentric.x));
            of_face.push(first..points.len());
        }
        (!points.is_empty()).then_some(Self { points, of_face })
    }

    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// Where a point is, and which way it faces.
    pub(super) fn receiver(&self, index: usize) -> Surface {
        self.points[index].surface
    }

    /// The number of a point's material.
    pub(super) fn material(&self, index: usize, world: &World) -> usize {
        world.faces[self.points[index].face.index()].material as usize
    }

    /// What arrives at each point by a mesh on its way, W/m².
    pub(super) fn arriving(&self, display: &Display, indirect_scale: DVec3) -> Vec<DVec3> {
        let [direct, indirect] = display.layers(indirect_scale);
        let mut found = Found::new(self);
        for Shown { face, corners, .. } in display.triangles() {
            let at = |sample: usize| direct[sample] + indirect[sample];
            let light =
                || corners.each_ref().map(|c| 0.5 * (at(c.samples[0].index()) + at(c.samples[1].index())));
            found.look(face, corners.each_ref().map(|c| c.barycentric), light);
        }
        found.values
    }

    /// What each point shows by the meshes that come out, without what it emits itself, W/m².
    pub(super) fn shown(&self, world: &World, meshes: &[BakedMesh], emission_is_shown: bool) -> Vec<DVec3> {
        let mut found = Found::new(self);
        for mesh in meshes {
            let mut faces = world.objects[mesh.object].faces.clone().peekable();
            for (triangle, &source) in mesh.source_triangle.iter().enumerate() {
                // Both are in the order of the source; a triangle without area is no face.
                while faces.next_if(|&face| world.faces[face].source_triangle < source).is_some() {}
                let Some(&face) = faces.peek().filter(|&&face| world.faces[face].source_triangle == source)
                else {
                    continue;
                };
                let light =
                    || mesh.corner_radiance[triangle].map(|rgb| PI * DVec3::from_array(rgb.map(f64::from)));
                let corners = mesh.corner_barycentric[triangle].map(DVec3::from_array);
                found.look(FaceId::new(face), corners, light);
            }
        }
        if emission_is_shown {
            for (value, point) in found.values.iter_mut().zip(&self.points) {
                *value -= DVec3::from_array(world.shown_material(point.face).exitance_rgb);
            }
        }
        found.values
    }
}

impl Point {
    fn new(world: &World, face: FaceId, [u, v]: [f64; 2]) -> Self {
        let root = u.sqrt();
        let barycentric = DVec3::new(1.0 - root, root * (1.0 - v), root * v);
        let of = &world.faces[face.index()];
        let normal = of
            .corner_normals
            .map_or(of.normal, |normals| interpolated(normals, barycentric).normalize_or(of.normal));
        let object = of.object.index() as u32;
        let surface = Surface {
            position: interpolated(world.corners(of), barycentric),
            normal,
            flat_normal: of.normal,
            object,
        };
        Self { face, barycentric, surface }
    }
}

/// The light of the triangles that points lie in.
struct Found<'a> {
    of: &'a Points,
    values: Vec<DVec3>,
    /// How deep each point lies in the triangle that its light is from; one on an edge is in both or, by rounding, in none.
    depth: Vec<f64>,
}

impl<'a> Found<'a> {
    fn new(of: &'a Points) -> Self {
        let count = of.points.len();
        Self { of, values: vec![DVec3::ZERO; count], depth: vec![f64::NEG_INFINITY; count] }
    }

    /// Gives a triangle of a face, by the barycentric coordinates of its corners, to the points that lie in it.
    fn look(&mut self, face: FaceId, corners: [DVec3; 3], light: impl Fn() -> [DVec3; 3]) {
        let range = self.of.of_face[face.index()].clone();
        if range.is_empty() {
            return;
        }
        let [a, b, c] = corners.map(DVec3::truncate);
        let low = a.x.min(b.x).min(c.x) - NEAR;
        let high = a.x.max(b.x).max(c.x) + NEAR;
        let points = &self.of.points[range.clone()];
        let first = points.partition_point(|point| point.barycentric.x < low);
        for (k, point) in points.iter().enumerate().skip(first) {
            let p = point.barycentric.truncate();
            if p.x > high {
                break;
            }
            let whole = (b - a).perp_dot(c - a);
            let inside = DVec3::new(
                (c - b).perp_dot(p - b) / whole,
                (a - c).perp_dot(p - c) / whole,
                (b - a).perp_dot(p - a) / whole,
            );
            let index = range.start + k;
            let depth = inside.min_element();
            if depth > self.depth[index] && depth > -NEAR {
                self.depth[index] = depth;
                self.values[index] = interpolated(light(), inside);
            }
        }
    }
}

/// Distance, in sizes of a face or of a triangle, from which a triangle may hold a point: far above rounding, and no light
/// changes over it.
const NEAR: f64 = 1e-6;

/// The same for a point in every bake.
fn random(point: u64, dimension: u64) -> f64 {
    unit(splitmix(splitmix(3 * point + dimension) ^ 0xA076_1D64_78BD_642F))
}
