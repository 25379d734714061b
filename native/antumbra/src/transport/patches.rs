//! Patches that fit the light: a patch sends its mean, so one that is lit unevenly is cut into smaller ones.
//!
//! The paper (§2.1) relies on patches being small enough that "the errors caused by shooting the radiosity from
//! patches are sufficiently small". Once the emitters have shot, it is known where they are not: around lamps, across
//! strong shadows, and where an object stands on a patch.

use glam::DVec3;

use crate::index::{ElementId, SampleId};
use crate::mesh::{Mesh, area};
use crate::scene::world::World;

/// Difference of radiosity within a patch of the automatic size, relative to the mean radiosity of the scene, that is
/// still sent as one. Nearby surfaces see such a patch at a quarter of their hemisphere or less, with errors of both
/// signs.
const MOST_SPREAD: f64 = 0.25;

/// Times that a patch may be quartered for its light: enough for a lamp that touches a wall.
const MOST_QUARTERED: u32 = 3;

/// Quarters patches until none is lit too unevenly for its size.
///
/// `irradiance`: per sample, front and back, W/m². `mean_radiosity`: W/m². `patch_size`: edge of a patch that may
/// spread by [`MOST_SPREAD`] of the mean, metres; smaller ones may spread more. `triangle_limit`: triangles of the mesh
/// from which on it is not subdivided any more.
pub(crate) fn fit_to_light(
    mesh: &mut Mesh,
    world: &World,
    patches: &[ElementId],
    irradiance: &[[DVec3; 2]],
    mean_radiosity: f64,
    patch_size: f64,
    triangle_limit: usize,
) -> Vec<ElementId> {
    let allowed = MOST_SPREAD * mean_radiosity * patch_size;
    let mut fitting = Vec::with_capacity(patches.len());
    // In reverse, so that patches leave the stack in their own order.
    let mut open: Vec<(ElementId, u32)> = patches.iter().rev().map(|&element| (element, 0)).collect();
    while let Some((id, quartered)) = open.pop() {
        let element = mesh.element(id);
        let reflectance = DVec3::from_array(world.material(element.face).reflectance_rgb);
        let size = area(element, world).sqrt();
        let (least, most) = range(mesh, id, irradiance);
        let spread =
            (0..2).map(|side| (reflectance * (most[side] - least[side])).max_element()).fold(0.0, f64::max);
        let full = element.is_leaf() && mesh.triangles >= triangle_limit;
        if quartered == MOST_QUARTERED || spread * size <= allowed || full {
            fitting.push(id);
            continue;
        }
        mesh.subdivide(id, &mut Vec::new());
        let children =
            mesh.element(id).children().expect("it was just subdivided; this is a bug in antumbra");
        open.extend(children.iter().rev().map(|&child| (child, quartered + 1)));
    }
    fitting
}

/// The least and the most irradiance on each side of an element, over all samples in it.
fn range(mesh: &Mesh, id: ElementId, irradiance: &[[DVec3; 2]]) -> ([DVec3; 2], [DVec3; 2]) {
    let at = |sample: SampleId| interpolated(mesh, sample, irradiance);
    let element = mesh.element(id);
    let (mut least, mut most) = ([DVec3::INFINITY; 2], [DVec3::NEG_INFINITY; 2]);
    let mut include = |low: [DVec3; 2], high: [DVec3; 2]| {
        for side in 0..2 {
            least[side] = least[side].min(low[side]);
            most[side] = most[side].max(high[side]);
        }
    };
    for sample in element.samples {
        include(at(sample), at(sample));
    }
    for child in element.children().into_iter().flatten() {
        let (low, high) = range(mesh, child, irradiance);
        include(low, high);
    }
    (least, most)
}

/// The light of a sample, or of its parents where it was made after the light was known.
fn interpolated(mesh: &Mesh, sample: SampleId, irradiance: &[[DVec3; 2]]) -> [DVec3; 2] {
    match (irradiance.get(sample.index()), mesh.sample(sample).parents) {
        (Some(&known), _) => known,
        (None, Some([a, b])) => {
            let [a, b] = [a, b].map(|parent| interpolated(mesh, parent, irradiance));
            [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
        }
        (None, None) => [DVec3::ZERO; 2],
    }
}
