//! What a solution starts from: how surfaces exchange light, patches, and the mesh that is shown before the light refines it.

use crate::adapt::contact_lines::contacts;
use crate::adapt::scene_lines::SceneLines;
use crate::display::DisplayMesh;
use crate::error::Error;
use crate::mesh::coarse::{LEAST_AREA, Sizes, cut_into_patches, subdivide_to};
use crate::mesh::{Grading, Mesh, Quartering, tessellate};
use crate::scene::world::World;
use crate::settings::{Method, Settings, Transport};
use crate::solve::{SHARE_OF_EMITTERS, SHARE_OF_PATCHES, Solver};
use crate::transport::hierarchical::Hierarchical;
use crate::transport::looking::{Looking, patch_size, patches_that_look_around};
use crate::transport::mode::Solution;
use crate::transport::shooting::{PatchMesh, Shooting};

/// Triangles up to which links carry the light unless something else is asked for: on the paper's scene, in the Cornell box
/// and in two rooms they err less than shooting and take 1.0, 0.6 and 0.7 times as long. Pairs that are told apart grow with
/// the square of the triangles: at a tolerance of 0.05 links took 0.4 and 0.8 times as long as looking around in scenes of 362
/// and 350 triangles, and 2.1, 1.4 and 2.6 times in those of 814, 878 and 960, with as large or larger errors.
const MOST_LINKED: usize = 500;

/// Contacts shorter than this, in patches, do not divide patches: what leaks under such a thing is a sixteenth of a
/// patch's area.
const SMALL_CONTACT: f64 = 0.25;

/// The same where patches look around, in patches that are smaller: inside the parts of a sofa that are pushed into each other
/// it is dark.
const LEAST_CONTACT: f64 = 1.0 / 64.0;

/// Longest edge of what is shown before it is refined, in patches that look around: the light and the darkness that no
/// corner of a larger element knows of would be looked for in a few places only.
const LONGEST_OF_CROWDS: f64 = 8.0;

/// Edge to which triangles are graded where patches look around, in patches.
const GRADED_TO: f64 = 0.5;

impl<'a> Solver<'a> {
    /// Whether the mesh starts from the patches' elements; the discontinuity methods start from the faces.
    pub(super) fn starts_coarse(&self) -> bool {
        matches!(self.problem.settings.method, Method::Uniform | Method::As)
    }

    /// Cuts the scene's faces into patches. Where the method knows contacts, no patch reaches under what stands on it:
    /// its mean would carry light there.
    pub(super) fn patch_mesh(&self, sizes: Sizes, ends: &(dyn Fn() -> bool + Sync)) -> PatchMesh {
        let (world, blockers) = (self.problem.world, self.problem.form_factors.blockers);
        let look_around = self.transport_mode == Transport::Rays;
        let shortest = if look_around {
            patch_size(world, self.problem.settings.effort) * LEAST_CONTACT
        } else {
            sizes.patch * SMALL_CONTACT
        };
        let mut mesh = match self.problem.settings.method {
            Method::Uniform | Method::As => Mesh::new(world),
            Method::Dm | Method::Adm => {
                let contacts = contacts(world, blockers, |_| true, shortest, f64::INFINITY);
                Mesh::of_tiles(&tessellate(world, &contacts, |_| true, 0, None).0)
            }
        };
        if look_around {
            return patches_that_look_around(world, blockers, mesh, self.problem.settings.effort, ends);
        }
        let elements = cut_into_patches(&mut mesh, sizes.patch, LEAST_AREA);
        PatchMesh { mesh, elements, patch_size: sizes.patch }
    }

    /// Where patches look around, what is shown follows their size, unless another is asked for.
    pub(super) fn sizes_beside(&self, mut sizes: Sizes, patches: &PatchMesh) -> Sizes {
        if self.transport_mode == Transport::Rays && self.problem.settings.element_size == 0.0 {
            sizes.element = sizes.element.min(LONGEST_OF_CROWDS * patches.patch_size);
            let least_area = 0.5 * (GRADED_TO * patches.patch_size).powi(2);
            sizes.grading = Some(Grading { longest: sizes.element, least_area });
        }
        sizes
    }

    /// Finds a first estimate of all light, in the way that is asked for or suits the scene.
    pub(super) fn exchange(
        &self,
        patches: PatchMesh,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<Solution<'a>, Error> {
        let problem = self.problem;
        Ok(match self.transport_mode {
            Transport::Shooting => {
                let shooting = Shooting::new(problem, patches, ends)?;
                Solution::Shooting(Box::new(shooting))
            }
            Transport::Hierarchical => {
                let mut hierarchical = Hierarchical::new(problem, &patches, ends)?;
                if self.plan.exchanges() {
                    hierarchical.estimate(ends)?;
                }
                if self.plan.nothing_is_reflected() {
                    hierarchical.know_all_light();
                }
                Solution::Hierarchical(Box::new(hierarchical))
            }
            Transport::Auto | Transport::Rays => {
                let looking = Looking::new(problem, patches, ends)?;
                Solution::Looking(Box::new(looking))
            }
        })
    }

    /// The mesh that the method starts from: `coarse`, or where there is none the faces, cut along lines.
    pub(super) fn display_mesh(
        &mut self,
        coarse: Option<Mesh>,
        sizes: Sizes,
        exchange: &Solution,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<DisplayMesh<'a>, Error> {
        let limit = u8::try_from(self.problem.settings.max_level).unwrap_or(u8::MAX);
        let world = self.problem.world;
        let Some(mut mesh) = coarse else {
            let lines = SceneLines {
                problem: self.problem,
                shown: &self.shown,
                shares: [SHARE_OF_EMITTERS, SHARE_OF_PATCHES],
                looks_for_shadows: self.plan.looks_for_shadows(),
            };
            let lines = lines.find(exchange, ends)?;
            // Bisecting twice does what quartering does once.
            let deepest = limit.saturating_mul(2);
            // A vertex makes two triangles, and its count is a guess; about half of them are left to refinement.
            let lines = lines.worthwhile(self.problem.settings.triangle_limit(world.faces.len()) / 5);
            let (mut mesh, cutting) =
                tessellate(world, &lines, |face| world.receives(face), deepest, sizes.grading);
            self.cutting = cutting;
            mesh.longest_edge =
                if self.problem.settings.element_size > 0.0 { sizes.element } else { f64::INFINITY };
            mesh.bisect_to(sizes.element, self.problem.settings.triangle_limit(mesh.live), ends);
            return Ok(DisplayMesh::Tessellated(mesh));
        };
        let shared_samples = mesh.samples.len();
        let levels = subdivide_to(&mut mesh, world, sizes.element, self.problem.settings.element_size > 0.0);
        let deepest = levels.iter().map(|level| level.saturating_add(limit)).collect();
        Ok(DisplayMesh::Quartered(Quartering { world, mesh, deepest, shared_samples }))
    }
}

/// How surfaces exchange light in a scene, as asked for or as suits it.
pub(super) fn transport_for(world: &World, settings: &Settings) -> Transport {
    match settings.transport {
        Transport::Auto if world.faces.len() <= MOST_LINKED => Transport::Hierarchical,
        Transport::Auto => Transport::Rays,
        asked_for => asked_for,
    }
}
