//! The linear elements that are nearest to the light, not those that touch it at the vertices.
//!
//! Light that bends one way over a region is missed by interpolation to one side everywhere, by twice of what a line
//! through its midst misses. What refinement computed in the middles of edges and at centroids tells how the light bends,
//! so the best linear elements (in least squares) cost no more evaluations. Samples at contacts, creases and borders keep
//! their limits, and darkness stays darkness.

use glam::DVec3;

use crate::adapt::layer::Layer;
use crate::adapt::refinable::Refinable;
use crate::index::SampleId;

/// Share of the correction that may be left: what is corrected is itself no more than the error.
const RESIDUAL: f64 = 1e-2;

/// Iterations, at most. The diagonally scaled mass matrix of linear elements has its eigenvalues between 1/2 and 2
/// (Wathen 1987): each divides the residual by three.
const MOST_ITERATIONS: usize = 20;

/// An element's part of the normal equations.
struct Part {
    samples: [usize; 3],
    /// m².
    area: f64,
}

/// The irradiance of all samples that makes the linear elements fit the light best, W/m².
pub(crate) fn fitted(mesh: &impl Refinable, layer: &Layer) -> Vec<DVec3> {
    let samples = mesh.samples();
    let n = layer.irradiance.len();
    let mut right = vec![DVec3::ZERO; n];
    let mut diagonal = vec![0.0; n];
    let mut parts = Vec::new();
    for element in mesh.leaves() {
        let Some(leaf) = mesh.leaf(element) else { continue };
        let at = leaf.samples.map(SampleId::index);
        let deviations: [DVec3; 3] = std::array::from_fn(|k| {
            if mesh.is_anchored(element, k) { DVec3::ZERO } else { layer.noisy_deviation(leaf.edges()[k]) }
        });
        let bulge = layer.noisy_bulge_of(element);
        let sum: DVec3 = deviations.iter().sum();
        for k in 0..3 {
            // Of 4 d l_i l_j, the integral against l_i is 4 d A/30, against the third one 4 d A/60; 27 b l_1 l_2 l_3
            // has 27 b A/180.
            let opposite = deviations[(k + 1) % 3];
            right[at[k]] += leaf.area * ((2.0 * sum - opposite) / 15.0 + 0.15 * bulge);
            diagonal[at[k]] += leaf.area / 6.0;
        }
        parts.push(Part { samples: at, area: leaf.area });
    }
    let free: Vec<bool> = (0..n)
        .map(|i| diagonal[i] > 0.0 && !samples[i].is_one_sided() && layer.irradiance[i] != DVec3::ZERO)
        .collect();
    let correction = solve(&parts, &diagonal, &free, right);
    (layer.irradiance.iter().zip(correction))
        .map(|(light, correction)| {
            // Neither below darkness nor out of it
            *light + correction.clamp(-light.abs(), light.abs())
        })
        .collect()
}

/// Conjugate gradients on the mass matrix, scaled by its diagonal, for the free samples.
fn solve(parts: &[Part], diagonal: &[f64], free: &[bool], right: Vec<DVec3>) -> Vec<DVec3> {
    let n = right.len();
    let mut found = vec![DVec3::ZERO; n];
    let mut residual = right;
    (0..n).filter(|&i| !free[i]).for_each(|i| residual[i] = DVec3::ZERO);
    let scaled = |residual: &[DVec3]| -> Vec<DVec3> {
        (0..n).map(|i| if free[i] { residual[i] / diagonal[i] } else { DVec3::ZERO }).collect()
    };
    let product = |a: &[DVec3], b: &[DVec3]| -> DVec3 { a.iter().zip(b).map(|(a, b)| *a * *b).sum() };
    let mut preconditioned = scaled(&residual);
    let mut direction = preconditioned.clone();
    let mut squared = product(&residual, &preconditioned);
    let enough = squared * (RESIDUAL * RESIDUAL);
    for _ in 0..MOST_ITERATIONS {
        if !squared.cmpgt(enough).any() {
            break;
        }
        let mut image = vec![DVec3::ZERO; n];
        for Part { samples, area } in parts {
            let sum: DVec3 = samples.iter().map(|&i| direction[i]).sum();
            for &i in samples {
                image[i] += area / 12.0 * (direction[i] + sum);
            }
        }
        (0..n).filter(|&i| !free[i]).for_each(|i| image[i] = DVec3::ZERO);
        let wanted = squared.cmpgt(enough);
        let ratio = |a: DVec3, b: DVec3| DVec3::select(wanted & b.cmpgt(DVec3::ZERO), a / b, DVec3::ZERO);
        let step = ratio(squared, product(&direction, &image));
        for i in 0..n {
            found[i] += step * direction[i];
            residual[i] -= step * image[i];
        }
        preconditioned = scaled(&residual);
        let before = squared;
        squared = product(&residual, &preconditioned);
        let turn = ratio(squared, before);
        for i in 0..n {
            direction[i] = preconditioned[i] + turn * direction[i];
        }
    }
    found
}
