//! Light at a point: how much of a receiver's hemisphere a polygon fills, and how much of that is not blocked.
//!
//! The paper (§3.2) samples visibility with rays; here it is computed. Everything is relative to the receiver
//! point, in `f64`, and nothing is ever projected, so that blockers across the horizon, behind the source or
//! through it are ordinary cases. Data flows one way:
//!
//! ```text
//! polygon → clip → form_factor → (filters) → hidden
//! ```
//!
//! **Guaranteed.** In any enclosure the visible form factors of all polygons from any point sum to 1 within 1e-12, times how
//! much farther than the nearest polygon that the point does not lie on the farthest is.
//! Blockers that share an edge, given by the same two vertices, leak nothing between them. Scaling the scene
//! changes nothing; so does the order of the candidates. Nothing is allocated once a [`Scratch`] has grown.
//!
//! **Not guaranteed.** Polygons must be convex and planar: the caller triangulates what is not. Coplanar polygons
//! that overlap neither light nor hide one another, so that the overlap counts twice. A point in the very plane of
//! a polygon sees nothing of it; a corner where two surfaces meet is evaluated as the limit from inside its own
//! element, by the caller.

pub(crate) mod blockers;
mod clip;
mod filters;
mod form_factor;
mod hidden;
pub(crate) mod packet;
mod polygon;
pub(crate) mod rays;
pub(crate) mod screens;
pub(crate) mod shaft;
pub(crate) mod trace;

pub use form_factor::unoccluded_form_factor;
pub(crate) use form_factor::{RADON_RULE, Weight, unoccluded_weighted};
pub(crate) use hidden::{Blocking, covers, grey, hides, visible_weighted};
pub use hidden::{
    MAX_FRAGMENTS, Scratch, TooManyFragments, Visibility, VisibleFormFactor, visible_form_factor,
};
pub(crate) use polygon::ANY_OBJECT;
pub use polygon::{ConvexPolygon, Receiver};
