//! Where the mesh is refined, and why.

pub(crate) mod adaptive_subdivision;
