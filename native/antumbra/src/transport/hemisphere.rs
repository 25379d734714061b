//! A hemisphere seen along rays: what surfaces are there, and what light they send here.
//!
//! Where sources are told apart one by one, each costs a search for what blocks it. In a scene of a hundred thousand faces
//! it is cheaper to ask what is seen in each direction: a ray costs the logarithm of the faces. Directions are spread like
//! the light that counts, by the cosine, evenly by strata (Malley's method on the concentric map of Shirley, Chiu 1997).
//! A first look along few tells where light changes, in a window or behind a leg of a table, and most others go there.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::lamps::Sky;
use crate::threads::AT_A_TIME;
use crate::transport::gather::Arrived;
use crate::transport::patch_tree::{PatchHit, PatchTree};
use crate::visibility::packet::PACKET;
use crate::visibility::rays::{splitmix, unit};
use crate::visibility::{Receiver, grey};

/// Directions about +z, each of which stands for the same share of the irradiance: one in each cell of a square of them, row
/// by row. Neighbours in the square are neighbours on the hemisphere.
#[derive(Debug, Clone)]
pub(crate) struct Directions {
    side: usize,
    directions: Vec<DVec3>,
}

impl Directions {
    /// A square of so many by so many.
    pub(crate) fn square(side: usize) -> Self {
        let random = |k: usize| unit(splitmix(k as u64));
        let place = |cell: usize, k: usize| (cell as f64 + random(k)) / side as f64;
        let directions =
            (0..side * side).map(|k| cosine_direction(place(k % side, 2 * k), place(k / side, 2 * k + 1)));
        Self { side, directions: directions.collect() }
    }

    pub(crate) fn len(&self) -> usize {
        self.directions.len()
    }

    /// The directions about a normal, in order.
    ///
    /// `turn`: about it, in full turns.
    pub(crate) fn about(&self, normal: DVec3, turn: f64) -> impl Iterator<Item = DVec3> + '_ {
        let frame = frame(normal, turn);
        self.directions.iter().map(move |&direction| (frame * direction).normalize())
    }

    /// Those in one cell of a coarser square, `parts` by `parts`, of `side` cells a side: there and back again, so that each
    /// is beside the one before.
    fn in_cell(&self, cell: usize, parts: usize) -> impl Iterator<Item = DVec3> + '_ {
        let coarse = self.side / parts;
        let (row, column) = (parts * (cell / coarse), parts * (cell % coarse));
        (0..parts * parts).map(move |k| {
            let (i, j) = (k / parts, k % parts);
            let j = if i.is_multiple_of(2) { j } else { parts - 1 - j };
            self.directions[(row + i) * self.side + column + j]
        })
    }
}

/// Turns +z to a normal.
fn frame(normal: DVec3, turn: f64) -> DMat3 {
    let (x, y) = normal.any_orthonormal_pair();
    let (sine, cosine) = (std::f64::consts::TAU * turn).sin_cos();
    DMat3::from_cols(cosine * x + sine * y, cosine * y - sine * x, normal)
}

/// All cells of a first look, two by two of them, so that those that follow each other are near each other.
fn in_blocks() -> impl Iterator<Item = usize> {
    const BLOCKS: usize = FIRST / 2;
    (0..CELLS).map(|k| {
        let (block, row, column) = (k / 4, k % 4 / 2, k % 2);
        (2 * (block / BLOCKS) + row) * FIRST + 2 * (block % BLOCKS) + column
    })
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

/// The squared error that strata leave falls about as N^-1.5: of all ways to send so many rays from receivers of weights w,
/// areas times variances, the error over all area is least with w^(1/2.5) from each.
pub(crate) const POWER: f64 = 0.4;

/// Cells along each side of a hemisphere that is looked at first, to see what more is worth. With 16 rays darkness in a
/// crevice cannot be told from noise.
const FIRST: usize = 6;

/// All of them.
const CELLS: usize = FIRST * FIRST;

/// Parts that each side of a cell may be cut into for a second look.
const PARTS: [usize; 8] = [2, 3, 4, 6, 8, 12, 16, 24];

/// Rays of a second look, at least.
const FEWEST: usize = PARTS[0] * PARTS[0] * CELLS;

/// The variance of a first look counts for at least this share of the usual one, and that in a cell for this share of the
/// mean of all cells: where none of few rays met a small window, they seem to agree.
const LEAST_VARIANCE: f64 = 0.25;

/// Rays that tell what is shown, about and at most, before it is refined: a minute of processor time. In scenes of half a million
/// vertices it is more, a second look of the fewest rays for each: they would be what is left after the first looks.
const RAYS_SHOWN: f64 = 6e7;

/// A first look whose standard error is more than this share of what it saw does not suffice, however small the area that it
/// is taken for, where all second looks of the fewest rays keep to [`RAYS_SHOWN`]: beside a window 36 rays meet it or miss it,
/// and a wrong vertex among small ones is seen. In a room lit by windows 5.4 % became 5.1 % for a fifth more rays.
const UNSURE: f64 = 0.1;

/// Receivers that tell the usual variance, about.
const PROBED: usize = 10_000;

/// Lit surfaces, looked at from any point.
pub(crate) struct Surroundings<'a> {
    surfaces: &'a PatchTree,
    /// What lies beyond them.
    sky: Option<&'a Sky>,
    /// What each side of them sends, W/m².
    radiosity: &'a [DVec3],
    first: Directions,
    /// Per number of [`PARTS`].
    second: Vec<Directions>,
    /// Rays of a second look per weight^[`POWER`].
    effort: f64,
    /// Of a first look, as a mean over all area, W²/m⁴.
    usual_variance: f64,
    /// Share of what a first look saw that its standard error may be.
    unsure: f64,
}

/// What a first look saw.
struct FirstLook {
    /// Of its mean.
    arrived: Arrived,
    /// Per cell: root of the variance of one ray, at most, W/m².
    deviations: [f64; CELLS],
}

impl<'a> Surroundings<'a> {
    pub(crate) fn new(surfaces: &'a PatchTree, radiosity: &'a [DVec3], sky: Option<&'a Sky>) -> Self {
        let second = PARTS.iter().map(|parts| Directions::square(FIRST * parts)).collect();
        let first = Directions::square(FIRST);
        Self {
            surfaces,
            sky,
            radiosity,
            first,
            second,
            effort: 0.0,
            usual_variance: 0.0,
            unsure: f64::INFINITY,
        }
    }

    /// Sends as many rays from now on as leave an rms error of about `wanted`, W/m², over all receivers, which stand for
    /// `areas`, m², or as many as it may.
    pub(crate) fn aim_at(&mut self, wanted: f64, receivers: &[Receiver], areas: &[f64]) {
        let step = receivers.len().div_ceil(PROBED).max(1);
        let probed: Vec<usize> = (0..receivers.len()).step_by(step).collect();
        let variances: Vec<f64> = (probed.par_iter().with_max_len(AT_A_TIME))
            .map(|&index| self.first_look(&receivers[index]).arrived.variance)
            .collect();
        let probed = || probed.iter().map(|&index| areas[index]).zip(&variances);
        let area: f64 = probed().map(|(area, _)| area).sum();
        if !(wanted > 0.0 && area > 0.0) {
            return;
        }
        self.usual_variance = probed().map(|(area, variance)| area * variance).sum::<f64>() / area;
        // What the probed may leave over their own area; all others are like them.
        let allowed = 3.0 * wanted * wanted * area;
        let weights: f64 = probed().map(|(area, &variance)| self.weight(area, variance).powf(POWER)).sum();
        if ((receivers.len() * FEWEST) as f64) < RAYS_SHOWN {
            self.unsure = UNSURE;
        }
        if weights > 0.0 {
            let enough = CELLS as f64 * (weights / allowed).powf(2.0 / 3.0);
            let most = RAYS_SHOWN.max((receivers.len() * FEWEST) as f64);
            self.effort = enough.min(most / (step as f64 * weights));
        }
    }

    fn weight(&self, area: f64, variance: f64) -> f64 {
        area * variance.max(LEAST_VARIANCE * self.usual_variance)
    }

    /// What arrives at a receiver that stands for an area, m², and the rays that it took.
    ///
    /// All receivers with the same normal look in the same directions: what they err by is then much alike, and little noise
    /// tells neighbours apart.
    pub(crate) fn at(&self, receiver: &Receiver, area: f64) -> (Arrived, usize) {
        let first = self.first_look(receiver);
        let rays = self.effort * self.weight(area, first.arrived.variance).powf(POWER);
        let is_unsure = first.arrived.variance.sqrt() > self.unsure * first.arrived.irradiance.length();
        if rays < FEWEST as f64 && !is_unsure {
            return (first.arrived, CELLS);
        }
        let rays = rays.max(FEWEST as f64);
        // Cells are looked at anew, all of them, lest what was met by chance decides what is believed.
        let frame = frame(receiver.normal, 0.0);
        let rays_per_deviation = rays / first.deviations.iter().sum::<f64>();
        let mut arrived = Arrived::default();
        let mut spent = CELLS;
        for (cell, deviation) in first.deviations.into_iter().enumerate() {
            let parts = (rays_per_deviation * deviation).sqrt();
            let level = PARTS.iter().rposition(|&most| most as f64 <= parts).unwrap_or(0);
            let count = PARTS[level] * PARTS[level];
            let mut sum = DVec3::ZERO;
            let mut differences = 0.0;
            let mut previous = None;
            let directions = self.second[level].in_cell(cell, PARTS[level]);
            for light in self.along_all(receiver.position, directions.map(|d| (frame * d).normalize())) {
                sum += light;
                differences +=
                    previous.replace(light).map_or(0.0, |last: DVec3| (light - last).length_squared());
            }
            arrived.irradiance += sum / count as f64;
            // Half of the mean square of the difference of two is the variance of one.
            arrived.variance += differences / (2 * (count - 1) * count) as f64;
            spent += count;
        }
        arrived.irradiance /= CELLS as f64;
        arrived.variance /= (CELLS * CELLS) as f64;
        (arrived, spent)
    }

    fn first_look(&self, receiver: &Receiver) -> FirstLook {
        let mut light = [DVec3::ZERO; CELLS];
        let frame = frame(receiver.normal, 0.0);
        let towards = |cell: usize| (frame * self.first.directions[cell]).normalize();
        for (cell, seen) in in_blocks().zip(self.along_all(receiver.position, in_blocks().map(towards))) {
            light[cell] = seen;
        }
        // Half of the square of the difference of two cells is the variance of one: to each of its neighbours.
        let mut greatest = [0.0_f64; CELLS];
        let (mut sum, mut pairs) = (0.0, 0);
        let mut compare = |a: usize, b: usize| {
            let variance = 0.5 * (light[a] - light[b]).length_squared();
            greatest[a] = greatest[a].max(variance);
            greatest[b] = greatest[b].max(variance);
            sum += variance;
            pairs += 1;
        };
        for cell in 0..CELLS {
            if cell % FIRST + 1 < FIRST {
                compare(cell, cell + 1);
            }
            if cell + FIRST < CELLS {
                compare(cell, cell + FIRST);
            }
        }
        let least = LEAST_VARIANCE * greatest.iter().sum::<f64>() / CELLS as f64;
        let arrived = Arrived {
            irradiance: light.iter().sum::<DVec3>() / CELLS as f64,
            variance: sum / f64::from(pairs) / CELLS as f64,
        };
        // The least is something, so that cells can be compared where all are alike.
        let deviations = greatest.map(|variance| variance.max(least).max(f64::MIN_POSITIVE).sqrt());
        FirstLook { arrived, deviations }
    }

    /// The light that comes along rays from one point, as exitances, W/m². Those that follow each other should be near each
    /// other.
    fn along_all(
        &self,
        from: DVec3,
        mut directions: impl Iterator<Item = DVec3>,
    ) -> impl Iterator<Item = DVec3> {
        std::iter::from_fn(move || {
            let first = directions.next()?;
            let mut packet = [first; PACKET];
            let mut count = 1;
            for direction in directions.by_ref().take(PACKET - 1) {
                packet[count] = direction;
                count += 1;
            }
            let hits = self.surfaces.first_hits(from, &packet);
            let light: [DVec3; PACKET] = std::array::from_fn(|k| self.along(from, packet[k], hits[k]));
            Some(light.into_iter().take(count))
        })
        .flatten()
    }

    /// The light that comes along a ray which meets something, or nothing: from the first surface, and through it from others
    /// where it lets light through.
    fn along(&self, mut from: DVec3, direction: DVec3, mut hit: Option<PatchHit>) -> DVec3 {
        let mut light = DVec3::ZERO;
        let mut through = DVec3::ONE;
        while let Some(PatchHit { side, through: share, distance }) = hit {
            light += (1.0 - grey(share)) * through * self.radiosity[side as usize];
            through *= share;
            if through == DVec3::ZERO {
                return light;
            }
            from += distance * direction;
            hit = self.surfaces.first_hit(from, direction);
        }
        light + through * self.sky.map_or(DVec3::ZERO, |sky| sky.towards(direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_spread_by_the_cosine() {
        for side in [2, 8, 32] {
            let directions = Directions::square(side);
            assert_eq!(directions.len(), side * side);
            let mean: DVec3 = directions.about(DVec3::Z, 0.3).sum::<DVec3>() / directions.len() as f64;
            // The mean of the cosine's distribution is (0, 0, 2/3); strata leave less than their size.
            let size = 1.0 / side as f64;
            assert!((mean - DVec3::new(0.0, 0.0, 2.0 / 3.0)).length() < 0.5 * size, "{side}: {mean}");
        }
    }
}
