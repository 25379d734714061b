//! Who sends light: emitting surfaces, area lights, and patches that reflect what they received (the paper, §2.1).
//!
//! Emission is constant over its surface, so an emitter is sent whole. Reflected light is sent per patch, the mean
//! over the patch's elements; the two sides of a patch are two sources.

use glam::DVec3;
use smallvec::SmallVec;

use crate::index::{ElementId, FaceId, VertexId, typed_index};
use crate::mesh::{Mesh, Side};
use crate::scene::quads::{Half, Merged, merge};
use crate::scene::world::{Face, World};
use crate::visibility::ConvexPolygon;

typed_index! {
    /// An emitter or one side of a patch.
    SourceId,
    /// A polygon whose elements send together.
    PatchId,
}

/// A polygon that emits from the side its normal points to.
#[derive(Debug, Clone)]
pub(crate) struct Emitter {
    pub(crate) polygon: ConvexPolygon,
    /// W/m².
    pub(crate) exitance: DVec3,
}

/// One or two elements that send what they reflect as one polygon.
#[derive(Debug, Clone)]
pub(crate) struct Patch {
    pub(crate) polygon: ConvexPolygon,
    pub(crate) elements: SmallVec<[ElementId; 2]>,
    pub(crate) reflectance: DVec3,
    pub(crate) receives: bool,
}

/// All sources of a scene: first the emitters, then two sides of every patch.
#[derive(Debug)]
pub(crate) struct Sources {
    pub(crate) emitters: Vec<Emitter>,
    pub(crate) patches: Vec<Patch>,
    /// Emitting faces and area lights, before their two sides were told apart.
    pub(crate) lights: usize,
}

impl Sources {
    /// Collects the emitters of the scene and makes patches of the given elements.
    pub(crate) fn new(world: &World, mesh: &Mesh, patch_elements: &[ElementId]) -> Self {
        let mut emitters = Vec::new();
        let mut lights = 0;
        let emitting: Vec<Half> = (world.faces.iter())
            .filter(|face| exitance(world, face) != DVec3::ZERO)
            .map(|face| front_half(world, face))
            .collect();
        for merged in merge(&emitting) {
            let material = (emitting[merged.halves[0]].key >> 32) as usize;
            let exitance = DVec3::from_array(world.materials[material].exitance_rgb);
            emitters.push(Emitter { polygon: merged.polygon.flipped(), exitance });
            emitters.push(Emitter { polygon: merged.polygon, exitance });
            lights += 1;
        }
        for light in &world.lights {
            if let Some(polygon) = ConvexPolygon::new(&light.outline) {
                emitters.push(Emitter { polygon, exitance: DVec3::from_array(light.exitance_rgb) });
                lights += 1;
            }
        }
        let halves: Vec<Half> = patch_elements.iter().map(|&e| element_half(world, mesh, e)).collect();
        let patches =
            merge(&halves).into_iter().map(|merged| patch(world, mesh, patch_elements, merged)).collect();
        Self { emitters, patches, lights }
    }

    pub(crate) fn len(&self) -> usize {
        self.emitters.len() + 2 * self.patches.len()
    }

    /// The source that a side of a patch is.
    pub(crate) fn of_patch(&self, patch: PatchId, side: Side) -> SourceId {
        SourceId::new(self.emitters.len() + 2 * patch.index() + usize::from(side == Side::Back))
    }

    /// The polygon that sends, its normal on the sending side.
    pub(crate) fn polygon(&self, source: SourceId) -> ConvexPolygon {
        match source.index().checked_sub(self.emitters.len()) {
            None => self.emitters[source.index()].polygon.clone(),
            Some(i) if i % 2 == 0 => self.patches[i / 2].polygon.clone(),
            Some(i) => self.patches[i / 2].polygon.flipped(),
        }
    }

    pub(crate) fn is_emitter(&self, source: SourceId) -> bool {
        source.index() < self.emitters.len()
    }

    pub(crate) fn area(&self, source: SourceId) -> f64 {
        match source.index().checked_sub(self.emitters.len()) {
            None => self.emitters[source.index()].polygon.area(),
            Some(i) => self.patches[i / 2].polygon.area(),
        }
    }
}

/// The polygons that block light: every face, paired where two are one quadrilateral.
pub(crate) fn blocking_polygons(world: &World) -> Vec<ConvexPolygon> {
    let halves: Vec<Half> = world.faces.iter().map(|face| front_half(world, face)).collect();
    merge(&halves).into_iter().map(|merged| merged.polygon).collect()
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
    half(&world.faces[element.face.index()], element.vertices, mesh.positions(element))
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
        receives: world.receives(face),
    }
}
