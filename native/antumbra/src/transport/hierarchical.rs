//! The exchange of light by links between nodes of a hierarchy, solved for all bounces at once (Hanrahan, Salzman,
//! Aupperle 1991, with clusters after Smits, Arvo, Greenberg 1994).
//!
//! Where shooting (the paper, §1) sends light from one patch at a time, here all of it is in one symmetric system that
//! conjugate gradients solve for any reflectance. What emitters bring comes from the display mesh, which knows the
//! shadows; what surfaces reflect is exchanged over links that are as coarse as the wanted error allows.
//!
//! **Guaranteed.** Where no light escapes, none is lost: what is absorbed equals what is emitted to rounding. A closed
//! space that reflects everything and is lit has no solution and is refused by name.

mod second_bounce;

use glam::DVec3;

use crate::display::{Display, Light, baked_area};
use crate::error::Error;
use crate::index::ElementId;
use crate::mesh::{Mesh, Side};
use crate::report::TransportSummary;
use crate::scene::world::interpolated;
use crate::settings::Quantity;
use crate::transport::enclosure::{Enclosure, RAYS, escaping, spaces};
use crate::transport::endless::Endless;
use crate::transport::hierarchy::{Hierarchy, Node, NodeId, Shape, Surface};
use crate::transport::links::{Links, NodeLight, Wanted};
use crate::transport::overlay::{Received, spread_over_leaves};
use crate::transport::problem::Problem;
use crate::transport::quadrature::quadrature;
use crate::transport::secondary::{OnFace, Reflector, reflectors};
use crate::transport::shooting::PatchMesh;
use crate::transport::source_tree::SourceTree;
use crate::transport::sources::{SourceId, Sources};
use crate::transport::system::System;
use crate::visibility::{ANY_OBJECT, Receiver};

/// Edge of the smallest element, in patches: enough for a lamp that touches a wall.
const SMALLEST: f64 = 1.0 / 16.0;

/// Times that the links are refined: each solution tells what light there is to link for. The second seldom adds a tenth.
const MOST_ROUNDS: usize = 3;

/// Growth of the number of links below which another round is not worth its solution.
const SETTLED: f64 = 1.1;

/// Share of the wanted error over all baked surfaces that a single link may make: for an estimate, and for good. Links to
/// one element err alike where a neighbour shades it, so that a thousand of them make the wanted error only at a
/// sixtieth. With the correction the Cornell box errs by 1.7, 1.03 and 0.85 % at 0.1, 0.03 and 0.015, with 8, 28 and 62
/// thousand links.
const ESTIMATE: f64 = 0.4;
const FINAL: f64 = 0.015;

/// Points at which emitters' light is computed on a leaf that is not displayed: a rule of two along each side.
const RULE: usize = 2;

/// The state of a solution by links.
pub(crate) struct Hierarchical<'a> {
    problem: Problem<'a>,
    hierarchy: Hierarchy,
    links: Links,
    light: NodeLight,
    /// Per node, of leaves: what emitters bring.
    direct: Vec<Received>,
    /// Mean radiosity that the baked surfaces show, W/m².
    mean_shown: f64,
    /// The same of what emitters bring, as it was first found.
    mean_of_direct: f64,
    system: System,
    /// Whether more than an estimate is known.
    solved: bool,
    /// [`Enclosure::caught`].
    caught: Vec<Option<f64>>,
}

impl<'a> Hierarchical<'a> {
    /// What emitters bring to a hierarchy over the roots of a mesh, in elements of the size of patches.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::EndlessLight`] where light can neither leave nor be absorbed.
    pub(crate) fn new(
        problem: Problem<'a>,
        patches: &PatchMesh,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, Error> {
        let Problem { world, emitters, .. } = problem;
        let PatchMesh { mesh, patch_size, .. } = patches;
        let roots: Vec<ElementId> = ElementId::range(0..mesh.roots.len()).collect();
        let roots = Sources::new(world, mesh, &roots);
        let hierarchy = Hierarchy::new(world, mesh, &roots, *patch_size, (SMALLEST * patch_size).powi(2));
        let mut this = Self {
            problem,
            links: Links::new(&hierarchy),
            hierarchy,
            light: NodeLight::default(),
            direct: Vec::new(),
            mean_shown: 0.0,
            mean_of_direct: 0.0,
            system: System::default(),
            solved: false,
            caught: Vec::new(),
        };
        // As if all surfaces got the same of what is sent
        let even = emitters.power.abs() / world.surface_area();
        this.mean_shown = this.mean_of(&vec![even; this.hierarchy.nodes.len()]);
        if this.mean_shown == 0.0 {
            // What is black shows none of it, however much that is.
            this.mean_shown = even.element_sum() / 3.0;
        }
        this.gather_direct(None, ends)?;
        this.leave_out_endless_light(mesh, &roots)?;
        this.light = NodeLight::of_leaves(&this.hierarchy, &this.reflected_direct(), &this.direct);
        // What is shown may get none of it directly
        this.mean_of_direct = this.mean_of(&this.irradiance_of_direct());
        this.mean_shown = this.mean_shown.max(this.mean_of_direct);
        Ok(this)
    }

    /// A first estimate of all light.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn estimate(&mut self, ends: &(dyn Fn() -> bool + Sync)) -> Result<(), Error> {
        self.exchange(ESTIMATE, None, ends)
    }

    /// Says that what emitters bring is all the light there is.
    pub(crate) fn know_all_light(&mut self) {
        if self.mean_of_direct != 0.0 {
            self.mean_shown = self.mean_of_direct;
        }
    }

    /// Once the display mesh knows the emitters' light: takes it over and solves for the rest.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub(crate) fn solve(&mut self, display: &Display, ends: &(dyn Fn() -> bool + Sync)) -> Result<(), Error> {
        self.exchange(FINAL, Some(display), ends)?;
        self.solved = true;
        Ok(())
    }

    /// Whether emitters light none of the places on what is baked that were looked at.
    pub(crate) fn is_dark(&self) -> bool {
        self.mean_of_direct == 0.0
    }

    /// Share of all light that has not arrived yet: until it is solved for, what surfaces reflect.
    pub(crate) fn remaining(&self) -> f64 {
        if self.solved || self.mean_shown == 0.0 {
            return 0.0;
        }
        (1.0 - self.mean_of(&self.irradiance_of_direct()) / self.mean_shown).clamp(0.0, 1.0)
    }

    /// Refines the links until they err by no more than a share of the wanted error, solving in between.
    fn exchange(
        &mut self,
        share: f64,
        display: Option<&Display>,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Error> {
        let area = baked_area(self.problem.world);
        for round in 0..MOST_ROUNDS {
            let wanted_error = self.wanted_error();
            let tolerance = share * wanted_error * area.sqrt();
            let before = self.links.links.len();
            let most = self.problem.settings.effort.links;
            let wanted = Wanted { error: wanted_error, per_link: tolerance, most };
            self.links.refine(&mut self.hierarchy, &mut self.light, self.problem.form_factors, wanted, ends);
            self.problem.monitor.check()?;
            self.gather_direct(display, ends)?;
            let settled = self.links.links.len() as f64 <= SETTLED * before as f64;
            // An estimate is as good with the solution before it.
            if settled && round > 0 && display.is_none() {
                break;
            }
            self.solve_system()?;
            if settled || ends() {
                break;
            }
        }
        Ok(())
    }

    /// Finds what emitters bring to every leaf: from the display mesh where it shows that side, otherwise from points.
    fn gather_direct(
        &mut self,
        display: Option<&Display>,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Error> {
        let hierarchy = &self.hierarchy;
        let mut direct = vec![Received::NOTHING; hierarchy.nodes.len()];
        let shown = |node: &Node| {
            display.is_some() && hierarchy.surface(node).is_some_and(|surface| self.is_displayed(surface))
        };
        if let Some(display) = display {
            self.spread(display, Light::Direct, &mut direct);
        }
        let mut points: Vec<(NodeId, f64)> = Vec::new();
        let mut receivers = Vec::new();
        for id in hierarchy.leaves() {
            let node = hierarchy.node(id);
            let Some(polygon) = node.polygon() else { continue };
            if shown(node) {
                direct[id.index()].mean /= node.area;
                continue;
            }
            if let Some(known) = self.direct.get(id.index()).filter(|known| known.least.is_finite()) {
                direct[id.index()] = *known;
                continue;
            }
            let object = hierarchy.surface(node).map_or(ANY_OBJECT, |surface| {
                self.problem.world.faces[surface.faces[0].index()].object.index() as u32
            });
            for (position, share) in quadrature(polygon, RULE) {
                points.push((id, share));
                receivers.push(Receiver::new(position, polygon.normal()).of(object));
            }
        }
        let seeds: Vec<u64> = (0..receivers.len() as u64).collect();
        // What rays err by at one leaf is averaged over all of them by whoever sees them.
        let wanted_error = self.wanted_error() * (self.hierarchy.leaves().count() as f64).sqrt();
        let gather = self.problem.gather_direct(wanted_error, ends);
        for ((id, share), arrived) in points.into_iter().zip(gather.at(&receivers, &seeds, &[])?) {
            let received = &mut direct[id.index()];
            received.mean += share * arrived.irradiance;
            received.include(arrived.irradiance);
        }
        self.direct = direct;
        Ok(())
    }

    /// Solves for the radiosity of all leaves over the links as they are.
    fn solve_system(&mut self) -> Result<(), Error> {
        let spaces = spaces(&self.hierarchy, &self.links.links);
        let lit = |index: usize| {
            self.direct[index].mean != DVec3::ZERO || self.light.radiosity[index] != DVec3::ZERO
        };
        let enclosure =
            Enclosure::new(&self.hierarchy, &spaces, lit, &self.caught, self.problem.form_factors.blockers);
        let emitted = self.emitted_inside(&spaces, &enclosure.closed);
        let arriving = self.irradiance_of_direct();
        self.system = System::solved(
            &self.hierarchy,
            &self.links.links,
            &enclosure,
            arriving,
            emitted,
            self.problem.monitor,
        );
        self.problem.monitor.check()?;
        self.caught = enclosure.caught;
        self.take_over_solution();
        Ok(())
    }

    /// Corrects what links get wrong by what the display mesh was found to receive of the light as it was.
    pub(crate) fn correct(&mut self, display: &Display) {
        let mut received = vec![Received::NOTHING; self.hierarchy.nodes.len()];
        self.spread(display, Light::Indirect, &mut received);
        let found = (self.hierarchy.nodes.iter().zip(&received))
            .map(|(node, received)| received.least.is_finite().then(|| received.mean / node.area))
            .collect();
        self.system.correct(&self.hierarchy, &self.links.links, found, self.problem.monitor);
        self.take_over_solution();
    }

    /// Whether the display mesh knows the emitters' light on a side of a surface.
    fn is_displayed(&self, surface: &Surface) -> bool {
        surface.side == Side::Front && surface.faces.iter().all(|&face| self.problem.world.receives(face))
    }

    fn take_over_solution(&mut self) {
        // What shows no light at all gives no scale: relative to it, no error would be small enough.
        let mean = self.mean_of(&self.system.irradiance());
        if mean != 0.0 {
            self.mean_shown = mean;
        }
        self.light = NodeLight::of_leaves(&self.hierarchy, &self.system.radiosity(), &self.direct);
    }

    /// Adds the light of the display mesh to the leaves below it; means are sums of integrals, W.
    fn spread(&self, display: &Display, light: Light, received: &mut [Received]) {
        display.for_each_lit(light, |face, places, values| {
            let corners = self.problem.world.corners(&self.problem.world.faces[face.index()]);
            let positions = places.map(|place| interpolated(corners, place));
            spread_over_leaves(&self.hierarchy, face, positions, values, received);
        });
    }

    /// What emitters send into a closed space, W, when they send to nowhere else.
    fn emitted_inside(&self, spaces: &[u32], closed: &[bool]) -> Option<DVec3> {
        let lit =
            |index: usize| self.direct[index].mean != DVec3::ZERO && self.hierarchy.nodes[index].is_leaf();
        if !self.problem.emitters.tree.lamps.is_empty() || self.problem.emitters.tree.sky.is_some() {
            return None;
        }
        let mut lit_leaves = (0..closed.len()).filter(|&index| lit(index));
        let space = spaces[lit_leaves.next().filter(|&first| closed[first])?];
        if !lit_leaves.all(|index| closed[index] && spaces[index] == space) {
            return None;
        }
        let mut inside = DVec3::ZERO;
        for (index, lamp) in self.problem.emitters.polygons.iter().enumerate() {
            // The outside of a room that emits on both sides lights nothing.
            if escaping(&lamp.polygon, RAYS, self.problem.form_factors.blockers, index as u64) == 0.0 {
                inside += lamp.radiosity * lamp.polygon.area();
            }
        }
        Some(inside)
    }

    /// Refuses light that would go on for ever, or leaves it out where it is little.
    ///
    /// `roots`: whose sides the surfaces are.
    fn leave_out_endless_light(&mut self, mesh: &Mesh, roots: &Sources) -> Result<(), Error> {
        let endless = Endless::new(self.problem.world, mesh, roots, self.problem.monitor)?;
        let mut direct = vec![DVec3::ZERO; roots.len()];
        for id in self.hierarchy.leaves() {
            if let Shape::Flat { surface, .. } = self.hierarchy.node(id).shape {
                let share = self.hierarchy.node(id).area / roots.area(SourceId::new(surface.index()));
                direct[surface.index()] += share * self.direct[id.index()].mean;
            }
        }
        endless.refuse(self.problem.world, mesh, roots, |side| direct[side])?;
        for (side, surface) in self.hierarchy.surfaces.iter_mut().enumerate() {
            surface.reflectance = endless.without(side, surface.reflectance);
        }
        Ok(())
    }

    fn irradiance_of_direct(&self) -> Vec<DVec3> {
        self.direct.iter().map(|received| received.mean).collect()
    }

    fn reflected_direct(&self) -> Vec<DVec3> {
        (self.hierarchy.nodes.iter().zip(&self.direct))
            .map(|(node, received)| {
                self.hierarchy
                    .surface(node)
                    .map_or(DVec3::ZERO, |surface| surface.reflectance * received.mean)
            })
            .collect()
    }

    /// Mean radiosity that the baked surfaces show, over the channels, W/m².
    fn mean_of(&self, irradiance: &[DVec3]) -> f64 {
        let white = self.problem.settings.quantity == Quantity::Irradiance;
        let (mut sum, mut area) = (DVec3::ZERO, 0.0);
        for id in self.hierarchy.leaves() {
            let node = self.hierarchy.node(id);
            let Some(surface) = self.hierarchy.surface(node).filter(|surface| surface.receives) else {
                continue;
            };
            let reflectance = if white { DVec3::ONE } else { surface.shown };
            sum += node.area * reflectance * irradiance[id.index()];
            area += node.area;
        }
        if area > 0.0 { sum.element_sum() / (3.0 * area) } else { 0.0 }
    }

    /// The error that the user wants, W/m².
    pub(crate) fn wanted_error(&self) -> f64 {
        self.problem.settings.tolerance * self.mean_shown
    }

    /// What whole faces reflect of the emitters' light, as far as it is known.
    pub(crate) fn reflectors(&self) -> Vec<Reflector> {
        let mut received: Vec<OnFace> = vec![([DVec3::ZERO; 2], 0.0); self.problem.world.faces.len()];
        for id in self.hierarchy.leaves() {
            let node = self.hierarchy.node(id);
            let Some(surface) = self.hierarchy.surface(node) else { continue };
            // A surface of two faces is one quadrilateral, lit as one.
            let area = node.area / surface.faces.len() as f64;
            for face in &surface.faces {
                let (power, known) = &mut received[face.index()];
                power[surface.side as usize] += area * self.direct[id.index()].mean;
                *known += 0.5 * area;
            }
        }
        reflectors(self.problem.world, &received)
    }

    /// What surfaces reflect, from coarse to fine.
    pub(crate) fn lit(&self) -> SourceTree {
        SourceTree::of_hierarchy(&self.hierarchy, &self.light)
    }

    /// For the report.
    pub(crate) fn summary(&self) -> TransportSummary {
        TransportSummary {
            mode: "HIERARCHICAL".to_owned(),
            elements: self.hierarchy.leaves().count(),
            links: self.links.links.len(),
            iterations: self.system.iterations,
            imbalance: self.system.imbalance(),
        }
    }
}
