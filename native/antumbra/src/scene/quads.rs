//! Pairs of triangles that form a planar convex quadrilateral: half the polygons to send, to block and to test.

use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::index::VertexId;
use crate::mesh::edge_key;
use crate::visibility::ConvexPolygon;

/// A triangle that may be paired.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Half {
    /// Counter-clockwise about `normal`.
    pub(crate) vertices: [VertexId; 3],
    pub(crate) positions: [DVec3; 3],
    pub(crate) normal: DVec3,
    /// Only halves with the same key are paired.
    pub(crate) key: u64,
}

/// A triangle, or two, as one polygon.
#[derive(Debug, Clone)]
pub(crate) struct Merged {
    /// Indices into the input.
    pub(crate) halves: SmallVec<[usize; 2]>,
    pub(crate) polygon: ConvexPolygon,
}

/// Distance from a plane, relative to the polygon's size, up to which four corners are planar. A quadrilateral of
/// f32 coordinates that was modelled flat stays flat to 1e-15 under an f64 transform; one that was rotated in f32 is
/// off by 1e-8, and the kernel would see its closure break by that much.
const PLANAR: f64 = 1e-12;

/// Pairs triangles across their longest edges, in the order of the input.
pub(crate) fn merge(halves: &[Half]) -> Vec<Merged> {
    let mut on_edge: FxHashMap<(VertexId, VertexId), SmallVec<[usize; 2]>> = FxHashMap::default();
    for (index, half) in halves.iter().enumerate() {
        for k in 0..3 {
            let key = edge_key(half.vertices[k], half.vertices[(k + 1) % 3]);
            on_edge.entry(key).or_default().push(index);
        }
    }
    let mut taken = vec![false; halves.len()];
    let mut merged = Vec::with_capacity(halves.len());
    for (index, half) in halves.iter().enumerate() {
        if taken[index] {
            continue;
        }
        taken[index] = true;
        let k = longest_edge(&half.positions);
        let key = edge_key(half.vertices[k], half.vertices[(k + 1) % 3]);
        let partner = on_edge[&key].iter().copied().find_map(|other| {
            if taken[other] || halves[other].key != half.key {
                return None;
            }
            quadrilateral(half, k, &halves[other]).map(|polygon| (other, polygon))
        });
        if let Some((other, polygon)) = partner {
            taken[other] = true;
            merged.push(Merged { halves: SmallVec::from_slice(&[index, other]), polygon });
        } else {
            let [a, b, c] = half.positions;
            // A part of a sliver may be too thin to have a normal of its own.
            let Some(polygon) = ConvexPolygon::triangle(a, b, c) else { continue };
            merged.push(Merged { halves: SmallVec::from_slice(&[index]), polygon });
        }
    }
    merged
}

fn longest_edge(p: &[DVec3; 3]) -> usize {
    let length = |k: usize| p[k].distance_squared(p[(k + 1) % 3]);
    (1..3).fold(0, |longest, k| if length(k) > length(longest) { k } else { longest })
}

/// The union of two triangles that share `half`'s edge `k`, if it is planar and convex.
fn quadrilateral(half: &Half, k: usize, other: &Half) -> Option<ConvexPolygon> {
    let apex = (0..3).find(|&i| !half.vertices.contains(&other.vertices[i]))?;
    let [a, b, c] = [k, (k + 1) % 3, (k + 2) % 3].map(|i| half.positions[i]);
    let d = other.positions[apex];
    let size_squared = a.distance_squared(b).max(c.distance_squared(d));
    let planar = half.normal.dot(d - a).powi(2) <= PLANAR * PLANAR * size_squared
        && half.normal.dot(other.normal) > 0.0;
    // Strictly convex at the two corners where the triangles meet.
    let corners = [(c, a, d), (d, b, c)];
    let convex = corners.iter().all(|&(previous, at, next)| {
        (at - previous).cross(next - at).dot(half.normal) > PLANAR * size_squared
    });
    (planar && convex).then(|| ConvexPolygon::new(&[a, d, b, c])).flatten()
}
