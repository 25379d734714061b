//! Where no light escapes: spaces that are closed all around, and what is emitted into them.
//!
//! Found by rays, not by topology: rooms are put together from many objects, and what matters is what light meets. A leak
//! that all rays miss is treated as closed; it loses less light than one ray in [`RAYS`].

use glam::DVec3;

use crate::transport::hierarchy::Hierarchy;
use crate::transport::links::Link;
use crate::visibility::ConvexPolygon;
use crate::visibility::blockers::Blockers;
use crate::visibility::rays::{point_on, splitmix, unit};

/// Rays by which a space counts as closed.
const RAYS: u64 = 512;

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

/// Per node, whether it is a leaf of a closed space.
///
/// `lit`: per node; spaces without light are not asked.
pub(crate) fn closed(
    hierarchy: &Hierarchy,
    spaces: &[u32],
    lit: impl Fn(usize) -> bool,
    blockers: &Blockers,
) -> Vec<bool> {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); hierarchy.nodes.len()];
    let mut is_lit = vec![false; hierarchy.nodes.len()];
    for (index, node) in hierarchy.nodes.iter().enumerate().filter(|(_, node)| node.is_leaf()) {
        members[spaces[index] as usize].push(index as u32);
        is_lit[spaces[index] as usize] |= lit(index);
        debug_assert!(node.polygon().is_some());
    }
    let mut closed = vec![false; hierarchy.nodes.len()];
    for (space, members) in members.iter().enumerate().filter(|(space, _)| is_lit[*space]) {
        let polygons: Vec<&ConvexPolygon> =
            members.iter().filter_map(|&leaf| hierarchy.nodes[leaf as usize].polygon()).collect();
        // A leaf that nothing is linked to is a space of its own, and open.
        if polygons.len() > 1 && escaping(&polygons, blockers, space as u64) == 0 {
            for &leaf in members {
                closed[leaf as usize] = true;
            }
        }
    }
    closed
}

/// How many of [`RAYS`] rays, spread over polygons like their light, meet nothing.
pub(crate) fn escaping(polygons: &[&ConvexPolygon], blockers: &Blockers, seed: u64) -> u64 {
    let mut sum = 0.0;
    let sums: Vec<f64> = (polygons.iter())
        .map(|polygon| {
            sum += polygon.area();
            sum
        })
        .collect();
    (0..RAYS)
        .filter(|&ray| {
            let random = |k: u64| unit(splitmix(seed.wrapping_mul(0x51_7C_C1).wrapping_add(4 * ray + k)));
            let at = (ray as f64 + random(0)) / RAYS as f64 * sum;
            let polygon = polygons[sums.partition_point(|&before| before <= at).min(polygons.len() - 1)];
            let normal = polygon.normal();
            let start = point_on(polygon, [random(1), random(2)]) + LIFT * blockers.diagonal() * normal;
            let to = cosine_direction(normal, random(3), (ray as f64 * 0.618_033_988_749_894_9).fract());
            !blockers.blocks_segment(start, start + 2.0 * blockers.diagonal() * to)
        })
        .count() as u64
}

/// A direction above a plane, as often as light takes it (Malley).
fn cosine_direction(normal: DVec3, u: f64, v: f64) -> DVec3 {
    let (x, y) = normal.any_orthonormal_pair();
    let (sine, cosine) = (std::f64::consts::TAU * v).sin_cos();
    (u.sqrt() * (cosine * x + sine * y) + (1.0 - u).sqrt() * normal).normalize()
}
