//! Anchoring (Baum, Rushmeier, Winget 1989; the paper, §3.3): a leaf whose neighbour is finer is cut through the
//! neighbour's vertex, so that the mesh has no T-vertices.

use glam::DVec3;

use crate::index::{ElementId, SampleId, VertexId};
use crate::mesh::Mesh;

/// A corner of a baked triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Corner {
    pub(crate) vertex: VertexId,
    /// A sample, or the two whose mean it is where the neighbour's split point is not this element's.
    pub(crate) samples: [SampleId; 2],
    /// Barycentric coordinates in the face; exact, since they are sums of powers of two.
    pub(crate) barycentric: DVec3,
}

/// The triangles of the leaves below a root element, anchored to their neighbours.
pub(crate) fn anchored(mesh: &Mesh, root: ElementId, mut emit: impl FnMut([Corner; 3])) {
    let element = mesh.element(root);
    let units = [DVec3::X, DVec3::Y, DVec3::Z];
    let corners = std::array::from_fn(|k| Corner {
        vertex: element.vertices[k],
        samples: [element.samples[k]; 2],
        barycentric: units[k],
    });
    descend(mesh, root, corners, &mut emit);
}

fn descend(mesh: &Mesh, id: ElementId, corners: [Corner; 3], emit: &mut impl FnMut([Corner; 3])) {
    let [a, b, c] = corners;
    let Some(children) = mesh.element(id).children() else {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| split_point(mesh, p, q));
        return emit_anchored(corners, [ab, bc, ca], emit);
    };
    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
        split_point(mesh, p, q).expect("a subdivided element's edges are split; this is a bug in antumbra")
    });
    for (child, corners) in children.into_iter().zip([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]) {
        descend(mesh, child, corners, emit);
    }
}

/// The corner in the middle of an edge, when the edge was split on either side.
fn split_point(mesh: &Mesh, a: Corner, b: Corner) -> Option<Corner> {
    let vertex = mesh.vertex_midpoint(a.vertex, b.vertex)?;
    let [sa, sb] = [a.samples[0], b.samples[0]];
    // Across a crease the neighbour's split point has no sample on this side: the mean of the ends stands for it.
    let samples = mesh.sample_midpoint(sa, sb).map_or([sa, sb], |s| [s; 2]);
    Some(Corner { vertex, samples, barycentric: 0.5 * (a.barycentric + b.barycentric) })
}

fn emit_anchored([a, b, c]: [Corner; 3], splits: [Option<Corner>; 3], emit: &mut impl FnMut([Corner; 3])) {
    match splits {
        [None, None, None] => emit([a, b, c]),
        [Some(ab), None, None] => halve(a, b, c, ab, emit),
        [None, Some(bc), None] => halve(b, c, a, bc, emit),
        [None, None, Some(ca)] => halve(c, a, b, ca, emit),
        [Some(ab), Some(bc), None] => cut_corner(a, b, c, ab, bc, emit),
        [None, Some(bc), Some(ca)] => cut_corner(b, c, a, bc, ca, emit),
        [Some(ab), None, Some(ca)] => cut_corner(c, a, b, ca, ab, emit),
        [Some(ab), Some(bc), Some(ca)] => {
            for triangle in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                emit(triangle);
            }
        }
    }
}

/// Cuts a triangle from the split point of its first edge to the corner opposite.
fn halve(a: Corner, b: Corner, c: Corner, ab: Corner, emit: &mut impl FnMut([Corner; 3])) {
    emit([a, ab, c]);
    emit([ab, b, c]);
}

/// Cuts off the corner between two split edges and halves the quadrilateral that remains.
fn cut_corner(a: Corner, b: Corner, c: Corner, ab: Corner, bc: Corner, emit: &mut impl FnMut([Corner; 3])) {
    emit([ab, b, bc]);
    emit([a, ab, bc]);
    emit([a, bc, c]);
}
