//! Pockets: spaces that light finds its way into, but hardly out of.

use glam::DVec3;
use rayon::prelude::*;

use crate::transport::rows::Rows;
use crate::visibility::grey;

/// Reflections after which light is late: in a room of a reflectance of 0.8, a thousandth of it.
const EARLY: usize = 32;

/// A pocket gets less than this share of its light early, relative to the scene as a whole.
const LATE: f64 = 0.25;

/// Leaves of the light in pockets what arrives there early. A pocket gets nearly all its light after more than [`EARLY`]
/// reflections, much later than the scene as a whole.
///
/// Inside a white cushion that absorbs nothing, light from one gap goes round until it finds the gap again: what it comes
/// to is the ratio of two shares, of light that gets in and of light that is lost, and a few rays per patch tell neither.
/// Where no gap is, the ends of patches that cross the cushion make one.
///
/// Per side: `radiosity`, the solution, and `direct`, what emitters bring, W/m²; `areas`, m².
pub(super) fn darken_pockets(
    radiosity: &mut [DVec3],
    rows: &Rows,
    reflectance: &[DVec3],
    direct: &[DVec3],
    areas: &[f64],
) {
    let early = early(rows, reflectance, direct);
    let all: f64 = radiosity.iter().zip(areas).map(|(sent, area)| area * sent.element_sum()).sum();
    let usual = early.iter().zip(areas).map(|(&sent, area)| area * f64::from(sent)).sum::<f64>() / all;
    for (sent, early) in radiosity.iter_mut().zip(early) {
        let share = (f64::from(early) / sent.element_sum()).abs();
        if share < LATE * usual {
            *sent *= share;
        }
    }
}

/// What every side reflects within [`EARLY`] reflections, over the channels, W/m²: enough to tell a pocket by.
fn early(rows: &Rows, reflectance: &[DVec3], direct: &[DVec3]) -> Vec<f32> {
    let reflected_directly: Vec<f32> =
        reflectance.iter().zip(direct).map(|(&rho, &direct)| (rho * direct).element_sum() as f32).collect();
    // Of what arrives in three channels, as if it were grey
    let reflectance: Vec<f32> = reflectance.iter().map(|&rho| grey(rho) as f32).collect();
    (0..EARLY).fold(vec![0.0; reflectance.len()], |radiosity: Vec<f32>, _| {
        let again = |side: usize| {
            reflected_directly[side] + reflectance[side] * rows.reflected_grey(side, &radiosity)
        };
        (0..reflectance.len()).into_par_iter().map(again).collect()
    })
}
