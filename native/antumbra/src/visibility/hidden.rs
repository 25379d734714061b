//! The part of a source that blockers leave visible (§3.2 of the paper, computed where the paper samples).
//!
//! A convex blocker hides the part of the source that is beyond the blocker's plane and inside the pyramid from the
//! receiver through the blocker's edges: an intersection of half-spaces, which is subtracted from the source.

use smallvec::SmallVec;
use thiserror::Error;

use super::clip::{Cut, Fragments, Plane, Vertex, plane_distance};
use super::form_factor::SeenSource;
use super::polygon::{ConvexPolygon, Receiver};

/// Most visible fragments that one source may fall into before the computation gives up.
///
/// Memory and time are at most proportional to it, whatever the scene; 64 rays cost as much as about 100 fragments.
pub const MAX_FRAGMENTS: usize = 1024;

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
    /// Which of the two cases, or between them.
    pub state: Visibility,
}

/// A candidate that may hide something.
#[derive(Debug, Clone, Copy)]
struct Suspect {
    /// Square of its approximate solid angle.
    size: f64,
    id: u32,
    /// Distance of its plane from the receiver along its normal.
    distance: f64,
}

/// Buffers that are reused from call to call; one per thread.
#[derive(Debug, Default)]
pub struct Scratch {
    fragments: Fragments,
    suspects: Vec<Suspect>,
    planes: Vec<Plane>,
    blockers: Vec<u32>,
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
    let Scratch { fragments, suspects, planes, blockers } = scratch;
    blockers.clear();

    // Clip the source to the receiver's horizon
    let Some(seen) = SeenSource::look(receiver, source, fragments) else {
        return Ok(VisibleFormFactor { value: 0.0, unoccluded: 0.0, state: Visibility::BelowHorizon });
    };
    let unoccluded = seen.form_factor(fragments.outline(0)).clamp(0.0, 1.0);

    // Suspect only what reaches into the pyramid between receiver and source
    planes.clear();
    planes.push(seen.nearer());
    planes.push(Plane::through_receiver(receiver.normal));
    let outline = fragments.outline(0);
    for (from, to) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        planes.extend(Plane::through_edge(glam::DVec3::ZERO, from.point, to.point));
    }
    suspects.clear();
    suspects
        .extend(candidates.iter().filter_map(|&id| suspect(receiver, id, &polygons[id as usize], planes)));

    // Subtract them, the largest first
    suspects.sort_unstable_by(|a, b| b.size.total_cmp(&a.size).then(a.id.cmp(&b.id)));
    for &Suspect { id, distance, .. } in suspects.iter() {
        shadow_of(receiver, &polygons[id as usize], distance, planes);
        let cut = fragments.subtract(planes);
        if cut != Cut::Missed {
            blockers.push(id);
        }
        if cut == Cut::Gone {
            return Ok(VisibleFormFactor { value: 0.0, unoccluded, state: Visibility::Hidden });
        }
        if fragments.len() > MAX_FRAGMENTS {
            return Err(TooManyFragments { unoccluded });
        }
    }
    if blockers.is_empty() {
        return Ok(VisibleFormFactor { value: unoccluded, unoccluded, state: Visibility::Visible });
    }

    // Sum what is left
    let visible: f64 = fragments.outlines().map(|outline| seen.form_factor(outline)).sum();
    let value = visible.clamp(0.0, unoccluded);
    Ok(VisibleFormFactor { value, unoccluded, state: Visibility::Partial })
}

/// The candidate, unless it is wholly outside one of `planes` or holds the receiver in its plane.
fn suspect(receiver: &Receiver, id: u32, polygon: &ConvexPolygon, planes: &[Plane]) -> Option<Suspect> {
    let vertices: SmallVec<[Vertex; 4]> =
        polygon.vertices().iter().map(|&vertex| Vertex::new(vertex - receiver.position)).collect();
    if planes.iter().any(|plane| vertices.iter().all(|vertex| plane.side(vertex) <= 0.0)) {
        return None;
    }
    let world = polygon.extent().max(receiver.position.abs().max_element());
    let distance = plane_distance(polygon.normal(), vertices[0].point, world);
    if distance == 0.0 {
        return None;
    }
    let center_distance2 = polygon.centroid().distance_squared(receiver.position);
    let solid_angle_times_distance = polygon.area() * distance / center_distance2;
    let size = solid_angle_times_distance * solid_angle_times_distance / center_distance2;
    Some(Suspect { size, id, distance })
}

/// The half-spaces whose intersection the blocker hides from the receiver.
fn shadow_of(receiver: &Receiver, blocker: &ConvexPolygon, distance: f64, planes: &mut Vec<Plane>) {
    let world = blocker.extent().max(receiver.position.abs().max_element());
    planes.clear();
    planes.push(Plane::beyond(blocker.normal(), distance, world));
    let vertices = blocker.vertices();
    for (&from, &to) in vertices.iter().zip(vertices.iter().cycle().skip(1)) {
        // Seen from behind, the outline runs clockwise.
        let (from, to) = if distance > 0.0 { (from, to) } else { (to, from) };
        planes.extend(Plane::through_edge(receiver.position, from, to));
    }
}
