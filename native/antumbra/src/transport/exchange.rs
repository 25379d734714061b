//! All links as one symmetric operator: radiosity of the leaves in, irradiance of the leaves out.
//!
//! Radiosity is averaged up the hierarchy, exchanged over the links, and what arrives is handed down (Hanrahan, Salzman,
//! Aupperle 1991: push and pull). With areas as weights the operator is its own transpose.
//!
//! What a leaf sends must arrive, but for what escapes, which rays tell: a row that sums to 1 - d where it should sum to 1
//! makes an error of d·rho/(1 - rho). Leaves therefore get factors, the same for sending and receiving, that make all
//! rows sum to their shares (Sinkhorn 1964; for symmetric matrices Ruiz 2001). Down as well as up: rows that sum to too
//! much and rows that sum to too little are equally many, and capping the former alone would lose light. None sums to
//! more than 1, so that the system has a solution.

use std::iter::Sum;
use std::ops::{AddAssign, Div, Mul};

use glam::DVec3;

use crate::monitor::Monitor;
use crate::transport::enclosure::Enclosure;
use crate::transport::hierarchy::{Hierarchy, Surface};
use crate::transport::links::Link;
use crate::visibility::grey;

/// Steps of the scaling. Each leaves about the square root of the defect that links of few points have; tens suffice.
const MOST_STEPS: usize = 300;

/// Defect of a row that cannot be told from rounding of its sum.
const CLOSED: f64 = 2e-15;

/// The same where light escapes, which is known from rays.
const OPEN: f64 = 1e-3;

/// A factor outside of this range does not correct a quadrature but hides a mistake.
const FACTORS: [f64; 2] = [0.25, 4.0];

/// What is exchanged: light of one channel, or of all of them at once.
pub(crate) trait Exchanged:
    Copy + Default + AddAssign + Sum + Mul<f64, Output = Self> + Div<f64, Output = Self>
{
}

impl Exchanged for f64 {}

impl Exchanged for DVec3 {}

/// The exchange of light between the leaves of a hierarchy.
pub(crate) struct Exchange<'a> {
    hierarchy: &'a Hierarchy,
    links: &'a [Link],
    /// Per node, used for leaves.
    factors: Vec<f64>,
}

impl<'a> Exchange<'a> {
    /// The exchange as it was estimated.
    pub(crate) fn new(hierarchy: &'a Hierarchy, links: &'a [Link]) -> Self {
        Self::with_factors(hierarchy, links, vec![1.0; hierarchy.nodes.len()])
    }

    /// The exchange with the factors of one that was restored.
    pub(crate) fn with_factors(hierarchy: &'a Hierarchy, links: &'a [Link], factors: Vec<f64>) -> Self {
        Self { hierarchy, links, factors }
    }

    /// Per node, of leaves: what restores its row sum.
    pub(crate) fn into_factors(self) -> Vec<f64> {
        self.factors
    }

    /// Restores the row sums to the shares that are caught, unless it is cancelled.
    pub(crate) fn restore(&mut self, enclosure: &Enclosure, monitor: &Monitor) {
        for _ in 0..MOST_STEPS {
            if monitor.is_cancelled() {
                break;
            }
            let sums = self.row_sums();
            let mut settled = true;
            // Of open spaces: the defect of all that is sent, and what that is.
            let (mut defect, mut sent) = (0.0, 0.0);
            for (index, &sum) in sums.iter().enumerate().filter(|(_, sum)| **sum > 0.0) {
                let Some(wanted) = enclosure.caught[index] else { continue };
                let factor = (self.factors[index] * (wanted / sum).sqrt()).clamp(FACTORS[0], FACTORS[1]);
                if enclosure.closed[index] {
                    settled &= (sum - wanted).abs() <= CLOSED;
                } else if factor != self.factors[index] {
                    // A factor at the end of its range will not get any better.
                    let area = self.hierarchy.nodes[index].area;
                    defect += area * (sum - wanted).abs();
                    sent += area * wanted;
                }
                self.factors[index] = factor;
            }
            if settled && defect <= OPEN * sent {
                break;
            }
        }
    }

    /// What share of what a leaf sends arrives at anything that stops it.
    fn row_sums(&self) -> Vec<f64> {
        let stops = |surface: Option<&Surface>| surface.map_or(1.0, |surface| grey(surface.stops));
        let nodes = self.hierarchy.nodes.iter();
        let ones: Vec<f64> = nodes.map(|node| stops(self.hierarchy.surface(node))).collect();
        self.apply(&ones)
    }

    /// Irradiance of every leaf. Other entries have no meaning, and those of `radiosity` do not matter. W/m².
    pub(crate) fn apply<T: Exchanged>(&self, radiosity: &[T]) -> Vec<T> {
        let nodes = &self.hierarchy.nodes;
        let mut sent = vec![T::default(); nodes.len()];
        for (index, node) in nodes.iter().enumerate().rev() {
            sent[index] = if node.is_leaf() {
                radiosity[index] * self.factors[index]
            } else {
                node.parts.iter().map(|part| sent[part.index()] * nodes[part.index()].area).sum::<T>()
                    / node.area
            };
        }
        let mut arrived = vec![T::default(); nodes.len()];
        for Link { ends: [a, b], exchange, .. } in self.links {
            let (a, b) = (a.index(), b.index());
            arrived[a] += sent[b] * (exchange / nodes[a].area);
            arrived[b] += sent[a] * (exchange / nodes[b].area);
        }
        for (index, node) in nodes.iter().enumerate() {
            let here = arrived[index];
            if node.is_leaf() {
                arrived[index] = here * self.factors[index];
            } else {
                node.parts.iter().for_each(|part| arrived[part.index()] += here);
            }
        }
        arrived
    }
}
