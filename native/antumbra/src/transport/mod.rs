//! Light between surfaces.

pub(crate) mod balance;
pub(crate) mod form_factors;
pub(crate) mod gather;
mod overlay;
mod patches;
pub(crate) mod secondary;
pub(crate) mod shooting;
pub(crate) mod source_tree;
pub(crate) mod sources;
