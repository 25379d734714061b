//! Planes, the side of a point, and a store of convex fragments that planes cut.
//!
//! All coordinates are relative to the receiver point, metres.

use std::ops::Range;

use glam::DVec3;
use smallvec::SmallVec;

use super::polygon::ConvexPolygon;

/// Distance below which a point lies *on* a plane, relative to its distance from the receiver.
///
/// Where polygons are coplanar, touch or share vertices, the true distance is 0 and the computed one is rounding,
/// whose sign is chance. Measured on the random rooms of the closure test: without snapping their sums of form
/// factors are off by up to 0.07, with 1e-16 by 0.016; every value from 1e-15 to 1e-8 closes to 2e-14, 1e-6 to 3e-9.
/// Larger values are also blind to what nearly touches the receiver: with 1e-10 the form factor of a cube's adjacent
/// faces is wrong in the tenth digit, because points beside the common edge no longer see the wall.
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

/// A convex outline that needs no allocation unless it is unusually complex.
pub(super) type Outline = SmallVec<[Vertex; 8]>;

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
    /// Computed from the nearer endpoint, at equal distances from the lexicographically first, so that two polygons that
    /// share an edge get the same plane to the last bit and nothing leaks between them; and from the edge's own vector.
    /// An edge that is short, far away, or passes beside the receiver has its direction without cancellation.
    pub(super) fn through_edge(receiver: DVec3, a: DVec3, b: DVec3) -> Option<Self> {
        let (to_a, to_b) = (a - receiver, b - receiver);
        let (near, far) = (to_a.length_squared(), to_b.length_squared());
        let ordered = near < far || (near == far && (a.x, a.y, a.z) < (b.x, b.y, b.z));
        let normal = if ordered { to_a.cross(b - a) } else { to_b.cross(a - b) };
        let size = normal.abs().element_sum();
        let scale = if ordered { 1.0 / size } else { -1.0 / size };
        // With |normal|₁ = 1 a height is at most the point's largest coordinate, to which it is snapped.
        (size > 0.0).then(|| Self::through_receiver(normal * scale))
    }

    /// The half-space beyond a polygon whose plane does not hold the receiver. `distance` is [`plane_distance`], `world`
    /// the largest coordinate involved.
    ///
    /// What lies off the plane by no more than the polygon's own vertices lies on it: a sliver hides nothing of itself.
    pub(super) fn beyond(polygon: &ConvexPolygon, distance: f64, world: f64) -> Self {
        let snap = SNAP * distance.abs() + SNAP_WORLD * world + polygon.unevenness();
        Self { normal: polygon.normal() * distance.signum(), offset: -distance.abs(), snap }
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

    /// Whether any vertex is inside, and any outside.
    pub(super) fn sides(&self, outline: &[Vertex]) -> (bool, bool) {
        outline.iter().map(|vertex| self.side(vertex)).fold((false, false), |(inside, outside), height| {
            (inside || height > 0.0, outside || height < 0.0)
        })
    }
}

/// How much farther than [`SNAP`] of a polygon's size a receiver is from it before it sees it.
///
/// A polygon that it sees must not be one that lies on another plane through the receiver, or it hides nothing of what it
/// covers. Over the polygon, the receiver is its height above a mean of the corners, so that where all of these are snapped
/// the height is at most `SNAP` of the farthest, times √3, by which the L₁ norm of a normal exceeds its length.
const SEEN: f64 = 2.0;

/// Distance along a polygon's normal from the receiver to its plane; exactly 0 when the receiver lies on it as well as the
/// polygon's own vertices do. `world`: the largest coordinate involved.
pub(super) fn plane_distance(polygon: &ConvexPolygon, receiver: DVec3, world: f64) -> f64 {
    let distance = polygon.normal().dot(polygon.vertices()[0] - receiver);
    let farthest = (polygon.centroid() - receiver).abs().max_element() + polygon.radius();
    let tilt = polygon.unevenness() / polygon.radius();
    let on_plane = distance.abs() <= (SEEN * SNAP + tilt) * farthest + SNAP_WORLD * world;
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

/// Vertices from which on it is worth to look for those that are no longer used: 128 kB, which stay in the cache.
const COMPACT_FROM: usize = 4096;

/// Convex fragments of one planar polygon.
///
/// Vertices are appended, and those of fragments that are gone stay until they are most of many: a fragment that
/// nothing cuts is hardly ever copied, yet memory stays proportional to the fragments there are.
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
    pub(super) fn restart(&mut self, outline: &[Vertex]) {
        self.clear();
        self.add(outline);
    }

    /// Forgets all fragments.
    pub(super) fn clear(&mut self) {
        self.vertices.clear();
        self.ranges.clear();
    }

    /// Adds one that overlaps none of those there are.
    pub(super) fn add(&mut self, outline: &[Vertex]) {
        let start = self.vertices.len();
        self.vertices.extend_from_slice(outline);
        self.ranges.push(start..self.vertices.len());
    }

    pub(super) fn len(&self) -> usize {
        self.ranges.len()
    }

    /// The outlines of all fragments.
    pub(super) fn outlines(&self) -> impl Iterator<Item = &[Vertex]> {
        self.ranges.iter().map(|fragment| &self.vertices[fragment.clone()])
    }

    /// Removes from every fragment what is inside all of `planes`.
    pub(super) fn subtract(&mut self, planes: &[Plane]) -> Cut {
        self.take(planes, |_| {})
    }

    /// The same, handing out the outlines of what it removes.
    pub(super) fn take(&mut self, planes: &[Plane], mut taken: impl FnMut(&[Vertex])) -> Cut {
        let mut result = Cut::Missed;
        let mut fragment = 0;
        let mut to_visit = self.ranges.len();
        while fragment < to_visit {
            let cut = self.subtract_from(fragment, planes);
            if cut != Cut::Missed {
                taken(&self.inside);
            }
            match cut {
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
        self.compact();
        if self.ranges.is_empty() { Cut::Gone } else { result }
    }

    /// Moves the vertices together when most of them belong to fragments that are gone.
    fn compact(&mut self) {
        if self.vertices.len() < COMPACT_FROM {
            return;
        }
        let used: usize = self.ranges.iter().map(ExactSizeIterator::len).sum();
        if self.vertices.len() < 2 * used {
            return;
        }
        self.inside.clear();
        for range in &mut self.ranges {
            let start = self.inside.len();
            self.inside.extend_from_slice(&self.vertices[range.clone()]);
            *range = start..self.inside.len();
        }
        std::mem::swap(&mut self.vertices, &mut self.inside);
    }

    /// Removes from one fragment what is inside all of `planes`: plane by plane, what is outside becomes a fragment
    /// of its own and what is inside goes on, until the last inside is left in `self.inside`.
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
            self.heights.clear();
            let (mut any_inside, mut any_outside) = (false, false);
            for vertex in &self.inside {
                let height = plane.side(vertex);
                any_inside |= height > 0.0;
                any_outside |= height < 0.0;
                self.heights.push(height);
            }
            if !any_inside {
                // No single plane separates them, but all together do.
                self.vertices.truncate(old_vertices);
                self.ranges.truncate(old_ranges);
                return Cut::Missed;
            }
            if any_outside {
                let start = self.vertices.len();
                self.next_inside.clear();
                let (inside, outside) = (&mut self.next_inside, &mut self.vertices);
                split(
                    &self.inside,
                    &self.heights,
                    |vertex| inside.push(vertex),
                    |vertex| outside.push(vertex),
                );
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

/// Keeps what of a convex outline is inside `plane`; false when that has no area.
pub(super) fn keep_inside(outline: &mut Outline, plane: &Plane) -> bool {
    let (any_inside, any_outside) = plane.sides(outline);
    if any_inside && any_outside {
        let heights: SmallVec<[f64; 8]> = outline.iter().map(|vertex| plane.side(vertex)).collect();
        let mut inside = Outline::new();
        split(outline, &heights, |vertex| inside.push(vertex), |_| {});
        *outline = inside;
    }
    any_inside
}

/// Hands out the two parts of a convex outline that the plane of `heights` divides. Both get the very same new
/// vertices, so that their boundaries cancel exactly.
fn split(
    outline: &[Vertex],
    heights: &[f64],
    mut add_inside: impl FnMut(Vertex),
    mut add_outside: impl FnMut(Vertex),
) {
    let (mut from, mut height_from) = (outline[outline.len() - 1], heights[outline.len() - 1]);
    for (&to, &height_to) in outline.iter().zip(heights) {
        if height_from * height_to < 0.0 {
            let t = height_from / (height_from - height_to);
            let crossing = Vertex::new(from.point.lerp(to.point, t));
            add_inside(crossing);
            add_outside(crossing);
        }
        if height_to >= 0.0 {
            add_inside(to);
        }
        if height_to <= 0.0 {
            add_outside(to);
        }
        (from, height_from) = (to, height_to);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slabs eat a square from the left, each a little further: one rectangle is left all the time.
    #[test]
    fn memory_stays_proportional_to_the_fragments() {
        let mut fragments = Fragments::default();
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        fragments.restart(&corners.map(|[x, y]| Vertex::new(DVec3::new(x, y, 1.0))));
        for i in 1..10_000 {
            let limit = f64::from(i) * 1e-4;
            let left_of_limit = Plane::through_receiver(DVec3::new(-1.0, 0.0, limit));
            assert_eq!(fragments.subtract(&[left_of_limit]), Cut::Reduced);
            let outline = fragments.outlines().next().expect("one is left");
            assert!(outline.iter().all(|vertex| vertex.point.x >= limit - 1e-12));
            assert_eq!((fragments.len(), outline.len()), (1, 4));
            assert!(fragments.vertices.len() < COMPACT_FROM + 4);
        }
    }
}
