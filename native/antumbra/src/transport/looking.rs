//! The exchange of light by rays, for scenes of very many faces: every patch looks around once, and what it sees is kept.
//!
//! Form factors between n patches are n²; of most of them a patch sees nothing. Rays that leave a patch like light arrives
//! there, spread by the cosine, meet what it gets light from in the right proportion (the hemisphere of Cohen, Greenberg
//! 1985, by rays as in Malley 1988). Patches are many and each sends little, so that a few rays per patch suffice: their
//! errors average out over all that look at it. The rows of this exchange sum exactly to the share that does not escape,
//! so that no light is lost and none is made, however few the rays.
//!
//! What is shown is gathered from the solution by rays as well, more of them ([`Surroundings`]).

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::adapt::patch_light::{PatchIrradiance, PatchLight};
use crate::display::{Display, Light};
use crate::error::Error;
use crate::mesh::Mesh;
use crate::mesh::coarse::{LEAST_AREA, cut_into_patches, patches_of};
use crate::report::TransportSummary;
use crate::scene::world::World;
use crate::settings::{Effort, Quantity};
use crate::transport::conjugate_residuals::solve;
use crate::transport::crevices::cut_at_crevices;
use crate::transport::endless::Endless;
use crate::transport::gather::Reflected;
use crate::transport::hemisphere::Surroundings;
use crate::transport::patch_tree::PatchTree;
use crate::transport::patches::received;
use crate::transport::pockets::darken_pockets;
use crate::transport::problem::Problem;
use crate::transport::rows::{Around, Rows, normal};
use crate::transport::shooting::PatchMesh;
use crate::transport::sources::{Patch, SourceId, Sources};
use crate::visibility::blockers::Blockers;
use crate::visibility::rays::{point_on, splitmix, spread, unit};
use crate::visibility::{Receiver, grey};

/// Edge of the smallest part of a patch that reaches into a crevice, in patches.
const SMALLEST: f64 = 1.0 / 16.0;

/// Faces for each of the patches that a scene's surface is cut into, however many it takes: a scene of more faces is larger as a
/// rule. In a flat of 64 rooms and a million triangles 20,000 patches were 0.7 m long, and a bake at a tolerance of 0.05 erred by
/// 7.3 %; with one for 8 faces by 5.8 %, with one for 4 by 5.1 %. An interior of 262,663 went from 4.9 to 4.1 %.
const FACES_PER_PATCH: f64 = 4.0;

/// Points of a side that is not shown at which the emitters' light is looked for, and where it differs: the middle of a lamp
/// shade's inside tells nothing of the light at its rim.
const UNSHOWN: [u32; 2] = [4, 32];

/// Light differs over a side where at some point it is off the mean by this share.
const UNEVEN: f64 = 0.25;

/// Residual, relative to what emitters bring, at which a solution is good: rays err by more.
const RESIDUAL: f64 = 1e-4;

/// Height, of the scene's size, from which the patch that a place is on is looked for: above the rounding of its polygon.
const ABOVE: f64 = 1e-6;

/// How much farther than that it may be, since facets lie below what they round off.
const FARTHEST_BELOW: f64 = 1e3;

/// The state of a solution by rays.
pub(crate) struct Looking<'a> {
    problem: Problem<'a>,
    mesh: Mesh,
    patches: Sources,
    /// Patches that block.
    tree: PatchTree,
    /// Per patch: share of what arrives that it stops, over the channels.
    stops: Vec<f64>,
    rows: Rows,
    /// What would go on for ever, and is left out.
    endless: Endless,
    /// Per side: what emitters bring, W/m².
    direct: Vec<DVec3>,
    /// Per side: what it reflects, W/m²; of filters that share of all rays that they stop.
    radiosity: Vec<DVec3>,
    iterations: usize,
    mean_shown: f64,
    solved: bool,
}

/// Edge of a patch, metres.
pub(crate) fn patch_size(world: &World, effort: Effort) -> f64 {
    let patches = effort.patches.max(world.faces.len() as f64 / FACES_PER_PATCH);
    (world.surface_area() / patches).sqrt()
}

/// Cuts the roots of a mesh into patches that are small where they reach under something.
pub(crate) fn patches_that_look_around(
    world: &World,
    blockers: &Blockers,
    mut mesh: Mesh,
    effort: Effort,
    ends: &(dyn Fn() -> bool + Sync),
) -> PatchMesh {
    let patch_size = patch_size(world, effort);
    // As many as if all surfaces were cut as small as slivers are elsewhere: a gigabyte of them
    let most = (4.0 * effort.patches / LEAST_AREA) as usize;
    // Mouldings are slivers, and what lights a wall beside windows: their length counts. A scene of hairs is nothing else, and
    // is cut to the squares' area.
    let is_of_hairs = patches_of(&mesh, patch_size, 0.0) > (mesh.roots.len() + most) as f64;
    let elements = cut_into_patches(&mut mesh, patch_size, if is_of_hairs { 1.0 } else { 0.0 });
    let smallest = SMALLEST * patch_size;
    let most = elements.len() + most;
    let elements = cut_at_crevices(&mut mesh, blockers, elements, smallest, most, ends);
    PatchMesh { mesh, elements, patch_size }
}

impl<'a> Looking<'a> {
    /// Lets every patch look around, and makes a first estimate of all light.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::EndlessLight`] where light can neither leave nor be absorbed.
    pub(crate) fn new(
        problem: Problem<'a>,
        patches: PatchMesh,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, Error> {
        let Problem { world, settings, monitor, emitters, .. } = problem;
        let PatchMesh { mut mesh, elements, .. } = patches;
        let patches = Sources::new(world, &mesh, &elements);
        mesh.settle();
        let through = |patch: &Patch| world.transmittance(mesh.element(patch.elements[0]).face);
        let stops = patches.patches.iter().map(|patch| 1.0 - grey(through(patch))).collect();
        let tree = PatchTree::new(world, &mesh, &patches);
        let around = Around { patches: &patches, tree: &tree, sky: emitters.around.as_ref() };
        let rows = Rows::look_around(around, settings.effort.rays, monitor, ends)?;
        let mut this = Self {
            problem,
            endless: Endless::of_rows(world, &mesh, &patches, &rows),
            mesh,
            rows,
            direct: Vec::new(),
            radiosity: vec![DVec3::ZERO; patches.len()],
            patches,
            tree,
            stops,
            iterations: 0,
            mean_shown: 0.0,
            solved: false,
        };
        // As if all surfaces got the same of what is sent
        this.mean_shown =
            this.mean_of(&vec![emitters.power.abs() / world.surface_area(); this.patches.len()]);
        this.gather_direct(ends)?;
        this.endless.refuse(world, &this.mesh, &this.patches, |side| this.direct[side])?;
        this.solve_system();
        Ok(this)
    }

    /// Once the display mesh knows the emitters' light: takes it over and solves again, or leaves it at the first estimate
    /// when it has to end.
    pub(crate) fn solve(&mut self, display: &Display, ends: &(dyn Fn() -> bool + Sync)) {
        self.solved = true;
        if ends() {
            return;
        }
        let elements = self.patches.patches.iter().flat_map(|patch| patch.elements.iter().copied());
        let received = received(&self.mesh, self.problem.world, Some(display), elements);
        for (index, patch) in self.patches.patches.iter().enumerate() {
            let mut power = DVec3::ZERO;
            let mut area = 0.0;
            for &element in &patch.elements {
                if let Some(known) = received[element.index()].filter(|known| known.least.is_finite()) {
                    power += self.mesh.element(element).area * known.mean;
                    area += self.mesh.element(element).area;
                }
            }
            if area > 0.0 {
                self.direct[2 * index] = power / area + self.rows.from_sky[2 * index];
            }
        }
        self.solve_system();
    }

    /// Whether emitters light no patch of what is baked.
    pub(crate) fn is_dark(&self) -> bool {
        self.mean_of(&self.direct) == 0.0
    }

    /// What emitters bring to every side: to its middle where the display mesh will tell more, else to some points of it.
    fn gather_direct(&mut self, ends: &(dyn Fn() -> bool + Sync)) -> Result<(), Error> {
        let is_shown = |side: usize| side.is_multiple_of(2) && self.patches.patches[side / 2].receives;
        let (shown, unshown): (Vec<usize>, Vec<usize>) = (0..self.patches.len())
            .filter(|&side| !self.rows.of(side).is_empty())
            .partition(|&side| is_shown(side));
        let [few, many] = UNSHOWN;
        let mut direct = vec![DVec3::ZERO; self.patches.len()];
        self.direct_at(&shown, 0..1, &mut direct, ends)?;
        let uneven = self.direct_at(&unshown, 1..few + 1, &mut direct, ends)?;
        self.direct_at(&uneven, 1..many + 1, &mut direct, ends)?;
        for (direct, from_sky) in direct.iter_mut().zip(&self.rows.from_sky) {
            *direct += *from_sky;
        }
        self.direct = direct;
        Ok(())
    }

    /// Makes known what emitters bring to sides, W/m²: the mean over some points of each. Returns those over which it differs.
    ///
    /// `points`: 0 is a side's middle, others are spread over it.
    fn direct_at(
        &self,
        sides: &[usize],
        points: Range<u32>,
        direct: &mut [DVec3],
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<usize>, Error> {
        let count = points.len();
        let (mut receivers, mut seeds) = (Vec::new(), Vec::new());
        for &side in sides {
            let Patch { polygon, elements, .. } = &self.patches.patches[side / 2];
            let face = &self.problem.world.faces[self.mesh.element(elements[0]).face.index()];
            let shift = [0, 1].map(|axis| unit(splitmix(2 * side as u64 + axis)));
            for point in points.clone() {
                let at =
                    if point == 0 { polygon.centroid() } else { point_on(polygon, spread(shift, point)) };
                receivers.push(Receiver::new(at, normal(polygon, side)).of(face.object.index() as u32));
                seeds.push(((side as u64) << 32) | u64::from(point));
            }
        }
        // What rays err by at one patch is averaged over all of them by whoever sees them.
        let wanted_error = self.wanted_error() * (self.patches.len() as f64).sqrt();
        let gather = self.problem.gather_direct(wanted_error, ends);
        let arrived = gather.at(&receivers, &seeds, &[])?;
        let mut uneven = Vec::new();
        for (&side, arrived) in sides.iter().zip(arrived.chunks_exact(count)) {
            let light = || arrived.iter().map(|arrived| arrived.irradiance);
            let mean = light().sum::<DVec3>() / count as f64;
            direct[side] = mean;
            if light().any(|light| (light - mean).length() > UNEVEN * mean.length()) {
                uneven.push(side);
            }
        }
        Ok(uneven)
    }

    /// Solves for what all sides reflect.
    fn solve_system(&mut self) {
        let patches = &self.patches.patches;
        let sides = 0..self.patches.len();
        // Rays that a filter stops see more of what it reflects: they are fewer.
        let stops = |side: usize| self.stops[side / 2];
        let areas: Vec<f64> =
            sides.clone().map(|side| stops(side) * self.patches.area(SourceId::new(side))).collect();
        let reflectance: Vec<DVec3> = (sides.clone())
            .map(|side| {
                let reflectance = self.endless.without(side, patches[side / 2].reflectance);
                if stops(side) > 0.0 { reflectance / stops(side) } else { DVec3::ZERO }
            })
            .collect();
        let arrive = |radiosity: &[DVec3]| -> Vec<DVec3> {
            (sides.clone().into_par_iter()).map(|side| self.rows.reflected(side, radiosity)).collect()
        };
        let mut solution = solve(arrive, &areas, &reflectance, &self.direct, RESIDUAL, self.problem.monitor);
        darken_pockets(&mut solution.radiosity, &self.rows, &reflectance, &self.direct, &areas);
        let mut irradiance = arrive(&solution.radiosity);
        irradiance.iter_mut().zip(&self.direct).for_each(|(indirect, direct)| *indirect += *direct);
        self.radiosity = solution.radiosity;
        self.iterations = solution.iterations;
        self.mean_shown = self.mean_of(&irradiance);
    }

    /// Mean radiosity that the baked surfaces show, over the channels, W/m².
    fn mean_of(&self, irradiance: &[DVec3]) -> f64 {
        let white = self.problem.settings.quantity == Quantity::Irradiance;
        let (mut sum, mut area) = (DVec3::ZERO, 0.0);
        for (index, patch) in self.patches.patches.iter().enumerate().filter(|(_, patch)| patch.receives) {
            let reflectance = if white { DVec3::ONE } else { patch.shown };
            sum += patch.polygon.area() * reflectance * irradiance[2 * index];
            area += patch.polygon.area();
        }
        if area > 0.0 { sum.element_sum() / (3.0 * area) } else { 0.0 }
    }

    /// The error that the user wants, W/m².
    pub(crate) fn wanted_error(&self) -> f64 {
        self.problem.settings.tolerance * self.mean_shown
    }

    /// Share of all light that has not arrived yet.
    pub(crate) fn remaining(&self) -> f64 {
        if self.solved || self.mean_shown == 0.0 {
            return 0.0;
        }
        (1.0 - self.mean_of(&self.direct) / self.mean_shown).clamp(0.0, 1.0)
    }

    /// About what arrives at a place on a surface: what its patch gets, W/m². The sky counts as a surface here.
    pub(crate) fn about(&self, light: Light, place: &Receiver) -> DVec3 {
        let Some(side) = self.below(place) else { return DVec3::ZERO };
        match light {
            Light::Direct => self.direct[side] - self.rows.from_sky[side],
            Light::Indirect => self.rows.reflected(side, &self.radiosity) + self.rows.from_sky[side],
        }
    }

    /// The side of a patch that a place is on. In a corner the surface goes on to one side only, and by rounding a ray may
    /// pass where it ends.
    fn below(&self, place: &Receiver) -> Option<usize> {
        let height = ABOVE * self.tree.diagonal();
        let (x, y) = place.normal.any_orthonormal_pair();
        let around = (0..8).map(|k| {
            let (sine, cosine) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
            height * (cosine * x + sine * y)
        });
        std::iter::once(DVec3::ZERO).chain(around).find_map(|beside| {
            let above = place.position + height * place.normal + beside;
            let hit = self.tree.first_hit_within(above, -place.normal, FARTHEST_BELOW * height)?;
            Some(hit.side as usize)
        })
    }

    /// What surfaces reflect.
    pub(crate) fn lit(&self) -> Reflected<'_> {
        let sky = self.problem.emitters.around.as_ref();
        Reflected::Around(Surroundings::new(&self.tree, &self.radiosity, sky))
    }

    /// What patches get of the light of surfaces and of what is beyond them.
    pub(crate) fn patch_light(&self) -> PatchLight {
        let arrived = (self.patches.patches.iter().enumerate()).filter_map(|(index, patch)| {
            let face = self.mesh.element(patch.elements[0]).face;
            let [irradiance, variance] = self.rows.arrived(2 * index, &self.radiosity)?;
            let at = patch.polygon.centroid();
            Some(PatchIrradiance { face, at, irradiance, variance, area: patch.polygon.area() })
        });
        PatchLight::new(self.problem.world, &arrived.collect::<Vec<_>>())
    }

    /// For the report.
    pub(crate) fn summary(&self) -> TransportSummary {
        TransportSummary {
            mode: "RAYS".to_owned(),
            elements: self.patches.len(),
            links: self.rows.hits(),
            iterations: self.iterations,
            imbalance: None,
        }
    }
}
