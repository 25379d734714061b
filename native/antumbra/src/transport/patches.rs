//! Patches that fit the light: a patch sends its mean, so one that is lit unevenly is cut into smaller ones.
//!
//! The paper (§2.1) relies on patches being small enough that "the errors caused by shooting the radiosity from
//! patches are sufficiently small". Once the emitters have shot, it is known where they are not: around lamps, across
//! strong shadows, and where an object stands on a patch.

use glam::DVec3;

use crate::display::{Display, Light};
use crate::error::Error;
use crate::index::ElementId;
use crate::mesh::Mesh;
use crate::scene::world::World;
use crate::transport::overlay::{Received, spread};

/// Difference of radiosity within a patch of the automatic size, relative to the mean radiosity of the scene, that is
/// still sent as one. Nearby surfaces see such a patch at a quarter of their hemisphere or less, with errors of both
/// signs.
const MOST_SPREAD: f64 = 0.25;

/// Times that a patch may be quartered for its light: enough for a lamp that touches a wall.
const MOST_QUARTERED: u32 = 3;

/// Which patches may be cut, and how far.
pub(crate) struct Fit {
    /// W/m²: the mean radiosity of the scene.
    pub(crate) mean_radiosity: f64,
    /// Edge of a patch that may spread by a quarter of the mean, metres; smaller ones may spread more.
    pub(crate) patch_size: f64,
    /// Triangles of the mesh from which on it is not subdivided any more.
    pub(crate) triangle_limit: usize,
}

impl Fit {
    /// Quarters patches until none is lit too unevenly for its size; in order.
    ///
    /// `light_new_samples`: makes the direct light known on samples that subdivision has made.
    ///
    /// # Errors
    /// Those of `light_new_samples`.
    pub(crate) fn cut(
        &self,
        mesh: &mut Mesh,
        world: &World,
        display: Option<&Display>,
        direct: &mut Vec<[DVec3; 2]>,
        patches: &[ElementId],
        mut light_new_samples: impl FnMut(&Mesh, &mut Vec<[DVec3; 2]>) -> Result<(), Error>,
    ) -> Result<Vec<ElementId>, Error> {
        let allowed = MOST_SPREAD * self.mean_radiosity * self.patch_size;
        let mut fitting: Vec<(ElementId, bool)> = patches.iter().map(|&element| (element, true)).collect();
        for _ in 0..MOST_QUARTERED {
            let open = fitting.iter().filter(|(_, open)| *open).map(|(element, _)| *element);
            let received = received(mesh, world, display, open);
            let mut next = Vec::with_capacity(fitting.len());
            let mut cut = false;
            for (id, open) in fitting {
                let element = mesh.element(id);
                let full = element.is_leaf() && mesh.triangles >= self.triangle_limit;
                let reflectance = DVec3::from_array(world.material(element.face).reflectance_rgb);
                let size = element.area.sqrt();
                let fits = |spread: DVec3| (reflectance * spread).max_element() * size <= allowed;
                if !open || full || spreads(mesh, id, received[id.index()], direct).into_iter().all(fits) {
                    next.push((id, false));
                    continue;
                }
                mesh.subdivide(id, &mut Vec::new());
                let children =
                    mesh.element(id).children().expect("it was just subdivided; this is a bug in antumbra");
                next.extend(children.map(|child| (child, true)));
                cut = true;
            }
            fitting = next;
            light_new_samples(mesh, direct)?;
            if !cut {
                break;
            }
        }
        Ok(fitting.into_iter().map(|(element, _)| element).collect())
    }
}

/// How much the direct light varies over an element: front, then back, W/m².
fn spreads(mesh: &Mesh, id: ElementId, received: Option<Received>, direct: &[[DVec3; 2]]) -> [DVec3; 2] {
    let corners = mesh.element(id).samples.map(|s| direct[s.index()]);
    let mut spreads: [DVec3; 2] = std::array::from_fn(|side| {
        let [a, b, c] = corners.map(|corner| corner[side]);
        a.max(b).max(c) - a.min(b).min(c)
    });
    if let Some(received) = received.filter(|received| received.least.is_finite()) {
        spreads[0] = received.most - received.least;
    }
    spreads
}

/// Mean direct light of every patch element, front and back, W/m²: from the display mesh where there is one, which
/// knows the shadows, otherwise from the element's corners.
pub(crate) fn direct_means(
    mesh: &Mesh,
    world: &World,
    display: Option<&Display>,
    direct: &[[DVec3; 2]],
    patches: &[ElementId],
) -> Vec<[DVec3; 2]> {
    let received = received(mesh, world, display, patches.iter().copied());
    (patches.iter())
        .map(|&id| {
            let [a, b, c] = mesh.element(id).samples.map(|s| direct[s.index()]);
            let mut means: [DVec3; 2] = std::array::from_fn(|side| (a[side] + b[side] + c[side]) / 3.0);
            if let Some(received) = received[id.index()].filter(|received| received.least.is_finite()) {
                means[0] = received.mean;
            }
            means
        })
        .collect()
}

/// What the display mesh brings to the given elements; nothing for those that are not displayed.
pub(crate) fn received(
    mesh: &Mesh,
    world: &World,
    display: Option<&Display>,
    elements: impl Iterator<Item = ElementId>,
) -> Vec<Option<Received>> {
    let mut received = vec![None; mesh.elements.len()];
    let Some(display) = display else { return received };
    for id in elements {
        if world.receives(mesh.element(id).face) {
            received[id.index()] = Some(Received::NOTHING);
        }
    }
    display.for_each_lit(Light::Direct, |face, places, values| {
        spread(mesh, face, places, values, &mut received);
    });
    received
}
