//! Where the mesh is refined, and why.

mod adaptive_subdivision;
mod bisection;
pub(crate) mod contact_lines;
mod contact_outlines;
pub(crate) mod fit;
mod five_cases;
mod lamp_lines;
pub(crate) mod layer;
pub(crate) mod line_choice;
pub(crate) mod line_search;
pub(crate) mod line_sources;
mod line_strength;
pub(crate) mod patch_light;
mod plate;
pub(crate) mod refinable;
pub(crate) mod refinement;
pub(crate) mod scene_lines;
pub(crate) mod suspects;
