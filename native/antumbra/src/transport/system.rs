//! The radiosity equation over the leaves of a hierarchy, and its correction by what a finer look finds.

use glam::DVec3;

use crate::monitor::Monitor;
use crate::transport::conjugate_residuals::solve;
use crate::transport::enclosure::Enclosure;
use crate::transport::exchange::Exchange;
use crate::transport::hierarchy::Hierarchy;
use crate::transport::links::Link;

/// Light that was interpolated may hold this share more or less than was sent; more means that it was not all counted.
const INTERPOLATION: f64 = 0.05;

/// Residual, relative to what emitters bring, at which a solution is good: below what f32 colours can show of any
/// reflectance for which f64 can tell 1 - rho.
const RESIDUAL: f64 = 1e-11;

/// One equation with its solution; all lists are per node and have a meaning for leaves.
#[derive(Debug, Default)]
pub(crate) struct System {
    /// m²; 0 for what is no leaf, and for leaves that light goes through as if they were not there.
    areas: Vec<f64>,
    /// Share of what arrives, per channel, that ends there.
    stops: Vec<DVec3>,
    /// Whether all surfaces let as much through of every channel, as links do.
    colourless: bool,
    reflectance: Vec<DVec3>,
    /// [`Exchange::factors`].
    factors: Vec<f64>,
    /// [`Enclosure::certain`].
    certain: Vec<Option<u32>>,
    /// What emitters send where all of it stays in one closed space, W.
    emitted: Option<DVec3>,
    /// What emitters bring, W/m².
    arriving: Vec<DVec3>,
    /// What links get wrong, as far as it is known, W/m².
    missed: Vec<DVec3>,
    /// What surfaces send each other, W/m².
    indirect: Vec<DVec3>,
    /// Of the last solution.
    pub(crate) iterations: usize,
}

impl System {
    /// Solves for the light of all leaves.
    ///
    /// `arriving`: what emitters bring, W/m². `emitted`: what that is scaled to, W, where all of it stays in one space.
    pub(crate) fn solved(
        hierarchy: &Hierarchy,
        links: &[Link],
        enclosure: &Enclosure,
        arriving: Vec<DVec3>,
        emitted: Option<DVec3>,
        monitor: &Monitor,
    ) -> Self {
        let mut exchange = Exchange::new(hierarchy, links);
        exchange.restore(enclosure, monitor);
        let nodes = &hierarchy.nodes;
        let stops: Vec<DVec3> = (nodes.iter())
            .map(|node| hierarchy.surface(node).map_or(DVec3::ZERO, |surface| surface.stops))
            .collect();
        let mut system = Self {
            areas: (nodes.iter().zip(&stops))
                .map(|(node, stops)| if *stops != DVec3::ZERO && node.is_leaf() { node.area } else { 0.0 })
                .collect(),
            colourless: stops.iter().all(|stops| *stops == DVec3::splat(stops.x)),
            stops,
            reflectance: (nodes.iter())
                .map(|node| hierarchy.surface(node).map_or(DVec3::ZERO, |surface| surface.reflectance))
                .collect(),
            factors: exchange.into_factors(),
            certain: enclosure.certain.clone(),
            missed: vec![DVec3::ZERO; nodes.len()],
            emitted,
            arriving,
            ..Self::default()
        };
        system.conserve_emitted();
        system.solve(hierarchy, links, monitor);
        system
    }

    fn solve(&mut self, hierarchy: &Hierarchy, links: &[Link], monitor: &Monitor) {
        let exchange = Exchange::with_factors(hierarchy, links, self.factors.clone());
        let known: Vec<DVec3> = self.arriving.iter().zip(&self.missed).map(|(a, b)| *a + *b).collect();
        let apply = |b: &[DVec3]| exchange.apply(b);
        let solution = solve(apply, &self.areas, &self.reflectance, &known, RESIDUAL, monitor);
        self.iterations = solution.iterations;
        self.indirect = exchange.apply(&solution.radiosity);
        self.indirect.iter_mut().zip(&self.missed).for_each(|(indirect, missed)| *indirect += *missed);
    }

    /// Solves again, with links corrected by what leaves are found to receive from others when the solution as it is
    /// sends its light exactly (deferred correction; Stetter 1978). What links blur comes out right to second order.
    ///
    /// `found`: W/m², where it is known. It is scaled to what was sent where it is certain how much of that is caught.
    pub(crate) fn correct(
        &mut self,
        hierarchy: &Hierarchy,
        links: &[Link],
        mut found: Vec<Option<DVec3>>,
        monitor: &Monitor,
    ) {
        let exchange = Exchange::with_factors(hierarchy, links, self.factors.clone());
        let by_links = exchange.apply(&self.radiosity());
        self.conserve(&by_links, &mut found);
        self.missed = (found.iter().zip(&by_links))
            .map(|(found, by_links)| found.map_or(DVec3::ZERO, |found| found - *by_links))
            .collect();
        self.solve(hierarchy, links, monitor);
    }

    /// Interpolated light holds a little more or less than was sent, which is set right.
    fn conserve(&self, sent: &[DVec3], found: &mut [Option<DVec3>]) {
        if !self.colourless {
            // Links let the same share of every channel through, and so sent another colour.
            return;
        }
        let mut sums = vec![[DVec3::ZERO; 2]; sent.len()];
        for (index, space) in self.certain.iter().enumerate() {
            if let (Some(space), Some(found)) = (*space, found[index]) {
                let [landed, wanted] = &mut sums[space as usize];
                *landed += self.ends_at(index) * found;
                *wanted += self.ends_at(index) * sent[index];
            }
        }
        for (index, space) in self.certain.iter().enumerate() {
            if let (Some(space), Some(found)) = (*space, &mut found[index]) {
                let [landed, wanted] = sums[space as usize];
                *found *= restoring(wanted, landed);
            }
        }
    }

    /// Area of a leaf times the share of what arrives that ends there, m².
    fn ends_at(&self, index: usize) -> DVec3 {
        self.areas[index] * self.stops[index]
    }

    /// So does what emitters bring.
    fn conserve_emitted(&mut self) {
        let Some(emitted) = self.emitted else { return };
        let landed = self.arriving.iter().enumerate().map(|(index, h)| self.ends_at(index) * *h).sum();
        let factor = restoring(emitted, landed);
        for h in &mut self.arriving {
            *h *= factor;
        }
    }

    /// All light that leaves receive, W/m².
    pub(crate) fn irradiance(&self) -> Vec<DVec3> {
        // What links were corrected by may be a little more than they bring. Only lights that take light away leave less
        // than none.
        let lights = self.arriving.iter().all(|direct| direct.cmpge(DVec3::ZERO).all());
        let least = if lights { DVec3::ZERO } else { DVec3::NEG_INFINITY };
        (self.arriving.iter().zip(&self.indirect))
            .map(|(direct, indirect)| (*direct + *indirect).max(least))
            .collect()
    }

    /// What leaves send, W/m²: exactly nothing where nothing arrives.
    pub(crate) fn radiosity(&self) -> Vec<DVec3> {
        self.reflectance.iter().zip(self.irradiance()).map(|(rho, h)| *rho * h).collect()
    }

    /// |absorbed - emitted| / emitted, the worst of the channels, where no light leaves the space that it is sent into.
    pub(crate) fn imbalance(&self) -> Option<f64> {
        let emitted = self.emitted?;
        let absorbed: DVec3 = (self.irradiance().into_iter().enumerate())
            .map(|(index, h)| self.areas[index] * (self.stops[index] - self.reflectance[index]) * h)
            .sum();
        let lost = (absorbed - emitted).abs() / emitted;
        Some(DVec3::select(emitted.cmpgt(DVec3::ZERO), lost, DVec3::ZERO).max_element())
    }
}

/// The factor from what landed to what was sent, per channel; 1 where that is no matter of interpolation.
fn restoring(sent: DVec3, landed: DVec3) -> DVec3 {
    let factor = sent / landed;
    DVec3::select((factor - DVec3::ONE).abs().cmplt(DVec3::splat(INTERPOLATION)), factor, DVec3::ONE)
}
