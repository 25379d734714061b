//! Where the mesh is refined, and why.

mod adaptive_subdivision;
mod bisection;
mod five_cases;
pub(crate) mod line_search;
pub(crate) mod refinement;
