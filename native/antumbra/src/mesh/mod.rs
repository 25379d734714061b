//! Elements, vertices and samples: where light is stored.
//!
//! Every face of the input is the root of a hierarchy of elements that are subdivided four to one (the paper, §2.1
//! and §2.2). Elements share vertices, which are points of the baked mesh, and samples, which are places where
//! irradiance is known. A vertex on a crease has a sample for each side; a vertex inside a smooth or flat region
//! has one.
//!
//! Guarantees: a split point on an edge is made once, from the edge's two ends, for all elements that share the
//! edge, so a watertight surface stays watertight; no edge of a leaf carries more than one split point (§3.3's
//! restriction); parts are numbered in the order they were made, and nothing depends on the order of a hash map.

mod anchor;
#[allow(dead_code, clippy::allow_attributes, reason = "nothing traces lines yet")]
mod arrangement;
pub(crate) mod coarse;
mod corner_groups;
#[allow(dead_code, clippy::allow_attributes, reason = "nothing traces lines yet")]
mod grid;
mod subdivide;
#[allow(dead_code, clippy::allow_attributes, reason = "nothing traces lines yet")]
mod triangulation;

use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::index::{ElementId, FaceId, SampleId, VertexId};
use crate::scene::world::World;
use crate::visibility::Receiver;

pub(crate) use anchor::{Corner, anchored};

/// Which side of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// Where the normal points.
    Front,
    /// The other one. Surfaces reflect on both sides, as Blender's do; only the front is baked.
    Back,
}

impl Side {
    pub(crate) const BOTH: [Self; 2] = [Self::Front, Self::Back];
}

/// A point of the refined mesh.
#[derive(Debug, Clone)]
pub(crate) struct Vertex {
    pub(crate) position: DVec3,
    /// The ends of the edge that it splits in half.
    pub(crate) parents: Option<[VertexId; 2]>,
}

/// A place where irradiance is known, on both sides of the surface.
#[derive(Debug, Clone)]
pub(crate) struct Sample {
    pub(crate) position: DVec3,
    /// Unit shading normal.
    pub(crate) normal: DVec3,
    /// A step into the elements that use the sample, so that values on edges are limits from inside.
    inward: DVec3,
    /// The samples whose mean stands for this one where light is even.
    pub(crate) parents: Option<[SampleId; 2]>,
}

/// Length of the step from a sample into its elements, relative to their size. A point exactly on a touching wall
/// sees 0 of it, where the limit is one half; a step s replaces the limit by a value that is wrong by about s times
/// the relative change of light over the element. It must stay well above the kernel's coplanarity tolerance (1e-12
/// of the wall), also for elements a thousand times smaller than the wall.
const ONE_SIDED_STEP: f64 = 1e-6;

impl Sample {
    /// The point and normal that light is gathered for.
    pub(crate) fn receiver(&self, side: Side) -> Receiver {
        let normal = if side == Side::Front { self.normal } else { -self.normal };
        // Stepping off the surface as well makes the facets around a smooth vertex block as they should.
        let lift = self.inward.length();
        Receiver { position: self.position + self.inward + lift * normal, normal }
    }
}

/// A triangle of the hierarchy.
#[derive(Debug, Clone)]
pub(crate) struct Element {
    pub(crate) face: FaceId,
    pub(crate) vertices: [VertexId; 3],
    pub(crate) samples: [SampleId; 3],
    /// Children are numbered one after the other: at corners 0, 1, 2, then in the middle.
    pub(crate) first_child: Option<ElementId>,
    pub(crate) level: u8,
}

impl Element {
    pub(crate) fn is_leaf(&self) -> bool {
        self.first_child.is_none()
    }

    pub(crate) fn children(&self) -> Option<[ElementId; 4]> {
        self.first_child.map(|first| std::array::from_fn(|k| ElementId::new(first.index() + k)))
    }
}

/// An unordered pair as a key: the smaller index first.
pub(crate) fn edge_key<T: Ord>(a: T, b: T) -> (T, T) {
    if a < b { (a, b) } else { (b, a) }
}

/// The element hierarchy of a whole scene.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) elements: Vec<Element>,
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) samples: Vec<Sample>,
    /// Leaves in all.
    pub(crate) leaves: usize,
    /// Triangles of the anchored mesh.
    pub(crate) triangles: usize,
    vertex_midpoints: FxHashMap<(VertexId, VertexId), VertexId>,
    sample_midpoints: FxHashMap<(SampleId, SampleId), SampleId>,
    edge_elements: FxHashMap<(VertexId, VertexId), SmallVec<[ElementId; 2]>>,
}

impl Mesh {
    /// One root element per face; element and face have the same index.
    pub(crate) fn new(world: &World) -> Self {
        let mut mesh = Self {
            vertices: world.vertices.iter().map(|&position| Vertex { position, parents: None }).collect(),
            ..Self::default()
        };
        let (samples, corner_samples) = corner_groups::group_corners(world);
        mesh.samples = samples;
        for (index, (face, samples)) in world.faces.iter().zip(corner_samples).enumerate() {
            let vertices = face.vertices.map(|v| VertexId::new(v as usize));
            mesh.push(Element { face: FaceId::new(index), vertices, samples, first_child: None, level: 0 });
        }
        mesh.leaves = mesh.elements.len();
        mesh.triangles = mesh.leaves;
        mesh
    }

    pub(crate) fn element(&self, id: ElementId) -> &Element {
        &self.elements[id.index()]
    }

    pub(crate) fn sample(&self, id: SampleId) -> &Sample {
        &self.samples[id.index()]
    }

    pub(crate) fn positions(&self, element: &Element) -> [DVec3; 3] {
        element.vertices.map(|v| self.vertices[v.index()].position)
    }

    /// The sample in the middle of an element's edge, when one was made.
    pub(crate) fn sample_midpoint(&self, a: SampleId, b: SampleId) -> Option<SampleId> {
        self.sample_midpoints.get(&edge_key(a, b)).copied()
    }

    fn vertex_midpoint(&self, a: VertexId, b: VertexId) -> Option<VertexId> {
        self.vertex_midpoints.get(&edge_key(a, b)).copied()
    }

    fn push(&mut self, element: Element) -> ElementId {
        let id = ElementId::new(self.elements.len());
        let [a, b, c] = element.vertices;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            self.edge_elements.entry(edge_key(from, to)).or_default().push(id);
        }
        self.elements.push(element);
        id
    }
}

/// Area of an element, m²: its face's, quartered at each level.
pub(crate) fn area(element: &Element, world: &World) -> f64 {
    world.faces[element.face.index()].area * 0.25_f64.powi(i32::from(element.level))
}
