//! How much a shadow boundary matters: by how much the slope or the curvature of the form factor jumps across it.
//!
//! Moving the receiver by 1 m across a wedge moves the wedge's trace over the source by
//! `m = (|z-p|/|p-x|) · sin(wedge, receiver)/sin(wedge, source)` metres, where light from `z` on the source passes the
//! blocker at `p` and arrives at `x`; for parallel planes that is `(d_s-d_b)/d_b`. With `K = cos cos'/(pi r²)`,
//!
//! - D1: a blocker edge in one plane with an edge of the source (un)covers all of it at once: the slope jumps by
//!   `∫ m K dl` over the part of it that is seen past the blocker edge. A polygon seen edge-on hides what is between
//!   the traces of its near and its far border: `∫ (m_near - m_far) K dl`, twice where it does not belong to a
//!   closed surface, because it then hides as much to either side.
//! - D2: the length of the source that a trace cuts bends at a corner: the curvature jumps by
//!   `m² K |cot a1 - cot a2|`, with `a` the directions (mod pi) of the two edges at the corner against the trace: of
//!   the source (VE) or, projected onto the source, of the blocker (EV).
//!
//! Other blockers are ignored: they only weaken the jumps of a convex blocker. Curvature jumps on D1 lines are not
//! computed; slopes dominate there. Lines that coincide each state the slope of the whole event.

use glam::DVec3;
use smallvec::SmallVec;

use super::silhouette::BlockerEdges;
use super::wedge::{Wedge, WedgeKind};
use crate::visibility::{ConvexPolygon, Receiver};

/// Sine of the angle between a trace and an edge, on the source, below which they are parallel: a D1 line.
///
/// The D2 formula has lost half its digits here, and blows up below. Little depends on where it changes, because
/// [`Jump::bound`] never charges a curvature more than the slope that it comes from.
const COPLANAR: f64 = 1e-9;

/// Gauss-Legendre nodes and weights on 0..1 with three points, exact to degree 5.
const GAUSS: [(f64, f64); 3] = {
    const AT: f64 = 0.387_298_334_620_741_7; // √(3/5)/2
    [(0.5 - AT, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + AT, 5.0 / 18.0)]
};

/// Panels per integral. Under sources 0.4 of their distance wide, one leaves an error of 1e-5, two of 3e-7, and four no
/// less than the finite differences that it is measured against. Not measured where a receiver nearly touches a source.
const PANELS: u32 = 2;

/// Jumps of the form factor's derivatives across a line, perpendicular to it in the receiver's plane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Jump {
    /// Of the first derivative, 1/m.
    pub(crate) slope: f64,
    /// Of the second derivative, 1/m².
    pub(crate) curvature: f64,
    /// What the curvature can change the slope by at most, 1/m: that of uncovering both edges at the corner.
    pub(crate) slope_limit: f64,
}

impl Jump {
    /// The most by which the form factor in a linear element of this size, metres, errs without the line.
    pub(crate) fn bound(&self, size: f64) -> f64 {
        // The limit may be infinite where the size is 0.
        if size <= 0.0 {
            return 0.0;
        }
        let bend = (self.curvature * size * size / 8.0).min(self.slope_limit * size / 4.0);
        self.slope * size / 4.0 + bend
    }
}

/// The jumps across a wedge's line at a point of it, with its receiver's normal.
///
/// Infinite where the receiver touches the blocker: the value itself jumps there.
pub(crate) fn jump(wedge: &Wedge, receiver: &Receiver, source: &ConvexPolygon, edges: &BlockerEdges) -> Jump {
    let Some(trace) = Trace::new(wedge, receiver, source) else { return Jump::default() };
    let jump = match wedge.id.kind {
        WedgeKind::VertexEdge => trace.vertex_edge(wedge, edges),
        WedgeKind::EdgeVertex => trace.edge_vertex(wedge, edges),
        WedgeKind::Face => {
            let slope = trace.face_slope(wedge.from, &wedge.through);
            let sides = if edges.is_closed(wedge.id.blocker) { 1.0 } else { 2.0 };
            Jump { slope: sides * slope, ..Jump::default() }
        }
    };
    // Not a number is an infinite sweep over a place that sends nothing here.
    let number = |value: f64| if value.is_nan() { 0.0 } else { value };
    Jump {
        slope: number(jump.slope),
        curvature: number(jump.curvature),
        slope_limit: number(jump.slope_limit),
    }
}

/// The trace of a wedge on the source's plane, as a receiver throws it.
struct Trace<'a> {
    x: DVec3,
    normal: DVec3,
    wedge_normal: DVec3,
    source: &'a ConvexPolygon,
    /// Unit direction of the trace, and across it, in the source's plane.
    along: DVec3,
    across: DVec3,
    /// sin(wedge, receiver)/sin(wedge, source)
    turn: f64,
}

impl<'a> Trace<'a> {
    /// `None` when the wedge is the source's plane, along which nothing is sent.
    fn new(wedge: &Wedge, receiver: &Receiver, source: &'a ConvexPolygon) -> Option<Self> {
        let along = source.normal().cross(wedge.normal);
        let sine = along.length();
        (sine > COPLANAR).then(|| Self {
            x: receiver.position,
            normal: receiver.normal,
            wedge_normal: wedge.normal,
            source,
            along: along / sine,
            across: source.normal().cross(along / sine),
            turn: receiver.normal.cross(wedge.normal).length() / sine,
        })
    }

    /// K from `z` on the source, 1/m².
    fn kernel(&self, z: DVec3) -> f64 {
        let to = z - self.x;
        let distance2 = to.length_squared();
        let cosines = self.normal.dot(to).max(0.0) * self.source.normal().dot(to).abs();
        cosines / (std::f64::consts::PI * distance2 * distance2)
    }

    /// `m` past `p` at `z`.
    fn sweep(&self, p: DVec3, z: DVec3) -> f64 {
        self.turn * (z.distance(p) / p.distance(self.x))
    }

    /// In the wedge's plane, perpendicular to the direction from the receiver to `point`: its product with `z - x` is
    /// 0 where `point` covers `z`.
    fn beside(&self, point: DVec3) -> DVec3 {
        self.wedge_normal.cross(point - self.x)
    }

    /// Cotangent of a direction in the source's plane against the trace; `None` when they are parallel.
    fn cotangent(&self, direction: DVec3) -> Option<f64> {
        let (along, across) = (direction.dot(self.along), direction.dot(self.across));
        (across.abs() > COPLANAR * direction.length()).then(|| along / across)
    }

    fn vertex_edge(&self, wedge: &Wedge, edges: &BlockerEdges) -> Jump {
        let z = wedge.from[0];
        let [a, b] = edges.edge(wedge.id.blocker).ends;
        let beside = self.beside(z);
        let at = beside.dot(self.x - a) / beside.dot(b - a);
        if !at.is_finite() {
            return Jump::default();
        }
        let m = self.sweep(a + (b - a) * at.clamp(0.0, 1.0), z);

        // Both edges of the source at the vertex
        let vertices = self.source.vertices();
        let (count, i) = (vertices.len(), wedge.id.source as usize);
        let mut jump = Jump::default();
        let mut cotangents = [None; 2];
        for (end, cotangent) in
            [vertices[(i + 1) % count], vertices[(i + count - 1) % count]].into_iter().zip(&mut cotangents)
        {
            *cotangent = self.cotangent(end - z);
            if cotangent.is_none() {
                jump.slope += self.edge_slope([z, end], [wedge.through[0], wedge.through[1]]);
            }
            jump.slope_limit += m * integrate([z, end], |z| self.kernel(z));
        }
        if let [Some(first), Some(second)] = cotangents {
            jump.curvature = m * m * self.kernel(z) * (first - second).abs();
        }
        jump
    }

    fn edge_vertex(&self, wedge: &Wedge, edges: &BlockerEdges) -> Jump {
        let p = wedge.through[0];
        let vertices = self.source.vertices();
        let i = wedge.id.source as usize;
        let source_edge = [vertices[i], vertices[(i + 1) % vertices.len()]];
        let beside = self.beside(p);
        let at = beside.dot(self.x - source_edge[0]) / beside.dot(source_edge[1] - source_edge[0]);
        if !at.is_finite() {
            return Jump::default();
        }
        let z = source_edge[0] + (source_edge[1] - source_edge[0]) * at.clamp(0.0, 1.0);
        let m = self.sweep(p, z);

        // The blocker's outline at the vertex, projected onto the source
        let mut jump = Jump::default();
        let mut cotangents = SmallVec::<[f64; 4]>::new();
        let mut parallel = false;
        for &edge in &edges.vertex(wedge.id.blocker).edges {
            if !edges.is_silhouette(edge, z) {
                continue;
            }
            let edge = edges.edge(edge);
            let direction =
                self.source.normal().cross((p - self.x).cross(edge.other_end(wedge.id.blocker) - p));
            if let Some(cotangent) = self.cotangent(direction) {
                cotangents.push(cotangent);
            } else {
                parallel = true;
                jump.slope += self.edge_slope(source_edge, edge.ends);
            }
        }
        jump.slope_limit = 2.0 * m * integrate(source_edge, |z| self.kernel(z));
        if !parallel {
            let least = cotangents.iter().copied().fold(f64::INFINITY, f64::min);
            let most = cotangents.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            // More than two edges bound several hidden sectors.
            let sectors = 0.5 * cotangents.len().max(2) as f64;
            let bend = if cotangents.is_empty() { 0.0 } else { most - least };
            jump.curvature = m * m * self.kernel(z) * bend * sectors;
        }
        jump
    }

    /// `∫ m K dl` over the part of an edge of the source that is seen past a blocker edge in the same plane.
    fn edge_slope(&self, edge: [DVec3; 2], past: [DVec3; 2]) -> f64 {
        // Clip the edge to the sector that the receiver sees the blocker edge in
        let [first, second] = past.map(|end| self.beside(end));
        let orientation = first.dot(past[1] - self.x).signum();
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        for inward in [first * orientation, second * -orientation] {
            let [start, end] = edge.map(|z| inward.dot(z - self.x));
            match (start < 0.0, end < 0.0) {
                (true, true) => return 0.0,
                (true, false) => low = low.max(start / (start - end)),
                (false, true) => high = high.min(start / (start - end)),
                (false, false) => {}
            }
        }
        if low >= high {
            return 0.0;
        }
        let part = [edge[0].lerp(edge[1], low), edge[0].lerp(edge[1], high)];
        integrate(part, |z| {
            let beside = self.beside(z);
            let at = beside.dot(self.x - past[0]) / beside.dot(past[1] - past[0]);
            let p = past[0] + (past[1] - past[0]) * at;
            // What is behind the source hides nothing of it.
            let hides = p.distance_squared(self.x) < z.distance_squared(self.x);
            if hides { self.sweep(p, z) * self.kernel(z) } else { 0.0 }
        })
    }

    /// `∫ (m_near - m_far) K dl` over the part of a chord of the source that is seen through a polygon edge-on.
    fn face_slope(&self, chord: [DVec3; 2], outline: &[DVec3]) -> f64 {
        // What covers the chord changes at the polygon's corners
        let mut cuts = SmallVec::<[f64; 8]>::from_slice(&[0.0, 1.0]);
        for &corner in outline {
            let beside = self.beside(corner);
            let [start, end] = chord.map(|z| beside.dot(z - self.x));
            if start * end < 0.0 {
                cuts.push(start / (start - end));
            }
        }
        cuts.sort_unstable_by(f64::total_cmp);
        (cuts.windows(2))
            .map(|cut| {
                let part = [chord[0].lerp(chord[1], cut[0]), chord[0].lerp(chord[1], cut[1])];
                integrate(part, |z| {
                    self.covered(z, outline)
                        .map_or(0.0, |[near, far]| self.turn * (1.0 / near - 1.0 / far) * self.kernel(z))
                })
            })
            .sum()
    }

    /// The part (0 to 1) of the way from the receiver to `z` that lies in a polygon in the wedge's plane.
    fn covered(&self, z: DVec3, outline: &[DVec3]) -> Option<[f64; 2]> {
        let way = z - self.x;
        let (mut near, mut far) = (0.0_f64, 1.0_f64);
        for (i, &a) in outline.iter().enumerate() {
            // The outline is counter-clockwise about the wedge's normal.
            let inward = self.wedge_normal.cross(outline[(i + 1) % outline.len()] - a);
            let (height, rise) = (inward.dot(self.x - a), inward.dot(way));
            if rise > 0.0 {
                near = near.max(-height / rise);
            } else if rise < 0.0 {
                far = far.min(-height / rise);
            } else if height < 0.0 {
                return None;
            }
        }
        (near < far).then_some([near, far])
    }
}

/// An integral along a segment.
fn integrate([a, b]: [DVec3; 2], value: impl Fn(DVec3) -> f64) -> f64 {
    let width = 1.0 / f64::from(PANELS);
    let nodes = (0..PANELS)
        .flat_map(|panel| GAUSS.map(|(at, weight)| ((f64::from(panel) + at) * width, weight * width)));
    a.distance(b) * nodes.map(|(at, weight)| weight * value(a.lerp(b, at))).sum::<f64>()
}
