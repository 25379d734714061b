//! Visible form factors from many samples to one source: exact where it pays, by counted rays in a crowd.
//!
//! Samples are gathered in clusters of neighbours (`clusters`); one shaft per cluster finds the polygons that could block any
//! of them (`narrowing`). Most shafts are empty.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use smallvec::SmallVec;

use crate::transport::clusters::Clustered;
use crate::visibility::blockers::{Blockers, TooMany};
use crate::visibility::rays::ShadowRays;
use crate::visibility::shaft::Shaft;
use crate::visibility::{
    ConvexPolygon, Receiver, Scratch, Weight, grey, unoccluded_form_factor, unoccluded_weighted,
    visible_weighted,
};

/// Candidates of a cluster's shaft beyond which every sample asks for its own: each candidate costs every sample of
/// the cluster about 10 ns to reject.
const MOST_SHARED: usize = 96;

/// Candidates up to which the exact form factor is always used; it then costs less than four rays.
pub(super) const ALWAYS_EXACT: usize = 16;

/// As many rays cost no more than asking for a receiver's own candidates, and are used at once.
const FEW_RAYS: u32 = 2;

/// Candidates up to which the exact form factor is used where the source matters: 64 blockers that all matter cost
/// 25 to 37 µs, as much as 30 to 60 rays; beyond, a point's cost grows faster than the rays'.
const MOST_EXACT: usize = 96;

/// Rays after which no more are asked when all agree: they miss a share of 4 % every other time, one of 25 % in a hundred.
const PROBE_RAYS: u32 = 16;

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
    /// Of what nothing opaque hides.
    pub(crate) value: f64,
    /// Share of that light, per channel, that gets through what lets some of it through.
    pub(crate) filter: DVec3,
    pub(crate) noise: f64,
}

impl Found {
    /// Of all light of any channel, with its share.
    pub(super) fn of(value: f64, filter: DVec3, noise: f64) -> Self {
        Self { value, filter, noise }
    }

    /// The form factor per channel.
    pub(crate) fn coloured(&self) -> DVec3 {
        self.value * self.filter
    }

    /// The same over the channels.
    pub(crate) fn grey(&self) -> f64 {
        self.value * grey(self.filter)
    }
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
    open: AtomicU64,
    pairs: AtomicU64,
    away: AtomicU64,
}

/// What is not looked at, since it would change nothing.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shortcuts {
    /// Nothing hides anything from anything: nobody asks what may come between.
    pub(crate) nothing_hides: bool,
    /// Groups of receivers that face away from a source are put to it all the same, one by one.
    pub(crate) look_behind: bool,
}

/// Scratch space of one thread.
#[derive(Default)]
pub(crate) struct Workspace {
    kernel: Scratch,
    own: Vec<u32>,
    pub(crate) shared: Vec<u32>,
    /// What was narrowed down for a cluster, one list after the other.
    pub(super) narrowed: Vec<u32>,
    /// Sources that a cluster was put to, and those that it faces away from.
    pairs: [u64; 2],
    /// Sources that were looked for from a cluster, and those that a single polygon hides from it.
    pub(super) screened: [u64; 2],
}

/// What may come between a cluster and a source, for the parts of the source to take over.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Narrowed {
    /// Too much, or nobody asked.
    Unknown,
    /// A part of [`Workspace::narrowed`].
    Known { start: u32, end: u32 },
}

impl Workspace {
    /// Forgets what was narrowed down for another cluster.
    pub(crate) fn next_cluster(&mut self) {
        self.narrowed.clear();
    }
}

/// Evaluates form factors in one scene.
pub(crate) struct FormFactors<'a> {
    pub(crate) blockers: &'a Blockers,
    pub(super) shortcuts: Shortcuts,
    counters: Arc<Counters>,
}

impl<'a> FormFactors<'a> {
    pub(crate) fn new(blockers: &'a Blockers, shortcuts: Shortcuts) -> Self {
        Self { blockers, shortcuts, counters: Arc::default() }
    }

    /// The same among other blockers, counted together.
    pub(crate) fn among<'b>(&self, blockers: &'b Blockers) -> FormFactors<'b> {
        let shortcuts = Shortcuts { nothing_hides: false, ..self.shortcuts };
        FormFactors { blockers, shortcuts, counters: Arc::clone(&self.counters) }
    }

    /// How many clusters of receivers were put to a source, and how many of these face away from it.
    pub(crate) fn pairs(&self) -> [u64; 2] {
        [&self.counters.pairs, &self.counters.away].map(|count| count.load(Ordering::Relaxed))
    }

    /// Counts what a cluster was put to.
    pub(crate) fn count_pairs(&self, workspace: &mut Workspace) {
        let [pairs, away] = std::mem::take(&mut workspace.pairs);
        self.counters.pairs.fetch_add(pairs, Ordering::Relaxed);
        self.counters.away.fetch_add(away, Ordering::Relaxed);
        self.blockers.count_screened(std::mem::take(&mut workspace.screened));
    }

    /// Whether light can go from a source to any member of a cluster.
    pub(super) fn may_light(&self, at: Clustered, source: &ConvexPolygon, workspace: &mut Workspace) -> bool {
        workspace.pairs[0] += 1;
        if at.faces(source) {
            return true;
        }
        workspace.pairs[1] += 1;
        self.shortcuts.look_behind
    }

    /// How many form factors were exact, how many were sampled, the rays that took, and how many of the exact ones had
    /// nothing before their source.
    pub(crate) fn counts(&self) -> [u64; 4] {
        let Counters { exact, sampled, rays, open, .. } = &*self.counters;
        [exact, sampled, rays, open].map(|count| count.load(Ordering::Relaxed))
    }

    /// Collects what may come between receiver points and a source.
    pub(crate) fn candidates<'w>(
        &self,
        shaft: impl FnOnce() -> Shaft,
        found: &'w mut Vec<u32>,
    ) -> Candidates<'w> {
        if self.shortcuts.nothing_hides {
            return Candidates::Shared(&[]);
        }
        match self.blockers.hiding(&shaft(), MOST_SHARED, found) {
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
        self.visible_weighted(receiver, source, None, candidates, weight, seed, workspace)
    }

    /// The same, with every direction times its `worth`.
    #[expect(clippy::too_many_arguments, reason = "as above, and one that hardly any source has")]
    pub(crate) fn visible_weighted(
        &self,
        receiver: &Receiver,
        source: &ConvexPolygon,
        worth: Option<Weight>,
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
            let blocking = self.blockers.blocking();
            let found = visible_weighted(receiver, source, worth, blocking, candidates, kernel).ok()?;
            self.counters.exact.fetch_add(1, Ordering::Relaxed);
            if candidates.is_empty() {
                self.counters.open.fetch_add(1, Ordering::Relaxed);
            }
            Some(Found::of(found.value, found.filter, 0.0))
        };
        if let Candidates::Shared(shared) = candidates
            && shared.len() <= ALWAYS_EXACT
            && let Some(found) = exact(shared, kernel)
        {
            return found;
        }
        // In a crowd, look at this receiver's own pyramid, unless a few rays are good enough.
        let unoccluded = unoccluded_weighted(receiver, source, worth);
        let count = rays_for(weight * unoccluded);
        if count > FEW_RAYS {
            let shaft =
                Shaft::new(&[receiver.position], &[], source, Some((receiver.position, receiver.normal)));
            let limit = ALWAYS_EXACT.max((count as usize).min(MOST_EXACT));
            if self.blockers.hiding(&shaft, limit, own).is_ok()
                && let Some(found) = exact(own, kernel)
            {
                return found;
            }
        }
        self.counters.sampled.fetch_add(1, Ordering::Relaxed);
        // Most receivers see all of a source or nothing, which a few rays tell; the others ask for all.
        let mut rays = ShadowRays::new(receiver, source, self.blockers, seed);
        rays.send(count.min(PROBE_RAYS));
        if rays.share().max_element() > 0.0 && rays.share().min_element() < 1.0 {
            rays.send(count);
        }
        let (asked, shares) = (rays.sent(), rays.share());
        let share = grey(shares);
        self.counters.rays.fetch_add(u64::from(asked), Ordering::Relaxed);
        // Rays that all agree may still all be wrong: the next one would have disagreed one time in so many.
        let doubt = (share * (1.0 - share)).max(0.25 / f64::from(asked)).sqrt();
        let noise = 2.0 * RAY_ERROR * doubt * f64::from(asked).powf(-0.75);
        let filter = if share > 0.0 { shares / share } else { DVec3::ONE };
        Found::of(unoccluded * share, filter, unoccluded * noise)
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

impl FormFactors<'_> {
    /// The visible and the unoccluded form factor of points of a polygon.
    ///
    /// `seed`: fixes the rays, when there are any.
    pub(crate) fn of_points(
        &self,
        polygon: &ConvexPolygon,
        receivers: &[Receiver],
        source: &ConvexPolygon,
        weight: f64,
        seed: u64,
        workspace: &mut Workspace,
    ) -> SmallVec<[(f64, f64); 16]> {
        let mut shared = std::mem::take(&mut workspace.shared);
        let hull = polygon.vertices();
        let edges: SmallVec<[[usize; 2]; 4]> = (0..hull.len()).map(|k| [k, (k + 1) % hull.len()]).collect();
        let shaft = || Shaft::new(hull, &edges, source, Some((hull[0], polygon.normal())));
        let candidates = self.candidates(shaft, &mut shared);
        let values = (receivers.iter().enumerate())
            .map(|(k, receiver)| {
                let seed = seed.wrapping_mul(16).wrapping_add(k as u64);
                let visible = self.visible(receiver, source, candidates, weight, seed, workspace).grey();
                let open = match candidates {
                    Candidates::Shared([]) => visible,
                    _ if faces(receiver, source) => unoccluded_form_factor(receiver, source),
                    _ => 0.0,
                };
                (visible, open)
            })
            .collect();
        workspace.shared = shared;
        values
    }

    /// Counts a point that was visible or not.
    pub(crate) fn count_point(&self) {
        self.counters.exact.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts a source that nothing could block.
    pub(crate) fn count_open(&self) {
        self.counters.exact.fetch_add(1, Ordering::Relaxed);
        self.counters.open.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts shadow rays that stand for one exchange.
    pub(crate) fn count_rays(&self, rays: u64) {
        self.counters.sampled.fetch_add(1, Ordering::Relaxed);
        self.counters.rays.fetch_add(rays, Ordering::Relaxed);
    }
}
