//! From two estimates at each point to an error with its interval.

use glam::DVec3;

use crate::transport::gather::rms;

/// Half of a normal distribution's 95 % interval, in standard deviations.
const NORMAL_95: f64 = 1.96;

/// Skewness of a mean below which it makes no difference, and dividing by it would lose digits.
const ALMOST_SYMMETRIC: f64 = 1e-6;

/// One point: what is shown there, and two independent estimates of what should be, W/m².
pub(super) struct Observed {
    pub(super) shown: DVec3,
    pub(super) estimates: [DVec3; 2],
}

impl Observed {
    /// What should be shown, as far as it is known, W/m².
    pub(super) fn truth(&self) -> DVec3 {
        0.5 * (self.estimates[0] + self.estimates[1])
    }
}

/// What is shown against what should be, relative to the mean of the latter over points and channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Compared {
    /// What should be shown, over points and channels, W/m².
    pub(super) mean: f64,
    /// Rms error, and its 95 % interval.
    pub(super) error: [f64; 3],
    /// Mean difference, and its 95 % interval.
    pub(super) bias: [f64; 3],
    /// 99 of 100 points differ less from the mean of their estimates, whose noise is in it.
    pub(super) p99: f64,
    /// Rms noise of the mean of a point's estimates.
    pub(super) noise: f64,
}

impl Compared {
    /// `None` where there is no light, or more is taken away than sent.
    pub(super) fn new(points: &[Observed]) -> Option<Self> {
        let count = points.len() as f64;
        let mean = points.iter().map(|point| point.truth().element_sum() / 3.0).sum::<f64>() / count;
        if mean.is_nan() || mean <= 0.0 {
            return None;
        }

        // (I - A)(I - B) has the squared error as its mean.
        let product = |point: &Observed| {
            let [a, b] = point.estimates.map(|estimate| point.shown - estimate);
            a.dot(b) / 3.0
        };
        let root = |square: f64| square.max(0.0).sqrt() / mean;
        let products: Vec<f64> = points.iter().map(product).collect();
        let [square, low, high] = interval(&products, 0.0);
        // A negative mean of what cannot be is chance, which must not end the interval below what else it allows.
        let error = [square, low, high + (-square).max(0.0)].map(root);

        let differences: Vec<f64> =
            points.iter().map(|p| (p.shown - p.truth()).element_sum() / 3.0).collect();
        let bias = interval(&differences, f64::NEG_INFINITY).map(|bias| bias / mean);
        let mut distances: Vec<f64> = points.iter().map(|p| rms(p.shown - p.truth()) / mean).collect();
        distances.sort_unstable_by(f64::total_cmp);
        let p99 = distances[((0.99 * count) as usize).min(points.len() - 1)];
        let noise = |p: &Observed| (0.5 * (p.estimates[0] - p.estimates[1])).length_squared() / 3.0;
        let noise = (points.iter().map(noise).sum::<f64>() / count).sqrt() / mean;
        Some(Self { mean, error, bias, p99, noise })
    }
}

/// The mean with its 95 % interval.
///
/// Errors sit in few places, so that their squares are far from normal: the interval is Hall's (1992), whose transformation
/// takes their skewness out of Student's t.
///
/// `least_skewness`: below which it is known not to be. Of the products of an error and two noises that is 0: a sample that
/// is skewed the other way got its outliers by chance, and would end its interval where hardly any error fits in.
fn interval(values: &[f64], least_skewness: f64) -> [f64; 3] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let moment = |power: i32| values.iter().map(|value| (value - mean).powi(power)).sum::<f64>() / count;
    let variance = moment(2);
    if variance <= 0.0 {
        return [mean; 3];
    }
    let deviation = (variance / (count - 1.0).max(1.0)).sqrt();
    let skew = (moment(3) / variance.powf(1.5)).max(least_skewness) / count.sqrt();
    let student = |normal: f64| {
        if skew.abs() < ALMOST_SYMMETRIC {
            return normal;
        }
        3.0 / skew * ((1.0 + skew * (normal - skew / 6.0)).cbrt() - 1.0)
    };
    [mean, mean - deviation * student(NORMAL_95), mean - deviation * student(-NORMAL_95)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::rays::{splitmix, unit};

    /// Estimates that are noisy, of two, which is shown with an error.
    fn noisy(error: f64, noise: f64, count: u64) -> Vec<Observed> {
        let random = |seed: u64| 3.0_f64.sqrt() * (2.0 * unit(splitmix(seed)) - 1.0);
        (0..count)
            .map(|k| Observed {
                shown: DVec3::splat(2.0 + error * random(3 * k)),
                estimates: [1, 2].map(|which| DVec3::splat(2.0 + noise * random(3 * k + which))),
            })
            .collect()
    }

    #[test]
    fn the_noise_of_the_estimates_is_not_taken_for_an_error() {
        let found = Compared::new(&noisy(0.02, 0.1, 1_000_000)).expect("there is light");
        let [error, low, high] = found.error;
        assert!((error / 0.01 - 1.0).abs() < 0.05, "{found:?}");
        assert!(low < error && error < high && high < 1.1 * low, "{found:?}");
        assert!((found.noise / (0.05 / 2.0_f64.sqrt()) - 1.0).abs() < 0.01, "{found:?}");
        assert!(found.bias[1] < 0.0 && found.bias[2] > 0.0 && found.bias[0].abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn what_is_too_bright_everywhere_is_biased_by_that() {
        let mut points = noisy(0.0, 0.01, 1_000);
        for point in &mut points {
            point.shown *= 1.1;
        }
        let found = Compared::new(&points).expect("there is light");
        assert!((found.bias[0] - 0.1).abs() < 0.001 && (found.error[0] - 0.1).abs() < 0.001, "{found:?}");
        assert!(found.p99 < 0.11, "{found:?}");
    }

    #[test]
    fn nothing_is_relative_to_darkness() {
        assert_eq!(Compared::new(&[Observed { shown: DVec3::ONE, estimates: [DVec3::ZERO; 2] }]), None);
    }
}
