//! What lamps bring to a cluster of receivers: one shaft for all of them, then each receiver's own view.

use glam::DVec3;
use smallvec::SmallVec;

use crate::lamps::{Lamp, SeenPolygon, Sight};
use crate::transport::clusters::Clustered;
use crate::transport::form_factors::{Candidates, FormFactors, Workspace};
use crate::transport::gather::{Arrived, rms};
use crate::visibility::{Receiver, covers, hides};

/// What light is worth, m²/W, that is to be as exact as it can be.
const SURELY: f64 = f64::INFINITY;

impl Lamp {
    /// What it brings to the receivers of a cluster that it lights.
    ///
    /// `worth`: one over the wanted error, m²/W. `found`: gets the receiver's number in the cluster.
    pub(crate) fn light_cluster(
        &self,
        at: Clustered,
        form_factors: &FormFactors,
        worth: f64,
        workspace: &mut Workspace,
        mut found: impl FnMut(usize, Arrived),
    ) {
        let own = self.blockers.as_ref().map(|blockers| form_factors.among(blockers));
        let form_factors = own.as_ref().unwrap_or(form_factors);
        let count = at.cluster.members.len();
        let mut shared = std::mem::take(&mut workspace.shared);
        let mut known: Option<Candidates> = (!self.casts_shadows).then_some(Candidates::Shared(&[]));
        let mut find: Option<&mut Vec<u32>> = Some(&mut shared);
        for k in 0..count {
            let receiver = at.receiver(k);
            let sight = self.seen_from(receiver);
            if let Sight::Dark = sight {
                continue;
            }
            // Most lamps are behind most clusters, or off to the side; only now it is known to be neither.
            let candidates = *known.get_or_insert_with(|| {
                let (low, high) = at.cluster.bounds();
                let list = find.take().expect("asked for once; this is a bug in antumbra");
                form_factors.candidates(|| self.shaft(low, high), list)
            });
            let brought = match sight {
                Sight::Dark => continue,
                Sight::Around(irradiance) => Arrived { irradiance, variance: 0.0 },
                Sight::Point(way, irradiance) => {
                    form_factors.count_point();
                    let through = self.through(receiver, way, candidates, form_factors);
                    Arrived { irradiance: through * irradiance, variance: 0.0 }
                }
                Sight::Polygon(seen) => {
                    seen.light(receiver, form_factors, candidates, worth, at.seed(k), workspace)
                }
            };
            found(k, brought);
        }
        workspace.shared = shared;
    }

    /// What it brings to one receiver, W/m².
    pub(crate) fn light(
        &self,
        receiver: &Receiver,
        form_factors: &FormFactors,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let own = self.blockers.as_ref().map(|blockers| form_factors.among(blockers));
        let form_factors = own.as_ref().unwrap_or(form_factors);
        match self.seen_from(receiver) {
            Sight::Dark => DVec3::ZERO,
            Sight::Around(irradiance) => irradiance,
            Sight::Point(way, irradiance) => {
                self.through(receiver, way, Candidates::Crowd, form_factors) * irradiance
            }
            Sight::Polygon(seen) => {
                seen.light(receiver, form_factors, Candidates::Crowd, SURELY, 0, workspace).irradiance
            }
        }
    }

    /// Share of a point's light, per channel, that gets to a receiver.
    fn through(
        &self,
        receiver: &Receiver,
        way: DVec3,
        candidates: Candidates,
        form_factors: &FormFactors,
    ) -> DVec3 {
        let blocking = form_factors.blockers.blocking();
        let mut filters: SmallVec<[u32; 8]> = SmallVec::new();
        let mut stops = |id: u32| {
            let polygon = &blocking.polygons[id as usize];
            if blocking.is_opaque(id) {
                return hides(polygon, receiver.position, way);
            }
            if covers(polygon, receiver.position, way) {
                filters.push(id);
            }
            false
        };
        let stopped = match candidates {
            Candidates::Shared(shared) => shared.iter().any(|&id| stops(id)),
            Candidates::Crowd => form_factors.blockers.any(&self.tube(receiver), stops),
        };
        if stopped {
            return DVec3::ZERO;
        }
        // The tree's order depends on its builder.
        filters.sort_unstable();
        filters.iter().map(|&id| blocking.transmittance(id)).product()
    }
}

impl SeenPolygon<'_> {
    /// What it brings to the receiver that sees it.
    pub(super) fn light(
        &self,
        receiver: &Receiver,
        form_factors: &FormFactors,
        candidates: Candidates,
        worth: f64,
        seed: u64,
        workspace: &mut Workspace,
    ) -> Arrived {
        if let Candidates::Shared([]) = candidates {
            form_factors.count_open();
            return Arrived { irradiance: self.open(receiver) * self.exitance, variance: 0.0 };
        }
        let worth = worth * rms(self.exitance);
        let found = self.with_weight(|weight| {
            form_factors.visible_weighted(receiver, &self.polygon, weight, candidates, worth, seed, workspace)
        });
        Arrived {
            irradiance: found.coloured() * self.exitance,
            variance: (found.noise * self.exitance).length_squared(),
        }
    }
}
