//! Secondary light sources: whole faces with what they reflect of the emitters' light (the paper, §3.2: "strong
//! secondary lightsources cause the most prominent discontinuities").
//!
//! Patches are cut where it suits the exchange of light; a shadow's boundary follows the border of the surface that
//! lights it. These are the faces of the scene, paired where two are one quadrilateral, with their mean radiosity after
//! one reflection. Later bounces are left out: they are weaker, and come from everywhere.

use glam::DVec3;

use crate::index::{ElementId, FaceId};
use crate::mesh::{Mesh, Side};
use crate::scene::world::World;
use crate::transport::sources::whole_faces;
use crate::visibility::ConvexPolygon;

/// A face, or two that are one quadrilateral. There is one for every blocking polygon, in the same order.
#[derive(Debug, Clone)]
pub(crate) struct Reflector {
    /// Its normal is on the front.
    pub(crate) polygon: ConvexPolygon,
    /// Of its first face.
    pub(crate) material: u32,
    /// Mean radiosity of the first bounce, front and back, W/m².
    pub(crate) radiosity: [DVec3; 2],
}

/// What a face receives: power on its front and back, W, and the area for which that is known, m².
pub(crate) type OnFace = ([DVec3; 2], f64);

/// What every face reflects.
///
/// `direct`: mean irradiance of the patch elements, front and back, W/m².
pub(crate) fn reflectors_of_patches(
    world: &World,
    mesh: &Mesh,
    elements: &[ElementId],
    direct: &[[DVec3; 2]],
) -> Vec<Reflector> {
    let mut received: Vec<OnFace> = vec![([DVec3::ZERO; 2], 0.0); world.faces.len()];
    for (&id, direct) in elements.iter().zip(direct) {
        let element = mesh.element(id);
        let (power, area) = &mut received[element.face.index()];
        for side in Side::BOTH {
            power[side as usize] += element.area * direct[side as usize];
        }
        *area += element.area;
    }
    reflectors(world, &received)
}

/// The same from what each face receives.
pub(crate) fn reflectors(world: &World, received: &[OnFace]) -> Vec<Reflector> {
    let reflector = |halves: &[usize], polygon: ConvexPolygon| {
        let area: f64 = halves.iter().map(|&face| received[face].1).sum();
        let material = world.faces[halves[0]].material;
        let reflectance = |face: usize| DVec3::from_array(world.material(FaceId::new(face)).reflectance_rgb);
        let radiosity = Side::BOTH.map(|side| {
            let sent = |&face: &usize| reflectance(face) * received[face].0[side as usize];
            let power: DVec3 = halves.iter().map(sent).sum();
            if area > 0.0 { power / area } else { DVec3::ZERO }
        });
        Reflector { polygon, material, radiosity }
    };
    whole_faces(world).into_iter().map(|merged| reflector(&merged.halves, merged.polygon)).collect()
}
