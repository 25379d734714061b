//! Visible form factors from many samples to one source: exact where it pays, by counted rays in a crowd.
//!
//! Samples are gathered in clusters of neighbours; one shaft per cluster finds the polygons that could block any of
//! them. Most shafts are empty.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;

use crate::index::SampleId;
use crate::mesh::{Mesh, Side};
use crate::visibility::blockers::{Blockers, TooMany};
use crate::visibility::rays::visible_share;
use crate::visibility::shaft::{BOX_EDGES, Shaft, box_corners};
use crate::visibility::{ConvexPolygon, Receiver, Scratch, unoccluded_form_factor, visible_form_factor};

/// Samples in a cluster. One shaft costs as much as a few exact evaluations; fewer samples share it too seldom, more
/// make it so wide that it is never empty.
const CLUSTER_SIZE: usize = 32;

/// Candidates of a cluster's shaft beyond which every sample asks for its own: each candidate costs every sample of
/// the cluster about 10 ns to reject.
const MOST_SHARED: usize = 96;

/// Candidates up to which the exact form factor is always used; it then costs less than four rays.
const ALWAYS_EXACT: usize = 16;

/// As many rays cost no more than asking for a receiver's own candidates, and are used at once.
const FEW_RAYS: u32 = 2;

/// Candidates up to which the exact form factor is used where the source matters: 64 blockers that all matter cost
/// 25 to 37 µs, as much as 30 to 60 rays; beyond, a point's cost grows faster than the rays'.
const MOST_EXACT: usize = 96;

/// Most rays for one form factor; its stratified rms error is then about a hundredth of the source's light.
const MOST_RAYS: f64 = 128.0;

/// Share of the tolerance that the noise of one source's rays may use up at one sample. Noise of hundreds of sources
/// adds up in quadrature and is averaged over neighbouring samples.
const RAY_NOISE: f64 = 0.1;

/// The stratified rms error of N rays to a half-hidden source is about this times N^(-3/4) of the source's light.
const RAY_ERROR: f64 = 0.4;

/// A form factor, and the standard error that rays left in it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Found {
    pub(crate) value: f64,
    pub(crate) noise: f64,
}

/// How the polygons that may block were found.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Candidates<'a> {
    /// All that may matter to any of the receivers.
    Shared(&'a [u32]),
    /// Too many for all of them together: ask again for each one.
    Crowd,
}

/// How often each way was taken; sums do not depend on the order.
#[derive(Debug, Default)]
struct Counters {
    exact: AtomicU64,
    sampled: AtomicU64,
    rays: AtomicU64,
}

/// Scratch space of one thread.
#[derive(Default)]
pub(crate) struct Workspace {
    kernel: Scratch,
    own: Vec<u32>,
    shared: Vec<u32>,
}

/// Evaluates form factors in one scene.
pub(crate) struct FormFactors<'a> {
    pub(crate) blockers: &'a Blockers,
    counters: Counters,
}

impl<'a> FormFactors<'a> {
    pub(crate) fn new(blockers: &'a Blockers) -> Self {
        Self { blockers, counters: Counters::default() }
    }

    /// How many form factors were exact, how many were sampled, and the rays that took.
    pub(crate) fn counts(&self) -> [u64; 3] {
        let Counters { exact, sampled, rays } = &self.counters;
        [exact, sampled, rays].map(|count| count.load(Ordering::Relaxed))
    }

    /// Collects what may come between receiver points and a source.
    pub(crate) fn candidates<'w>(&self, shaft: &Shaft, found: &'w mut Vec<u32>) -> Candidates<'w> {
        match self.blockers.candidates(shaft, MOST_SHARED, found) {
            Ok(()) => Candidates::Shared(found),
            Err(TooMany) => Candidates::Crowd,
        }
    }

    /// The visible form factor from one receiver to the sending side of a source.
    ///
    /// `weight`: radiosity that a form factor of one would bring, relative to the wanted error.
    /// `seed`: fixes the rays, when there are any.
    pub(crate) fn visible(
        &self,
        receiver: &Receiver,
        source: &ConvexPolygon,
        candidates: Candidates,
        weight: f64,
        seed: u64,
        workspace: &mut Workspace,
    ) -> Found {
        if !faces(receiver, source) {
            return Found::default();
        }
        let Workspace { kernel, own, .. } = workspace;
        let exact = |candidates: &[u32], kernel: &mut Scratch| {
            let found =
                visible_form_factor(receiver, source, self.blockers.polygons(), candidates, kernel).ok()?;
            self.counters.exact.fetch_add(1, Ordering::Relaxed);
            Some(Found { value: found.value, noise: 0.0 })
        };
        if let Candidates::Shared(shared) = candidates
            && shared.len() <= ALWAYS_EXACT
            && let Some(found) = exact(shared, kernel)
        {
            return found;
        }
        // In a crowd, look at this receiver's own pyramid, unless a few rays are good enough.
        let unoccluded = unoccluded_form_factor(receiver, source);
        let count = rays_for(weight * unoccluded);
        if count > FEW_RAYS {
            let shaft =
                Shaft::new(&[receiver.position], &[], source, Some((receiver.position, receiver.normal)));
            let limit = ALWAYS_EXACT.max((count as usize).min(MOST_EXACT));
            if self.blockers.candidates(&shaft, limit, own).is_ok()
                && let Some(found) = exact(own, kernel)
            {
                return found;
            }
        }
        self.counters.sampled.fetch_add(1, Ordering::Relaxed);
        self.counters.rays.fetch_add(u64::from(count), Ordering::Relaxed);
        let share = visible_share(receiver, source, self.blockers, count, seed);
        // Rays that all agree may still all be wrong: the next one would have disagreed one time in so many.
        let doubt = (share * (1.0 - share)).max(0.25 / f64::from(count)).sqrt();
        let noise = 2.0 * RAY_ERROR * doubt * f64::from(count).powf(-0.75);
        Found { value: unoccluded * share, noise: unoccluded * noise }
    }
}

/// Whether any light can go straight from the sending side of the source to the receiver.
pub(crate) fn faces(receiver: &Receiver, source: &ConvexPolygon) -> bool {
    let vertices = source.vertices();
    source.normal().dot(receiver.position - vertices[0]) > 0.0
        && vertices.iter().any(|&v| receiver.normal.dot(v - receiver.position) > 0.0)
}

/// Rays after which the noise of a source that could bring `potential` (in wanted errors) is below [`RAY_NOISE`]:
/// the stratified rms error of a half-hidden source is about 0.4 N^(-3/4) of it.
fn rays_for(potential: f64) -> u32 {
    (RAY_ERROR * potential / RAY_NOISE).powf(4.0 / 3.0).ceil().clamp(1.0, MOST_RAYS) as u32
}

/// Form factors of one sample: front and back. Single precision is far finer than any tolerance, and columns are
/// what fills the memory.
pub(crate) type FormFactorPair = [f32; 2];

/// Neighbouring samples.
#[derive(Debug)]
pub(crate) struct Cluster {
    pub(crate) samples: Vec<SampleId>,
    low: DVec3,
    high: DVec3,
}

/// Groups the first `count` samples of a mesh into clusters along a Morton curve.
pub(crate) fn clusters(mesh: &Mesh, count: usize) -> Vec<Cluster> {
    let positions = mesh.samples[..count].iter().map(|s| s.position);
    let low = positions.clone().fold(DVec3::INFINITY, DVec3::min);
    let size =
        (positions.clone().fold(DVec3::NEG_INFINITY, DVec3::max) - low).max_element().max(f64::MIN_POSITIVE);
    let mut order: Vec<(u64, u32)> =
        positions.enumerate().map(|(i, p)| (morton((p - low) / size), i as u32)).collect();
    order.sort_unstable();
    (order.chunks(CLUSTER_SIZE))
        .map(|chunk| {
            let samples: Vec<SampleId> = chunk.iter().map(|&(_, i)| SampleId::new(i as usize)).collect();
            let points =
                samples.iter().flat_map(|&s| Side::BOTH.map(|side| mesh.sample(s).receiver(side).position));
            let low = points.clone().fold(DVec3::INFINITY, DVec3::min);
            let high = points.fold(DVec3::NEG_INFINITY, DVec3::max);
            Cluster { samples, low, high }
        })
        .collect()
}

/// Interleaves 21 bits of each coordinate of a point in the unit cube.
fn morton(p: DVec3) -> u64 {
    let spread = |v: f64| {
        let mut x = (v * 2_097_151.0) as u64 & 0x1F_FFFF;
        for (shift, mask) in [
            (32, 0x1F_0000_0000_FFFF),
            (16, 0x1F_0000_FF00_00FF),
            (8, 0x100F_00F0_0F00_F00F),
            (4, 0x10C3_0C30_C30C_30C3),
            (2, 0x1249_2492_4924_9249),
        ] {
            x = (x | (x << shift)) & mask;
        }
        x
    };
    spread(p.x) | (spread(p.y) << 1) | (spread(p.z) << 2)
}

impl FormFactors<'_> {
    /// The form factors of all samples of a cluster, in its order.
    pub(crate) fn of_cluster(
        &self,
        mesh: &Mesh,
        cluster: &Cluster,
        source: &ConvexPolygon,
        weight: f64,
        workspace: &mut Workspace,
    ) -> Vec<FormFactorPair> {
        let mut pairs = vec![[0.0; 2]; cluster.samples.len()];
        // Most clusters lie behind a source or face away from it.
        let receivers = cluster.samples.iter().map(|&s| Side::BOTH.map(|side| mesh.sample(s).receiver(side)));
        if !receivers.clone().flatten().any(|receiver| faces(&receiver, source)) {
            return pairs;
        }
        let mut shared = std::mem::take(&mut workspace.shared);
        let shaft = Shaft::new(&box_corners(cluster.low, cluster.high), &BOX_EDGES, source, None);
        let candidates = self.candidates(&shaft, &mut shared);
        for ((pair, receivers), &sample) in pairs.iter_mut().zip(receivers).zip(&cluster.samples) {
            for (k, receiver) in receivers.iter().enumerate() {
                let seed = 2 * sample.index() as u64 + k as u64;
                pair[k] = self.visible(receiver, source, candidates, weight, seed, workspace).value as f32;
            }
        }
        workspace.shared = shared;
        pairs
    }
}
