//! How much light escapes: nothing from spaces that are closed all around.
//!
//! Found by rays, not by topology: rooms are put together from many objects, and what matters is what light meets. A leak
//! that all rays miss is treated as closed; it loses less light than one ray in [`RAYS`].

use glam::DVec3;
use rayon::prelude::*;

use crate::transport::hierarchy::{Hierarchy, NodeId};
use crate::transport::links::Link;
use crate::visibility::blockers::Blockers;
use crate::visibility::rays::{point_on, splitmix, unit};
use crate::visibility::{ConvexPolygon, grey};

/// Rays by which a space counts as closed.
pub(crate) const RAYS: u64 = 512;

/// Rays of one leaf, at least, unless all of them together would be more than so many: what the light of hundreds of
/// leaves errs by through theirs averages out.
const RAYS_OF_LEAF: u64 = 32;
const MOST_RAYS: u64 = 1 << 22;

/// Standard error, relative to what is caught, below which a space's rays tell more of its balance than light that is
/// interpolated over its surfaces.
const CERTAIN: f64 = 1e-3;

/// Step of a ray's start off its surface, in diagonals of the scene: above rounding, below all that is modelled.
const LIFT: f64 = 1e-9;

/// The leaves that exchange light with each other, directly or through others from which they are told apart, as a number
/// per node.
pub(crate) fn spaces(hierarchy: &Hierarchy, links: &[Link]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..hierarchy.nodes.len() as u32).collect();
    let mut linked = vec![false; hierarchy.nodes.len()];
    // Clusters may hold what is on different sides of a wall.
    let flat = |link: &&Link| link.ends.iter().all(|&end| hierarchy.node(end).polygon().is_some());
    for link in links.iter().filter(flat) {
        join(&mut parent, link.ends[0].index() as u32, link.ends[1].index() as u32);
        link.ends.iter().for_each(|end| linked[end.index()] = true);
    }
    for (index, node) in hierarchy.nodes.iter().enumerate() {
        for part in &node.parts {
            if linked[index] {
                linked[part.index()] = true;
                join(&mut parent, index as u32, part.index() as u32);
            }
        }
    }
    (0..parent.len() as u32).map(|node| root(&mut parent, node)).collect()
}

/// The smallest member of a set stands for it.
fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

fn root(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        parent[node as usize] = parent[parent[node as usize] as usize];
        node = parent[node as usize];
    }
    node
}

/// How much of what leaves send meets a surface.
pub(crate) struct Enclosure {
    /// Per node: of a leaf of a lit space, the share of its rays that meet something. Nothing for others.
    pub(crate) caught: Vec<Option<f64>>,
    /// Per node, whether it is a leaf of a lit space from which no ray escapes.
    pub(crate) closed: Vec<bool>,
    /// Per node, for a leaf: the space that it lies in, where the rays tell all that is caught there to [`CERTAIN`].
    pub(crate) certain: Vec<Option<u32>>,
}

impl Enclosure {
    /// Asks [`RAYS`] rays of every lit space, and at least [`RAYS_OF_LEAF`] of every leaf there.
    ///
    /// `lit`: per node; spaces without light are not asked. `known`: shares that were found before, per node.
    pub(crate) fn new(
        hierarchy: &Hierarchy,
        spaces: &[u32],
        lit: impl Fn(usize) -> bool,
        known: &[Option<f64>],
        blockers: &Blockers,
    ) -> Self {
        let nodes = hierarchy.nodes.len();
        let mut members = vec![0_u64; nodes];
        let mut is_lit = vec![false; nodes];
        for leaf in hierarchy.leaves().map(NodeId::index) {
            members[spaces[leaf] as usize] += 1;
            is_lit[spaces[leaf] as usize] |= lit(leaf);
        }
        let lit_spaces = || (0..nodes).filter(|&space| is_lit[space]);
        let asked: u64 = lit_spaces().map(|space| members[space]).sum();
        let of_leaf = RAYS_OF_LEAF.min(MOST_RAYS / asked.max(1)).max(1);
        // Small spaces by the thousands are leaves that only clusters are linked to.
        let of_space = RAYS.min(MOST_RAYS / (lit_spaces().count() as u64).max(1));
        let rays = |space: usize| of_space.div_ceil(members[space]).max(of_leaf);
        let caught: Vec<Option<f64>> = (0..nodes)
            .into_par_iter()
            .map(|index| {
                let node = &hierarchy.nodes[index];
                let space = spaces[index] as usize;
                let polygon = node.polygon().filter(|_| node.is_leaf() && is_lit[space])?;
                if let Some(Some(share)) = known.get(index) {
                    return Some(*share);
                }
                let rays = rays(space);
                Some(1.0 - escaping(polygon, rays, blockers, index as u64) / rays as f64)
            })
            .collect();
        // A leaf that nothing is linked to is a space of its own, and open.
        let mut is_closed: Vec<bool> = (0..nodes).map(|space| is_lit[space] && members[space] > 1).collect();
        for (index, share) in caught.iter().enumerate() {
            is_closed[spaces[index] as usize] &= share.is_none_or(|share| share == 1.0);
        }
        let closed = (0..nodes).map(|i| caught[i].is_some() && is_closed[spaces[i] as usize]).collect();
        let certain = certain(hierarchy, spaces, &caught, rays);
        Self { caught, closed, certain }
    }
}

/// The spaces of leaves of which it is certain how much is caught there.
fn certain(
    hierarchy: &Hierarchy,
    spaces: &[u32],
    caught: &[Option<f64>],
    rays: impl Fn(usize) -> u64,
) -> Vec<Option<u32>> {
    // Per space: what is caught of light that is the same everywhere, and its variance.
    let mut sums = vec![(0.0, 0.0); spaces.len()];
    for (index, share) in caught.iter().enumerate() {
        let Some(share) = *share else { continue };
        let space = spaces[index] as usize;
        let area = hierarchy.nodes[index].area;
        sums[space].0 += area * share;
        sums[space].1 += area * area * share * (1.0 - share) / rays(space) as f64;
    }
    (0..spaces.len())
        .map(|index| {
            let (sum, variance) = sums[spaces[index] as usize];
            (caught[index].is_some() && variance.sqrt() <= CERTAIN * sum).then_some(spaces[index])
        })
        .collect()
}

/// How many rays of a polygon, spread over it and its hemisphere like its light, meet nothing; of those that meet filters
/// the share that gets through.
pub(crate) fn escaping(polygon: &ConvexPolygon, rays: u64, blockers: &Blockers, seed: u64) -> f64 {
    let normal = polygon.normal();
    // Without a turn of its own, all parts of a wall would look in the same directions and miss the same leaks.
    let turn = unit(splitmix(!seed));
    (0..rays)
        .map(|ray| {
            let random = |k: u64| unit(splitmix(seed.wrapping_mul(0x51_7C_C1).wrapping_add(4 * ray + k)));
            let start = point_on(polygon, [random(1), random(2)]) + LIFT * blockers.diagonal() * normal;
            let height = (ray as f64 + random(0)) / rays as f64;
            let to = cosine_direction(normal, height, (turn + ray as f64 * 0.618_033_988_749_894_9).fract());
            grey(blockers.through_segment(start, start + 2.0 * blockers.diagonal() * to))
        })
        .sum()
}

/// A direction above a plane, as often as light takes it (Malley).
fn cosine_direction(normal: DVec3, u: f64, v: f64) -> DVec3 {
    let (x, y) = normal.any_orthonormal_pair();
    let (sine, cosine) = (std::f64::consts::TAU * v).sin_cos();
    (u.sqrt() * (cosine * x + sine * y) + (1.0 - u).sqrt() * normal).normalize()
}
