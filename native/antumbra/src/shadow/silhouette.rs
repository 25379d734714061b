//! Which edges of the blocking polygons bound a shadow, seen from a point of the source (§2.3 of the paper).
//!
//! An edge bounds what is hidden when all polygons that share it lie on one side of it, seen from the point. That is
//! asked of the polygons' own directions away from the edge, never of their normals, so that the winding does not
//! matter, nor how many polygons share the edge.

use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use super::sharp::Apex;
use crate::visibility::ConvexPolygon;

/// Angle from the straight continuation, radians, below which two polygons count as one flat surface whose common
/// edge never bounds a shadow.
///
/// A flat surface of f32 coordinates that was rotated in f32 is bent by about 1e-7; with 1e-9 its inner edges would
/// bound shadows for points that see it edge-on, where its border's shadow is within 1e-7 of them. A sphere is bent
/// by less only from 1e13 polygons on.
const FLAT: f64 = 1e-6;

/// Height over a polygon's plane, relative to the coordinates, below which a point lies in it: rounding of a dot
/// product of f64 differences, with room. A point in the plane sees the polygon as a line, and each of its edges
/// may bound the shadow; a larger value only adds lines that already coincide.
pub(super) const ON_PLANE: f64 = 1e-12;

/// An edge of one or more blocking polygons.
#[derive(Debug, Clone)]
pub(crate) struct BlockerEdge {
    /// Its ends, metres.
    pub(crate) ends: [DVec3; 2],
    /// The same as indices of [`BlockerEdges::vertex`].
    pub(crate) vertices: [u32; 2],
    /// The polygons that share it.
    pub(crate) polygons: SmallVec<[u32; 2]>,
    /// For each of them the unit direction from the edge into it.
    inward: SmallVec<[DVec3; 2]>,
    /// Whether two of them continue each other in one plane.
    flat: bool,
}

impl BlockerEdge {
    /// The end that is not this vertex.
    pub(super) fn other_end(&self, vertex: u32) -> DVec3 {
        self.ends[usize::from(self.vertices[0] == vertex)]
    }

    /// For each polygon, on which side of the plane through `from` and the edge it lies, times the rounding below
    /// which that is chance.
    fn sides(&self, from: Apex) -> impl Iterator<Item = (f64, f64)> {
        let [a, b] = self.ends;
        let (way, size) = match from {
            Apex::Point(from) => (a - from, a.abs().max_element() + from.abs().max_element()),
            Apex::Direction(towards) => (-towards, 1.0),
        };
        let plane = way.cross(b - a);
        let rounding = ON_PLANE * size * (b - a).length();
        self.inward.iter().map(move |inward| (inward.dot(plane), rounding))
    }
}

/// A corner of one or more blocking polygons.
#[derive(Debug, Clone)]
pub(crate) struct BlockerVertex {
    /// Metres.
    pub(crate) position: DVec3,
    /// The edges that end there.
    pub(crate) edges: SmallVec<[u32; 4]>,
}

/// The edges and corners of all blocking polygons, matched by bit-identical positions.
#[derive(Debug, Default)]
pub(crate) struct BlockerEdges {
    edges: Vec<BlockerEdge>,
    vertices: Vec<BlockerVertex>,
    polygons: Vec<PolygonParts>,
}

/// What a polygon is made of, in the order of its outline: edge `i` starts at vertex `i`.
#[derive(Debug)]
struct PolygonParts {
    edges: SmallVec<[u32; 4]>,
    vertices: SmallVec<[u32; 4]>,
    /// Whether it belongs to a closed surface.
    closed: bool,
}

impl BlockerEdges {
    /// Matches the edges of all polygons. Polygons keep their indices.
    pub(crate) fn new(polygons: &[ConvexPolygon]) -> Self {
        let mut this = Self::default();
        let mut vertex_at = FxHashMap::<[u64; 3], u32>::default();
        let mut edge_between = FxHashMap::<[u32; 2], u32>::default();
        for (index, polygon) in polygons.iter().enumerate() {
            let vertices: SmallVec<[u32; 4]> = (polygon.vertices().iter())
                .map(|&position| {
                    // Adding 0 makes the two zeros one.
                    let key = (position + DVec3::ZERO).to_array().map(f64::to_bits);
                    *vertex_at.entry(key).or_insert_with(|| {
                        this.vertices.push(BlockerVertex { position, edges: SmallVec::new() });
                        this.vertices.len() as u32 - 1
                    })
                })
                .collect();
            let edges = (0..vertices.len())
                .map(|i| {
                    let ends = [vertices[i], vertices[(i + 1) % vertices.len()]];
                    let key = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                    let edge = *edge_between.entry(key).or_insert_with(|| this.add_edge(ends));
                    this.attach(edge, index as u32, polygon, ends);
                    edge
                })
                .collect();
            this.polygons.push(PolygonParts { edges, vertices, closed: false });
        }
        this.find_closed_surfaces();
        this
    }

    fn add_edge(&mut self, vertices: [u32; 2]) -> u32 {
        let index = self.edges.len() as u32;
        for vertex in vertices {
            self.vertices[vertex as usize].edges.push(index);
        }
        let ends = vertices.map(|vertex| self.vertices[vertex as usize].position);
        let (polygons, inward) = (SmallVec::new(), SmallVec::new());
        self.edges.push(BlockerEdge { ends, vertices, polygons, inward, flat: false });
        index
    }

    /// Adds a polygon, which runs the edge from `from` to `to`, to those that share it.
    fn attach(&mut self, edge: u32, polygon: u32, shape: &ConvexPolygon, [from, to]: [u32; 2]) {
        let along = self.vertices[to as usize].position - self.vertices[from as usize].position;
        let inward = shape.normal().cross(along).normalize();
        let edge = &mut self.edges[edge as usize];
        edge.flat |= (edge.inward.iter())
            .any(|other| other.dot(inward) < 0.0 && other.cross(inward).length_squared() < FLAT * FLAT);
        edge.polygons.push(polygon);
        edge.inward.push(inward);
    }

    /// Marks the polygons of surfaces without border: every edge that can be reached is shared by two.
    fn find_closed_surfaces(&mut self) {
        let mut visited = vec![false; self.polygons.len()];
        for start in 0..self.polygons.len() {
            if std::mem::replace(&mut visited[start], true) {
                continue;
            }
            let mut surface = vec![start];
            let (mut closed, mut next) = (true, 0);
            while next < surface.len() {
                for &edge in &self.polygons[surface[next]].edges {
                    let neighbours = &self.edges[edge as usize].polygons;
                    closed &= neighbours.len() == 2;
                    for &neighbour in neighbours {
                        if !std::mem::replace(&mut visited[neighbour as usize], true) {
                            surface.push(neighbour as usize);
                        }
                    }
                }
                next += 1;
            }
            for polygon in surface {
                self.polygons[polygon].closed = closed;
            }
        }
    }

    /// An edge by its index.
    pub(crate) fn edge(&self, edge: u32) -> &BlockerEdge {
        &self.edges[edge as usize]
    }

    /// A corner by its index.
    pub(crate) fn vertex(&self, vertex: u32) -> &BlockerVertex {
        &self.vertices[vertex as usize]
    }

    /// The edges of a polygon, in the order of its outline.
    pub(crate) fn edges_of(&self, polygon: u32) -> &[u32] {
        &self.polygons[polygon as usize].edges
    }

    /// The corners of a polygon, in the order of its outline.
    pub(crate) fn vertices_of(&self, polygon: u32) -> &[u32] {
        &self.polygons[polygon as usize].vertices
    }

    /// Whether an edge lies inside a flat surface: two of its polygons continue each other in one plane.
    pub(crate) fn is_flat(&self, edge: u32) -> bool {
        self.edges[edge as usize].flat
    }

    /// Whether a polygon belongs to a surface without border.
    pub(crate) fn is_closed(&self, polygon: u32) -> bool {
        self.polygons[polygon as usize].closed
    }

    /// Whether an edge bounds what its polygons hide from a point. Also true where the point lies in the plane of one
    /// of them, unless that is flat there.
    pub(crate) fn is_silhouette(&self, edge: u32, from: DVec3) -> bool {
        self.is_silhouette_from(edge, Apex::Point(from))
    }

    /// The same from a point or from far away.
    pub(crate) fn is_silhouette_from(&self, edge: u32, from: Apex) -> bool {
        let edge = self.edge(edge);
        if edge.flat {
            return false;
        }
        let (left, right) = edge.sides(from).fold((false, false), |(left, right), (side, rounding)| {
            (left || side > rounding, right || side < -rounding)
        });
        !(left && right)
    }

    /// The part of the segment from `from[0]` to `from[1]` from where an edge is a silhouette, as the least interval
    /// of its parameter (0 to 1) that holds all of it.
    pub(crate) fn silhouette_span(&self, edge: u32, from: [DVec3; 2]) -> Option<[f64; 2]> {
        let edge = self.edge(edge);
        if edge.flat {
            return None;
        }
        // All polygons on the one side, or all on the other: sides change linearly along the segment.
        let span_of = |sign: f64| {
            let (mut low, mut high) = (0.0_f64, 1.0_f64);
            for ((start, rounding), (end, rounding_at_end)) in
                edge.sides(Apex::Point(from[0])).zip(edge.sides(Apex::Point(from[1])))
            {
                let slack = rounding.max(rounding_at_end);
                let (start, end) = (sign * start + slack, sign * end + slack);
                match (start < 0.0, end < 0.0) {
                    (true, true) => return None,
                    (true, false) => low = low.max(start / (start - end)),
                    (false, true) => high = high.min(start / (start - end)),
                    (false, false) => {}
                }
            }
            (low <= high).then_some([low, high])
        };
        match (span_of(1.0), span_of(-1.0)) {
            (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
            (a, b) => a.or(b),
        }
    }

    /// Whether the border of what is hidden can bend at a vertex: false where the only two edges that can be
    /// silhouettes continue each other.
    pub(crate) fn is_corner(&self, vertex: u32) -> bool {
        let at = self.vertex(vertex);
        let mut away = (at.edges.iter().map(|&edge| self.edge(edge)).filter(|edge| !edge.flat))
            .map(|edge| (edge.other_end(vertex) - at.position).normalize());
        match (away.next(), away.next(), away.next()) {
            (None, ..) => false,
            (Some(a), Some(b), None) => a.dot(b) > 0.0 || a.cross(b).length_squared() >= FLAT * FLAT,
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shadow::tests::{cuboid, polygon};

    fn silhouettes(polygons: &[ConvexPolygon], from: DVec3) -> usize {
        let edges = BlockerEdges::new(polygons);
        (0..edges.edges.len() as u32).filter(|&edge| edges.is_silhouette(edge, from)).count()
    }

    #[test]
    fn a_cube_shows_its_outline_whatever_its_winding() {
        let mut cube = cuboid(DVec3::ZERO, DVec3::splat(0.5));
        for _ in 0..2 {
            assert_eq!(silhouettes(&cube, DVec3::new(0.1, 0.2, 4.0)), 4, "above one face");
            assert_eq!(silhouettes(&cube, DVec3::new(0.1, 2.0, 4.0)), 6, "beside an edge");
            assert_eq!(silhouettes(&cube, DVec3::new(1.5, 2.0, 4.0)), 6, "beside a corner");
            // In the plane of a side: both of its long edges and both upright ones may bound the shadow.
            assert_eq!(silhouettes(&cube, DVec3::new(0.5, 0.2, 4.0)), 7, "in the plane of a side");
            cube[1] = cube[1].flipped();
            cube[4] = cube[4].flipped();
        }
    }

    #[test]
    fn inner_edges_of_flat_surfaces_are_never_silhouettes() {
        let [a, b, c, d] = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let card = [polygon(&[a, b, c]), polygon(&[a, c, d])];
        for from in [DVec3::Z, DVec3::new(3.0, 2.0, 1.0), DVec3::new(5.0, 0.5, 0.0)] {
            assert_eq!(silhouettes(&card, from), 4);
        }
    }

    #[test]
    fn an_edge_of_three_polygons_is_covered_when_they_lie_on_both_sides() {
        let fin = |direction: DVec3| polygon(&[DVec3::ZERO, DVec3::Y, direction + DVec3::Y, direction]);
        let fins = BlockerEdges::new(&[fin(DVec3::X), fin(DVec3::NEG_X + DVec3::Z), fin(DVec3::Z)]);
        let shared = (0..fins.edges.len() as u32).find(|&edge| fins.edge(edge).polygons.len() == 3);
        let shared = shared.expect("three fins share an edge");
        assert!(!fins.is_silhouette(shared, DVec3::new(0.1, 0.5, 5.0)));
        assert!(fins.is_silhouette(shared, DVec3::new(-5.0, 0.5, 0.1)));
    }

    #[test]
    fn a_straight_border_has_no_corner() {
        let at = |x, y| DVec3::new(x, y, 0.0);
        let card = [
            polygon(&[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]),
            polygon(&[at(1.0, 0.0), at(2.0, 0.0), at(2.0, 1.0), at(1.0, 1.0)]),
        ];
        let edges = BlockerEdges::new(&card);
        let corners: Vec<f64> = (0..edges.vertices.len() as u32)
            .filter(|&vertex| edges.is_corner(vertex))
            .map(|vertex| edges.vertex(vertex).position.x)
            .collect();
        assert_eq!(corners, [0.0, 0.0, 2.0, 2.0]);
        assert!(!edges.is_closed(0));
        assert!(BlockerEdges::new(&cuboid(DVec3::ZERO, DVec3::ONE)).is_closed(3));
    }
}
