//! Links between nodes that exchange light as one (Hanrahan, Salzman, Aupperle 1991): as coarse as the wanted error
//! allows, each for both directions, so that reciprocity is exact.
//!
//! Whether two nodes see each other is computed like everything else: exactly from points of the smaller one to the
//! polygon of the larger; by counted rays between clusters. A link knows by how much its form factor varies over its
//! ends, and so what taking one value for all of them errs by; links that err too much give way to links between parts.

use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;

use crate::transport::form_factors::{FormFactors, Workspace};
use crate::transport::gather::rms;
use crate::transport::hierarchy::{Hierarchy, Node, NodeId, REPRESENTATIVES};
use crate::transport::quadrature::quadrature;
use crate::visibility::{ConvexPolygon, Receiver, grey, unoccluded_form_factor};

/// Two nodes that exchange light.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    pub(crate) ends: [NodeId; 2],
    /// Form factor from either end to the other times its area, m²: the same both ways.
    pub(crate) exchange: f64,
    /// How much the form factor from each end to the other varies over it.
    varies: [f64; 2],
    /// Share of that which comes out as an error.
    felt: f64,
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
    fn is_dark(&self, id: NodeId) -> bool {
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
const OF_VARIATION: f64 = 0.1;

/// The same where something may stand in between: points see it or not, and the mean over the end is as unsure as they
/// are few. And between clusters, whose representatives are fewer still.
const OF_PARTIAL: f64 = 0.3;
const OF_CLUSTERS: f64 = 0.5;

/// Clusters whose balls are farther apart than this many of their radii exchange light as their representatives do.
const APART: f64 = 1.5;

/// Size relative to distance up to which one point stands for a polygon, and up to which a rule of four does. The midpoint
/// rule errs by about a sixth of the square of the size, 0.4 % and, with four points, its square.
const ONE_POINT: f64 = 0.15;
const FOUR_POINTS: f64 = 0.6;

/// The kernel of a small polygon changes by about this much of itself times its radius over the distance.
const CHANGE: f64 = 4.0;

/// A polygon that all points see nothing of may still be seen in between by this share, until something smaller is asked.
const DOUBT: f64 = 0.1;

/// Sides of surfaces from which on pairs of clusters are linked by what they may err by alone. With fewer, all pairs that
/// are near or in part face away are told apart down to their surfaces, which grows with their square.
const CROWDED: usize = 40_000;

/// Pairs that are looked at before what they give way to is.
const AT_ONCE: usize = 1 << 16;

/// What became of a pair.
enum Outcome {
    /// They exchange nothing.
    Nothing,
    Dark,
    /// They are too near, or differ too much, to be estimated as they are: this end gives way to its parts.
    Divide(usize),
    Linked(Link),
}

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
        let mut kept = Vec::with_capacity(self.links.len());
        for link in std::mem::take(&mut self.links) {
            match to_divide(&link, hierarchy, light, tolerance) {
                Some(end) => push_parts(link.ends, end, hierarchy, light, &mut pairs),
                None => kept.push(link),
            }
        }
        self.links = kept;
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
                        match to_divide(&link, hierarchy, light, tolerance).filter(|_| !full) {
                            Some(end) => push_parts(pair, end, hierarchy, light, &mut pairs),
                            None => self.links.push(link),
                        }
                    }
                }
            }
        }
    }
}

/// The end of a pair that is a cluster; the larger one when both are.
fn larger_cluster(pair: [NodeId; 2], hierarchy: &Hierarchy) -> usize {
    let radius = |end: usize| {
        let node = hierarchy.node(pair[end]);
        if node.polygon().is_some() { -1.0 } else { node.radius }
    };
    usize::from(radius(1) > radius(0))
}

/// The larger end of a pair, or the other one when it cannot be divided.
fn larger(pair: [NodeId; 2], hierarchy: &Hierarchy) -> usize {
    let [one, other] = pair.map(|end| hierarchy.node(end).radius);
    let larger = usize::from(other > one);
    if hierarchy.is_divisible(pair[larger]) { larger } else { 1 - larger }
}

/// The end of a link that errs most, if that is too much and it can be divided; otherwise the other one.
fn to_divide(link: &Link, hierarchy: &Hierarchy, light: &NodeLight, tolerance: f64) -> Option<usize> {
    let errors = errors(link, hierarchy, light);
    if errors[0].hypot(errors[1]) <= tolerance {
        return None;
    }
    let first = usize::from(errors[1] > errors[0]);
    [first, 1 - first].into_iter().find(|&end| hierarchy.is_divisible(link.ends[end]))
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

/// What it takes to estimate an exchange.
struct Estimate<'a> {
    hierarchy: &'a Hierarchy,
    form_factors: &'a FormFactors<'a>,
    light: &'a NodeLight,
    /// W/m².
    wanted_error: f64,
    /// [`Wanted::per_link`].
    tolerance: f64,
    /// Whether clusters may be linked that touch, or face away in part.
    crowded: bool,
}

impl Estimate<'_> {
    fn of(&self, pair: [NodeId; 2], workspace: &mut Workspace) -> Outcome {
        let nodes = pair.map(|end| self.hierarchy.node(end));
        if pair[0] == pair[1] {
            let flat = nodes[0].polygon().is_some();
            return if flat || self.hardly_matters(pair) { Outcome::Nothing } else { Outcome::Divide(0) };
        }
        if !may_exchange(nodes[0], nodes[1]) || !may_exchange(nodes[1], nodes[0]) {
            return Outcome::Nothing;
        }
        if pair.iter().all(|&end| self.light.is_dark(end)) {
            return Outcome::Dark;
        }
        let seed = (pair[0].index() as u64) << 32 | pair[1].index() as u64;
        let link = if let (Some(one), Some(other)) = (nodes[0].polygon(), nodes[1].polygon()) {
            self.of_polygons(pair, [one, other], seed, workspace)
        } else {
            let reach = nodes[0].radius + nodes[1].radius;
            let apart = nodes[0].centre.distance(nodes[1].centre) >= APART * reach;
            return if self.crowded {
                if apart || self.hardly_matters(pair) {
                    self.of_clusters(pair, nodes)
                } else {
                    Outcome::Divide(larger(pair, self.hierarchy))
                }
            } else if apart && faces_wholly(nodes[0], nodes[1]) && faces_wholly(nodes[1], nodes[0]) {
                self.of_clusters(pair, nodes)
            } else {
                Outcome::Divide(larger_cluster(pair, self.hierarchy))
            };
        };
        link.map_or(Outcome::Nothing, Outcome::Linked)
    }

    /// Whether it is no error worth looking at if all light of each went to the other, or none.
    ///
    /// With F the form factor to something of area a, which is at most 1 and whose integral is at most a, the integral of
    /// F² is at most a, too: of the smaller one's area, for both.
    fn hardly_matters(&self, pair: [NodeId; 2]) -> bool {
        let area = pair.map(|end| self.hierarchy.node(end).area).into_iter().fold(f64::INFINITY, f64::min);
        let error = |k: usize| {
            let there = pair[1 - k].index();
            OF_CLUSTERS * rms(self.light.radiosity[there] + self.light.spread[there]) * area.sqrt()
        };
        self.crowded && error(0).hypot(error(1)) <= self.tolerance
    }

    /// Exactly, from points of the smaller polygon to the larger one.
    fn of_polygons(
        &self,
        pair: [NodeId; 2],
        polygons: [&ConvexPolygon; 2],
        seed: u64,
        workspace: &mut Workspace,
    ) -> Option<Link> {
        let nodes = pair.map(|end| self.hierarchy.node(end));
        let near = usize::from(nodes[1].radius < nodes[0].radius);
        let far = 1 - near;
        let (here, there) = (polygons[near], polygons[far]);
        let distance = nodes[0].centre.distance(nodes[1].centre);
        let gap = (distance - nodes[far].radius).max(0.25 * distance);
        let size = nodes[near].radius / gap;

        // From points of the smaller one
        let brightest = pair.iter().map(|end| rms(self.light.radiosity[end.index()])).fold(0.0, f64::max);
        let weight = if self.wanted_error > 0.0 { brightest / self.wanted_error } else { 0.0 };
        let order = 1 + usize::from(size > ONE_POINT) + usize::from(size > FOUR_POINTS);
        let points = quadrature(here, order);
        let receivers: SmallVec<[Receiver; 16]> =
            points.iter().map(|&(position, _)| Receiver::new(position, here.normal())).collect();
        let seen = self.form_factors.of_points(here, &receivers, there, weight, seed, workspace);
        let mut mean = 0.0;
        let mut unoccluded = 0.0;
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for ((value, open), (_, share)) in seen.iter().zip(&points) {
            mean += share * value;
            unoccluded += share * open;
            least = least.min(*value);
            most = most.max(*value);
        }
        if unoccluded == 0.0 {
            return None;
        }
        let visible = mean / unoccluded;
        // Points lie inside; corners see more of a difference.
        let sampled = 1.5 * (most - least);
        let smooth = visible * unoccluded * (CHANGE * size).min(1.0);
        let hidden = |form_factor: f64| {
            if visible == 1.0 {
                0.0
            } else {
                (visible * (1.0 - visible)).max(DOUBT * (1.0 - visible)) * form_factor
            }
        };
        let mut varies = [0.0; 2];
        varies[near] = if order == 1 { smooth } else { sampled }.max(hidden(unoccluded));
        // From the corners of the larger one, as if nothing blocked
        let share = nodes[near].area / nodes[far].area;
        varies[far] = (visible * variation(there, here)).max(hidden(unoccluded * share));
        if mean == 0.0 && varies == [0.0; 2] {
            return None;
        }
        let felt = if visible == 1.0 { OF_VARIATION } else { OF_PARTIAL };
        Some(Link { ends: pair, exchange: mean * here.area(), varies, felt })
    }

    /// From representatives to representatives, each by one ray.
    fn of_clusters(&self, pair: [NodeId; 2], nodes: [&Node; 2]) -> Outcome {
        let points = nodes.map(|node| self.hierarchy.representatives(node));
        let counts = points.each_ref().map(SmallVec::len);
        let nearest = 0.5 * (nodes[0].radius + nodes[1].radius);
        let mut kernels = [[0.0; REPRESENTATIVES]; REPRESENTATIVES];
        for (i, &(x, n)) in points[0].iter().enumerate() {
            for (j, &(y, m)) in points[1].iter().enumerate() {
                let to = y - x;
                // What is near is not nearer than it is large.
                let distance2 = to.length_squared().max(nearest * nearest);
                kernels[i][j] = n.dot(to).max(0.0) * (-m.dot(to)).max(0.0)
                    / (std::f64::consts::PI * distance2 * distance2);
            }
        }
        // What faces away would have its share of what its cluster gets: an error, too. No form factor is larger than
        // this, and a part that no representative stands for may have it.
        let distance = nodes[0].centre.distance(nodes[1].centre).max(nearest);
        let most = 1.0 / (std::f64::consts::PI * distance * distance);
        let wholly = faces_wholly(nodes[0], nodes[1]) && faces_wholly(nodes[1], nodes[0]);
        let unseen = if wholly { 0.0 } else { DOUBT * most };
        let link = |kernels: &[[f64; REPRESENTATIVES]; REPRESENTATIVES], hidden: f64| {
            let mut sums = [[0.0; REPRESENTATIVES]; 2];
            for i in 0..counts[0] {
                for j in 0..counts[1] {
                    sums[0][i] += kernels[i][j] / counts[1] as f64;
                    sums[1][j] += kernels[i][j] / counts[0] as f64;
                }
            }
            let varies = std::array::from_fn(|k| {
                let of = &sums[k][..counts[k]];
                let most = of.iter().copied().fold(0.0, f64::max);
                let least = of.iter().copied().fold(f64::INFINITY, f64::min);
                (most - least + DOUBT * hidden + unseen) * nodes[1 - k].area
            });
            let total: f64 = sums[0][..counts[0]].iter().sum();
            let exchange = nodes[0].area * nodes[1].area * total / counts[0] as f64;
            Link { ends: pair, exchange, varies, felt: OF_CLUSTERS }
        };
        let divides = |link: &Link| to_divide(link, self.hierarchy, self.light, self.tolerance);
        // No ray helps where they err too much by their shape alone.
        let whole = self.hardly_matters(pair);
        if let Some(end) = divides(&link(&kernels, 0.0)).filter(|_| !whole) {
            return Outcome::Divide(end);
        }
        let mut rays = 0;
        let mut hidden = 0.0;
        for (i, &(x, _)) in points[0].iter().enumerate() {
            for (j, &(y, _)) in points[1].iter().enumerate() {
                if kernels[i][j] > 0.0 {
                    rays += 1;
                    let through = grey(self.form_factors.blockers.between(x, y));
                    if through < 1.0 {
                        hidden += (1.0 - through) * kernels[i][j] / (counts[0] * counts[1]) as f64;
                        kernels[i][j] *= through;
                    }
                }
            }
        }
        if rays > 0 {
            self.form_factors.count_rays(rays);
        }
        let link = link(&kernels, hidden);
        match divides(&link).filter(|_| !whole) {
            Some(end) => Outcome::Divide(end),
            None if link.exchange == 0.0 => Outcome::Nothing,
            None => Outcome::Linked(link),
        }
    }
}

/// Whether any part of `other` may lie in front of any part of `node`.
fn may_exchange(node: &Node, other: &Node) -> bool {
    if let (Some(polygon), Some(other)) = (node.polygon(), other.polygon()) {
        let origin = polygon.vertices()[0];
        return other.vertices().iter().any(|&v| polygon.normal().dot(v - origin) > 0.0);
    }
    let to = other.centre - node.centre;
    let distance = to.length();
    let reach = node.radius + other.radius;
    if distance <= reach {
        return true;
    }
    let angle = (node.axis.dot(to) / distance).clamp(-1.0, 1.0).acos();
    angle - node.cone - (reach / distance).asin() < std::f64::consts::FRAC_PI_2
}

/// Whether all of a node faces all of another, which is apart.
fn faces_wholly(node: &Node, other: &Node) -> bool {
    let to = other.centre - node.centre;
    let distance = to.length();
    let reach = ((node.radius + other.radius) / distance).min(1.0);
    let angle = (node.axis.dot(to) / distance).clamp(-1.0, 1.0).acos();
    angle + node.cone + reach.asin() < std::f64::consts::FRAC_PI_2
}

/// How much the unblocked form factor to a source varies over a polygon.
fn variation(polygon: &ConvexPolygon, source: &ConvexPolygon) -> f64 {
    let centre = polygon.centroid();
    let at = |position| unoccluded_form_factor(&Receiver::new(position, polygon.normal()), source);
    let middle = at(centre);
    // Not quite at the corners: one that touches the source sees all of it or nothing.
    let corners = polygon.vertices().iter().map(|&v| at(v.lerp(centre, 0.1)));
    let (least, most) =
        corners.fold((middle, middle), |(least, most), value| (least.min(value), most.max(value)));
    most - least
}
