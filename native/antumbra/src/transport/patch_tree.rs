//! Patches as rays meet them: whole faces in a search tree, and from a face down to the patch, half by half.
//!
//! A face of an interior is cut into hundreds of patches. In a tree of all of them a ray would fetch several times as much
//! memory, and neighbouring rays would soon part; which of a face's patches it met, its quarters tell.

use glam::DVec3;

use crate::index::ElementId;
use crate::mesh::Mesh;
use crate::scene::world::World;
use crate::transport::sources::Sources;
use crate::visibility::blockers::Blockers;
use crate::visibility::packet::PACKET;
use crate::visibility::trace::Hit;

/// Patches that block, for rays.
pub(crate) struct PatchTree {
    /// Faces, or their parts between contacts, paired where two are one quadrilateral.
    wholes: Blockers,
    /// Where the halves of each polygon begin in `halves`; and where the last end.
    begins: Vec<u32>,
    halves: Vec<Half>,
    /// Quarters: four for each that was cut.
    quarters: Vec<Part>,
}

/// A triangle that is one of the polygons of the tree, or half of it.
struct Half {
    corner: DVec3,
    /// Their products with a way from the corner are the weights of the second and third corner.
    gradients: [DVec3; 2],
    part: Part,
}

/// A triangle of the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Patch(u32),
    /// The first of its quarters: at corners 0, 1, 2, then in the middle.
    Cut(u32),
}

/// Where a ray meets a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PatchHit {
    /// Twice the number of the patch, and one more on its back.
    pub(crate) side: u32,
    /// Share of light, per channel, that goes on.
    pub(crate) through: DVec3,
    /// Metres.
    pub(crate) distance: f64,
}

impl PatchTree {
    /// Builds the tree over all patches that block.
    ///
    /// `mesh`: whose elements the patches are.
    pub(crate) fn new(world: &World, mesh: &Mesh, patches: &Sources) -> Self {
        let mut patch_of = vec![None; mesh.elements.len()];
        for (index, patch) in patches.patches.iter().enumerate() {
            for element in &patch.elements {
                patch_of[element.index()] = Some(index as u32);
            }
        }
        let through = |root: ElementId| world.transmittance(mesh.element(root).face);
        let blocking: Vec<ElementId> =
            ElementId::range(0..mesh.roots.len()).filter(|&root| through(root) != DVec3::ONE).collect();
        let mut this = Self {
            wholes: Blockers::new(Vec::new(), Vec::new(), world.diagonal),
            begins: vec![0],
            halves: Vec::new(),
            quarters: Vec::new(),
        };
        let (mut polygons, mut transmittances) = (Vec::new(), Vec::new());
        for whole in Sources::new(world, mesh, &blocking).patches {
            for &root in &whole.elements {
                if let Some(part) = this.part(mesh, root, &patch_of) {
                    this.halves.push(Half::new(mesh.positions(mesh.element(root)), part));
                }
            }
            // None of its parts has an area that could be told.
            if this.halves.len() as u32 == this.begins[this.begins.len() - 1] {
                continue;
            }
            this.begins.push(this.halves.len() as u32);
            transmittances.push(through(whole.elements[0]));
            polygons.push(whole.polygon);
        }
        this.wholes = Blockers::new(polygons, transmittances, world.diagonal);
        this
    }

    /// What an element is cut into, down to patches; nothing where no part of it is one. Parts too thin to be patches count
    /// as what lies beside them.
    fn part(&mut self, mesh: &Mesh, id: ElementId, patch_of: &[Option<u32>]) -> Option<Part> {
        if let Some(patch) = patch_of[id.index()] {
            return Some(Part::Patch(patch));
        }
        let parts = mesh.element(id).children()?.map(|child| self.part(mesh, child, patch_of));
        let beside = parts.iter().flatten().next().copied()?;
        let first = self.quarters.len() as u32;
        self.quarters.extend(parts.map(|part| part.unwrap_or(beside)));
        Some(Part::Cut(first))
    }

    /// The first patch that a ray from a surface meets, the surface itself left out.
    ///
    /// `direction`: of length one.
    pub(crate) fn first_hit(&self, from: DVec3, direction: DVec3) -> Option<PatchHit> {
        self.wholes.first_hit(from, direction).map(|hit| self.on_patch(hit, from, direction))
    }

    /// The same, nearer than `reach`, metres.
    pub(crate) fn first_hit_within(&self, from: DVec3, direction: DVec3, reach: f64) -> Option<PatchHit> {
        self.wholes.first_hit_within(from, direction, reach).map(|hit| self.on_patch(hit, from, direction))
    }

    /// The same for rays from one point that lie near each other.
    pub(crate) fn first_hits(&self, from: DVec3, directions: &[DVec3; PACKET]) -> [Option<PatchHit>; PACKET] {
        let hits = self.wholes.first_hits(from, directions);
        std::array::from_fn(|k| hits[k].map(|hit| self.on_patch(hit, from, directions[k])))
    }

    /// The patch that stops a ray: of filters as often as they do, over random numbers.
    ///
    /// `chance`: 0 to 1, which filter stops it.
    pub(crate) fn first_stop(&self, from: DVec3, direction: DVec3, chance: f64) -> Option<PatchHit> {
        self.wholes.first_stop(from, direction, chance).map(|hit| self.on_patch(hit, from, direction))
    }

    fn on_patch(&self, hit: Hit, from: DVec3, direction: DVec3) -> PatchHit {
        let polygon = hit.polygon as usize;
        let halves = &self.halves[self.begins[polygon] as usize..self.begins[polygon + 1] as usize];
        let patch = match halves[0].part {
            Part::Patch(patch) if is_one_patch(halves) => patch,
            _ => self.patch_at(halves, from + hit.distance * direction),
        };
        PatchHit {
            side: 2 * patch + u32::from(!hit.front),
            through: self.wholes.blocking().transmittance(hit.polygon),
            distance: hit.distance,
        }
    }

    fn patch_at(&self, halves: &[Half], point: DVec3) -> u32 {
        let (mut weights, mut part) = (halves[0].weights(point), halves[0].part);
        if let [_, second] = halves
            && weights.min_element() < 0.0
        {
            (weights, part) = (second.weights(point), second.part);
        }
        loop {
            let first = match part {
                Part::Patch(patch) => return patch,
                Part::Cut(first) => first,
            };
            let corner = (0..3).find(|&k| weights[k] >= 0.5);
            weights = match corner {
                Some(k) => 2.0 * weights - DVec3::AXES[k],
                // Its corners are the middles of the edges 01, 12 and 20.
                None => DVec3::new(1.0 - 2.0 * weights.z, 1.0 - 2.0 * weights.x, 1.0 - 2.0 * weights.y),
            };
            part = self.quarters[first as usize + corner.unwrap_or(3)];
        }
    }

    /// Size of the scene, metres.
    pub(crate) fn diagonal(&self) -> f64 {
        self.wholes.diagonal()
    }
}

/// Whether all of a polygon belongs to one patch.
fn is_one_patch(halves: &[Half]) -> bool {
    halves.iter().all(|half| half.part == halves[0].part)
}

impl Half {
    fn new([a, b, c]: [DVec3; 3], part: Part) -> Self {
        let [along, across] = [b - a, c - a];
        let normal = along.cross(across);
        let per_area = 1.0 / normal.length_squared();
        Self { corner: a, gradients: [across.cross(normal) * per_area, normal.cross(along) * per_area], part }
    }

    /// Barycentric weights of a point.
    fn weights(&self, point: DVec3) -> DVec3 {
        let way = point - self.corner;
        let [second, third] = self.gradients.map(|gradient| gradient.dot(way));
        DVec3::new(1.0 - second - third, second, third)
    }
}
