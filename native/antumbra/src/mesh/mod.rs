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
pub(crate) mod arrangement;
pub(crate) mod coarse;
mod corner_groups;
mod grading;
pub(crate) mod grid;
mod quartering;
mod skeleton;
mod subdivide;
mod tessellation;
mod triangulation;

use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::index::{ElementId, FaceId, SampleId, VertexId};
use crate::scene::world::World;
use crate::visibility::Receiver;

pub(crate) use anchor::{Corner, anchored};
pub(crate) use grading::Grading;
pub(crate) use quartering::Quartering;
pub(crate) use skeleton::{Cutting, tessellate};
pub(crate) use tessellation::{Tessellation, Tile};

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
    /// A step into the elements that use the sample, so that values on edges are limits from inside; zero inside
    /// a flat face and off its lines, where light is the same from every side.
    inward: DVec3,
    /// Whether elements with this sample lie on one side of it only: at a contact, a crease or a border. Its light is
    /// then a limit, which the point itself does not have.
    one_sided: bool,
    /// Whether it is looked at in its flat face, not above it: where a sharp shadow ends, which moves with the height.
    in_plane: bool,
    /// The object whose surface it is on.
    pub(crate) object: u32,
    /// The samples whose mean stands for this one where light is even.
    pub(crate) parents: Option<[SampleId; 2]>,
}

/// Length of the step from a sample into its elements, relative to their size. A point exactly on a touching wall
/// sees 0 of it, where the limit is one half. A value at one step s is wrong by about s times the relative change of
/// light over the element, one extrapolated from s and 2s by about s²: 1.4e-11 of the light at the foot of a wall.
/// Smaller steps would come near the kernel's coplanarity tolerance, 1e-12 of a wall that may be a thousand times as
/// large as the element; at 1e-4 limits would be off by 1e-8.
const ONE_SIDED_STEP: f64 = 1e-6;

/// Distance from the edges of its elements, in cells of the grid along the face's longest edge, that a sample's step
/// must lead to at least. Vertices on a contact are rounded to the grid, by up to √½ cell where lines cross, and the
/// contact's edges move with them. Measured at the foot of a cube: with 0, a corner of elements of 0.1 m on a floor of
/// 7.3 m was on the wrong side of the wall and black; with 1 none was, and with 4 limits on a floor of 60 m were off by
/// 7.7e-10 instead of 4.8e-11.
const CLEAR_CELLS: f64 = 2.0;

/// No step is longer than this share of the way to the middle of an element, however thin: two of them stay inside.
const LONGEST_STEP: f64 = 0.25;

/// The step into an element, relative to the way to a point in it.
///
/// `inside`: distance of that point from the edges, metres. `longest`: longest edge of the face, metres.
fn relative_step(inside: f64, longest: f64) -> f64 {
    let clear = CLEAR_CELLS * longest / f64::from(grid::GRID);
    (clear / inside).clamp(ONE_SIDED_STEP, LONGEST_STEP)
}

fn longest_edge([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}

/// The receivers whose light tells a sample's.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Approach {
    pub(crate) near: Receiver,
    /// Twice as far from the sample on the same line: the sample's light is the limit, 2·near - far. `None` where light
    /// is the same from all sides, and where it is not known better than to a step.
    pub(crate) far: Option<Receiver>,
}

impl Sample {
    /// The point and normal that light is gathered for.
    pub(crate) fn receiver(&self, side: Side) -> Receiver {
        self.after_steps(1.0, side)
    }

    /// Whether its light is a limit from one side.
    pub(crate) fn is_one_sided(&self) -> bool {
        self.one_sided
    }

    /// The points from which the limit of its light follows.
    pub(crate) fn approach(&self, side: Side) -> Approach {
        let far = self.one_sided.then(|| self.after_steps(2.0, side));
        Approach { near: self.after_steps(1.0, side), far }
    }

    fn after_steps(&self, steps: f64, side: Side) -> Receiver {
        let normal = if side == Side::Front { self.normal } else { -self.normal };
        // Stepping off the surface as well makes the facets around a smooth vertex block as they should.
        let lift = if self.in_plane { 0.0 } else { self.inward.length() };
        let step = self.inward + lift * normal;
        Receiver::new(self.position + steps * step, normal).of(self.object)
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
    /// m².
    pub(crate) area: f64,
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

/// Where a root of the hierarchy lies on its face.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Root {
    pub(crate) face: FaceId,
    /// Barycentric coordinates of its corners.
    pub(crate) places: [DVec3; 3],
}

/// The element hierarchy of a whole scene. Its roots are the first elements, in the order of their faces.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mesh {
    pub(crate) roots: Vec<Root>,
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
        let (samples, corner_samples) = corner_groups::group_corners(world);
        let mut mesh = Self::without_roots(&world.vertices, samples);
        for (index, (face, samples)) in world.faces.iter().zip(corner_samples).enumerate() {
            let vertices = face.vertices.map(|v| VertexId::new(v as usize));
            let root = Root { face: FaceId::new(index), places: [DVec3::X, DVec3::Y, DVec3::Z] };
            mesh.push_root(root, vertices, samples, face.area);
        }
        mesh
    }

    /// One root element per tile of a tessellation that nothing has refined yet.
    pub(crate) fn of_tiles(tessellation: &Tessellation) -> Self {
        let mut mesh = Self::without_roots(&tessellation.positions, tessellation.samples.clone());
        for tile in &tessellation.tiles {
            let root = Root { face: tile.face, places: tile.points.map(grid::GridPoint::barycentric) };
            mesh.push_root(root, tile.vertices, tile.samples, tessellation.area(tile));
        }
        mesh
    }

    fn without_roots(positions: &[DVec3], samples: Vec<Sample>) -> Self {
        let vertices = positions.iter().map(|&position| Vertex { position, parents: None }).collect();
        Self { vertices, samples, ..Self::default() }
    }

    fn push_root(&mut self, root: Root, vertices: [VertexId; 3], samples: [SampleId; 3], area: f64) {
        self.push(Element { face: root.face, vertices, samples, first_child: None, level: 0, area });
        self.roots.push(root);
        self.leaves += 1;
        self.triangles += 1;
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
