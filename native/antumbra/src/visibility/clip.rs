//! Planes, the side of a point, and a store of convex fragments that planes cut.
//!
//! All coordinates are relative to the receiver point, metres.

use std::ops::Range;

use glam::DVec3;

/// Distance below which a point lies *on* a plane, relative to its distance from the receiver.
///
/// Where polygons are coplanar, touch or share vertices, the true distance is 0 and the computed one is rounding,
/// whose sign is chance: without snapping, the sum of all form factors in a closed room was off by 0.117. Measured
/// on random rooms with solids inside, every value from 1e-15 to 1e-8 closes equally well: smaller ones miss
/// rounding that some intersections have amplified, larger ones shift shadows by what they snap. This one is in the
/// middle of that plateau, and moves a shadow by at most 1e-12 of its distance.
const SNAP: f64 = 1e-12;

/// Distance below which a point lies on a polygon's own plane, relative to the largest coordinate.
///
/// World coordinates are rounded to half an epsilon of their size, however small the polygon and however near the
/// receiver: three coordinates of each of two points and of the plane's own points. Without it a point that lies on
/// a polygon may count as behind it by 1e-17 m and see nothing at all.
pub(super) const SNAP_WORLD: f64 = 8.0 * f64::EPSILON;

/// A point and how far from a plane it may be to lie on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    pub(super) point: DVec3,
    snap: f64,
}

impl Vertex {
    pub(super) fn new(point: DVec3) -> Self {
        Self { point, snap: SNAP * point.abs().max_element() }
    }
}

/// The half-space `normal · p + offset > 0`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    normal: DVec3,
    offset: f64,
    snap: f64,
}

impl Plane {
    /// The half-space in front of a plane through the receiver.
    pub(super) fn through_receiver(normal: DVec3) -> Self {
        Self { normal, offset: 0.0, snap: 0.0 }
    }

    /// The half-space to the left of the edge from `a` to `b` (world space), seen from the receiver; `None` when the
    /// edge is a point.
    ///
    /// Computed from the endpoints in lexicographic order, so that two polygons that share an edge get the same
    /// plane to the last bit and nothing leaks between them, and from the edge's own vector, so that an edge that is
    /// short or far away has its direction without cancellation.
    pub(super) fn through_edge(receiver: DVec3, a: DVec3, b: DVec3) -> Option<Self> {
        let ordered = (a.x, a.y, a.z) < (b.x, b.y, b.z);
        let (first, second) = if ordered { (a, b) } else { (b, a) };
        let normal = (first - receiver).cross(second - first);
        let size = normal.abs().element_sum();
        let scale = if ordered { 1.0 / size } else { -1.0 / size };
        // With |normal|₁ = 1 a height is at most the point's largest coordinate, to which it is snapped.
        (size > 0.0).then(|| Self::through_receiver(normal * scale))
    }

    /// The half-space beyond a plane that does not hold the receiver. `distance` is that plane's distance from it
    /// along `normal`, of either sign; `world` the largest coordinate involved.
    pub(super) fn beyond(normal: DVec3, distance: f64, world: f64) -> Self {
        let snap = SNAP * distance.abs() + SNAP_WORLD * world;
        Self { normal: normal * distance.signum(), offset: -distance.abs(), snap }
    }

    /// The complement.
    pub(super) fn flipped(self) -> Self {
        Self { normal: -self.normal, offset: -self.offset, snap: self.snap }
    }

    /// Positive inside, negative outside, exactly 0 on the plane: the only place where that is decided.
    #[inline]
    pub(super) fn side(&self, vertex: &Vertex) -> f64 {
        let height = self.normal.dot(vertex.point) + self.offset;
        if height.abs() <= vertex.snap + self.snap { 0.0 } else { height }
    }
}

/// Distance along `normal` from the receiver to a plane through `point` (relative to the receiver); exactly 0 when
/// the receiver lies on it.
pub(super) fn plane_distance(normal: DVec3, point: DVec3, world: f64) -> f64 {
    let distance = normal.dot(point);
    let on_plane = distance.abs() <= SNAP * point.abs().max_element() + SNAP_WORLD * world;
    if on_plane { 0.0 } else { distance }
}

/// What a set of half-spaces did to a fragment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cut {
    /// They do not meet inside it; the fragment is whole.
    Missed,
    /// Some of it is gone.
    Reduced,
    /// All of it is gone.
    Gone,
}

/// Convex fragments of one planar polygon.
///
/// Vertices are only appended: a fragment that nothing cuts is never copied.
#[derive(Debug, Default)]
pub(super) struct Fragments {
    vertices: Vec<Vertex>,
    ranges: Vec<Range<usize>>,
    inside: Vec<Vertex>,
    next_inside: Vec<Vertex>,
    heights: Vec<f64>,
}

impl Fragments {
    /// Starts again from one fragment.
    pub(super) fn restart(&mut self, outline: impl Iterator<Item = Vertex>) {
        self.vertices.clear();
        self.ranges.clear();
        self.vertices.extend(outline);
        self.ranges.push(0..self.vertices.len());
    }

    pub(super) fn len(&self) -> usize {
        self.ranges.len()
    }

    /// The outline of one fragment.
    pub(super) fn outline(&self, fragment: usize) -> &[Vertex] {
        &self.vertices[self.ranges[fragment].clone()]
    }

    /// The outlines of all fragments.
    pub(super) fn outlines(&self) -> impl Iterator<Item = &[Vertex]> {
        self.ranges.iter().map(|fragment| &self.vertices[fragment.clone()])
    }

    /// Keeps of the only fragment what is inside `plane`; false when that is nothing.
    pub(super) fn keep_inside(&mut self, plane: &Plane) -> bool {
        let (any_inside, any_outside) = measure(plane, &self.vertices, &mut self.heights);
        if any_inside && any_outside {
            self.next_inside.clear();
            split(&self.vertices, &self.heights, &mut self.next_inside, None);
            std::mem::swap(&mut self.vertices, &mut self.next_inside);
            self.ranges[0] = 0..self.vertices.len();
        }
        any_inside
    }

    /// Removes from every fragment what is inside all of `planes`.
    pub(super) fn subtract(&mut self, planes: &[Plane]) -> Cut {
        let mut result = Cut::Missed;
        let mut fragment = 0;
        let mut to_visit = self.ranges.len();
        while fragment < to_visit {
            match self.subtract_from(fragment, planes) {
                Cut::Missed => fragment += 1,
                Cut::Reduced => {
                    result = Cut::Reduced;
                    fragment += 1;
                }
                Cut::Gone => {
                    result = Cut::Reduced;
                    // The last one not yet visited takes its place; what was split off stays behind those.
                    to_visit -= 1;
                    self.ranges.swap(fragment, to_visit);
                    self.ranges.swap_remove(to_visit);
                }
            }
        }
        if self.ranges.is_empty() { Cut::Gone } else { result }
    }

    /// Removes from one fragment what is inside all of `planes`: plane by plane, what is outside becomes a fragment of its
    /// own and what is inside goes on, until the last inside is dropped.
    fn subtract_from(&mut self, fragment: usize, planes: &[Plane]) -> Cut {
        let range = self.ranges[fragment].clone();

        // Leave the fragment whole if one plane keeps it outside
        for plane in planes {
            if !self.vertices[range.clone()].iter().any(|vertex| plane.side(vertex) > 0.0) {
                return Cut::Missed;
            }
        }

        // Split off what each plane leaves outside
        let (old_vertices, old_ranges) = (self.vertices.len(), self.ranges.len());
        self.inside.clear();
        self.inside.extend_from_slice(&self.vertices[range]);
        for plane in planes {
            let (any_inside, any_outside) = measure(plane, &self.inside, &mut self.heights);
            if !any_inside {
                // No single plane separates them, but all together do.
                self.vertices.truncate(old_vertices);
                self.ranges.truncate(old_ranges);
                return Cut::Missed;
            }
            if any_outside {
                let start = self.vertices.len();
                self.next_inside.clear();
                split(&self.inside, &self.heights, &mut self.next_inside, Some(&mut self.vertices));
                self.ranges.push(start..self.vertices.len());
                std::mem::swap(&mut self.inside, &mut self.next_inside);
            }
        }
        if self.ranges.len() == old_ranges {
            return Cut::Gone;
        }
        self.ranges.swap_remove(fragment);
        Cut::Reduced
    }
}

/// The side of every vertex into `heights`; whether any is inside, and any outside.
fn measure(plane: &Plane, outline: &[Vertex], heights: &mut Vec<f64>) -> (bool, bool) {
    heights.clear();
    heights.extend(outline.iter().map(|vertex| plane.side(vertex)));
    (heights.iter().any(|&height| height > 0.0), heights.iter().any(|&height| height < 0.0))
}

/// Appends the two parts of a convex outline that the plane of `heights` divides. Both get the very same new
/// vertices, so that their boundaries cancel exactly.
fn split(
    outline: &[Vertex],
    heights: &[f64],
    inside: &mut Vec<Vertex>,
    mut outside: Option<&mut Vec<Vertex>>,
) {
    let mut from = outline.len() - 1;
    for to in 0..outline.len() {
        let (height_from, height_to) = (heights[from], heights[to]);
        if height_from * height_to < 0.0 {
            let t = height_from / (height_from - height_to);
            let crossing = Vertex::new(outline[from].point.lerp(outline[to].point, t));
            inside.push(crossing);
            if let Some(outside) = outside.as_deref_mut() {
                outside.push(crossing);
            }
        }
        if height_to >= 0.0 {
            inside.push(outline[to]);
        }
        if height_to <= 0.0
            && let Some(outside) = outside.as_deref_mut()
        {
            outside.push(outline[to]);
        }
        from = to;
    }
}
