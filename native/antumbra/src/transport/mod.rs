//! Light between surfaces: progressive refinement (Cohen, Chen, Wallace, Greenberg 1988; the paper, §1 and §2.1).

pub(crate) mod balance;
pub(crate) mod column;
pub(crate) mod form_factors;
mod patches;
mod sample_light;
pub(crate) mod shooting;
pub(crate) mod sources;
