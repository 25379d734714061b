//! The light that patches get from a refined mesh: exact integrals of its linear elements over each patch.
//!
//! Display elements follow the shadows, patches do not (Lischinski, Tampieri, Greenberg 1993 keep the two apart in the
//! same way). Both lie in the plane of a face; every element is clipped down the hierarchy that the patches are a part of.

use glam::{DMat3, DVec3};
use smallvec::SmallVec;

use crate::index::{ElementId, FaceId};
use crate::mesh::Mesh;
use crate::transport::hierarchy::{Hierarchy, NodeId};
use crate::visibility::ConvexPolygon;

/// What an element of the hierarchy receives: the integral over it in parts of its area, and the extremes, W/m².
#[derive(Debug, Clone, Copy)]
pub(crate) struct Received {
    pub(crate) mean: DVec3,
    pub(crate) least: DVec3,
    pub(crate) most: DVec3,
}

impl Received {
    pub(crate) const NOTHING: Self =
        Self { mean: DVec3::ZERO, least: DVec3::INFINITY, most: DVec3::NEG_INFINITY };

    pub(crate) fn include(&mut self, value: DVec3) {
        self.least = self.least.min(value);
        self.most = self.most.max(value);
    }
}

/// A corner of a clipped element.
#[derive(Debug, Clone, Copy)]
struct Point {
    /// Barycentric in the hierarchy element it is clipped to.
    place: DVec3,
    value: DVec3,
}

type Outline = SmallVec<[Point; 8]>;

/// Spreads a linear display element over the hierarchy elements on its face that collect: those that have something to
/// collect in.
///
/// `places`: the corners, barycentric in the face. `values`: W/m².
pub(crate) fn spread(
    mesh: &Mesh,
    face: FaceId,
    places: [DVec3; 3],
    values: [DVec3; 3],
    received: &mut [Option<Received>],
) {
    let first = mesh.roots.partition_point(|root| root.face < face);
    for (index, root) in mesh.roots.iter().enumerate().skip(first).take_while(|(_, root)| root.face == face) {
        let root_from_face = DMat3::from_cols(root.places[0], root.places[1], root.places[2]).inverse();
        let mut outline: Outline = (places.into_iter().zip(values))
            .map(|(place, value)| Point { place: root_from_face * place, value })
            .collect();
        if root.places != [DVec3::X, DVec3::Y, DVec3::Z] {
            for k in 0..3 {
                outline = clipped(&outline, |point| point.place[k]);
            }
        }
        descend(mesh, ElementId::new(index), &outline, received);
    }
}

fn descend(mesh: &Mesh, id: ElementId, outline: &Outline, received: &mut [Option<Received>]) {
    if outline.len() < 3 {
        return;
    }
    if let Some(received) = &mut received[id.index()] {
        outline.iter().for_each(|point| received.include(point.value));
        received.mean += integral(outline);
        return;
    }
    let Some(children) = mesh.element(id).children() else { return };
    let mut middle = outline.clone();
    for (k, &child) in children[..3].iter().enumerate() {
        // The child at corner k holds what has at least half of that corner's weight.
        let mut corner = clipped(outline, |p| p.place[k] - 0.5);
        for point in &mut corner {
            point.place *= 2.0;
            point.place[k] -= 1.0;
        }
        descend(mesh, child, &corner, received);
        middle = clipped(&middle, |p| 0.5 - p.place[k]);
    }
    // The middle child's corners are the middles of the edges 0-1, 1-2 and 2-0.
    for point in &mut middle {
        let p = point.place;
        point.place = DVec3::new(1.0 - 2.0 * p.z, 1.0 - 2.0 * p.x, 1.0 - 2.0 * p.y);
    }
    descend(mesh, children[3], &middle, received);
}

/// Spreads a linear display element over the leaves of the surfaces on the front of its face; their means are sums of
/// integrals, W, until they are divided by the leaves' areas.
///
/// `corners`: positions, metres. `values`: W/m².
pub(crate) fn spread_over_leaves(
    hierarchy: &Hierarchy,
    face: FaceId,
    corners: [DVec3; 3],
    values: [DVec3; 3],
    received: &mut [Received],
) {
    let outline: Outline =
        corners.into_iter().zip(values).map(|(place, value)| Point { place, value }).collect();
    let surfaces = hierarchy.fronts(face);
    for surface in surfaces {
        let root = hierarchy.surfaces[surface.index()].node;
        // A surface that is alone on its face holds all of it.
        let polygon = hierarchy.node(root).polygon().filter(|_| surfaces.len() > 1);
        let within = polygon.map_or_else(|| outline.clone(), |polygon| inside(&outline, polygon));
        descend_to_leaves(hierarchy, root, &within, received);
    }
}

fn descend_to_leaves(hierarchy: &Hierarchy, id: NodeId, outline: &Outline, received: &mut [Received]) {
    if outline.len() < 3 {
        return;
    }
    let node = hierarchy.node(id);
    if node.is_leaf() {
        let received = &mut received[id.index()];
        outline.iter().for_each(|point| received.include(point.value));
        let Some(polygon) = node.polygon() else { return };
        received.mean += fan(outline, |a, b| 0.5 * polygon.normal().dot(a.cross(b)).abs());
        return;
    }
    for &part in &node.parts {
        let Some(polygon) = hierarchy.node(part).polygon() else { continue };
        descend_to_leaves(hierarchy, part, &inside(outline, polygon), received);
    }
}

/// The part of an outline in the plane of a polygon that is inside it.
fn inside(outline: &Outline, polygon: &ConvexPolygon) -> Outline {
    let vertices = polygon.vertices();
    let mut kept = outline.clone();
    for (k, &from) in vertices.iter().enumerate() {
        if kept.is_empty() {
            break;
        }
        let to = vertices[(k + 1) % vertices.len()];
        let inward = polygon.normal().cross(to - from);
        kept = clipped(&kept, |point| inward.dot(point.place - from));
    }
    kept
}

/// The part of a convex outline where a linear function is not negative.
fn clipped(outline: &Outline, height: impl Fn(&Point) -> f64) -> Outline {
    let mut kept = Outline::new();
    for (i, from) in outline.iter().enumerate() {
        let to = &outline[(i + 1) % outline.len()];
        let (a, b) = (height(from), height(to));
        if a >= 0.0 {
            kept.push(*from);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            let t = a / (a - b);
            kept.push(Point { place: from.place.lerp(to.place, t), value: from.value.lerp(to.value, t) });
        }
    }
    kept
}

/// The integral of the linear values over the outline, in parts of the hierarchy element's area.
fn integral(outline: &Outline) -> DVec3 {
    // Weights of corners 1 and 2 are coordinates in which the element has area one half.
    fan(outline, |a, b| (a.y * b.z - a.z * b.y).abs())
}

/// The integral over the triangles about the first corner, of which `area` tells the size from two of their sides.
fn fan(outline: &Outline, area: impl Fn(DVec3, DVec3) -> f64) -> DVec3 {
    let origin = outline[0];
    (outline[1..].windows(2))
        .map(|pair| {
            let mean = (origin.value + pair[0].value + pair[1].value) / 3.0;
            area(pair[0].place - origin.place, pair[1].place - origin.place) * mean
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(place: [f64; 3], value: f64) -> Point {
        Point { place: place.into(), value: DVec3::splat(value) }
    }

    #[test]
    fn a_linear_element_has_the_mean_of_its_corners() {
        let outline: Outline =
            [point([1.0, 0.0, 0.0], 1.0), point([0.0, 1.0, 0.0], 2.0), point([0.0, 0.0, 1.0], 6.0)]
                .into_iter()
                .collect();
        assert!((integral(&outline) - DVec3::splat(3.0)).abs().max_element() < 1e-15);
    }

    #[test]
    fn clipping_keeps_the_linear_function() {
        let outline: Outline =
            [point([1.0, 0.0, 0.0], 0.0), point([0.0, 1.0, 0.0], 0.0), point([0.0, 0.0, 1.0], 4.0)]
                .into_iter()
                .collect();
        // Where corner 2 has at least half of the weight: a quarter of the area, of mean 4 · (1 + 1/2 + 1/2) / 3
        let corner = clipped(&outline, |p| p.place.z - 0.5);
        assert!((integral(&corner) - DVec3::splat(8.0 / 3.0 / 4.0)).abs().max_element() < 1e-15);
    }
}
