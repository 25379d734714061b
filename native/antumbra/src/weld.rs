//! What the caller gets back.

use glam::DVec3;

use crate::report::Report;

/// The refined meshes with their light, and what it took to make them.
#[derive(Debug, Clone)]
pub struct Bake {
    /// One mesh per receiving object, in the order of the input.
    pub meshes: Vec<BakedMesh>,
    /// Timeline, result and warnings.
    pub report: Report,
}

/// A refined triangle mesh. Every attribute of the source can be carried over: each vertex and each corner knows
/// its source triangle and its place in it.
#[derive(Debug, Clone, Default)]
pub struct BakedMesh {
    /// Index into [`crate::scene::SceneInput::objects`].
    pub object: usize,
    /// Vertices in object space; source vertices keep their exact coordinates.
    pub positions: Vec<DVec3>,
    /// Per vertex: a source triangle that holds it.
    pub vertex_source_triangle: Vec<u32>,
    /// Per vertex: its barycentric coordinates in that triangle; exactly a unit vector at a source vertex.
    pub vertex_barycentric: Vec<[f64; 3]>,
    /// Corner vertices, wound like the source triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Per triangle: the source triangle it is a part of.
    pub source_triangle: Vec<u32>,
    /// Per triangle and corner: barycentric coordinates in the source triangle.
    pub corner_barycentric: Vec<[[f64; 3]; 3]>,
    /// Per triangle and edge (corner k to k+1): the source triangle's edge it lies on (0, 1, 2), or -1.
    pub source_edge: Vec<[i8; 3]>,
    /// Per triangle and corner: scene-linear `B/pi` or `H/pi`, rgb, never clipped.
    pub corner_radiance: Vec<[[f32; 3]; 3]>,
}
