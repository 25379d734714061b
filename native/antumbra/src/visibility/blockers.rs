//! Everything that blocks light, with a search tree over it.
//!
//! The f32 tree (obvhs `Bvh2`) only narrows down who could block: its boxes are grown by their rounding, and every
//! decision is made in f64 on the polygons themselves.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use smallvec::SmallVec;

use crate::visibility::screens::Screening;
use crate::visibility::shaft::Shaft;
use crate::visibility::trace::Panel;
use crate::visibility::{Blocking, ConvexPolygon};

/// The blocking polygons of a scene.
pub(crate) struct Blockers {
    polygons: Vec<ConvexPolygon>,
    /// Share of light that each lets through, per channel; empty where all are opaque.
    transmittances: Vec<DVec3>,
    /// The largest of those that are opaque.
    large: Vec<u32>,
    tree: Option<Bvh2>,
    /// What rays need of the polygons, in the order of the tree: neighbours lie in memory side by side.
    panels: Vec<Panel>,
    /// Size of the scene, for the length of rays.
    diagonal: f64,
    /// Per polygon: whether nothing is behind it that could be hidden.
    hides_nothing: Vec<bool>,
    /// Whether everything counts as standing between all things.
    everywhere: bool,
    /// What single polygons were found to hide.
    pub(super) screening: Screening,
}

/// How the tree is built. Testing a polygon in f64 costs more than a box, so that leaves of fewer polygons than usual pay; and
/// of ten times as many nodes as usual it is asked whether they would be better off elsewhere. In an interior of 140,000
/// triangles rays are a seventh faster than with the defaults, for 0.3 s.
const BUILD: BvhBuildParams = BvhBuildParams {
    reinsertion_batch_ratio: 0.5,
    collapse_traversal_cost: 1.5,
    ..BvhBuildParams::medium_build()
};

/// More candidates than the caller asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TooMany;

impl std::fmt::Debug for Blockers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Blockers").field("polygons", &self.polygons.len()).finish_non_exhaustive()
    }
}

impl Blockers {
    /// Builds the tree over polygons that let nothing through. They keep their indices.
    #[cfg(test)]
    pub(crate) fn opaque(polygons: Vec<ConvexPolygon>, diagonal: f64) -> Self {
        let transmittances = vec![DVec3::ZERO; polygons.len()];
        Self::new(polygons, transmittances, diagonal)
    }

    /// Builds the tree. Polygons keep their indices.
    ///
    /// `transmittances`: the share of light that each lets through, per channel.
    pub(crate) fn new(polygons: Vec<ConvexPolygon>, mut transmittances: Vec<DVec3>, diagonal: f64) -> Self {
        if transmittances.iter().all(|&share| share == DVec3::ZERO) {
            transmittances.clear();
        }
        if polygons.is_empty() {
            let (large, panels) = (Vec::new(), Vec::new());
            return Self {
                polygons,
                transmittances,
                large,
                tree: None,
                panels,
                diagonal,
                hides_nothing: Vec::new(),
                everywhere: false,
                screening: Screening::default(),
            };
        }
        let hides_nothing = vec![false; polygons.len()];
        let mut boxes: Vec<Aabb> = polygons.iter().map(grown_box).collect();
        // obvhs 0.4.0 gives a primitive centred on the maximum bound the Morton code 0, far from its neighbours, and
        // closed axis-aligned rooms are full of those; two specks outside the bounds keep everything off the bound.
        let whole = boxes.iter().fold(Aabb::empty(), |whole, b| whole.union(b));
        let margin = 1e-3 * whole.diagonal() + Vec3A::splat(f32::MIN_POSITIVE);
        boxes.push(Aabb::from_point(whole.min - margin));
        boxes.push(Aabb::from_point(whole.max + margin));
        let tree = build_bvh2(&boxes, BUILD, &mut std::time::Duration::default());
        let large = largest(Blocking { polygons: &polygons, transmittances: &transmittances });
        let panels = (tree.primitive_indices.iter())
            .map(|&index| {
                polygons.get(index as usize).map_or_else(Panel::nowhere, |polygon| Panel::new(index, polygon))
            })
            .collect();
        Self {
            polygons,
            transmittances,
            large,
            tree: Some(tree),
            panels,
            diagonal,
            hides_nothing,
            everywhere: false,
            screening: Screening::default(),
        }
    }

    /// Whether everything is taken for a candidate, wherever it stands.
    pub(crate) fn takes_everything(&self) -> bool {
        self.everywhere
    }

    /// Tells which polygons hide nothing from anything.
    pub(crate) fn hide_nothing(&mut self, polygons: Vec<bool>) {
        self.hides_nothing = polygons;
    }

    /// Takes everything for a candidate, wherever it stands.
    pub(crate) fn take_everything(&mut self) {
        self.everywhere = true;
    }

    /// Looks for sources behind single polygons that hide all of them.
    pub(crate) fn look_behind_screens(&mut self) {
        self.screening.is_off = true;
    }

    /// Whether what single polygons hide is to be left out.
    pub(crate) fn looks_for_screens(&self) -> bool {
        !self.screening.is_off && !self.everywhere
    }

    /// Counts sources that were asked for by groups of receivers, and those that a single polygon hides.
    pub(crate) fn count_screened(&self, asked_and_hidden: [u64; 2]) {
        self.screening.count(asked_and_hidden);
    }

    /// How many sources were asked for by groups of receivers, and how many of these a single polygon hides.
    pub(crate) fn screened(&self) -> [u64; 2] {
        self.screening.counts()
    }

    /// Size of the scene, metres.
    pub(crate) fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// The search tree, where there is anything; primitives are those of [`Self::panel`].
    pub(super) fn tree(&self) -> Option<&Bvh2> {
        self.tree.as_ref()
    }

    /// What rays need of a primitive of the tree.
    pub(super) fn panel(&self, primitive: usize) -> &Panel {
        &self.panels[primitive]
    }

    /// All polygons, by index.
    pub(crate) fn polygons(&self) -> &[ConvexPolygon] {
        &self.polygons
    }

    /// All polygons, and what they let through.
    pub(crate) fn blocking(&self) -> Blocking<'_> {
        Blocking { polygons: &self.polygons, transmittances: &self.transmittances }
    }

    /// Indices of the largest opaque polygons: walls and the like, which hide much at once.
    pub(crate) fn large(&self) -> &[u32] {
        &self.large
    }

    /// Collects the polygons that could block light inside the shaft, in ascending order.
    ///
    /// # Errors
    /// [`TooMany`] as soon as there are more than `limit`.
    pub(crate) fn candidates(
        &self,
        shaft: &Shaft,
        limit: usize,
        found: &mut Vec<u32>,
    ) -> Result<(), TooMany> {
        self.collect(shaft, limit, |_| true, found)
    }

    /// The same, without those that hide nothing from anything.
    ///
    /// # Errors
    /// [`TooMany`] as soon as there are more than `limit`.
    pub(crate) fn hiding(&self, shaft: &Shaft, limit: usize, found: &mut Vec<u32>) -> Result<(), TooMany> {
        self.collect(shaft, limit, |index| !self.hides_nothing[index as usize], found)
    }

    fn collect(
        &self,
        shaft: &Shaft,
        limit: usize,
        wanted: impl Fn(u32) -> bool,
        found: &mut Vec<u32>,
    ) -> Result<(), TooMany> {
        found.clear();
        let in_shaft = |low, high| self.everywhere || shaft.may_touch_box(low, high);
        let outcome = self.visit(in_shaft, |index, polygon| {
            if self.everywhere || (wanted(index) && shaft.may_block(polygon)) {
                if found.len() == limit {
                    return ControlFlow::Break(());
                }
                found.push(index);
            }
            ControlFlow::Continue(())
        });
        if outcome.is_break() {
            return Err(TooMany);
        }
        // The tree's order depends on its builder; the kernel's rounding must not.
        found.sort_unstable();
        Ok(())
    }

    /// Whether what is asked holds for any of the polygons that may lie inside a shaft.
    pub(crate) fn any(&self, shaft: &Shaft, mut asked: impl FnMut(u32) -> bool) -> bool {
        let in_shaft = |low, high| shaft.may_touch_box(low, high);
        let outcome = self.visit(in_shaft, |index, _| {
            let hides = !self.hides_nothing[index as usize];
            if hides && asked(index) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        outcome.is_break()
    }

    /// Collects the polygons near a box, in ascending order.
    pub(crate) fn touching(&self, low: DVec3, high: DVec3, margin: f64, found: &mut Vec<u32>) {
        found.clear();
        let (low, high) = (low - margin, high + margin);
        let apart = |least: DVec3, most: DVec3| least.cmpgt(high).any() || most.cmplt(low).any();
        let _ = self.visit(
            |least, most| !apart(least, most),
            |index, polygon| {
                let vertices = || polygon.vertices().iter().copied();
                if !apart(
                    vertices().fold(DVec3::INFINITY, DVec3::min),
                    vertices().fold(DVec3::NEG_INFINITY, DVec3::max),
                ) {
                    found.push(index);
                }
                ControlFlow::Continue(())
            },
        );
        found.sort_unstable();
    }

    /// Visits the polygons in all boxes (lowest and highest corner) that are wanted, until it is told to stop.
    fn visit(
        &self,
        wants: impl Fn(DVec3, DVec3) -> bool,
        mut visit: impl FnMut(u32, &ConvexPolygon) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Some(tree) = &self.tree else { return ControlFlow::Continue(()) };
        let mut stack = SmallVec::<[u32; 96]>::new();
        stack.push(0);
        while let Some(index) = stack.pop() {
            let node = &tree.nodes[index as usize];
            if !wants(node.aabb().min.as_dvec3(), node.aabb().max.as_dvec3()) {
                continue;
            }
            if !node.is_leaf() {
                stack.push(node.first_index);
                stack.push(node.first_index + 1);
                continue;
            }
            let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            for &primitive in &tree.primitive_indices[range] {
                // Two primitives are no polygons.
                if let Some(polygon) = self.polygons.get(primitive as usize) {
                    visit(primitive, polygon)?;
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// How many polygons count as large: the walls, floors and tops of a few rooms.
const MOST_LARGE: usize = 64;

fn largest(blocking: Blocking) -> Vec<u32> {
    let mut order: Vec<u32> =
        (0..blocking.polygons.len() as u32).filter(|&index| blocking.is_opaque(index)).collect();
    let area = |index: &u32| blocking.polygons[*index as usize].area();
    order.sort_unstable_by(|a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
    order.truncate(MOST_LARGE);
    order
}

/// The polygon's box, grown by the rounding of its corners to f32 and of a ray's origin.
fn grown_box(polygon: &ConvexPolygon) -> Aabb {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &v in polygon.vertices() {
        low = low.min(v);
        high = high.max(v);
    }
    let grow = |v: DVec3| v.abs().as_vec3a() * (4.0 * f32::EPSILON) + Vec3A::splat(f32::MIN_POSITIVE);
    Aabb::new(low.as_vec3a() - grow(low), high.as_vec3a() + grow(high))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed axis-aligned room with tessellated walls: the case that obvhs' Morton codes wrap on.
    #[test]
    fn tree_of_a_tessellated_room_stays_tight() {
        let n = 24;
        let mut polygons = Vec::new();
        for axis in 0..3 {
            for side in [0.0, 1.0] {
                for i in 0..n {
                    for j in 0..n {
                        let at = |u: f64, v: f64| {
                            let mut p = DVec3::splat(side);
                            p[(axis + 1) % 3] = u / f64::from(n);
                            p[(axis + 2) % 3] = v / f64::from(n);
                            p
                        };
                        let (u, v) = (f64::from(i), f64::from(j));
                        let corners = [at(u, v), at(u + 1.0, v), at(u + 1.0, v + 1.0), at(u, v + 1.0)];
                        polygons.push(ConvexPolygon::new(&corners).expect("a square has an area"));
                    }
                }
            }
        }
        let relative_area = |tree: &Bvh2| {
            let area: f32 = tree.nodes.iter().map(|node| node.aabb().surface_area()).sum();
            area / tree.nodes[0].aabb().surface_area()
        };
        let blockers = Blockers::opaque(polygons, 3.0_f64.sqrt());
        let tree = blockers.tree.as_ref().expect("there are polygons");
        // A flat box has twice its polygon's area, so each of the twelve levels adds two roots or a little more.
        assert!(
            relative_area(tree) < 5.0 * 12.0,
            "the nodes' area is {} times the root's",
            relative_area(tree)
        );
    }
}
