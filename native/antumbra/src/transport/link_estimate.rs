//! What two nodes exchange, and by how much that varies over them: exactly between polygons, by rays between clusters.

use smallvec::SmallVec;

use crate::transport::form_factors::{FormFactors, Workspace};
use crate::transport::gather::rms;
use crate::transport::hierarchy::{Hierarchy, Node, NodeId, REPRESENTATIVES};
use crate::transport::links::{Link, NodeLight, OF_VARIATION, too_coarse};
use crate::transport::quadrature::quadrature;
use crate::visibility::{ConvexPolygon, Receiver, grey, unoccluded_form_factor};

/// What [`OF_VARIATION`] is where something may stand in between: points see it or not, and the mean over the end is as unsure
/// as they are few. And between clusters, whose representatives are fewer still.
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

/// What became of a pair.
pub(super) enum Outcome {
    /// They exchange nothing.
    Nothing,
    Dark,
    /// They are too near, or differ too much, to be estimated as they are: this end gives way to its parts.
    Divide(usize),
    Linked(Link),
}

/// What it takes to estimate an exchange.
pub(super) struct Estimate<'a> {
    pub(super) hierarchy: &'a Hierarchy,
    pub(super) form_factors: &'a FormFactors<'a>,
    pub(super) light: &'a NodeLight,
    /// W/m².
    pub(super) wanted_error: f64,
    /// [`Wanted::per_link`].
    pub(super) tolerance: f64,
    /// Whether clusters may be linked that touch, or face away in part.
    pub(super) crowded: bool,
}

impl Estimate<'_> {
    /// What becomes of a pair.
    pub(super) fn of(&self, pair: [NodeId; 2], workspace: &mut Workspace) -> Outcome {
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
        let divides = |link: &Link| {
            too_coarse(link, self.hierarchy, self.light, self.tolerance).map(|coarse| coarse.end)
        };
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
