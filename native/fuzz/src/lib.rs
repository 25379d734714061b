//! What the fuzz targets are made of: polygons, lines and scenes from bytes, and what must hold of them.
//!
//! One target each for the visible form factor, its closure, the lines on a face, the check of what comes in, and whole
//! bakes of tiny scenes. `cargo xtask fuzz` runs them. What they find becomes a test in `native/antumbra/tests`.

mod arrangement;
mod bytes;
mod form_factor;
mod scene_input;
mod solver;

pub use arrangement::arrangement;
pub use form_factor::{closure, form_factor};
pub use scene_input::scene_input;
pub use solver::solver;
