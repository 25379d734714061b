//! Radiosity on a mesh that is refined where the light needs it.
//!
//! Implements W. Stürzlinger, *Adaptive Mesh Refinement with Discontinuities for the Radiosity Method* (1994),
//! called "the paper" throughout. The solver knows neither Python nor Blender: a [`scene::SceneInput`] goes in,
//! a [`weld::Bake`] comes out.
//!
//! Data flows one way; only `solve` loops:
//!
//! ```text
//! scene → visibility → lamps → mesh → transport → adapt → weld → verify → report
//! ```
//!
//! Units: metres, W/m² (radiosity `B`, irradiance `H`, exitance `E`), `B = E + rho·H` per colour channel; a diffuse
//! surface's outgoing radiance is `B/pi`.

mod adapt;
mod course;
mod display;
pub mod error;
#[cfg(feature = "fuzzing")]
#[doc(hidden)]
pub mod fuzzing;
mod index;
mod lamps;
mod mesh;
pub mod monitor;
mod plan;
pub mod report;
pub mod scene;
pub mod settings;
mod shadow;
pub mod solve;
mod threads;
mod transport;
mod verify;
pub mod visibility;
pub mod weld;

pub use error::Error;
