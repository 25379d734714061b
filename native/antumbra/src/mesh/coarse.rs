//! The mesh before any light: faces cut into patches, patches into elements (the paper, §2.1).

use crate::index::{ElementId, FaceId};
use crate::mesh::Mesh;
use crate::scene::world::World;
use crate::settings::{Method, Settings};

/// Patches that the surfaces would be cut into if all were one square, at a tolerance of one per cent. A patch sends
/// its mean: fewer blur light between neighbours, more cost shots. Chosen as a round number of that size, not by a
/// sweep; patches that the emitters light unevenly are cut further.
const PATCHES: f64 = 150.0;

/// Elements of a uniform mesh per patch and edge, at a tolerance of one per cent.
const UNIFORM_ELEMENTS: f64 = 4.0;

/// A face is cut to a 2^10th of its size at most before any light is known.
const DEEPEST_COARSE: u8 = 10;

/// Sizes of the coarse mesh, in metres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sizes {
    pub(crate) patch: f64,
    pub(crate) element: f64,
}

impl Sizes {
    /// The sizes that the settings ask for, or the automatic ones.
    pub(crate) fn new(world: &World, settings: &Settings) -> Self {
        let area: f64 = world.faces.iter().map(|face| face.area).sum();
        let fineness = (settings.tolerance / 0.01).sqrt();
        let patch = (area * fineness / PATCHES).sqrt();
        let automatic = match settings.method {
            Method::As => patch,
            Method::Uniform => patch * fineness / UNIFORM_ELEMENTS,
        };
        let element = if settings.element_size > 0.0 { settings.element_size } else { automatic };
        Self { patch: patch.max(element), element }
    }
}

/// The elements of a coarse mesh that later stages start from.
pub(crate) struct CoarseElements {
    /// Elements that send together.
    pub(crate) patches: Vec<ElementId>,
    /// Leaves of baked objects.
    pub(crate) receiving: Vec<ElementId>,
    /// Per face: the level of its coarse elements.
    pub(crate) levels: Vec<u8>,
}

/// Subdivides every face until no edge is longer than the sizes allow. Objects that are not baked stop at patches.
pub(crate) fn subdivide_coarsely(mesh: &mut Mesh, world: &World, sizes: Sizes) -> CoarseElements {
    let faces = (0..world.faces.len()).map(FaceId::new);
    let level_for = |face: FaceId, size: f64| {
        let [a, b, c] = world.corners(&world.faces[face.index()]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (longest / size).log2().ceil().clamp(0.0, f64::from(DEEPEST_COARSE)) as u8
    };
    let patch_levels: Vec<u8> = faces.clone().map(|face| level_for(face, sizes.patch)).collect();
    let levels: Vec<u8> =
        faces
            .map(|face| {
                if world.receives(face) { level_for(face, sizes.element) } else { patch_levels[face.index()] }
            })
            .collect();
    let mut subdivided = Vec::new();
    let mut index = 0;
    // Children are appended, so this visits every element that it makes.
    while index < mesh.elements.len() {
        let id = ElementId::new(index);
        let element = mesh.element(id);
        if element.level < levels[element.face.index()] {
            mesh.subdivide(id, &mut subdivided);
        }
        index += 1;
    }
    let elements =
        || mesh.elements.iter().enumerate().map(|(index, element)| (ElementId::new(index), element));
    CoarseElements {
        patches: elements()
            .filter(|(_, e)| e.level == patch_levels[e.face.index()])
            .map(|(id, _)| id)
            .collect(),
        receiving: elements()
            .filter(|(_, e)| e.is_leaf() && world.receives(e.face))
            .map(|(id, _)| id)
            .collect(),
        levels,
    }
}
