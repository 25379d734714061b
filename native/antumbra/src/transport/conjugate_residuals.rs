//! The radiosity equation by conjugate residuals, which converge for every reflectance.
//!
//! With H what the emitters bring, K the exchange and R the reflectances, B = R (H + K B). Written with B = R^½ w this is
//! (I - R^½ K R^½) w = R^½ H: symmetric where areas are the weights and K keeps reciprocity, positive where some light gets
//! lost, free of any division by a reflectance, so that black surfaces are ordinary ones. Each step makes the residual as
//! small as the last few directions allow: for a symmetric K that is the method of conjugate residuals (Stiefel 1955), and
//! where rays make it only nearly symmetric it still cannot diverge (Eisenstat, Elman, Schultz 1983, Orthomin). The three
//! channels are solved at once.

use glam::DVec3;
use rayon::prelude::*;

use crate::monitor::Monitor;

/// Iterations, at most. A residual falls by 20 or more per iteration in rooms; thirteen serve a reflectance of 0.999999.
const MOST_ITERATIONS: usize = 200;

/// Directions that the next one is made conjugate to: one for a symmetric K, and some for what rays miss of that.
const KEPT: usize = 4;

/// A solution, and what it took.
pub(crate) struct Solution {
    /// Radiosity, W/m².
    pub(crate) radiosity: Vec<DVec3>,
    pub(crate) iterations: usize,
}

/// A direction of search, its image under the operator, and that image's square.
struct Direction {
    step: Vec<DVec3>,
    image: Vec<DVec3>,
    squared: DVec3,
}

/// Solves for the radiosity of all surfaces, by a K that is symmetric or nearly so.
///
/// `exchange`: K. `areas`: weights, m²; entries whose area is 0 are ignored. `arriving`: H, W/m². `enough`: the residual,
/// relative to the right side, at which it ends; it ends as it is where it is cancelled.
pub(crate) fn solve(
    exchange: impl Fn(&[DVec3]) -> Vec<DVec3>,
    areas: &[f64],
    reflectance: &[DVec3],
    arriving: &[DVec3],
    enough: f64,
    monitor: &Monitor,
) -> Solution {
    solve_keeping(KEPT, exchange, areas, reflectance, arriving, enough, monitor)
}

/// The same by any K: the more directions are kept, the less symmetric it may be.
pub(crate) fn solve_keeping(
    most_kept: usize,
    exchange: impl Fn(&[DVec3]) -> Vec<DVec3>,
    areas: &[f64],
    reflectance: &[DVec3],
    arriving: &[DVec3],
    enough: f64,
    monitor: &Monitor,
) -> Solution {
    let roots: Vec<DVec3> = reflectance.par_iter().map(|rho| rho.powf(0.5)).collect();
    let scaled = |values: &[DVec3]| -> Vec<DVec3> {
        roots.par_iter().zip(values).map(|(root, value)| *root * *value).collect()
    };
    // In order, so that sums are the same on any number of threads
    let product = |one: &[DVec3], other: &[DVec3]| -> DVec3 {
        areas.iter().zip(one.iter().zip(other)).map(|(area, (a, b))| *area * *a * *b).sum()
    };
    let operate = |w: &[DVec3]| -> Vec<DVec3> {
        let mut image = exchange(&scaled(w));
        image.par_iter_mut().zip(w.par_iter().zip(&roots)).for_each(|(k, (w, root))| *k = *w - *root * *k);
        image
    };
    let add = |to: &mut Vec<DVec3>, factor: DVec3, of: &[DVec3]| {
        to.par_iter_mut().zip(of).for_each(|(value, other)| *value += factor * *other);
    };

    // Start with the ambient estimate: as if everything saw everything alike (Cohen, Chen, Wallace, Greenberg 1988)
    let right = scaled(arriving);
    let mut w = right.clone();
    add(&mut w, ambient(areas, reflectance, arriving), &roots);
    let mut residual = operate(&w);
    residual.par_iter_mut().zip(&right).for_each(|(image, right)| *image = *right - *image);
    let enough = product(&right, &right) * (enough * enough);
    let mut kept: Vec<Direction> = Vec::with_capacity(most_kept);
    let mut iterations = 0;
    loop {
        // A channel that is done stands still.
        let open = product(&residual, &residual).cmpgt(enough);
        if iterations == MOST_ITERATIONS || !open.any() || monitor.is_cancelled() {
            break;
        }
        iterations += 1;
        let mut step = residual.clone();
        let mut image = operate(&step);
        for known in &kept {
            let turn = divided(product(&image, &known.image), known.squared, open);
            add(&mut step, -turn, &known.step);
            add(&mut image, -turn, &known.image);
        }
        let squared = product(&image, &image);
        let length = divided(product(&residual, &image), squared, open);
        add(&mut w, length, &step);
        add(&mut residual, -length, &image);
        if kept.len() == most_kept {
            kept.remove(0);
        }
        kept.push(Direction { step, image, squared });
    }
    Solution { radiosity: scaled(&w), iterations }
}

/// Channel by channel; 0 where it is not wanted or the divisor is not positive.
fn divided(value: DVec3, by: DVec3, wanted: glam::BVec3) -> DVec3 {
    DVec3::select(wanted & by.cmpgt(DVec3::ZERO), value / by, DVec3::ZERO)
}

/// The mean irradiance that reflections add in the end, if all surfaces were one enclosure.
fn ambient(areas: &[f64], reflectance: &[DVec3], arriving: &[DVec3]) -> DVec3 {
    let (mut reflected, mut lost) = (DVec3::ZERO, DVec3::ZERO);
    for ((&area, rho), h) in areas.iter().zip(reflectance).zip(arriving) {
        reflected += area * *rho * *h;
        lost += area * (DVec3::ONE - *rho);
    }
    divided(reflected, lost, glam::BVec3::TRUE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An integrating sphere: every part sees every other by its share of the area, so that
    /// B = rho (H + mean(rho H)/(1 - mean(rho))).
    #[test]
    fn a_sphere_of_mixed_reflectances_has_its_closed_form() {
        let areas: Vec<f64> = (1..=40).map(f64::from).collect();
        let total: f64 = areas.iter().sum();
        for top in [0.0, 0.5, 0.99, 0.999_999] {
            let reflectance: Vec<DVec3> =
                (0..40).map(|i| DVec3::new(top, top * f64::from(i % 5) / 4.0, top * 0.5)).collect();
            let arriving: Vec<DVec3> = (0..40).map(|i| DVec3::splat(f64::from(i % 7))).collect();
            let mean = |values: &dyn Fn(usize) -> DVec3| -> DVec3 {
                (0..40).map(|i| areas[i] * values(i)).sum::<DVec3>() / total
            };
            let exchange = |b: &[DVec3]| vec![mean(&|i| b[i]); 40];
            let solution = solve(exchange, &areas, &reflectance, &arriving, 1e-11, &Monitor::new());
            let reflected = mean(&|i| reflectance[i] * arriving[i]);
            let ambient = reflected / (DVec3::ONE - mean(&|i| reflectance[i]));
            for i in 0..40 {
                let wanted = reflectance[i] * (arriving[i] + ambient);
                let error = (solution.radiosity[i] - wanted).abs().max_element();
                assert!(error <= 1e-9 * ambient.max_element().max(1.0), "rho {top}, part {i}: {error:e}");
            }
            assert!(solution.iterations <= 5, "{} iterations", solution.iterations);
        }
    }
}
