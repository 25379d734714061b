//! Light between surfaces.

pub(crate) mod balance;
mod columns;
mod conjugate_residuals;
pub(crate) mod crevices;
mod enclosure;
mod endless;
mod exchange;
pub(crate) mod form_factors;
pub(crate) mod gather;
pub(crate) mod hemisphere;
pub(crate) mod hierarchical;
mod hierarchy;
mod links;
pub(crate) mod looking;
pub(crate) mod mode;
mod overlay;
mod patch_tree;
mod patches;
mod quadrature;
mod rows;
pub(crate) mod secondary;
pub(crate) mod shooting;
pub(crate) mod source_tree;
pub(crate) mod sources;
mod system;
