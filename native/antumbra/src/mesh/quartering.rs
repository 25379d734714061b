//! The display mesh of uniform meshes and of adaptive subdivision: a hierarchy of elements that are quartered.

use crate::index::ElementId;
use crate::mesh::Mesh;
use crate::scene::world::World;

/// A hierarchy with the limits of its refinement.
pub(crate) struct Quartering<'a> {
    pub(crate) world: &'a World,
    pub(crate) mesh: Mesh,
    /// Per face: the deepest level its elements may reach.
    pub(crate) deepest: Vec<u8>,
    /// The first samples, which are those of the patches before they were fitted.
    pub(crate) shared_samples: usize,
}

impl Mesh {
    /// The leaves of what is baked.
    pub(crate) fn leaves_of_baked(&self, world: &World) -> Vec<ElementId> {
        (self.elements.iter().enumerate())
            .filter(|(_, element)| element.is_leaf() && world.receives(element.face))
            .map(|(index, _)| ElementId::new(index))
            .collect()
    }
}
