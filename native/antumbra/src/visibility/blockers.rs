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
use obvhs::ray::{Ray, RayHit};
use smallvec::SmallVec;

use crate::visibility::shaft::Shaft;
use crate::visibility::{Blocking, ConvexPolygon, grey};

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
}

/// Share of the way between two surfaces that a ray leaves out at each end: far above the rounding of the points and of
/// the planes that they lie in, far below what could stand in between.
const OFF_THE_SURFACE: f64 = 1e-9;

/// Where a ray first meets a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    pub(crate) polygon: u32,
    /// Whether it meets the side of the polygon's normal.
    pub(crate) front: bool,
    /// Metres.
    pub(crate) distance: f64,
}

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
        let tree = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut std::time::Duration::default());
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

    /// Size of the scene, metres.
    pub(crate) fn diagonal(&self) -> f64 {
        self.diagonal
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
            if !wants(node.aabb.min.as_dvec3(), node.aabb.max.as_dvec3()) {
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

    /// Share of light, per channel, that goes from one point to another of surfaces, which block nothing themselves
    /// however their points are rounded.
    pub(crate) fn between(&self, from: DVec3, to: DVec3) -> DVec3 {
        let step = (to - from) * OFF_THE_SURFACE;
        self.through_segment(from + step, to - step)
    }

    /// Share of light, per channel, that goes along the open segment between two points.
    pub(crate) fn through_segment(&self, from: DVec3, to: DVec3) -> DVec3 {
        if self.transmittances.is_empty() {
            let crossed = |panel: &Panel, span| panel.is_crossed(from, span);
            return if self.meets(from, to, crossed) { DVec3::ZERO } else { DVec3::ONE };
        }
        let mut passed: SmallVec<[u32; 8]> = SmallVec::new();
        let stops = |panel: &Panel, span| {
            panel.is_crossed(from, span) && {
                passed.push(panel.polygon);
                self.blocking().is_opaque(panel.polygon)
            }
        };
        if self.meets(from, to, stops) {
            return DVec3::ZERO;
        }
        // The tree's order depends on its builder.
        passed.sort_unstable();
        passed.iter().map(|&id| self.blocking().transmittance(id)).product()
    }

    /// Whether what is asked holds for any of the polygons that the open segment between two points crosses.
    pub(crate) fn is_crossed(&self, from: DVec3, to: DVec3, asked: impl Fn(u32) -> bool) -> bool {
        self.meets(from, to, |panel, span| panel.is_crossed(from, span) && asked(panel.polygon))
    }

    /// Whether what is asked of a polygon and the whole segment holds for any that may lie on it.
    fn meets(&self, from: DVec3, to: DVec3, mut asked: impl FnMut(&Panel, DVec3) -> bool) -> bool {
        let Some(tree) = &self.tree else { return false };
        let span = to - from;
        // Of length one: obvhs takes components below f32's epsilon for zero, which all are in a scene of a micrometre.
        let length = span.length();
        let Some(direction) = (span / length).as_vec3a().try_normalize() else { return false };
        // The boxes are grown by their own rounding; the ray's origin is rounded the same way, so start a little
        // behind it and end a little beyond.
        let slack = (self.diagonal * f64::from(f32::EPSILON) * 4.0) as f32;
        let ray = Ray::new(from.as_vec3a(), direction, -slack, length as f32 + slack);
        !tree.ray_traverse_miss(
            ray,
            |_, primitive| {
                if asked(&self.panels[primitive], span) { 0.0 } else { f32::INFINITY }
            },
        )
    }

    /// The polygon that stops a ray from a surface: of filters as often as they do, over random numbers.
    ///
    /// `chance`: 0 to 1, which filter stops it.
    pub(crate) fn first_stop(&self, from: DVec3, direction: DVec3, mut chance: f64) -> Option<Hit> {
        let mut hit = self.first_hit(from, direction)?;
        let mut travelled = 0.0;
        loop {
            let through = grey(self.blocking().transmittance(hit.polygon));
            if chance >= through {
                break;
            }
            chance /= through;
            travelled += hit.distance;
            hit = self.first_hit(from + travelled * direction, direction)?;
        }
        Some(Hit { distance: travelled + hit.distance, ..hit })
    }

    /// The first polygon that a ray from a surface meets; the surface itself is left out.
    ///
    /// `direction`: of length one.
    pub(crate) fn first_hit(&self, from: DVec3, direction: DVec3) -> Option<Hit> {
        self.first_hit_within(from, direction, f64::INFINITY)
    }

    /// The same where only what is near counts: nearer than `reach`, metres.
    pub(crate) fn first_hit_within(&self, from: DVec3, direction: DVec3, reach: f64) -> Option<Hit> {
        let tree = self.tree.as_ref()?;
        let slack = (self.diagonal * f64::from(f32::EPSILON) * 4.0) as f32;
        let ray = Ray::new(from.as_vec3a(), direction.as_vec3a(), -slack, reach as f32 + slack);
        let nearest = OFF_THE_SURFACE * self.diagonal;
        let mut first: Option<Hit> = None;
        tree.ray_traverse(ray, &mut RayHit::none(), |_, primitive| {
            let panel = &self.panels[primitive];
            let along = panel.normal.dot(direction);
            let distance = panel.normal.dot(panel.corners[0] - from) / along;
            let farthest = first.map_or(reach, |hit| hit.distance);
            // A ray along the plane has an infinite distance, or none.
            if !(distance > nearest && distance < farthest && panel.is_passed(from, direction)) {
                return f32::INFINITY;
            }
            first = Some(Hit { polygon: panel.polygon, front: along < 0.0, distance });
            // What the tree compares with is rounded, and so are its boxes.
            distance as f32 * (1.0 + 4.0 * f32::EPSILON) + slack
        });
        first
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

/// A triangle or quadrilateral as rays need it.
struct Panel {
    normal: DVec3,
    /// A triangle's last corner is there twice: an edge of no length has everything on both sides.
    corners: [DVec3; 4],
    polygon: u32,
}

impl Panel {
    fn new(index: u32, polygon: &ConvexPolygon) -> Self {
        let vertices = polygon.vertices();
        let last = vertices.len() - 1;
        Self {
            normal: polygon.normal(),
            corners: std::array::from_fn(|k| vertices[k.min(last)]),
            polygon: index,
        }
    }

    /// One that no ray meets.
    fn nowhere() -> Self {
        Self { normal: DVec3::ZERO, corners: [DVec3::ZERO; 4], polygon: u32::MAX }
    }

    /// Whether the open segment `from + t·span`, 0 < t < 1, crosses it.
    fn is_crossed(&self, from: DVec3, span: DVec3) -> bool {
        let start = self.normal.dot(from - self.corners[0]);
        let end = self.normal.dot(from + span - self.corners[0]);
        start * end < 0.0 && self.is_passed(from, span)
    }

    /// Whether the line through a point passes inside: on the same side of every edge. Signs of volumes, nothing is
    /// projected.
    fn is_passed(&self, from: DVec3, span: DVec3) -> bool {
        let [a, b, c, d] = self.corners.map(|corner| corner - from);
        let sides = [a.cross(b).dot(span), b.cross(c).dot(span), c.cross(d).dot(span), d.cross(a).dot(span)];
        sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0)
    }
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
            let area: f32 = tree.nodes.iter().map(|node| node.aabb.surface_area()).sum();
            area / tree.nodes[0].aabb.surface_area()
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

    #[test]
    fn segment_is_blocked_by_what_it_crosses_and_by_nothing_else() {
        let square = |z: f64| {
            let corner = |x, y| DVec3::new(x, y, z);
            ConvexPolygon::new(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)])
                .expect("a square has an area")
        };
        let blockers = Blockers::opaque(vec![square(0.0), square(1.0)], 2.0);
        let blocked = |from, to| blockers.through_segment(from, to) == DVec3::ZERO;
        let at = DVec3::new;
        assert!(blocked(at(0.5, 0.5, -1.0), at(0.5, 0.5, 0.5)));
        assert!(!blocked(at(0.5, 0.5, 0.1), at(0.5, 0.5, 0.9)));
        assert!(!blocked(at(1.5, 0.5, -1.0), at(1.5, 0.5, 2.0)));
        // A segment that starts or ends on a polygon does not cross it.
        assert!(!blocked(at(0.5, 0.5, 0.0), at(0.2, 0.3, 1.0)));
    }
}
