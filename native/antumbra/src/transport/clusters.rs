//! Receivers near each other, which share their shafts.

use glam::DVec3;

use crate::transport::form_factors::faces;
use crate::visibility::shaft::box_corners;
use crate::visibility::{ConvexPolygon, Receiver};

/// Points in a cluster, at most. One shaft costs as much as a few exact evaluations, so fewer points share it too
/// seldom; more make a box so wide that distant sources fall into many parts for it. Measured on two closed rooms at
/// 8, 16 and 32: CPU time 1.0 to 1.3, 0.9 and 1.0 relative to 32; rays, the sign of crowded shafts, 1, 3 and 10.
pub(crate) const CLUSTER_SIZE: usize = 16;

/// Receivers, with what fixes their rays.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seeded<'a> {
    pub(crate) receivers: &'a [Receiver],
    pub(crate) seeds: &'a [u64],
}

/// Receivers near each other, which share their shafts.
#[derive(Debug)]
pub(crate) struct Cluster {
    /// Indices into the caller's receivers.
    pub(crate) members: Vec<u32>,
    pub(super) corners: [DVec3; 8],
}

impl Cluster {
    /// The box around its members.
    pub(crate) fn bounds(&self) -> (DVec3, DVec3) {
        (self.corners[0], self.corners[7])
    }

    /// Takes in another receiver, beyond the size that clusters are made with.
    pub(crate) fn add(&mut self, member: u32, position: DVec3) {
        let (low, high) = self.bounds();
        self.members.push(member);
        self.corners = box_corners(low.min(position), high.max(position));
    }
}

/// A cluster with the receivers that it is of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clustered<'a> {
    pub(crate) cluster: &'a Cluster,
    pub(crate) of: Seeded<'a>,
}

impl<'a> Clustered<'a> {
    /// The k-th member.
    pub(crate) fn receiver(&self, k: usize) -> &'a Receiver {
        &self.of.receivers[self.cluster.members[k] as usize]
    }

    pub(crate) fn seed(&self, k: usize) -> u64 {
        self.of.seeds[self.cluster.members[k] as usize]
    }

    /// Whether light can come from the sending side of a source to any member.
    pub(super) fn faces(&self, source: &ConvexPolygon) -> bool {
        (0..self.cluster.members.len()).any(|k| faces(self.receiver(k), source))
    }
}

/// Groups receivers into compact clusters of at most `size`: halved along their longest extent until they are small
/// enough. (Along a space-filling curve neighbours may lie on opposite sides of the scene.)
pub(crate) fn clusters(receivers: &[Receiver], size: usize) -> Vec<Cluster> {
    let mut clusters = Vec::with_capacity(2 * receivers.len() / size + 1);
    let mut order: Vec<u32> = (0..receivers.len() as u32).collect();
    split(receivers, &mut order, size, &mut clusters);
    clusters
}

fn split(receivers: &[Receiver], members: &mut [u32], size: usize, clusters: &mut Vec<Cluster>) {
    if members.is_empty() {
        return;
    }
    let at = |i: u32| receivers[i as usize].position;
    let low = members.iter().fold(DVec3::INFINITY, |low, &i| low.min(at(i)));
    let high = members.iter().fold(DVec3::NEG_INFINITY, |high, &i| high.max(at(i)));
    if members.len() <= size {
        clusters.push(Cluster { members: members.to_vec(), corners: box_corners(low, high) });
        return;
    }
    let extent = high - low;
    let axis = (1..3).fold(0, |longest, axis| if extent[axis] > extent[longest] { axis } else { longest });
    let middle = members.len() / 2;
    members.select_nth_unstable_by(middle, |&a, &b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(&b)));
    let (lower, upper) = members.split_at_mut(middle);
    split(receivers, lower, size, clusters);
    split(receivers, upper, size, clusters);
}
