//! The radiosity equation by conjugate gradients (Hestenes, Stiefel 1952), which converge for every reflectance.
//!
//! With H what the emitters bring, K the exchange and R the reflectances, B = R (H + K B). Written with B = R^½ w this is
//! (I - R^½ K R^½) w = R^½ H: symmetric where areas are the weights, positive where some light gets lost, free of any
//! division by a reflectance, so that black surfaces are ordinary ones. The three channels are solved at once.

use glam::DVec3;

/// Residual, relative to the right side, at which it ends: below what f32 colours can show of any reflectance for which f64
/// can tell 1 - rho.
const RESIDUAL: f64 = 1e-11;

/// Iterations, at most. A residual falls by 20 or more per iteration in rooms; thirteen serve a reflectance of 0.999999.
const MOST_ITERATIONS: usize = 200;

/// A solution, and what it took.
pub(crate) struct Solution {
    /// Radiosity, W/m².
    pub(crate) radiosity: Vec<DVec3>,
    pub(crate) iterations: usize,
}

/// Solves for the radiosity of all surfaces.
///
/// `exchange`: K, self-adjoint with `areas` as weights. `arriving`: H, W/m². Entries whose area is 0 are ignored.
pub(crate) fn solve(
    exchange: impl Fn(&[DVec3]) -> Vec<DVec3>,
    areas: &[f64],
    reflectance: &[DVec3],
    arriving: &[DVec3],
) -> Solution {
    let n = areas.len();
    let roots: Vec<DVec3> = reflectance.iter().map(|rho| rho.powf(0.5)).collect();
    let scaled =
        |values: &[DVec3]| -> Vec<DVec3> { roots.iter().zip(values).map(|(r, v)| *r * *v).collect() };
    let product =
        |one: &[DVec3], other: &[DVec3]| -> DVec3 { (0..n).map(|i| areas[i] * one[i] * other[i]).sum() };
    let operate = |w: &[DVec3]| -> Vec<DVec3> {
        let arrived = exchange(&scaled(w));
        (0..n).map(|i| w[i] - roots[i] * arrived[i]).collect()
    };

    // Start with the ambient estimate: as if everything saw everything alike (Cohen, Chen, Wallace, Greenberg 1988)
    let right = scaled(arriving);
    let ambient = ambient(areas, reflectance, arriving);
    let mut w: Vec<DVec3> = roots.iter().zip(&right).map(|(root, h)| *h + *root * ambient).collect();
    let mut residual: Vec<DVec3> = operate(&w).iter().zip(&right).map(|(a, b)| *b - *a).collect();
    let mut direction = residual.clone();
    let mut squared = product(&residual, &residual);
    let enough = product(&right, &right) * (RESIDUAL * RESIDUAL);
    let mut iterations = 0;
    while iterations < MOST_ITERATIONS && squared.cmpgt(enough).any() {
        iterations += 1;
        let image = operate(&direction);
        let curvature = product(&direction, &image);
        // A channel that is done, or in which nothing is lost, stands still.
        let step = divided(squared, curvature, squared.cmpgt(enough));
        for i in 0..n {
            w[i] += step * direction[i];
            residual[i] -= step * image[i];
        }
        let before = squared;
        squared = product(&residual, &residual);
        let turn = divided(squared, before, before.cmpgt(enough));
        for i in 0..n {
            direction[i] = residual[i] + turn * direction[i];
        }
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
            let solution = solve(exchange, &areas, &reflectance, &arriving);
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
