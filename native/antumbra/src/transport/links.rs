//! Links between nodes that exchange light as one (Hanrahan, Salzman, Aupperle 1991): as coarse as the wanted error
//! allows, each for both directions, so that reciprocity is exact.
//!
//! Whether two nodes see each other is computed like everything else: exactly from points of the smaller one to the
//! polygon of the larger; by counted rays between clusters. A link knows by how much its form factor varies over its
//! ends, and so what taking one value for all of them errs by; links that err too much give way to links between parts.

use glam::DVec3;
use rayon::prelude::*;

use crate::transport::form_factors::{FormFactors, Workspace};
use crate::transport::gather::rms;
use crate::transport::hierarchy::{Hierarchy, NodeId};
use crate::transport::link_estimate::{Estimate, Outcome};
use crate::transport::overlay::Received;

/// Two nodes that exchange light.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    pub(crate) ends: [NodeId; 2],
    /// Form factor from either end to the other times its area, m²: the same both ways.
    pub(crate) exchange: f64,
    /// How much the form factor from each end to the other varies over it.
    pub(super) varies: [f64; 2],
    /// Share of that which comes out as an error.
    pub(super) felt: f64,
}

/// The light of all nodes, as far as it is known.
#[derive(Debug, Default, Clone)]
pub(crate) struct NodeLight {
    /// Mean radiosity, W/m².
    pub(crate) radiosity: Vec<DVec3>,
    /// Largest difference between a part's radiosity and the node's, W/m².
    pub(crate) spread: Vec<DVec3>,
    /// Mean reflectance.
    pub(crate) reflectance: Vec<DVec3>,
}

impl NodeLight {
    /// Tells all nodes the light of the leaves below them.
    ///
    /// Per node, of leaves: `radiosity`, and `direct`, which tells by how much that differs within one.
    pub(super) fn of_leaves(hierarchy: &Hierarchy, radiosity: &[DVec3], direct: &[Received]) -> Self {
        let nodes = &hierarchy.nodes;
        let mut light = Self {
            radiosity: radiosity.to_vec(),
            spread: vec![DVec3::ZERO; nodes.len()],
            reflectance: vec![DVec3::ZERO; nodes.len()],
        };
        for (index, node) in nodes.iter().enumerate().rev() {
            if let Some(surface) = hierarchy.surface(node) {
                light.reflectance[index] = surface.reflectance;
            }
            if node.is_leaf() {
                let Received { least, most, .. } = direct[index];
                let difference = if least.is_finite() { most - least } else { DVec3::ZERO };
                light.spread[index] = 0.5 * light.reflectance[index] * difference;
                continue;
            }
            let mean = |values: &[DVec3]| {
                node.parts.iter().map(|part| nodes[part.index()].area * values[part.index()]).sum::<DVec3>()
                    / node.area
            };
            light.radiosity[index] = mean(&light.radiosity);
            light.reflectance[index] = mean(&light.reflectance);
            let here = light.radiosity[index];
            light.spread[index] = (node.parts.iter())
                .map(|part| (light.radiosity[part.index()] - here).abs() + light.spread[part.index()])
                .fold(DVec3::ZERO, DVec3::max);
        }
        light
    }

    pub(super) fn is_dark(&self, id: NodeId) -> bool {
        self.radiosity[id.index()] == DVec3::ZERO && self.spread[id.index()] == DVec3::ZERO
    }

    /// Parts that were just made have the light of the whole.
    fn inherit(&mut self, hierarchy: &Hierarchy, id: NodeId) {
        for _ in &hierarchy.node(id).parts {
            self.radiosity.push(self.radiosity[id.index()]);
            self.spread.push(0.5 * self.spread[id.index()]);
            self.reflectance.push(self.reflectance[id.index()]);
        }
    }
}

/// How fine links should be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wanted {
    /// The error that the user wants, W/m².
    pub(crate) error: f64,
    /// What a link may err by, W/m² times the root of the area where it is felt.
    pub(crate) per_link: f64,
    /// Most links.
    pub(crate) most: usize,
}

/// All links of a scene.
#[derive(Debug, Default)]
pub(crate) struct Links {
    pub(crate) links: Vec<Link>,
    /// Pairs in the dark: not worth a look until one of them is lit.
    dark: Vec<[NodeId; 2]>,
}

/// Share of what a link's form factor varies by, over an end, that comes out as an error elsewhere: the mean over the end
/// is right, and whoever gathers from it sees all of it.
pub(super) const OF_VARIATION: f64 = 0.1;

/// Sides of surfaces from which on pairs of clusters are linked by what they may err by alone. With fewer, all pairs that
/// are near or in part face away are told apart down to their surfaces, which grows with their square.
const CROWDED: usize = 40_000;

/// Parts that an end is divided into, at most.
const MOST_PARTS: usize = 4;

/// Pairs that are looked at before what they give way to is.
const AT_ONCE: usize = 1 << 16;

impl Links {
    /// The pair of the whole scene with itself.
    pub(crate) fn new(hierarchy: &Hierarchy) -> Self {
        let root = (!hierarchy.nodes.is_empty()).then(|| [NodeId::new(0); 2]);
        Self { links: Vec::new(), dark: root.into_iter().collect() }
    }

    /// Refines until no link errs by more than is wanted, or there are too many, or it ends. New parts are made where
    /// that takes it.
    pub(crate) fn refine(
        &mut self,
        hierarchy: &mut Hierarchy,
        light: &mut NodeLight,
        form_factors: &FormFactors,
        wanted: Wanted,
        ends: &(dyn Fn() -> bool + Sync),
    ) {
        let Wanted { error: wanted_error, per_link: tolerance, most } = wanted;
        let mut pairs: Vec<[NodeId; 2]> = std::mem::take(&mut self.dark);
        for (link, end) in self.take_coarse(hierarchy, light, wanted) {
            push_parts(link.ends, end, hierarchy, light, &mut pairs);
        }
        // What faces away must get nothing where it can be afforded: it would take light out of the room.
        let crowded = hierarchy.surfaces.len() > CROWDED;
        // Some at a time, the last ones first, so that few wait.
        while !pairs.is_empty() {
            let now = pairs.split_off(pairs.len().saturating_sub(AT_ONCE));
            let estimate = Estimate { hierarchy, form_factors, light, wanted_error, tolerance, crowded };
            let outcomes: Vec<Outcome> = (now.par_iter().with_min_len(16))
                .map_init(Workspace::default, |workspace, &pair| {
                    if ends() { Outcome::Nothing } else { estimate.of(pair, workspace) }
                })
                .collect();
            let full = self.links.len() + outcomes.len() > most;
            for (pair, outcome) in now.into_iter().zip(outcomes) {
                match outcome {
                    Outcome::Nothing => {}
                    Outcome::Dark => self.dark.push(pair),
                    Outcome::Divide(end) => push_parts(pair, end, hierarchy, light, &mut pairs),
                    Outcome::Linked(link) => {
                        match too_coarse(&link, hierarchy, light, tolerance).filter(|_| !full) {
                            Some(TooCoarse { end, .. }) => {
                                push_parts(pair, end, hierarchy, light, &mut pairs);
                            }
                            None => self.links.push(link),
                        }
                    }
                }
            }
        }
    }

    /// Takes out the links that err by more than is wanted, each with the end to divide; when their parts would be too many,
    /// those that err most.
    fn take_coarse(
        &mut self,
        hierarchy: &Hierarchy,
        light: &NodeLight,
        wanted: Wanted,
    ) -> Vec<(Link, usize)> {
        let links = std::mem::take(&mut self.links);
        let judged: Vec<Option<TooCoarse>> =
            links.par_iter().map(|link| too_coarse(link, hierarchy, light, wanted.per_link)).collect();
        let mut all: Vec<f64> = judged.iter().flatten().map(|coarse| coarse.error).collect();
        let room = wanted.most.saturating_sub(links.len()) / (MOST_PARTS - 1);
        let fits = all.len() <= room;
        let least = if fits { 0.0 } else { *all.select_nth_unstable_by(room, |a, b| b.total_cmp(a)).1 };
        let mut coarse = Vec::with_capacity(all.len().min(room));
        for (link, judged) in links.into_iter().zip(judged) {
            match judged.filter(|coarse| coarse.error > least) {
                Some(TooCoarse { end, .. }) => coarse.push((link, end)),
                None => self.links.push(link),
            }
        }
        coarse
    }
}

/// A link that errs by more than is wanted.
pub(super) struct TooCoarse {
    /// W/m² times the root of the area where it is felt.
    error: f64,
    /// Which to divide: the one that errs most, if it can be; otherwise the other.
    pub(super) end: usize,
}

/// By how much a link errs, if that is too much and one of its ends can be divided.
pub(super) fn too_coarse(
    link: &Link,
    hierarchy: &Hierarchy,
    light: &NodeLight,
    tolerance: f64,
) -> Option<TooCoarse> {
    let errors = errors(link, hierarchy, light);
    let error = errors[0].hypot(errors[1]);
    if error <= tolerance {
        return None;
    }
    let first = usize::from(errors[1] > errors[0]);
    let end = [first, 1 - first].into_iter().find(|&end| hierarchy.is_divisible(link.ends[end]))?;
    Some(TooCoarse { error, end })
}

/// What comes of taking one value for all of an end, for each end: the rms error of irradiance times the root of the
/// area where it is felt, W/m. (Not of radiosity: what black surfaces take must be right for others to get the rest.)
fn errors(link: &Link, hierarchy: &Hierarchy, light: &NodeLight) -> [f64; 2] {
    let nodes = link.ends.map(|end| hierarchy.node(end));
    let distance = nodes[0].centre.distance(nodes[1].centre);
    std::array::from_fn(|k| {
        let (here, there) = (link.ends[k].index(), link.ends[1 - k].index());
        let (node, other) = (nodes[k], nodes[1 - k]);
        // It receives unevenly
        let received = rms(light.radiosity[there]) * link.varies[k];
        // It sends unevenly, to where its parts are not seen alike
        let change = (2.0 * node.radius / distance).min(1.0);
        let sent = rms(light.spread[here]) * (link.exchange / other.area) * change;
        link.felt * received * node.area.sqrt() + OF_VARIATION * sent * other.area.sqrt()
    })
}

/// Replaces a pair by the pairs of an end's parts with the other end.
fn push_parts(
    pair: [NodeId; 2],
    end: usize,
    hierarchy: &mut Hierarchy,
    light: &mut NodeLight,
    pairs: &mut Vec<[NodeId; 2]>,
) {
    let whole = pair[end];
    if hierarchy.node(whole).is_leaf() && hierarchy.divide(whole) {
        light.inherit(hierarchy, whole);
    }
    let parts = &hierarchy.node(whole).parts;
    if pair[0] == pair[1] {
        for (k, &one) in parts.iter().enumerate() {
            pairs.extend(parts[k..].iter().map(|&other| [one, other]));
        }
    } else {
        pairs.extend(parts.iter().map(|&part| if end == 0 { [part, pair[1]] } else { [pair[0], part] }));
    }
}
