//! The end of shooting: what sources with kept columns still have to send, by all bounces at once.
//!
//! Shot by shot that takes about 1/(1 - reflectance) shots of every patch. When all that is worth a column has one, the
//! columns are the matrix of the radiosity equation, which conjugate residuals solve in some ten steps.

use glam::DVec3;
use rayon::prelude::*;

use crate::monitor::Monitor;
use crate::transport::columns::Column;
use crate::transport::conjugate_residuals::solve_keeping;

/// Residual, relative to what is unshot, at which the last bounces are known: below what f32 colours can show of any
/// reflectance for which f64 can tell 1 - rho.
const RESIDUAL: f64 = 1e-11;

/// Share of the brightest by which a source may be darker than nothing: rounding. More means that the columns are no
/// exchange of light: faces that lie in one place are seen one through the other, and gain with each bounce.
const BELOW_NOTHING: f64 = 1e-9;

/// Directions that the next one is made conjugate to: means over coarse patches keep reciprocity within some per cent only. With
/// four, a furnace that reflects 0.999999 was off by a hundredth after 200 iterations.
const KEPT: usize = 40;

/// Sides of patches that one thread takes at once.
const AT_ONCE: usize = 64;

/// What the sources with columns send in the end.
pub(super) struct LastBounces {
    /// Per source, W/m²; nothing for those without a column.
    pub(super) radiosity: Vec<DVec3>,
    /// What that brings to each, W/m².
    pub(super) arrived: Vec<DVec3>,
    pub(super) iterations: usize,
}

/// Solves for what is still to be sent; nothing where that is no light.
///
/// `unshot`: per source, none of it negative, W/m². `reflectance`: what a source sends of what it receives.
pub(super) fn last_bounces(
    columns: &[Option<Column>],
    areas: &[f64],
    reflectance: &[DVec3],
    unshot: &[DVec3],
    monitor: &Monitor,
) -> Option<LastBounces> {
    let known = |source: usize| columns[source].is_some();
    let only_known = |values: &[DVec3]| -> Vec<DVec3> {
        values.iter().enumerate().map(|(k, v)| if known(k) { *v } else { DVec3::ZERO }).collect()
    };
    let areas: Vec<f64> =
        areas.iter().enumerate().map(|(k, area)| if known(k) { *area } else { 0.0 }).collect();
    let reflectance = only_known(reflectance);
    // As if it were reflected of something that arrives
    let arriving: Vec<DVec3> = (unshot.iter().zip(&reflectance))
        .map(|(unshot, rho)| DVec3::select(rho.cmpgt(DVec3::ZERO), unshot / rho, DVec3::ZERO))
        .collect();
    let exchange = |radiosity: &[DVec3]| arrived(columns, radiosity);
    let solution = solve_keeping(KEPT, exchange, &areas, &reflectance, &arriving, RESIDUAL, monitor);
    let least = solution.radiosity.iter().map(|b| b.min_element()).fold(0.0, f64::min);
    let most = solution.radiosity.iter().map(|b| b.max_element()).fold(0.0, f64::max);
    if !most.is_finite() || least < -BELOW_NOTHING * most {
        return None;
    }
    let radiosity: Vec<DVec3> = solution.radiosity.iter().map(|b| b.max(DVec3::ZERO)).collect();
    Some(LastBounces { arrived: exchange(&radiosity), radiosity, iterations: solution.iterations })
}

/// What arrives at the sides of all patches, W/m².
fn arrived(columns: &[Option<Column>], radiosity: &[DVec3]) -> Vec<DVec3> {
    let mut arrived = vec![DVec3::ZERO; radiosity.len()];
    arrived.par_chunks_mut(AT_ONCE).enumerate().for_each(|(chunk, arrived)| {
        for (column, radiosity) in columns.iter().zip(radiosity) {
            let Some(column) = column else { continue };
            let means = &column.patches.as_flattened()[chunk * AT_ONCE..];
            arrived.iter_mut().zip(means).for_each(|(arrived, mean)| *arrived += *mean * *radiosity);
        }
    });
    arrived
}
