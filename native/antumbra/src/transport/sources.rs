//! Who sends light: emitting surfaces, area lights, and patches that reflect what they received (the paper, §2.1).
//!
//! Emission is constant over its surface, so an emitter is sent whole. Reflected light is sent per patch, its mean over
//! the patch; the two sides of a patch are two sources.

use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::index::{ElementId, FaceId, VertexId, typed_index};
use crate::lamps::{Lamp, Sky};
use crate::mesh::{Mesh, Side};
use crate::scene::quads::{Half, Merged, merge};
use crate::scene::world::{Face, World};
use crate::transport::source_tree::{LitPolygon, SourceTree};
use crate::visibility::ConvexPolygon;
use crate::visibility::blockers::Blockers;

typed_index! {
    /// One side of a patch.
    SourceId,
    /// A polygon whose elements send together.
    PatchId,
}

/// One or two elements that send what they reflect as one polygon.
#[derive(Debug, Clone)]
pub(crate) struct Patch {
    pub(crate) polygon: ConvexPolygon,
    pub(crate) elements: SmallVec<[ElementId; 2]>,
    pub(crate) reflectance: DVec3,
    /// The same where it is shown; more where the patch reflects nothing to others.
    pub(crate) shown: DVec3,
    pub(crate) receives: bool,
}

/// What emits: faces, area lights and lamps.
#[derive(Debug)]
pub(crate) struct Emitters {
    /// Each emits from the side of its normal; an emitting face is there twice.
    pub(crate) polygons: Vec<LitPolygon>,
    /// The same for those who gather.
    pub(crate) tree: SourceTree,
    /// The sky, where it is met along rays and not sought out.
    pub(crate) around: Option<Sky>,
    /// Power that is emitted, W; of what is far away, what could be caught of it.
    pub(crate) power: DVec3,
    /// Emitting faces and all other lights, before the two sides of faces were told apart.
    pub(crate) lights: usize,
}

/// Everything that reflects: two sides of every patch.
#[derive(Debug)]
pub(crate) struct Sources {
    pub(crate) patches: Vec<Patch>,
}

impl Emitters {
    /// Collects the emitters of the scene.
    pub(crate) fn new(world: &World) -> Self {
        let mut polygons = Vec::new();
        let mut lights = 0;
        let emitting: Vec<Half> = (world.faces.iter())
            .filter(|face| exitance(world, face) != DVec3::ZERO)
            .map(|face| front_half(world, face))
            .collect();
        for merged in merge(&emitting) {
            let material = (emitting[merged.halves[0]].key >> 32) as usize;
            let radiosity = DVec3::from_array(world.materials[material].exitance_rgb);
            polygons.push(LitPolygon { polygon: merged.polygon.flipped(), radiosity });
            polygons.push(LitPolygon { polygon: merged.polygon, radiosity });
            lights += 1;
        }
        for light in &world.lights {
            if let Some(polygon) = ConvexPolygon::new(&light.outline) {
                polygons.push(LitPolygon { polygon, radiosity: DVec3::from_array(light.exitance_rgb) });
                lights += 1;
            }
        }
        let lamps = Lamp::all(world);
        let sky = Sky::of_world(world);
        lights += lamps.len() + usize::from(sky.is_some());
        let surface_area = world.surface_area();
        let from_lamps: DVec3 = lamps.iter().map(|lamp| lamp.power(surface_area)).sum();
        let from_sky = sky.as_ref().map_or(DVec3::ZERO, |sky| sky.power(surface_area));
        let from_polygons: DVec3 = polygons.iter().map(|lit| lit.radiosity * lit.polygon.area()).sum();
        let mut tree = SourceTree::flat(&polygons);
        tree.lamps = lamps;
        tree.sky = sky;
        Self { tree, around: None, polygons, power: from_polygons + from_lamps + from_sky, lights }
    }
}

impl Emitters {
    /// Leaves the sky to those who look around.
    pub(crate) fn look_around_for_the_sky(&mut self) {
        self.around = self.tree.sky.take();
    }
}

impl Sources {
    /// Makes patches of the given elements, pairing them where two are one quadrilateral.
    pub(crate) fn new(world: &World, mesh: &Mesh, patch_elements: &[ElementId]) -> Self {
        let halves: Vec<Half> = patch_elements.iter().map(|&e| element_half(world, mesh, e)).collect();
        let patches =
            merge(&halves).into_iter().map(|merged| patch(world, mesh, patch_elements, merged)).collect();
        Self { patches }
    }

    pub(crate) fn len(&self) -> usize {
        2 * self.patches.len()
    }

    /// The source that a side of a patch is.
    pub(crate) fn of_patch(patch: PatchId, side: Side) -> SourceId {
        SourceId::new(2 * patch.index() + usize::from(side == Side::Back))
    }

    /// The polygon that sends, its normal on the sending side.
    pub(crate) fn polygon(&self, source: SourceId) -> ConvexPolygon {
        let patch = &self.patches[source.index() / 2];
        if source.index().is_multiple_of(2) { patch.polygon.clone() } else { patch.polygon.flipped() }
    }

    pub(crate) fn area(&self, source: SourceId) -> f64 {
        self.patches[source.index() / 2].polygon.area()
    }
}

/// Everything that blocks light: every face that does, paired where two are one quadrilateral.
pub(crate) fn blockers(world: &World) -> Blockers {
    blockers_among(world, |_| true)
}

/// The same of some faces; of an object all or none.
pub(crate) fn blockers_among(world: &World, takes: impl Fn(FaceId) -> bool) -> Blockers {
    let (polygons, transmittances) = whole_faces(world)
        .into_iter()
        .filter(|merged| takes(FaceId::new(merged.halves[0])))
        .map(|merged| (merged.polygon, world.transmittance(FaceId::new(merged.halves[0]))))
        .unzip();
    Blockers::new(polygons, transmittances, world.diagonal)
}

/// Every face that blocks, paired where two are one quadrilateral that lets the same share of light through, of whatever
/// materials; halves are indices of faces.
pub(crate) fn whole_faces(world: &World) -> Vec<Merged> {
    let blocks = |face: &FaceId| world.transmittance(*face) != DVec3::ONE;
    let faces: Vec<FaceId> = FaceId::range(0..world.faces.len()).filter(blocks).collect();
    // The number of the first material that lets as much through
    let mut shares: FxHashMap<[u64; 3], u64> = FxHashMap::default();
    let alike: Vec<u64> = (world.materials.iter().enumerate())
        .map(|(k, material)| *shares.entry(material.transmittance_rgb.map(f64::to_bits)).or_insert(k as u64))
        .collect();
    let half = |face: &FaceId| {
        let face = &world.faces[face.index()];
        let key = (alike[face.material as usize] << 32) | face.object.index() as u64;
        Half { key, ..front_half(world, face) }
    };
    let halves: Vec<Half> = faces.iter().map(half).collect();
    let mut merged = merge(&halves);
    for half in merged.iter_mut().flat_map(|merged| &mut merged.halves) {
        *half = faces[*half].index();
    }
    merged
}

fn exitance(world: &World, face: &Face) -> DVec3 {
    DVec3::from_array(world.materials[face.material as usize].exitance_rgb)
}

/// Faces are paired within an object and a material.
fn pairing_key(face: &Face) -> u64 {
    (u64::from(face.material) << 32) | face.object.index() as u64
}

fn front_half(world: &World, face: &Face) -> Half {
    half(face, face.vertices.map(|v| VertexId::new(v as usize)), world.corners(face))
}

fn element_half(world: &World, mesh: &Mesh, id: ElementId) -> Half {
    let element = mesh.element(id);
    // Where a contact lies between two elements they share vertices, but no samples, and must not become one patch.
    let samples = element.samples.map(|sample| VertexId::new(sample.index()));
    half(&world.faces[element.face.index()], samples, mesh.positions(element))
}

fn half(face: &Face, vertices: [VertexId; 3], positions: [DVec3; 3]) -> Half {
    let [a, b, c] = positions;
    let front = (b - a).cross(c - a).dot(face.normal) >= 0.0;
    let turn = |[p, q, r]: [usize; 3]| if front { [p, q, r] } else { [p, r, q] };
    Half {
        vertices: turn([0, 1, 2]).map(|k| vertices[k]),
        positions: turn([0, 1, 2]).map(|k| positions[k]),
        normal: face.normal,
        key: pairing_key(face),
    }
}

fn patch(world: &World, mesh: &Mesh, elements: &[ElementId], merged: Merged) -> Patch {
    let elements: SmallVec<[ElementId; 2]> = merged.halves.iter().map(|&h| elements[h]).collect();
    let face: FaceId = mesh.element(elements[0]).face;
    Patch {
        polygon: merged.polygon,
        elements,
        reflectance: DVec3::from_array(world.material(face).reflectance_rgb),
        shown: DVec3::from_array(world.shown_material(face).reflectance_rgb),
        receives: world.receives(face),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{MaterialInput, ObjectInput, SceneInput};
    use glam::DMat4;

    /// A square of two triangles with these materials.
    fn square(materials: [u32; 2]) -> World {
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let material = |reflectance: f64| MaterialInput {
            name: "paint".to_owned(),
            reflectance_rgb: [reflectance; 3],
            exitance_rgb: [0.0; 3],
            transmittance_rgb: [0.0; 3],
        };
        let object = ObjectInput {
            name: "square".to_owned(),
            positions: vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
            world_from_object: DMat4::IDENTITY,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            triangle_materials: materials.to_vec(),
            corner_normals: None,
            receives: true,
            blocks: true,
            sends: true,
        };
        let input = SceneInput {
            materials: vec![material(0.2), material(0.6)],
            objects: vec![object],
            ..SceneInput::default()
        };
        World::new(&input).expect("a square is valid")
    }

    #[test]
    fn a_textured_square_blocks_as_one_and_sends_as_two() {
        for (materials, patches) in [([0, 0], 1), ([0, 1], 2)] {
            let world = square(materials);
            assert_eq!(blockers(&world).polygons().len(), 1);
            let mesh = Mesh::new(&world);
            let roots: Vec<ElementId> = ElementId::range(0..mesh.roots.len()).collect();
            assert_eq!(Sources::new(&world, &mesh, &roots).patches.len(), patches);
        }
    }
}
