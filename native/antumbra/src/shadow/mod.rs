//! The exact shadow boundaries of a source and a blocker on a receiver's plane (§2.3 and §3.2 of the paper).
//!
//! Light changes its slope or its curvature only where what is visible of the source changes its form: on the planes
//! through a source vertex and a blocker edge (VE), through a source edge and a blocker vertex (EV), and on the plane
//! of a blocking polygon, which is seen edge-on there. The paper keeps these wedges of a shooter and a blocker in a
//! BSP tree of the two; here they are a list that is intersected with the receiver's plane. Data flows one way:
//!
//! ```text
//! silhouette → wedge → boundary → strength          sharp          contact
//! ```
//!
//! Points and directions have no penumbra: the light itself jumps where their shadows end ([`sharp`]).
//!
//! **Guaranteed.** Every discontinuity of the first or second derivative that one source and one convex solid or card
//! cause on a plane, within the reach asked for, lies on a traced line or a contact. Neither the winding of the
//! blockers nor the order of their polygons changes a line. Polygons that share an edge or a corner, given by the same
//! positions to the bit, give the same wedges under the same [`wedge::WedgeId`].
//!
//! **Not guaranteed.** What several blockers, or far parts of a concave one, cause together is not traced: planes
//! through an edge of one and a vertex of the other, and the curved surfaces of three edges. Lines may exist where
//! something else hides the source, so that nothing jumps there. A source sends to the side that its normal points
//! to; flip it for the other side. What touches a receiver along a whole edge throws no line there but has a contact.
//! The line where the source's own plane meets the receiver is not a shadow and not here.
//!
//! **Departs from the paper** in tracing polygon planes too: where the light grazes the side of a box, or a card, the
//! slope jumps on the plane of that side. Scans of the exact form factor found those lines missing without it.

pub(crate) mod boundary;
pub(crate) mod contact;
pub(crate) mod sharp;
pub(crate) mod silhouette;
pub(crate) mod strength;
#[cfg(test)]
mod tests;
pub(crate) mod wedge;
