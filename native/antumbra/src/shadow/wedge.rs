//! The planes on which the visible part of a source changes its form: VE and EV wedges, and planes of blocking
//! polygons (§2.3 and §3.2 of the paper; Heckbert 1992; Lischinski, Tampieri and Greenberg 1992).
//!
//! Each wedge is independent of the receiver, so that those of a source and a blocker are found once per shot.
//! Pruned is only what is exact: an edge counts where it is a silhouette seen from the source's vertex (seen from any
//! point of the wedge it is the same), a vertex for the part of the source's edge from where one of its edges is. A
//! wedge need not be tangent to the blocker: where a corner slides across an edge of the source, the visible
//! outline bends as much as where it only touches it.

use std::sync::OnceLock;

use glam::DVec3;
use smallvec::SmallVec;

use super::silhouette::{BlockerEdges, ON_PLANE};
use crate::visibility::ConvexPolygon;

/// Part of a source's edge below which it throws no line: where only an end of the edge sees a vertex as a corner, the
/// slack for rounding leaves about this much. A larger rest costs a line too short to matter.
const SHORTEST_SPAN: f64 = 1e-12;

/// What of the source and what of the blockers meet in a wedge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum WedgeKind {
    /// A source vertex and a blocker edge.
    VertexEdge,
    /// A source edge, by its first vertex, and a blocker vertex.
    EdgeVertex,
    /// The source (index 0) and the plane of a blocking polygon.
    Face,
}

/// The same for every polygon that shares the edge or the vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct WedgeId {
    pub(crate) kind: WedgeKind,
    /// Index of the source's vertex or edge.
    pub(crate) source: u32,
    /// Index of the blockers' edge, vertex or polygon.
    pub(crate) blocker: u32,
}

/// A plane that light grazes a blocker in, with the parts of source and blocker that bound it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wedge {
    pub(crate) id: WedgeId,
    /// Unit normal of its plane, of either sign.
    pub(crate) normal: DVec3,
    /// The part of the source: a vertex twice, or the ends of (a part of) an edge, or of the plane's cut through it.
    pub(crate) from: [DVec3; 2],
    /// The part of the blocker in front of the source's plane: a vertex, the ends of an edge, or an outline.
    pub(crate) through: SmallVec<[DVec3; 4]>,
}

/// A source's plane; in front is where it sends.
struct Front {
    normal: DVec3,
    point: DVec3,
    rounding: f64,
}

impl Front {
    fn of(source: &ConvexPolygon) -> Self {
        let extent = source.vertices().iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
        Self { normal: source.normal(), point: source.vertices()[0], rounding: ON_PLANE * extent }
    }

    /// Height over the plane, exactly 0 in it.
    fn height(&self, point: DVec3) -> f64 {
        let height = self.normal.dot(point - self.point);
        if height.abs() <= self.rounding + ON_PLANE * point.abs().max_element() { 0.0 } else { height }
    }

    /// The part of a convex outline (or of a segment) that is in front; empty unless some of it strictly is.
    fn clip(&self, outline: &[DVec3]) -> SmallVec<[DVec3; 4]> {
        let mut kept = SmallVec::new();
        let sides = if outline.len() == 2 { 1 } else { outline.len() };
        if !outline.iter().any(|&point| self.height(point) > 0.0) {
            return kept;
        }
        for (i, &a) in outline.iter().enumerate() {
            let h_a = self.height(a);
            if h_a >= 0.0 {
                kept.push(a);
            }
            let b = outline[(i + 1) % outline.len()];
            let h_b = self.height(b);
            if i < sides && h_a * h_b < 0.0 {
                kept.push(a + (b - a) * (h_a / (h_a - h_b)));
            }
        }
        kept
    }
}

/// All wedges of one blocking polygon: of its silhouette edges, its corners and its plane.
pub(crate) fn wedges_of(
    source: &ConvexPolygon,
    edges: &BlockerEdges,
    polygons: &[ConvexPolygon],
    blocker: u32,
) -> Vec<Wedge> {
    let front = Front::of(source);
    let polygon = &polygons[blocker as usize];
    let mut wedges = Vec::new();
    if polygon.vertices().iter().all(|&vertex| front.height(vertex) <= 0.0) {
        return wedges;
    }
    let corners = source.vertices();
    for &edge in edges.edges_of(blocker) {
        let part = front.clip(&edges.edge(edge).ends);
        if part.len() < 2 {
            continue;
        }
        for (i, &vertex) in corners.iter().enumerate() {
            if !edges.is_silhouette(edge, vertex) {
                continue;
            }
            let id = WedgeId { kind: WedgeKind::VertexEdge, source: i as u32, blocker: edge };
            // The plane of the whole edge: clipping must not turn it.
            let [a, b] = edges.edge(edge).ends;
            let Some(normal) = plane_normal(vertex, [a, b]) else { continue };
            wedges.push(Wedge { id, normal, from: [vertex; 2], through: part.clone() });
        }
    }
    for &vertex in edges.vertices_of(blocker) {
        let position = edges.vertex(vertex).position;
        if front.height(position) <= 0.0 || !edges.is_corner(vertex) {
            continue;
        }
        for (i, &start) in corners.iter().enumerate() {
            let edge = [start, corners[(i + 1) % corners.len()]];
            let Some(from) = seen_as_corner(edges, vertex, edge) else { continue };
            let Some(normal) = plane_normal(position, edge) else { continue };
            let id = WedgeId { kind: WedgeKind::EdgeVertex, source: i as u32, blocker: vertex };
            wedges.push(Wedge { id, normal, from, through: SmallVec::from_slice(&[position]) });
        }
    }
    if let Some(from) = cut(source, polygon) {
        let id = WedgeId { kind: WedgeKind::Face, source: 0, blocker };
        let through = front.clip(polygon.vertices());
        wedges.push(Wedge { id, normal: polygon.normal(), from, through });
    }
    wedges
}

/// The part of a source's edge from where a blocker's vertex is a corner of its outline.
fn seen_as_corner(edges: &BlockerEdges, vertex: u32, from: [DVec3; 2]) -> Option<[DVec3; 2]> {
    let [low, high] = (edges.vertex(vertex).edges.iter())
        .filter_map(|&edge| edges.silhouette_span(edge, from))
        .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?;
    let at = |t: f64| if t >= 1.0 { from[1] } else { from[0] + (from[1] - from[0]) * t };
    (high - low > SHORTEST_SPAN).then(|| [at(low), at(high)])
}

/// Unit normal of the plane through a point and a segment; `None` when they are in line.
fn plane_normal(point: DVec3, [a, b]: [DVec3; 2]) -> Option<DVec3> {
    let along = b - a;
    // From the nearer end, for the smaller rounding.
    let nearer = if point.distance_squared(a) < point.distance_squared(b) { a } else { b };
    let normal = (nearer - point).cross(along);
    let size = point.abs().max_element() + nearer.abs().max_element();
    (normal.length() > ON_PLANE * size * along.length()).then(|| normal.normalize())
}

/// The segment in which a polygon's plane cuts a source, or the source's edge that lies in it.
fn cut(source: &ConvexPolygon, polygon: &ConvexPolygon) -> Option<[DVec3; 2]> {
    let plane = Front::of(polygon);
    let vertices = source.vertices();
    let mut points = SmallVec::<[DVec3; 4]>::new();
    for (i, &a) in vertices.iter().enumerate() {
        let b = vertices[(i + 1) % vertices.len()];
        let (h_a, h_b) = (plane.height(a), plane.height(b));
        if h_a == 0.0 {
            points.push(a);
        } else if h_a * h_b < 0.0 {
            points.push(a + (b - a) * (h_a / (h_a - h_b)));
        }
    }
    // A touched corner sends no light along the plane; a source that lies in the plane sends none over it.
    (points.len() == 2).then(|| [points[0], points[1]])
}

/// The wedges of one source, each blocker's computed when first asked for, by whichever thread, and kept for the shot (the
/// paper's stored shadow BSP trees).
#[derive(Debug)]
pub(crate) struct WedgeCache<'a> {
    source: &'a ConvexPolygon,
    edges: &'a BlockerEdges,
    polygons: &'a [ConvexPolygon],
    /// Per polygon.
    known: Vec<OnceLock<Vec<Wedge>>>,
}

impl<'a> WedgeCache<'a> {
    /// For a source and all blocking polygons with their edges.
    pub(crate) fn new(
        source: &'a ConvexPolygon,
        edges: &'a BlockerEdges,
        polygons: &'a [ConvexPolygon],
    ) -> Self {
        let known = std::iter::repeat_with(OnceLock::new).take(polygons.len()).collect();
        Self { source, edges, polygons, known }
    }

    /// The wedges of one blocker, as [`wedges_of`].
    pub(crate) fn wedges(&self, blocker: u32) -> &[Wedge] {
        self.known[blocker as usize]
            .get_or_init(|| wedges_of(self.source, self.edges, self.polygons, blocker))
    }
}
