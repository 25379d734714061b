//! Light that can neither leave nor be absorbed: it has no solution, and is refused by the names of what it lies between.
//!
//! Found by rays, like whether a space is closed: what arrives is exact at each receiver, whose form factors sum to 1 at most,
//! but summed over a source's patches it is what was sent within some per cent only, so that what a shot loses tells nothing of
//! what gets out.

use glam::DVec3;
use rayon::prelude::*;

use crate::error::Error;
use crate::index::FaceId;
use crate::mesh::Mesh;
use crate::monitor::Monitor;
use crate::scene::world::World;
use crate::transport::hemisphere::Directions;
use crate::transport::patch_tree::PatchTree;
use crate::transport::rows::{Rows, rays_from};
use crate::transport::sources::{SourceId, Sources};

/// Absorbed share of what arrives that cannot be told from none: rounding of 1 - rho.
const ABSORBS_NOTHING: f64 = 1e-12;

/// Strata along each side of a patch's hemisphere, 529 rays, about as many as a space is asked for by links: light that
/// leaves by less goes on for hundreds of reflections.
const STRATA: usize = 23;

/// Share of the emitters' light that may be caught where nothing absorbs it: in gaps between white things that no ray found
/// the way out of. More is no gap.
const CAUGHT_IN_GAPS: f64 = 0.01;

/// Per side of a patch and per colour channel: whether all light that it gets stays among such as it for ever.
#[derive(Default)]
pub(crate) struct Endless(Vec<[bool; 3]>);

impl Endless {
    /// Looks around from what absorbs nothing. Where all absorb something, this costs nothing.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(super) fn new(
        world: &World,
        mesh: &Mesh,
        patches: &Sources,
        monitor: &Monitor,
    ) -> Result<Self, Error> {
        let white = absorb_nothing(world, mesh, patches);
        if white.iter().all(|channels| *channels == [false; 3]) {
            return Ok(Self(white));
        }
        let tree = PatchTree::new(world, mesh, patches);
        let directions = Directions::square(STRATA);
        let met: Vec<Option<Vec<u32>>> = (0..patches.len())
            .into_par_iter()
            .map(|side| {
                let asked = !monitor.is_cancelled() && white[side] != [false; 3];
                asked.then(|| around(side, patches, &tree, &directions, &white)).flatten()
            })
            .collect();
        monitor.check()?;
        Ok(Self::among(white, |side| met[side].as_deref()))
    }

    /// Of rows that are known.
    pub(super) fn of_rows(world: &World, mesh: &Mesh, patches: &Sources, rows: &Rows) -> Self {
        Self::among(absorb_nothing(world, mesh, patches), |side| rows.enclosed(side))
    }

    /// `white`: per side and channel, whether it absorbs nothing. `met`: the sides that the rays of one meet; none where one of
    /// them leaves or where nobody looked.
    fn among<'a>(white: Vec<[bool; 3]>, met: impl Fn(usize) -> Option<&'a [u32]> + Sync) -> Self {
        let mut endless = white;
        let mut open: Vec<usize> = (0..endless.len()).filter(|&side| endless[side] != [false; 3]).collect();
        // What leaks, and what leaks by that
        loop {
            let keeps = |&side: &usize| {
                let others = met(side)?.iter().map(|&other| endless[other as usize]);
                Some(others.fold(endless[side], |kept, other| [0, 1, 2].map(|k| kept[k] && other[k])))
            };
            let kept: Vec<[bool; 3]> = open.par_iter().map(|side| keeps(side).unwrap_or_default()).collect();
            let changed = open.iter().zip(&kept).any(|(&side, kept)| endless[side] != *kept);
            open.iter().zip(kept).for_each(|(&side, kept)| endless[side] = kept);
            if !changed {
                return Self(endless);
            }
            open.retain(|&side| endless[side] != [false; 3]);
        }
    }

    /// What a side reflects of light that it gets for good: nothing where that would go on for ever.
    pub(super) fn without(&self, side: usize, reflected: DVec3) -> DVec3 {
        let [r, g, b] = self.0[side].map(|endless| f64::from(!endless));
        reflected * DVec3::new(r, g, b)
    }

    /// Refuses light that is emitted into closed spaces which absorb nothing of it.
    ///
    /// `direct`: per side, what emitters bring, W/m².
    ///
    /// # Errors
    /// [`Error::EndlessLight`].
    pub(super) fn refuse(
        &self,
        world: &World,
        mesh: &Mesh,
        patches: &Sources,
        direct: impl Fn(usize) -> DVec3,
    ) -> Result<(), Error> {
        let power = |side: usize| patches.area(SourceId::new(side)) * direct(side).abs();
        let caught = |side: usize| power(side) - self.without(side, power(side));
        let sides = || 0..patches.len();
        let all: DVec3 = sides().map(power).sum();
        if sides().map(caught).sum::<DVec3>().cmple(CAUGHT_IN_GAPS * all).all() {
            return Ok(());
        }
        let lit = sides().filter(|&side| caught(side) != DVec3::ZERO);
        let object = |side: usize| world.faces[face(mesh, patches, side).index()].object;
        Err(Error::endless_light(lit.map(|side| world.objects[object(side).index()].name.clone())))
    }
}

/// Per side and channel, whether all light that it gets is reflected or let through.
fn absorb_nothing(world: &World, mesh: &Mesh, patches: &Sources) -> Vec<[bool; 3]> {
    let absorbs_nothing = |side: usize| {
        let patch = &patches.patches[side / 2];
        let absorbed = DVec3::ONE - world.transmittance(face(mesh, patches, side)) - patch.reflectance;
        absorbed.to_array().map(|absorbed| absorbed <= ABSORBS_NOTHING)
    };
    (0..patches.len()).map(absorbs_nothing).collect()
}

fn face(mesh: &Mesh, patches: &Sources, side: usize) -> FaceId {
    mesh.element(patches.patches[side / 2].elements[0]).face
}

/// The sides that the rays of one meet; none as soon as one of them leaves or meets what absorbs what this does not.
fn around(
    side: usize,
    patches: &Sources,
    tree: &PatchTree,
    directions: &Directions,
    white: &[[bool; 3]],
) -> Option<Vec<u32>> {
    let mut met: Vec<u32> = rays_from(&patches.patches[side / 2].polygon, side, directions)
        .map(|ray| {
            let hit = ray.first_stop(tree)?;
            let shared = (white[side].iter().zip(white[hit.side as usize])).any(|(&a, b)| a && b);
            shared.then_some(hit.side)
        })
        .collect::<Option<_>>()?;
    met.sort_unstable();
    met.dedup();
    Some(met)
}
