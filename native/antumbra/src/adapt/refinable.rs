//! What refinement asks of a mesh, whichever way it is made finer.

use crate::index::{ElementId, FaceId, SampleId};
use crate::mesh::{Sample, edge_key};
use crate::visibility::Receiver;

/// What refinement has to know of a leaf.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leaf {
    pub(crate) face: FaceId,
    pub(crate) samples: [SampleId; 3],
    /// m².
    pub(crate) area: f64,
}

impl Leaf {
    /// Edge k joins corners k and k + 1; each edge by its two samples.
    pub(crate) fn edges(&self) -> [(SampleId, SampleId); 3] {
        std::array::from_fn(|k| edge_key(self.samples[k], self.samples[(k + 1) % 3]))
    }
}

/// Two leaves whose common edge could join their other corners instead.
#[derive(Debug, Clone)]
pub(crate) struct Flip {
    /// Leaves as they are, then as they would be.
    pub(crate) now: [Leaf; 2],
    pub(crate) then: [Leaf; 2],
    pub(crate) elements: [ElementId; 2],
    /// Where the centroids would be.
    pub(crate) centroids: [Receiver; 2],
    /// The edge that would be, and the sample in its middle.
    pub(crate) edge: (SampleId, SampleId),
    pub(crate) middle: Sample,
}

/// A mesh of triangles that can be refined.
pub(crate) trait Refinable: Sync {
    /// All samples; parents come before their children.
    fn samples(&self) -> &[Sample];
    /// All leaves, in order.
    fn leaves(&self) -> Vec<ElementId>;
    /// A leaf, or nothing when the element is one no longer.
    fn leaf(&self, element: ElementId) -> Option<Leaf>;
    /// Whether the element may be made finer.
    fn may_refine(&self, element: ElementId) -> bool;
    /// The sample in the middle of an edge of a leaf, made or not.
    fn middle(&self, element: ElementId, edge: usize) -> Sample;
    /// Whether an edge of a leaf has a vertex in its middle that only its neighbours are refined to.
    fn is_anchored(&self, _element: ElementId, _edge: usize) -> bool {
        false
    }
    /// Where a leaf's centroid receives light.
    fn centroid(&self, element: ElementId) -> Receiver;
    /// Makes an element finer; `squared_deviations` tell how much each of its edges wants it. New leaves are appended.
    fn refine(&mut self, element: ElementId, squared_deviations: [f64; 3], fresh: &mut Vec<ElementId>);
    /// Share of an element's squared error that refining it once removes, about.
    fn removes(&self) -> f64;
    /// Triangles that refining one element adds, at least.
    fn adds(&self) -> usize;
    /// Triangles of the baked mesh.
    fn triangles(&self) -> usize;
    /// Edges of the given leaves that could be flipped.
    fn flips(&self, _fresh: &[ElementId]) -> Vec<Flip> {
        Vec::new()
    }
    /// Flips the edge between two leaves, unless they are leaves no longer. New leaves are appended.
    fn flip(&mut self, _flip: &Flip, _fresh: &mut Vec<ElementId>) {}
}
