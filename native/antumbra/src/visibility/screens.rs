//! What a single polygon hides: behind the wall of a room there is nothing to look for of the lamps in it.
//!
//! A blocker that hides all corners of a convex body from all corners of another hides all of the one from all of the
//! other, since all three are convex. So sources are first left out for many receivers at once, then for fewer: in a
//! building of many rooms each group is left with the sources of a few.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;

use crate::visibility::blockers::Blockers;
use crate::visibility::hides;
use crate::visibility::shaft::box_corners;

/// Receivers, by the lowest and highest corner of what they lie in.
pub(crate) type Bounds = (DVec3, DVec3);

/// What holds all of a source; nothing where no polygon can be told to hide it.
pub(crate) type Body = Option<SmallVec<[DVec3; 8]>>;

/// Fewer sources are looked at one by one anyway.
const FEWEST: usize = 4;

/// Groups of receivers from which a source is looked for at once, by how many; then for each by itself. Neighbours follow
/// each other.
const AT_ONCE: [usize; 2] = [64, 8];

/// How much was found to be hidden; sums do not depend on the order.
#[derive(Debug, Default)]
pub(super) struct Screening {
    /// Nobody is to look.
    pub(super) is_off: bool,
    asked: AtomicU64,
    hidden: AtomicU64,
}

impl Screening {
    /// Sources times groups of receivers, and how many of these pairs a single polygon parts.
    pub(super) fn counts(&self) -> [u64; 2] {
        [&self.asked, &self.hidden].map(|count| count.load(Ordering::Relaxed))
    }

    /// Adds pairs, and how many of them are parted.
    pub(super) fn count(&self, [asked, hidden]: [u64; 2]) {
        self.asked.fetch_add(asked, Ordering::Relaxed);
        self.hidden.fetch_add(hidden, Ordering::Relaxed);
    }
}

/// Per group of receivers: the sources that no single polygon hides from all of it.
pub(crate) struct Unscreened {
    /// Where in `sources` those of each group begin, and where the last end; nothing when all see all.
    starts: Vec<u32>,
    sources: Vec<u32>,
    all: Vec<u32>,
}

impl Unscreened {
    /// Looks for what hides sources from groups of receivers.
    pub(crate) fn new(blockers: &Blockers, groups: &[Bounds], sources: &[Body]) -> Self {
        let all: Vec<u32> = (0..sources.len() as u32).collect();
        if sources.len() < FEWEST || !blockers.looks_for_screens() {
            return Self { starts: Vec::new(), sources: Vec::new(), all };
        }
        let parts: Vec<Vec<Vec<u32>>> = (groups.par_chunks(AT_ONCE[0]))
            .map(|groups| {
                let left = left(blockers, whole(groups), sources, &all);
                let few = groups.chunks(AT_ONCE[1]).flat_map(|groups| {
                    let left = self::left(blockers, whole(groups), sources, &left);
                    groups.iter().map(move |&group| self::left(blockers, group, sources, &left))
                });
                few.collect()
            })
            .collect();
        let mut found = Self { starts: Vec::with_capacity(groups.len() + 1), sources: Vec::new(), all };
        for left in parts.iter().flatten() {
            found.starts.push(found.sources.len() as u32);
            found.sources.extend(left);
        }
        found.starts.push(found.sources.len() as u32);
        let asked = (groups.len() * sources.len()) as u64;
        blockers.screening.count([asked, asked - found.sources.len() as u64]);
        found
    }

    /// The sources that a group may see, in order.
    pub(crate) fn of(&self, group: usize) -> &[u32] {
        match self.starts.get(group..group + 2) {
            Some(&[start, end]) => &self.sources[start as usize..end as usize],
            _ => &self.all,
        }
    }
}

/// Around all of them.
fn whole(groups: &[Bounds]) -> Bounds {
    let around = |(low, high): Bounds, group: &Bounds| (low.min(group.0), high.max(group.1));
    groups.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), around)
}

/// Of some sources, those that are not hidden from a group.
fn left(blockers: &Blockers, (low, high): Bounds, sources: &[Body], some: &[u32]) -> Vec<u32> {
    let corners = box_corners(low, high);
    let is_left = |&source: &u32| {
        sources[source as usize].as_ref().is_none_or(|body| !is_screened(blockers, &corners, body))
    };
    some.iter().copied().filter(is_left).collect()
}

/// Whether one polygon hides all of a body from all of another. Only those between their middles are asked.
pub(crate) fn is_screened(blockers: &Blockers, from: &[DVec3], to: &[DVec3]) -> bool {
    let middle = |corners: &[DVec3]| corners.iter().sum::<DVec3>() / corners.len() as f64;
    blockers.is_crossed(middle(from), middle(to), |index| screens(blockers, index, from, to))
}

/// Whether a polygon hides all of a convex body from all of another.
pub(crate) fn screens(blockers: &Blockers, polygon: u32, from: &[DVec3], to: &[DVec3]) -> bool {
    let hides = |from: DVec3, to: DVec3| hides(&blockers.polygons()[polygon as usize], from, to - from);
    blockers.blocking().is_opaque(polygon) && from.iter().all(|&from| to.iter().all(|&to| hides(from, to)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::ConvexPolygon;

    /// A wall at x = 0, 2 m wide and high about the origin.
    fn wall() -> Blockers {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let corners = corners.map(|[y, z]| DVec3::new(0.0, y, z));
        Blockers::opaque(vec![ConvexPolygon::new(&corners).expect("a square has an area")], 4.0)
    }

    fn body(middle: DVec3, half: f64) -> SmallVec<[DVec3; 8]> {
        box_corners(middle - half, middle + half).into_iter().collect()
    }

    #[test]
    fn a_source_is_left_out_only_where_one_polygon_hides_all_of_it() {
        let at = DVec3::new;
        let group = |x: f64, y: f64| (at(x, y, 0.0) - 0.1, at(x, y, 0.0) + 0.1);
        let sources = [
            Some(body(at(1.0, 0.0, 0.0), 0.1)),
            // Behind the wall and larger than it, farther out than it, before it, and anywhere
            Some(body(at(2.5, 0.0, 0.0), 1.9)),
            Some(body(at(1.0, 2.5, 0.0), 0.1)),
            Some(body(at(-1.0, 0.5, 0.0), 0.1)),
            None,
        ];
        let groups = [group(-1.0, 0.0), group(-1.0, 0.9), group(1.0, 0.5), group(-0.05, 0.0)];
        let found = Unscreened::new(&wall(), &groups, &sources);
        assert_eq!(found.of(0), [1, 2, 3, 4]);
        // Half of the way to the wall's border, all of a small source is still behind it
        assert_eq!(found.of(1), [1, 2, 3, 4]);
        assert_eq!(found.of(2), [0, 1, 2, 4]);
        // It lies across the wall
        assert_eq!(found.of(3), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn what_stands_between_many_groups_is_found_for_each_by_itself() {
        let sources: Vec<Body> =
            (0..5).map(|k| Some(body(DVec3::new(1.0, 0.0, 0.1 * f64::from(k)), 0.05))).collect();
        let groups: Vec<Bounds> = (0..200)
            .map(|k| {
                let middle = DVec3::new(if k % 2 == 0 { -1.0 } else { 1.0 }, 0.0, 0.001 * f64::from(k));
                (middle - 0.01, middle + 0.01)
            })
            .collect();
        let found = Unscreened::new(&wall(), &groups, &sources);
        for k in 0..groups.len() {
            assert_eq!(found.of(k).len(), if k % 2 == 0 { 0 } else { 5 }, "{k}");
        }
    }

    #[test]
    fn few_sources_are_all_left() {
        let found =
            Unscreened::new(&wall(), &[(DVec3::NEG_ONE, DVec3::NEG_ONE)], &[Some(body(DVec3::X, 0.1))]);
        assert_eq!(found.of(0), [0]);
    }
}
