//! Surfaces from coarse to fine: clusters of faces, faces, elements of faces (Hanrahan, Salzman, Aupperle 1991; clusters
//! after Smits, Arvo, Greenberg 1994 and, with normals that agree, Willmott, Heckbert, Garland 1999).
//!
//! A node is one side of something flat, or several such sides that lie near each other and face alike. Both sides of
//! every face are there: Blender's faces reflect on both. Nodes above faces are made once; below them faces are
//! divided wherever the exchange of light asks for it.
//!
//! Guarantees: a node comes before its parts, so one pass in order goes down and one in reverse goes up; the parts of a
//! node cover it exactly; the first node is the root of all.

use glam::DVec3;
use smallvec::{SmallVec, smallvec};

use crate::index::{FaceId, typed_index};
use crate::mesh::coarse::LEAST_AREA;
use crate::mesh::{Mesh, Side};
use crate::scene::world::World;
use crate::transport::sources::Sources;
use crate::visibility::ConvexPolygon;

typed_index! {
    /// A node of the hierarchy.
    NodeId,
    /// One side of a flat surface of the input: a face, two that are one quadrilateral, or part of a face between contacts.
    SurfaceId,
}

/// One side of a flat surface of the input.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub(crate) faces: SmallVec<[FaceId; 2]>,
    pub(crate) side: Side,
    pub(crate) reflectance: DVec3,
    /// [`Patch::shown`](crate::transport::sources::Patch::shown).
    pub(crate) shown: DVec3,
    /// Whether its light is shown.
    pub(crate) receives: bool,
    /// Share of what arrives, per channel, that ends here; the rest is counted where it goes on to.
    pub(crate) stops: DVec3,
    pub(crate) node: NodeId,
}

/// What a node is.
#[derive(Debug, Clone)]
pub(crate) enum Shape {
    /// Flat; the polygon's normal is on the node's side.
    Flat { polygon: ConvexPolygon, surface: SurfaceId },
    /// Several surfaces: a range of [`Hierarchy::clustered`].
    Cluster(std::ops::Range<u32>),
}

/// Something that exchanges light as one.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub(crate) shape: Shape,
    /// What it consists of; nothing for a leaf.
    pub(crate) parts: SmallVec<[NodeId; 4]>,
    /// m².
    pub(crate) area: f64,
    /// A ball around it, metres.
    pub(crate) centre: DVec3,
    pub(crate) radius: f64,
    /// All of its normals are within this angle, radians, from the axis.
    pub(crate) axis: DVec3,
    pub(crate) cone: f64,
}

impl Node {
    pub(crate) fn is_leaf(&self) -> bool {
        self.parts.is_empty()
    }

    pub(crate) fn polygon(&self) -> Option<&ConvexPolygon> {
        match &self.shape {
            Shape::Flat { polygon, .. } => Some(polygon),
            Shape::Cluster(_) => None,
        }
    }

    fn flat(polygon: ConvexPolygon, surface: SurfaceId) -> Self {
        let centre = polygon.centroid();
        Self {
            parts: SmallVec::new(),
            area: polygon.area(),
            centre,
            radius: polygon.vertices().iter().map(|v| v.distance(centre)).fold(0.0, f64::max),
            axis: polygon.normal(),
            cone: 0.0,
            shape: Shape::Flat { polygon, surface },
        }
    }
}

/// The hierarchy of a whole scene.
#[derive(Debug)]
pub(crate) struct Hierarchy {
    pub(crate) nodes: Vec<Node>,
    pub(crate) surfaces: Vec<Surface>,
    /// Surfaces in the order of the clusters.
    pub(crate) clustered: Vec<SurfaceId>,
    /// Sums of the surfaces' areas in that order, m²: the first is 0.
    area_before: Vec<f64>,
    /// Per face: its surfaces on the front.
    fronts: Vec<SmallVec<[SurfaceId; 1]>>,
    /// Elements with less area are not divided, m².
    pub(crate) smallest: f64,
}

impl Hierarchy {
    /// Clusters both sides of the roots of a mesh, and divides surfaces until none is larger than a square of `size`
    /// metres.
    ///
    /// `roots`: paired; surface k is the side k of these. `smallest`: area of an element from which on it is not divided any
    /// more, m².
    pub(crate) fn new(world: &World, mesh: &Mesh, roots: &Sources, size: f64, smallest: f64) -> Self {
        let mut surfaces = Vec::new();
        let mut polygons = Vec::new();
        for patch in &roots.patches {
            let faces: SmallVec<[FaceId; 2]> = patch.elements.iter().map(|&e| mesh.element(e).face).collect();
            for side in Side::BOTH {
                let front = side == Side::Front;
                polygons.push(if front { patch.polygon.clone() } else { patch.polygon.flipped() });
                surfaces.push(Surface {
                    faces: faces.clone(),
                    side,
                    reflectance: patch.reflectance,
                    shown: patch.shown,
                    receives: patch.receives && front,
                    stops: DVec3::ONE - world.transmittance(faces[0]),
                    node: NodeId::new(0),
                });
            }
        }
        let mut fronts = vec![SmallVec::new(); world.faces.len()];
        for (index, surface) in surfaces.iter().enumerate().filter(|(_, s)| s.side == Side::Front) {
            for face in &surface.faces {
                let known: &mut SmallVec<[SurfaceId; 1]> = &mut fronts[face.index()];
                if !known.contains(&SurfaceId::new(index)) {
                    known.push(SurfaceId::new(index));
                }
            }
        }
        let mut hierarchy = Self {
            nodes: Vec::with_capacity(2 * surfaces.len()),
            clustered: SurfaceId::range(0..surfaces.len()).collect(),
            area_before: Vec::new(),
            surfaces,
            fronts,
            smallest,
        };
        let mut order = std::mem::take(&mut hierarchy.clustered);
        if !order.is_empty() {
            hierarchy.cluster(&mut order, 0, &polygons);
        }
        hierarchy.clustered = order;
        let mut sum = 0.0;
        hierarchy.area_before = std::iter::once(0.0)
            .chain(hierarchy.clustered.iter().map(|surface| {
                sum += polygons[surface.index()].area();
                sum
            }))
            .collect();
        hierarchy.divide_to(size);
        hierarchy
    }

    /// Makes the node of some surfaces, halving them by place or by direction, whichever differs more.
    fn cluster(&mut self, members: &mut [SurfaceId], first: u32, polygons: &[ConvexPolygon]) -> NodeId {
        let id = NodeId::new(self.nodes.len());
        if let [surface] = *members {
            self.surfaces[surface.index()].node = id;
            self.nodes.push(Node::flat(polygons[surface.index()].clone(), surface));
            return id;
        }
        let of = |surface: &SurfaceId| &polygons[surface.index()];
        let mut area = 0.0;
        let mut sum = DVec3::ZERO;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut least, mut most) = ([f64::INFINITY; 6], [f64::NEG_INFINITY; 6]);
        for polygon in members.iter().map(of) {
            area += polygon.area();
            sum += polygon.area() * polygon.normal();
            for &vertex in polygon.vertices() {
                low = low.min(vertex);
                high = high.max(vertex);
            }
            for (k, value) in place_and_direction(polygon).into_iter().enumerate() {
                least[k] = least[k].min(value);
                most[k] = most[k].max(value);
            }
        }
        let centre = 0.5 * (low + high);
        let axis = sum.try_normalize().unwrap_or(DVec3::Z);
        let cosine = members.iter().map(|m| of(m).normal().dot(axis)).fold(1.0, f64::min);
        self.nodes.push(Node {
            shape: Shape::Cluster(first..first + members.len() as u32),
            parts: SmallVec::new(),
            area,
            centre,
            radius: 0.5 * (high - low).length(),
            axis,
            cone: cosine.clamp(-1.0, 1.0).acos(),
        });

        // Opposite directions count as much as the diagonal.
        let weight = 0.5 * (high - low).length();
        let extent = |k: usize| (most[k] - least[k]) * if k < 3 { 1.0 } else { weight };
        let k = (1..6).fold(0, |widest, k| if extent(k) > extent(widest) { k } else { widest });
        let key = |m: &SurfaceId| place_and_direction(of(m))[k];
        let mut split = members.len() / 2;
        members.sort_unstable_by(|a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        if k >= 3 {
            // Directions come in heaps, as those of walls do: between them, not through the middle one.
            let middle = 0.5 * (least[k] + most[k]);
            let between = members.partition_point(|m| key(m) < middle);
            if (1..members.len()).contains(&between) {
                split = between;
            }
        }
        let (one, other) = members.split_at_mut(split);
        let parts = smallvec![
            self.cluster(one, first, polygons),
            self.cluster(other, first + split as u32, polygons)
        ];
        self.nodes[id.index()].parts = parts;
        id
    }

    pub(crate) fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.index()]
    }

    /// All leaves, in order.
    pub(crate) fn leaves(&self) -> impl Iterator<Item = NodeId> + '_ {
        NodeId::range(0..self.nodes.len()).filter(|&id| self.node(id).is_leaf())
    }

    /// The surface that a flat node is a part of.
    pub(crate) fn surface(&self, node: &Node) -> Option<&Surface> {
        match node.shape {
            Shape::Flat { surface, .. } => Some(&self.surfaces[surface.index()]),
            Shape::Cluster(_) => None,
        }
    }

    /// The surfaces on the front of a face.
    pub(crate) fn fronts(&self, face: FaceId) -> &[SurfaceId] {
        &self.fronts[face.index()]
    }

    /// Whether a node has parts, or may be given some.
    pub(crate) fn is_divisible(&self, id: NodeId) -> bool {
        let node = self.node(id);
        !node.is_leaf() || node.area > self.smallest
    }

    /// Divides a leaf. `false` when it cannot be.
    pub(crate) fn divide(&mut self, id: NodeId) -> bool {
        let Shape::Flat { polygon, surface } = &self.node(id).shape else { return false };
        let surface = *surface;
        let pieces = pieces(polygon);
        if pieces.is_empty() {
            return false;
        }
        for piece in pieces {
            let part = NodeId::new(self.nodes.len());
            self.nodes.push(Node::flat(piece, surface));
            self.nodes[id.index()].parts.push(part);
        }
        true
    }

    fn divide_to(&mut self, size: f64) {
        let mut index = 0;
        // Parts are appended, so this visits all that it makes.
        while index < self.nodes.len() {
            let node = &self.nodes[index];
            // Quarters of a sliver are half as long, but four; long quadrilaterals are halved
            let is_triangle = node.polygon().is_some_and(|polygon| polygon.vertices().len() == 3);
            let least_area = if is_triangle { LEAST_AREA } else { LEAST_AREA_OF_STRIPS };
            let is_sliver = node.area <= least_area * size * size;
            let is_long = node.radius > LONGEST * size && !is_sliver;
            if node.is_leaf() && (node.area > size * size || is_long) {
                self.divide(NodeId::new(index));
            }
            index += 1;
        }
    }

    /// Some points of a node with their normals, each of which stands for the same share of its area.
    pub(crate) fn representatives(&self, node: &Node) -> SmallVec<[(DVec3, DVec3); REPRESENTATIVES]> {
        match &node.shape {
            Shape::Flat { polygon, .. } => {
                let centre = polygon.centroid();
                // Half-way to the corners lie about the means of the quarters.
                polygon.vertices().iter().map(|&v| (0.5 * (v + centre), polygon.normal())).collect()
            }
            Shape::Cluster(range) => {
                let [from, to] = [range.start, range.end].map(|i| self.area_before[i as usize]);
                (0..REPRESENTATIVES)
                    .map(|k| {
                        let at = from + (to - from) * (k as f64 + 0.5) / REPRESENTATIVES as f64;
                        let index = self.area_before.partition_point(|&before| before <= at).max(1) - 1;
                        let surface = self.clustered[index.min(self.clustered.len() - 1)];
                        let node = self.node(self.surfaces[surface.index()].node);
                        (node.centre, node.axis)
                    })
                    .collect()
            }
        }
    }
}

/// Points that stand for a node, at most: of two nodes, each sees each, so their number counts in square.
pub(crate) const REPRESENTATIVES: usize = 4;

/// Times that a piece may be longer than its size when its area is small.
const LONGEST: f64 = 2.0;

/// The same as [`LEAST_AREA`] of quadrilaterals: strips down to a 512th of the size in width are cut to pieces as long as any.
/// With none, a needle of half a metre and a billionth of a millimetre, alone in its scene, became eight million pieces.
const LEAST_AREA_OF_STRIPS: f64 = LEAST_AREA / 16.0;

/// Quadrilaterals this many times longer than wide are halved, not quartered.
const LONG: f64 = 2.0;

fn place_and_direction(polygon: &ConvexPolygon) -> [f64; 6] {
    let (p, n) = (polygon.centroid(), polygon.normal());
    [p.x, p.y, p.z, n.x, n.y, n.z]
}

/// The parts of a triangle or quadrilateral; none when they would have no area.
fn pieces(polygon: &ConvexPolygon) -> SmallVec<[ConvexPolygon; 4]> {
    let middle = |a: DVec3, b: DVec3| 0.5 * (a + b);
    let outlines: SmallVec<[SmallVec<[DVec3; 4]>; 4]> = match *polygon.vertices() {
        [a, b, c] => {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            smallvec![smallvec![a, ab, ca], smallvec![ab, b, bc], smallvec![ca, bc, c], smallvec![ab, bc, ca]]
        }
        [a, b, c, d] => {
            let [ab, bc, cd, da] = [middle(a, b), middle(b, c), middle(c, d), middle(d, a)];
            let [length, width] = [a.distance(b) + c.distance(d), b.distance(c) + d.distance(a)];
            if length > LONG * width {
                smallvec![smallvec![a, ab, cd, d], smallvec![ab, b, c, cd]]
            } else if width > LONG * length {
                smallvec![smallvec![a, b, bc, da], smallvec![da, bc, c, d]]
            } else {
                let centre = middle(ab, cd);
                smallvec![
                    smallvec![a, ab, centre, da],
                    smallvec![ab, b, bc, centre],
                    smallvec![centre, bc, c, cd],
                    smallvec![da, centre, cd, d]
                ]
            }
        }
        _ => SmallVec::new(),
    };
    let count = outlines.len();
    let pieces: SmallVec<[ConvexPolygon; 4]> =
        outlines.iter().filter_map(|outline| ConvexPolygon::new(outline)).collect();
    if pieces.len() == count { pieces } else { SmallVec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(corners: &[[f64; 2]]) -> ConvexPolygon {
        let corners: Vec<DVec3> = corners.iter().map(|&[x, y]| DVec3::new(x, y, 1.0)).collect();
        ConvexPolygon::new(&corners).expect("it has area")
    }

    #[test]
    fn parts_cover_the_whole_and_face_as_it_does() {
        for whole in [
            polygon(&[[0.0, 0.0], [3.0, 0.0], [0.5, 2.0]]),
            polygon(&[[0.0, 0.0], [2.0, 0.0], [2.5, 1.5], [0.0, 2.0]]),
            polygon(&[[0.0, 0.0], [9.0, 0.0], [9.0, 1.0], [0.0, 1.0]]),
            polygon(&[[0.0, 0.0], [1.0, 0.0], [1.0, 9.0], [0.0, 9.0]]),
        ] {
            let parts = pieces(&whole);
            assert_eq!(parts.len(), if whole.area() == 9.0 { 2 } else { 4 });
            let area: f64 = parts.iter().map(ConvexPolygon::area).sum();
            assert!((area / whole.area() - 1.0).abs() < 1e-15);
            assert!(parts.iter().all(|part| part.normal().dot(whole.normal()) > 1.0 - 1e-15));
        }
    }
}
