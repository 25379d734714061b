//! The part of a source that blockers leave visible (§3.2 of the paper, computed where the paper samples).
//!
//! A convex blocker hides the part of the source that is beyond the blocker's plane and inside the pyramid from the
//! receiver through the blocker's edges: an intersection of half-spaces, which is subtracted from the source.

use glam::DVec3;
use thiserror::Error;

use super::clip::{Cut, Fragments, Outline, Plane, Vertex, plane_distance};
use super::filters::Filtered;
use super::form_factor::{SeenSource, Weight};
use super::polygon::{ConvexPolygon, Receiver};

/// Most visible fragments that one source may fall into before the computation gives up.
///
/// Memory is at most proportional to it, time to it and to the number of candidates. Measured: 64 small triangles
/// leave 50 fragments (26 µs), 500 leave about 370 (0.2 to 0.7 ms). Above this limit a call costs as much as several
/// hundred rays, which are then precise enough; a much lower one would give up exact penumbrae behind ordinary meshes.
pub const MAX_FRAGMENTS: usize = 256;

/// The source fell into more than [`MAX_FRAGMENTS`] visible fragments: sample it instead.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("the visible part of a source fell into more than {MAX_FRAGMENTS} fragments")]
pub struct TooManyFragments {
    /// The form factor without blockers.
    pub unoccluded: f64,
}

/// How much of a source a receiver sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visibility {
    /// Nothing, blockers or not: the source is below the receiver's horizon, or the receiver in its plane.
    BelowHorizon,
    /// All that is above the horizon: no blocker hides any of it.
    Visible,
    /// Some of it.
    Partial,
    /// Nothing: blockers hide it.
    Hidden,
}

/// What a receiver gets of a source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisibleFormFactor {
    /// Share of the cosine-weighted hemisphere that the visible part fills, 0 to `unoccluded`.
    pub value: f64,
    /// The same without blockers.
    pub unoccluded: f64,
    /// How much of it that is, in a word.
    pub state: Visibility,
}

/// The same where some of what stands in between lets a part of the light through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SeenThrough {
    /// Of the part that nothing opaque hides.
    pub(crate) value: f64,
    /// Share of that part's light that gets through, per channel.
    pub(crate) filter: DVec3,
    pub(crate) unoccluded: f64,
    /// Hidden only where it is by what is opaque; partial also where a filter covers all of it.
    pub(crate) state: Visibility,
}

impl SeenThrough {
    /// Where no filter stands in between.
    fn plain(value: f64, unoccluded: f64, state: Visibility) -> Self {
        Self { value, filter: DVec3::ONE, unoccluded, state }
    }

    /// The share of the hemisphere that would bring as much, over the channels.
    pub(crate) fn grey(&self) -> f64 {
        self.value * grey(self.filter)
    }
}

/// Everything that may block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Blocking<'a> {
    pub(crate) polygons: &'a [ConvexPolygon],
    /// Share of light that each lets through, per channel; empty where all are opaque.
    pub(crate) transmittances: &'a [DVec3],
}

impl Blocking<'_> {
    /// What a polygon lets through.
    pub(crate) fn transmittance(&self, id: u32) -> DVec3 {
        self.transmittances.get(id as usize).copied().unwrap_or(DVec3::ZERO)
    }

    pub(crate) fn is_opaque(&self, id: u32) -> bool {
        self.transmittance(id) == DVec3::ZERO
    }

    /// Whether no polygon lets any light through.
    pub(crate) fn all_opaque(&self) -> bool {
        self.transmittances.is_empty()
    }
}

/// The mean of a colour's channels; of the same in all, that to the last bit.
pub(crate) fn grey(colour: DVec3) -> f64 {
    if colour.x == colour.y && colour.y == colour.z { colour.x } else { colour.element_sum() / 3.0 }
}

/// A candidate that may hide something.
#[derive(Debug, Clone, Copy)]
struct Suspect {
    /// Square of its approximate solid angle.
    size: f64,
    id: u32,
    /// Whether the receiver sees its front.
    front: bool,
    /// The half-space beyond its own plane, if that cuts the source.
    beyond: Option<Plane>,
}

impl Suspect {
    /// The candidate, unless it is wholly outside one of the planes of the `pyramid`, holds the receiver in its plane
    /// or has nothing of the source beyond it.
    fn new(
        id: u32,
        polygon: &ConvexPolygon,
        receiver: &Receiver,
        pyramid: &[Plane],
        source: &[Vertex],
        corners: &mut Outline,
    ) -> Option<Self> {
        corners.clear();
        for &vertex in polygon.vertices() {
            corners.push(Vertex::new(vertex - receiver.position));
        }
        if pyramid.iter().any(|plane| !corners.iter().any(|corner| plane.side(corner) > 0.0)) {
            return None;
        }
        let world = polygon.extent().max(receiver.position.abs().max_element());
        let distance = plane_distance(polygon, receiver.position, world);
        if distance == 0.0 {
            return None;
        }
        let beyond = Plane::beyond(polygon, distance, world);
        let (any_beyond, any_nearer) = beyond.sides(source);
        if !any_beyond {
            return None;
        }
        let center_distance2 = polygon.centroid().distance_squared(receiver.position);
        let solid_angle_times_distance = polygon.area() * distance / center_distance2;
        let size = solid_angle_times_distance * solid_angle_times_distance / center_distance2;
        Some(Self { size, id, front: distance < 0.0, beyond: any_nearer.then_some(beyond) })
    }

    /// The half-spaces whose intersection with the source it hides.
    fn shadow(&self, receiver: &Receiver, polygon: &ConvexPolygon, planes: &mut Vec<Plane>) {
        planes.clear();
        let vertices = polygon.vertices();
        let mut from = vertices[vertices.len() - 1];
        for &to in vertices {
            // Seen from the front, the outline runs clockwise about the direction of sight.
            let (left, right) = if self.front { (to, from) } else { (from, to) };
            planes.extend(Plane::through_edge(receiver.position, left, right));
            from = to;
        }
        planes.extend(self.beyond);
    }
}

/// Buffers that are reused from call to call; one per thread.
#[derive(Debug, Default)]
pub struct Scratch {
    outline: Outline,
    corners: Outline,
    fragments: Fragments,
    suspects: Vec<Suspect>,
    planes: Vec<Plane>,
    blockers: Vec<u32>,
    filtered: Filtered,
}

impl Scratch {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Indices of the polygons that hid something in the last call: the paper's light blockers (§3.2). What a larger
    /// one had hidden before is not counted again, and after the source is gone none follow.
    pub fn blockers(&self) -> &[u32] {
        &self.blockers
    }
}

/// Whether a polygon hides a point from a receiver position, by the planes that decide what it hides of a source.
///
/// `target`: relative to the receiver, metres. A polygon that the receiver lies on hides nothing, nor does one that the
/// target lies on; on its border it hides, so that nothing leaks between two that share an edge.
pub(crate) fn hides(polygon: &ConvexPolygon, receiver: DVec3, target: DVec3) -> bool {
    stands_before(polygon, receiver, target, |_, _| true)
}

/// The same for a filter: of those that share an edge on the line of sight exactly one counts, since each would take its
/// share of the light.
pub(crate) fn covers(polygon: &ConvexPolygon, receiver: DVec3, target: DVec3) -> bool {
    // In a plane, the order of an edge's ends is the sign of its product with one direction, as if the point lay off all
    // edges to one side.
    stands_before(polygon, receiver, target, |left, right| {
        (left.x, left.y, left.z) < (right.x, right.y, right.z)
    })
}

/// Whether a polygon lies across a line of sight; `owns`: whether an edge that is on it, given by its left and right end
/// as the receiver sees it, is a part of the polygon.
fn stands_before(
    polygon: &ConvexPolygon,
    receiver: DVec3,
    target: DVec3,
    owns: impl Fn(DVec3, DVec3) -> bool,
) -> bool {
    let target = Vertex::new(target);
    let vertices = polygon.vertices();
    let world = polygon.extent().max(receiver.abs().max_element());
    let distance = plane_distance(polygon, receiver, world);
    if distance == 0.0 || Plane::beyond(polygon, distance, world).side(&target) <= 0.0 {
        return false;
    }
    let mut from = vertices[vertices.len() - 1];
    vertices.iter().all(|&to| {
        // Seen from the front, the outline runs clockwise about the direction of sight.
        let (left, right) = if distance < 0.0 { (to, from) } else { (from, to) };
        from = to;
        Plane::through_edge(receiver, left, right).is_none_or(|plane| {
            let side = plane.side(&target);
            side > 0.0 || (side == 0.0 && owns(left, right))
        })
    })
}

/// Share of the receiver's cosine-weighted hemisphere that the visible part of `source` fills.
///
/// `candidates` are the indices into `polygons` of everything that may block, which they do from both sides; the
/// source itself and polygons that the receiver lies on may be among them and have no effect. Their order has none
/// either.
///
/// # Errors
/// [`TooManyFragments`] when the visible part is too complex to be worth it.
///
/// # Panics
/// When a candidate is not an index into `polygons`.
pub fn visible_form_factor(
    receiver: &Receiver,
    source: &ConvexPolygon,
    polygons: &[ConvexPolygon],
    candidates: &[u32],
    scratch: &mut Scratch,
) -> Result<VisibleFormFactor, TooManyFragments> {
    let blocking = Blocking { polygons, transmittances: &[] };
    let SeenThrough { value, unoccluded, state, .. } =
        visible_weighted(receiver, source, None, blocking, candidates, scratch)?;
    Ok(VisibleFormFactor { value, unoccluded, state })
}

/// The same past what lets a part of the light through, and with every direction times its weight: what a source sends
/// that is not alike in all directions.
///
/// # Errors
/// [`TooManyFragments`] as above.
pub(crate) fn visible_weighted(
    receiver: &Receiver,
    source: &ConvexPolygon,
    weight: Option<Weight>,
    blocking: Blocking,
    candidates: &[u32],
    scratch: &mut Scratch,
) -> Result<SeenThrough, TooManyFragments> {
    let Scratch { outline, corners, fragments, suspects, planes, blockers, filtered } = scratch;
    let polygons = blocking.polygons;
    blockers.clear();

    // Clip the source to the receiver's horizon
    let Some(seen) = SeenSource::look(receiver, source, outline) else {
        return Ok(SeenThrough::plain(0.0, 0.0, Visibility::BelowHorizon));
    };
    let whole = seen.form_factor(outline);
    let form_factor = |outline: &[Vertex]| match weight {
        None => seen.form_factor(outline),
        Some(weight) => seen.weighted_form_factor(outline, weight, whole),
    };
    // A weight may be above 1.
    let unoccluded = match weight {
        None => whole.clamp(0.0, 1.0),
        Some(_) => form_factor(outline).max(0.0),
    };
    if candidates.is_empty() {
        return Ok(SeenThrough::plain(unoccluded, unoccluded, Visibility::Visible));
    }

    // Suspect only what reaches into the pyramid between receiver and source
    planes.clear();
    planes.push(seen.nearer());
    planes.push(Plane::through_receiver(receiver.normal));
    for (from, to) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        planes.extend(Plane::through_edge(DVec3::ZERO, from.point, to.point));
    }
    let suspect = |&id: &u32| Suspect::new(id, &polygons[id as usize], receiver, planes, outline, corners);
    suspects.clear();
    suspects.extend(candidates.iter().filter_map(suspect));

    // Subtract them, the largest first
    fragments.restart(outline);
    suspects.sort_unstable_by(|a, b| b.size.total_cmp(&a.size).then(a.id.cmp(&b.id)));
    for suspect in suspects.iter().filter(|suspect| blocking.is_opaque(suspect.id)) {
        suspect.shadow(receiver, &polygons[suspect.id as usize], planes);
        let cut = fragments.subtract(planes);
        if cut != Cut::Missed {
            blockers.push(suspect.id);
        }
        if cut == Cut::Gone {
            return Ok(SeenThrough::plain(0.0, unoccluded, Visibility::Hidden));
        }
        if fragments.len() > MAX_FRAGMENTS {
            return Err(TooManyFragments { unoccluded });
        }
    }

    // Tell apart what filters cover
    filtered.restart();
    let opaque = blockers.len();
    for suspect in suspects.iter().filter(|suspect| !blocking.is_opaque(suspect.id)) {
        suspect.shadow(receiver, &polygons[suspect.id as usize], planes);
        if filtered.cover(fragments, planes, blocking.transmittance(suspect.id)) {
            blockers.push(suspect.id);
        }
        if fragments.len() + filtered.len() > MAX_FRAGMENTS {
            return Err(TooManyFragments { unoccluded });
        }
    }
    if blockers.is_empty() {
        return Ok(SeenThrough::plain(unoccluded, unoccluded, Visibility::Visible));
    }

    // Sum what is left
    let clear: f64 = fragments.outlines().map(form_factor).sum();
    if blockers.len() == opaque {
        return Ok(SeenThrough::plain(clear.clamp(0.0, unoccluded), unoccluded, Visibility::Partial));
    }
    let (mut visible, mut through) = (clear, clear * DVec3::ONE);
    for (transmittance, covered) in filtered.layers() {
        let covered: f64 = covered.outlines().map(form_factor).sum();
        visible += covered;
        through += covered * transmittance;
    }
    let filter = if visible > 0.0 { (through / visible).clamp(DVec3::ZERO, DVec3::ONE) } else { DVec3::ONE };
    let value = visible.clamp(0.0, unoccluded);
    Ok(SeenThrough { value, filter, unoccluded, state: Visibility::Partial })
}
