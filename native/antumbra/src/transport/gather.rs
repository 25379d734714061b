//! Light that arrives at points from a set of sources (the paper, §3.2: "the illumination for a regular grid of
//! sampling points is computed"). Points that lie near each other share their shafts.

use std::ops::AddAssign;

use glam::DVec3;
use rayon::prelude::*;

use crate::error::Error;
use crate::mesh::Approach;
use crate::monitor::Monitor;
use crate::threads::AT_A_TIME;
use crate::transport::clusters::{CLUSTER_SIZE, Cluster, Clustered, Seeded, clusters};
use crate::transport::form_factors::{FormFactors, Found, Narrowed, Workspace};
use crate::transport::hemisphere::Surroundings;
use crate::transport::source_tree::{Seen, SourceTree, Step};
use crate::visibility::Receiver;
use crate::visibility::screens::{Bounds, Unscreened};

/// Parts of a source are told apart where taking their mean could be wrong by this, in wanted errors. Signs differ from
/// source to source, and the bound is many times what it is wrong by, since parts count as a receiver sees them. Cornell
/// box at 1, 4 and 16: 1.25, 1.22 and 1.34 % error with 10, 6 and 3 million form factors.
const NEGLIGIBLE: f64 = 4.0;

/// What arrives at a point.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Arrived {
    /// Irradiance, W/m².
    pub(crate) irradiance: DVec3,
    /// Variance that rays left in it, summed over the channels, W²/m⁴.
    pub(crate) variance: f64,
}

impl Arrived {
    /// Where it ended before anybody looked.
    pub(crate) const UNKNOWN: Self = Self { irradiance: DVec3::ZERO, variance: f64::INFINITY };

    /// Whether anybody looked.
    pub(crate) fn is_known(&self) -> bool {
        self.variance < f64::INFINITY
    }
}

impl AddAssign for Arrived {
    fn add_assign(&mut self, other: Self) {
        self.irradiance += other.irradiance;
        self.variance += other.variance;
    }
}

/// What sends light.
#[derive(Clone, Copy)]
pub(crate) enum Lit<'a> {
    /// Sources, which are sought out.
    Sources(&'a SourceTree),
    /// Surfaces that are met along rays.
    Around(&'a Surroundings<'a>),
}

impl<'a> Lit<'a> {
    /// Sources that are sought out.
    pub(crate) fn sources(self) -> Option<&'a SourceTree> {
        match self {
            Self::Sources(sources) => Some(sources),
            Self::Around(_) => None,
        }
    }
}

/// What surfaces reflect, for those who gather it.
pub(crate) enum Reflected<'a> {
    Sources(SourceTree),
    Around(Surroundings<'a>),
}

impl Reflected<'_> {
    pub(crate) fn lit(&self) -> Lit<'_> {
        match self {
            Self::Sources(sources) => Lit::Sources(sources),
            Self::Around(surroundings) => Lit::Around(surroundings),
        }
    }
}

/// Sources, and all that it takes to find their light.
pub(crate) struct Gather<'a> {
    pub(crate) form_factors: &'a FormFactors<'a>,
    pub(crate) monitor: &'a Monitor,
    pub(crate) sources: Lit<'a>,
    /// The rms error that the user wants, W/m²; infinite sources of rays where nothing is known yet (0).
    pub(crate) wanted_error: f64,
    /// When to leave it at what is known: the caller stops, or the time is up.
    pub(crate) ends: &'a (dyn Fn() -> bool + Sync),
}

impl Gather<'_> {
    /// What arrives at each receiver; [`Arrived::UNKNOWN`] where it ended before its turn.
    ///
    /// `seeds`: per receiver, what fixes its rays. `areas`: that each stands for, m²; may be empty where sources are sought
    /// out.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn at(
        &self,
        receivers: &[Receiver],
        seeds: &[u64],
        areas: &[f64],
    ) -> Result<Vec<Arrived>, Error> {
        match self.sources {
            Lit::Sources(tree) => {
                self.at_members(tree, &clusters(receivers, CLUSTER_SIZE), Seeded { receivers, seeds })
            }
            Lit::Around(surroundings) => self.by_rays(surroundings, receivers, areas),
        }
    }

    /// What arrives at the end of each approach: at its near receiver, or, where there is a far one, the limit.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn limits(
        &self,
        approaches: &[Approach],
        seeds: &[u64],
        areas: &[f64],
    ) -> Result<Vec<Arrived>, Error> {
        let tree = match self.sources {
            Lit::Sources(tree) => tree,
            Lit::Around(surroundings) => {
                // Rays are not continued.
                let receivers: Vec<Receiver> = approaches.iter().map(|approach| approach.near).collect();
                return self.by_rays(surroundings, &receivers, areas);
            }
        };
        let mut receivers: Vec<Receiver> = approaches.iter().map(|approach| approach.near).collect();
        let mut seeds = seeds.to_vec();
        let mut clusters = clusters(&receivers, CLUSTER_SIZE);
        // Both of a pair see the same sources told apart and the same candidates: what is left out is left out of both.
        let mut pairs: Vec<[usize; 2]> = Vec::new();
        for cluster in &mut clusters {
            for k in 0..cluster.members.len() {
                let near = cluster.members[k] as usize;
                if let Some(far) = approaches[near].far {
                    cluster.add(receivers.len() as u32, far.position);
                    pairs.push([near, receivers.len()]);
                    receivers.push(far);
                    seeds.push(seeds[near]);
                }
            }
        }
        let mut arrived =
            self.at_members(tree, &clusters, Seeded { receivers: &receivers, seeds: &seeds })?;
        for [near, far] in pairs {
            arrived[near] = limit(arrived[near], arrived[far]);
        }
        arrived.truncate(approaches.len());
        Ok(arrived)
    }

    fn at_members(&self, tree: &SourceTree, clusters: &[Cluster], of: Seeded) -> Result<Vec<Arrived>, Error> {
        let mut arrived = vec![Arrived::default(); of.receivers.len()];
        if of.receivers.is_empty() || tree.is_empty() {
            return Ok(arrived);
        }
        let bounds: Vec<Bounds> = clusters.iter().map(Cluster::bounds).collect();
        let unscreened = Unscreened::new(self.form_factors.blockers, &bounds, &tree.bodies());
        let found: Vec<Vec<Arrived>> = (clusters.par_iter().enumerate().with_max_len(AT_A_TIME))
            .map_init(Workspace::default, |workspace, (number, cluster)| {
                if (self.ends)() {
                    return vec![Arrived::UNKNOWN; cluster.members.len()];
                }
                let mut sums = vec![Arrived::default(); cluster.members.len()];
                let at = Clustered { cluster, of };
                let (low, high) = cluster.bounds();
                workspace.next_cluster();
                let negligible = NEGLIGIBLE * self.wanted_error;
                let (seen, seen_lamps) = tree.split(unscreened.of(number));
                tree.visit(seen, low, high, negligible, Narrowed::Unknown, |source, step, known| {
                    let polygon = match (source.seen(), step) {
                        (Seen::Polygon(polygon), Step::Whole) => polygon,
                        (Seen::Polygon(polygon), Step::ToParts) => {
                            return self.form_factors.narrow(at, polygon, known, workspace);
                        }
                        (Seen::Cluster(_), Step::ToParts) => return Some(known),
                        (Seen::Cluster(representatives), Step::Whole) => {
                            let share = source.area() / representatives.len() as f64;
                            self.form_factors.of_representatives(at, representatives, share, |k, found| {
                                sums[k].irradiance += found.coloured() * source.radiosity();
                                sums[k].variance += (found.noise * source.radiosity()).length_squared();
                            });
                            return None;
                        }
                    };
                    let found = |k: usize, found: Found| {
                        sums[k].irradiance += found.coloured() * source.radiosity_from(at.receiver(k));
                        sums[k].variance += (found.noise * source.radiosity()).length_squared();
                    };
                    let weight = self.weight(source.radiosity());
                    self.form_factors.of_cluster(at, polygon, weight, known, workspace, found);
                    None
                });
                for &lamp in seen_lamps {
                    tree.lamp(lamp).light_cluster(
                        at,
                        self.form_factors,
                        self.weight(DVec3::ONE),
                        workspace,
                        |k, brought| sums[k] += brought,
                    );
                }
                if let Some(sky) = &tree.sky {
                    sky.light_cluster(at, self.form_factors, self.wanted_error, workspace, |k, brought| {
                        sums[k] += brought;
                    });
                }
                self.form_factors.count_pairs(workspace);
                sums
            })
            .collect();
        self.monitor.check()?;
        for (cluster, sums) in clusters.iter().zip(found) {
            for (&member, sum) in cluster.members.iter().zip(sums) {
                arrived[member as usize] = sum;
            }
        }
        Ok(arrived)
    }

    fn by_rays(
        &self,
        surroundings: &Surroundings,
        receivers: &[Receiver],
        areas: &[f64],
    ) -> Result<Vec<Arrived>, Error> {
        let arrived = (receivers.par_iter().zip_eq(areas).with_max_len(AT_A_TIME))
            .map(|(receiver, &area)| {
                if (self.ends)() {
                    return Arrived::UNKNOWN;
                }
                let (arrived, rays) = surroundings.at(receiver, area);
                self.form_factors.count_rays(rays as u64);
                arrived
            })
            .collect();
        self.monitor.check()?;
        Ok(arrived)
    }

    /// What a source could bring, in wanted errors; before anything is known, every ray is worth it.
    fn weight(&self, radiosity: DVec3) -> f64 {
        if self.wanted_error > 0.0 { rms(radiosity) / self.wanted_error } else { f64::INFINITY }
    }
}

/// Light at the end of a line, from one step and from two steps away: what is missed is of second order.
fn limit(near: Arrived, far: Arrived) -> Arrived {
    // Rays differ by their noise, which the difference would make five times the variance of.
    if near.variance > 0.0 || far.variance > 0.0 {
        return near;
    }
    // Where nothing arrives nothing is continued, and light does not change its sign, which is negative for lights that
    // take it away.
    let continued = 2.0 * near.irradiance - far.irradiance;
    let same_sign = (continued * near.irradiance).cmpgt(DVec3::ZERO);
    Arrived { irradiance: DVec3::select(same_sign, continued, DVec3::ZERO), variance: 0.0 }
}

/// The root mean square of a colour over its channels.
pub(crate) fn rms(colour: DVec3) -> f64 {
    (colour.length_squared() / 3.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::form_factors::Shortcuts;
    use crate::visibility::blockers::Blockers;

    /// Seen from its axis, a disc of area a fills a/(a + pi d²) of the hemisphere.
    #[test]
    fn a_place_of_a_cluster_sends_what_its_disc_does_however_near() {
        let blockers = Blockers::opaque(Vec::new(), 1.0);
        let form_factors = FormFactors::new(&blockers, Shortcuts::default());
        let receivers = [Receiver::new(DVec3::ZERO, DVec3::Z)];
        let of = Seeded { receivers: &receivers, seeds: &[0] };
        let cluster = &clusters(&receivers, CLUSTER_SIZE)[0];
        for distance in [1e-12_f64, 1e-6, 0.1, 100.0] {
            let places = [(distance * DVec3::Z, -DVec3::Z)];
            let mut value = 0.0;
            let found = |_, found: Found| value = found.grey();
            form_factors.of_representatives(Clustered { cluster, of }, &places, 0.5, found);
            let exact = 0.5 / (0.5 + std::f64::consts::PI * distance * distance);
            assert!((value / exact - 1.0).abs() < 1e-12, "{value} from {distance} m");
        }
    }

    #[test]
    fn limits_continue_light_but_neither_its_noise_nor_beyond_darkness() {
        let arrived = |x: f64, y: f64, z: f64| Arrived { irradiance: DVec3::new(x, y, z), variance: 0.0 };
        let found = limit(arrived(1.5, 0.0, 0.25), arrived(2.0, 0.5, 0.75));
        assert_eq!(found.irradiance, DVec3::new(1.0, 0.0, 0.0));
        let taken_away = limit(arrived(-1.5, -0.25, 0.0), arrived(-2.0, -0.75, -1.0));
        assert_eq!(taken_away.irradiance, DVec3::new(-1.0, 0.0, 0.0));
        let noisy = Arrived { variance: 0.1, ..arrived(1.5, 0.0, 0.25) };
        assert_eq!(limit(noisy, arrived(2.0, 0.5, 0.75)).irradiance, noisy.irradiance);
    }
}
