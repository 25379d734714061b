//! A hemisphere seen along rays: what surfaces are there, and what light they send here.
//!
//! Where sources are told apart one by one, each costs a search for what blocks it. In a scene of a hundred thousand faces
//! it is cheaper to ask what is seen in each direction: a ray costs the logarithm of the faces. Directions are spread like
//! the light that counts, by the cosine, evenly by strata (Malley's method on the concentric map of Shirley, Chiu 1997).

use glam::DVec3;

use crate::lamps::Sky;
use crate::transport::gather::Arrived;
use crate::visibility::blockers::Blockers;
use crate::visibility::rays::{splitmix, unit};
use crate::visibility::{Receiver, grey};

/// Directions about +z, each of which stands for the same share of the irradiance. Neighbours in the list are neighbours
/// on the hemisphere, so that their differences tell the error.
#[derive(Debug, Clone)]
pub(crate) struct Directions(Vec<DVec3>);

impl Directions {
    /// At least so many, in a square of strata of even side.
    pub(crate) fn at_least(count: usize) -> Self {
        let side = ((count as f64).sqrt().ceil() as usize).next_multiple_of(2);
        let random = |k: usize| unit(splitmix(k as u64));
        let strata = (0..side * side).map(|k| {
            // Back and forth, so that pairs never part
            let (row, column) = (k / side, k % side);
            let column = if row.is_multiple_of(2) { column } else { side - 1 - column };
            let place = |stratum: usize, k: usize| (stratum as f64 + random(k)) / side as f64;
            cosine_direction(place(column, 2 * k), place(row, 2 * k + 1))
        });
        Self(strata.collect())
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// The directions about a normal, in order.
    ///
    /// `turn`: about it, in full turns.
    pub(crate) fn about(&self, normal: DVec3, turn: f64) -> impl Iterator<Item = DVec3> + '_ {
        let (x, y) = normal.any_orthonormal_pair();
        let (sine, cosine) = (std::f64::consts::TAU * turn).sin_cos();
        let (x, y) = (cosine * x + sine * y, cosine * y - sine * x);
        self.0.iter().map(move |d| (d.x * x + d.y * y + d.z * normal).normalize())
    }
}

/// From a unit square to the hemisphere about +z, as often as light takes it; neighbours stay neighbours.
fn cosine_direction(u: f64, v: f64) -> DVec3 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return DVec3::Z;
    }
    let (radius, angle) = if a.abs() > b.abs() {
        (a, std::f64::consts::FRAC_PI_4 * (b / a))
    } else {
        (b, std::f64::consts::FRAC_PI_2 - std::f64::consts::FRAC_PI_4 * (a / b))
    };
    let (sine, cosine) = angle.sin_cos();
    DVec3::new(radius * cosine, radius * sine, (1.0 - radius * radius).max(0.0).sqrt())
}

/// Strata along each side of a hemisphere, at most.
const MOST_STRATA: usize = 32;

/// Rays that a receiver is worth.
#[derive(Debug)]
pub(crate) struct Effort {
    /// Strata along each side, at least.
    fewest: usize,
    /// With so many strata along each side, and two more each.
    hemispheres: Vec<Directions>,
    /// Rays per m²^[`POWER`].
    rays: f64,
}

/// The squared error that strata leave falls about as N^-1.5: of all ways to send so many rays from receivers that stand for
/// areas a, the error over all area is least with a^(1/2.5) from each.
const POWER: f64 = 0.4;

impl Effort {
    /// So many rays in all from receivers that stand for so much area each, about.
    ///
    /// `fewest`: strata along each side, an even number.
    pub(crate) fn of(total: f64, areas: impl Iterator<Item = f64>, fewest: usize) -> Self {
        let weights: f64 = areas.map(|area| area.powf(POWER)).sum();
        let hemispheres =
            (fewest..=MOST_STRATA).step_by(2).map(|side| Directions::at_least(side * side)).collect();
        Self { fewest, hemispheres, rays: if weights > 0.0 { total / weights } else { 0.0 } }
    }

    /// Where to look from a receiver that stands for an area, m².
    pub(crate) fn directions(&self, area: f64) -> &Directions {
        let strata = (self.rays * area.powf(POWER)).sqrt() as usize;
        &self.hemispheres[(strata.clamp(self.fewest, MOST_STRATA) - self.fewest) / 2]
    }
}

/// Lit surfaces, looked at from any point.
pub(crate) struct Surroundings<'a> {
    /// Their normals are on their fronts.
    pub(crate) surfaces: &'a Blockers,
    /// What lies beyond them.
    pub(crate) sky: Option<&'a Sky>,
    /// What each surface sends from its front and back, W/m².
    pub(crate) radiosity: Vec<[DVec3; 2]>,
    pub(crate) effort: &'a Effort,
}

impl Surroundings<'_> {
    /// What comes along a ray: from the first surface, and through it from others where it lets light through.
    fn along(&self, mut from: DVec3, direction: DVec3) -> DVec3 {
        let mut light = DVec3::ZERO;
        let mut through = DVec3::ONE;
        while let Some(hit) = self.surfaces.first_hit(from, direction) {
            let share = self.surfaces.blocking().transmittance(hit.polygon);
            let sent = self.radiosity[hit.polygon as usize][usize::from(!hit.front)];
            light += (1.0 - grey(share)) * through * sent;
            through *= share;
            if through == DVec3::ZERO {
                return light;
            }
            from += hit.distance * direction;
        }
        light + through * self.sky.map_or(DVec3::ZERO, |sky| sky.towards(direction))
    }

    /// What arrives at a receiver.
    ///
    /// All receivers with the same normal look in the same directions: what they err by is then alike, and no noise tells
    /// neighbours apart.
    pub(crate) fn at(&self, receiver: &Receiver, directions: &Directions) -> Arrived {
        let mut sum = DVec3::ZERO;
        let mut differences = 0.0;
        let mut previous = DVec3::ZERO;
        for (k, direction) in directions.about(receiver.normal, 0.0).enumerate() {
            let light = self.along(receiver.position, direction);
            sum += light;
            if k % 2 == 1 {
                // Of two neighbouring strata, the square of the difference is on average the sum of their variances.
                differences += (light - previous).length_squared();
            }
            previous = light;
        }
        let count = directions.len() as f64;
        Arrived { irradiance: sum / count, variance: differences / (count * count) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_spread_by_the_cosine() {
        for count in [1, 60, 1000] {
            let directions = Directions::at_least(count);
            assert!(directions.len() >= count);
            let mean: DVec3 = directions.about(DVec3::Z, 0.3).sum::<DVec3>() / directions.len() as f64;
            // The mean of the cosine's distribution is (0, 0, 2/3); strata leave less than their size.
            let size = 1.0 / (directions.len() as f64).sqrt();
            assert!((mean - DVec3::new(0.0, 0.0, 2.0 / 3.0)).length() < 0.5 * size, "{count}: {mean}");
        }
    }
}
