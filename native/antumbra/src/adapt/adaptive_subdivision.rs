//! Adaptive subdivision, "AS" (the paper, §2.2): an element is quartered where it is lit unevenly, and each quarter
//! is looked at in turn. Where the light of a source is even, only coarse elements are evaluated for it and the finer
//! samples are interpolated.
//!
//! Departures from the paper. An element's error is estimated from how far the light in the middle of its edges is
//! from the mean of their ends: a steady gradient costs nothing, since a linear element holds it exactly. The elements
//! with the largest errors are quartered, round by round, until the rms error over all baked surfaces is the wanted
//! one; a fixed threshold would spend most vertices on edges of shadows too fine to matter. What counts is the sum
//! over a group of sources, all emitters or all reflecting patches, not a single shot: six glowing walls light a room
//! evenly though each alone does not. And equal values at the vertices do not make an element even while something
//! may block an emitter: a shadow can lie inside.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::error::Error;
use crate::index::{ElementId, SampleId, VertexId};
use crate::mesh::{Mesh, Sample, Side, area, edge_key};
use crate::monitor::Monitor;
use crate::scene::world::World;
use crate::transport::column::Column;
use crate::transport::form_factors::{Candidates, FormFactors, Workspace, faces};
use crate::visibility::shaft::{Shaft, TRIANGLE_EDGES};
use crate::visibility::{ConvexPolygon, Receiver, unoccluded_form_factor};

/// Where the light at the corners of an element differs by less than this, in wanted errors, unblocked light is even:
/// its second difference is smaller still.
const EVEN: f64 = 1.0;

/// A shadow that no corner sees is looked for only where it could make at least this share of the squared error that
/// is allowed over all surfaces. A scene of a hundred thousand small triangles would otherwise spend its time on
/// shadows smaller than they are; missing one costs a thirtieth of the wanted error at most.
const WORTH_SEARCHING: f64 = 1e-3;

/// Elements whose corners' differences could not make this share of the allowed squared error are left alone: even a
/// hundred thousand of them together stay below it.
const WORTH_TESTING: f64 = 1e-6;

/// A deviation counts when its square is above this many variances of the rays at the middle: three standard errors
/// of the whole, in which the ends' rays take half as much part again. Refining for noise would only make more of it.
const CERTAIN: f64 = 13.5;

/// In one round, elements with at least this share of the largest squared error are quartered. More at once would
/// refine what the next round finds good enough; fewer cost a round of bookkeeping each.
const ROUND: f64 = 0.125;

/// A source whose light can deviate by less than this, in wanted errors, is interpolated: hundreds of such sources
/// add up to one wanted error at most, since their signs differ.
const INTERPOLATED: f64 = 0.03;

/// A source and its form factors.
pub(crate) struct GroupSource {
    pub(crate) polygon: ConvexPolygon,
    /// W/m².
    pub(crate) radiosity: DVec3,
    pub(crate) column: Column,
}

/// What a refinement needs to know.
pub(crate) struct Refinement<'a> {
    pub(crate) world: &'a World,
    pub(crate) form_factors: &'a FormFactors<'a>,
    pub(crate) monitor: &'a Monitor,
    /// Per material: the share of arriving light that is shown, per channel.
    pub(crate) shown: &'a [DVec3],
    /// The rms error that this group may leave, W/m².
    pub(crate) wanted_error: f64,
    /// The integral of the squared error that this group may leave over all baked surfaces, W²/m².
    pub(crate) allowed: f64,
    /// When to leave the mesh as it is: the caller stops, or the time is up.
    pub(crate) ends: &'a (dyn Fn() -> bool + Sync),
    /// Per face: the deepest level its elements may reach.
    pub(crate) deepest: &'a [u8],
    /// Triangles that the anchored mesh may have.
    pub(crate) triangle_budget: usize,
    /// Whether shadows are looked for where all corners of an element are lit alike.
    pub(crate) hidden_shadows: bool,
}

/// What may block a source from an element.
enum Obstacles {
    /// These polygons, or none.
    Listed(Vec<u32>),
    /// Too many to list.
    Crowd,
}

/// An element under test.
struct Suspect {
    element: ElementId,
    /// Sources that may light it unevenly, by index, with what may block them.
    sources: Vec<(u32, Obstacles)>,
}

/// A leaf with the integral of its squared error, W²/m².
struct Uneven {
    element: ElementId,
    squared_error: f64,
}

/// What was found in the middle of an edge.
#[derive(Default)]
struct Middle {
    /// Computed form factors, by source.
    values: SmallVec<[(u32, f32); 2]>,
    /// Irradiance beyond the mean of the edge's ends, W/m²; zero where it cannot be told from the noise of rays.
    deviation: DVec3,
}

type Middles = FxHashMap<(SampleId, SampleId), Middle>;

impl Refinement<'_> {
    /// Refines the mesh below the given elements until the estimated rms error over them is the wanted one.
    ///
    /// Returns whether the triangle budget held it back.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn refine(
        &self,
        mesh: &mut Mesh,
        group: &mut [GroupSource],
        elements: &[ElementId],
    ) -> Result<bool, Error> {
        let mut pool: Vec<Uneven> = Vec::new();
        let mut frontier = elements.to_vec();
        let mut middles_known = Middles::default();
        while !(self.ends)() {
            self.test(mesh, group, &mut frontier, &mut pool, &mut middles_known)?;
            pool.retain(|leaf| mesh.element(leaf.element).is_leaf());
            pool.sort_unstable_by(|a, b| {
                b.squared_error.total_cmp(&a.squared_error).then(a.element.cmp(&b.element))
            });
            let excess = pool.iter().map(|leaf| leaf.squared_error).sum::<f64>() - self.allowed;
            let largest = pool.iter().find(|leaf| self.may_be_subdivided(mesh, leaf.element));
            let Some(largest) = largest.map(|leaf| leaf.squared_error).filter(|_| excess > 0.0) else {
                break;
            };
            if mesh.triangles >= self.triangle_budget {
                group.par_iter_mut().for_each(|source| source.column.interpolate_all(mesh));
                return Ok(true);
            }
            let (mut removed, mut subdivided) = (0.0, Vec::new());
            for leaf in pool.iter().take_while(|leaf| leaf.squared_error >= ROUND * largest) {
                if removed > excess || mesh.triangles >= self.triangle_budget {
                    break;
                }
                if self.may_be_subdivided(mesh, leaf.element) && mesh.element(leaf.element).is_leaf() {
                    mesh.subdivide(leaf.element, &mut subdivided);
                    removed += leaf.squared_error;
                }
            }
            keep_middles(mesh, group, &subdivided, &middles_known);
            frontier.extend(subdivided.iter().filter_map(|&e| mesh.element(e).children()).flatten());
        }
        // What was computed at one element changes what is interpolated from it at another.
        group.par_iter_mut().for_each(|source| source.column.interpolate_all(mesh));
        Ok(false)
    }

    /// Tests the frontier, and what lies below it in the hierarchy where the light is uneven, down to the leaves.
    /// Uneven leaves join the pool; the frontier is empty afterwards.
    fn test(
        &self,
        mesh: &Mesh,
        group: &mut [GroupSource],
        frontier: &mut Vec<ElementId>,
        pool: &mut Vec<Uneven>,
        known: &mut Middles,
    ) -> Result<(), Error> {
        while !frontier.is_empty() {
            let suspects = self.suspects(mesh, group, frontier)?;
            frontier.clear();
            known.extend(self.compute_middles(mesh, group, &suspects)?);
            let mut refined = Vec::new();
            for suspect in &suspects {
                let squared_error = self.squared_error(mesh, suspect.element, known);
                if let Some(children) = mesh.element(suspect.element).children() {
                    refined.push(suspect.element);
                    frontier.extend(children);
                } else if squared_error > 0.0 {
                    pool.push(Uneven { element: suspect.element, squared_error });
                }
            }
            keep_middles(mesh, group, &refined, known);
        }
        Ok(())
    }

    fn may_be_subdivided(&self, mesh: &Mesh, id: ElementId) -> bool {
        let element = mesh.element(id);
        element.level < self.deepest[element.face.index()]
    }

    /// The integral over an element of the squared difference between the quadratic through its corners and edges'
    /// middles and the linear interpolant, as shown and averaged over the channels, W²/m²: with deviations d at the middles it
    /// is 16/90 A times the sum of `d_i d_j` over all unordered pairs, `i = j` included.
    fn squared_error(&self, mesh: &Mesh, id: ElementId, middles: &Middles) -> f64 {
        let element = mesh.element(id);
        let shown = self.shown[self.world.faces[element.face.index()].material as usize];
        let [d, e, f]: [DVec3; 3] = std::array::from_fn(|k| {
            let key = edge_key(element.samples[k], element.samples[(k + 1) % 3]);
            shown * middles.get(&key).map_or(DVec3::ZERO, |middle| middle.deviation)
        });
        let forms = d.dot(d) + e.dot(e) + f.dot(f) + d.dot(e) + e.dot(f) + f.dot(d);
        area(element, self.world) * forms * (16.0 / 90.0 / 3.0)
    }

    /// The elements that the group could light unevenly.
    fn suspects(
        &self,
        mesh: &Mesh,
        group: &[GroupSource],
        frontier: &[ElementId],
    ) -> Result<Vec<Suspect>, Error> {
        let suspects: Vec<Option<Suspect>> = (frontier.par_iter())
            .map_init(
                Vec::new,
                |found, &id| {
                    if (self.ends)() { None } else { self.suspect(mesh, group, id, found) }
                },
            )
            .collect();
        self.monitor.check()?;
        Ok(suspects.into_iter().flatten().collect())
    }

    fn suspect(
        &self,
        mesh: &Mesh,
        group: &[GroupSource],
        id: ElementId,
        found: &mut Vec<u32>,
    ) -> Option<Suspect> {
        let element = mesh.element(id);
        let face = element.face.index();
        let receivers = element.samples.map(|s| mesh.sample(s).receiver(Side::Front));
        let corner_light = element
            .samples
            .map(|s| -> DVec3 { group.iter().map(|source| source.column.front(s) * source.radiosity).sum() });
        let spread = (0..3)
            .map(|k| self.in_wanted_errors(corner_light[k] - corner_light[(k + 1) % 3], face))
            .fold(0.0, f64::max);
        let element_area = area(element, self.world);
        let share =
            |wanted_errors: f64| (wanted_errors * self.wanted_error).powi(2) * element_area / self.allowed;
        if spread < EVEN || share(spread) < WORTH_TESTING {
            let most = group.iter().map(|source| brightest(&receivers, source)).sum();
            if !self.hidden_shadows || share(self.in_wanted_errors(most, face)) < WORTH_SEARCHING {
                return None;
            }
        }
        let sources: Vec<_> = (group.iter().enumerate())
            .filter_map(|(index, source)| {
                let candidates = self.may_be_uneven(mesh, id, &receivers, source, found)?;
                Some((index as u32, candidates))
            })
            .collect();
        // Unblocked light is smooth: where all corners agree, it is even.
        let unblocked = sources
            .iter()
            .all(|(_, obstacles)| matches!(obstacles, Obstacles::Listed(list) if list.is_empty()));
        if sources.is_empty() || (unblocked && spread < EVEN) {
            return None;
        }
        Some(Suspect { element: id, sources })
    }

    /// What may block the source from an element, if its light may be uneven there.
    fn may_be_uneven(
        &self,
        mesh: &Mesh,
        id: ElementId,
        receivers: &[Receiver; 3],
        source: &GroupSource,
        found: &mut Vec<u32>,
    ) -> Option<Obstacles> {
        let element = mesh.element(id);
        let face = element.face.index();
        // Reflected light counts by what differs at the corners (the paper, §2.2); most of it does not.
        if !self.hidden_shadows {
            let values = element.samples.map(|s| source.column.front(s));
            let spread = values.iter().copied().fold(0.0, f64::max)
                - values.iter().copied().fold(f64::INFINITY, f64::min);
            if self.in_wanted_errors(spread * source.radiosity, face) < INTERPOLATED {
                return None;
            }
        }
        // Light that cannot reach the tolerance cannot be uneven by it.
        let most = self.in_wanted_errors(brightest(receivers, source), face);
        if most < INTERPOLATED {
            return None;
        }
        let points = receivers.each_ref().map(|r| r.position);
        let flat = self.world.faces[face].corner_normals.is_none();
        let plane = flat.then_some((points[0], receivers[0].normal));
        let shaft = Shaft::new(&points, &TRIANGLE_EDGES, &source.polygon, plane);
        match self.form_factors.candidates(&shaft, found) {
            Candidates::Crowd => Some(Obstacles::Crowd),
            Candidates::Shared([]) => {
                // Without blockers a far source is nearly linear: its second difference falls with the square of
                // size over distance.
                let size = points[0].distance(points[1]).max(points[0].distance(points[2]));
                let distance = (points.iter())
                    .map(|p| p.distance(source.polygon.centroid()))
                    .fold(f64::INFINITY, f64::min);
                let bend = most * (size / distance).powi(2).min(1.0);
                (bend >= INTERPOLATED).then(|| Obstacles::Listed(Vec::new()))
            }
            Candidates::Shared(list) => Some(Obstacles::Listed(list.to_vec())),
        }
    }

    /// Exact light in the middle of every edge of the suspects, each edge once.
    fn compute_middles(
        &self,
        mesh: &Mesh,
        group: &[GroupSource],
        suspects: &[Suspect],
    ) -> Result<Middles, Error> {
        let mut seen = Middles::default();
        let mut wanted = Vec::new();
        for suspect in suspects {
            let element = mesh.element(suspect.element);
            for k in 0..3 {
                let key = edge_key(element.samples[k], element.samples[(k + 1) % 3]);
                seen.entry(key).or_insert_with(|| {
                    wanted.push((key, suspect, k));
                    Middle::default()
                });
            }
        }
        let found: Vec<Middle> = (wanted.par_iter())
            .map_init(Workspace::default, |workspace, &(ends, suspect, k)| {
                // An empty middle deviates from nothing, so nothing is refined for it.
                if (self.ends)() {
                    return Middle::default();
                }
                self.compute_middle(mesh, group, suspect, ends, k, workspace)
            })
            .collect();
        self.monitor.check()?;
        for ((key, ..), middle) in wanted.iter().zip(found) {
            seen.insert(*key, middle);
        }
        Ok(seen)
    }

    fn compute_middle(
        &self,
        mesh: &Mesh,
        group: &[GroupSource],
        suspect: &Suspect,
        (a, b): (SampleId, SampleId),
        k: usize,
        workspace: &mut Workspace,
    ) -> Middle {
        let element = mesh.element(suspect.element);
        let face = element.face.index();
        let sample = match mesh.sample_midpoint(a, b) {
            Some(existing) => mesh.sample(existing).clone(),
            None => middle_sample(mesh, element.vertices, [a, b], k),
        };
        let receiver = sample.receiver(Side::Front);
        let seed = ((a.index() as u64) << 32) | b.index() as u64;
        let (mut middle, mut variance) = (Middle::default(), 0.0);
        for (index, obstacles) in &suspect.sources {
            let source = &group[*index as usize];
            let candidates = match obstacles {
                Obstacles::Listed(list) => Candidates::Shared(list),
                Obstacles::Crowd => Candidates::Crowd,
            };
            let weight = self.in_wanted_errors(source.radiosity, face);
            let found =
                self.form_factors.visible(&receiver, &source.polygon, candidates, weight, seed, workspace);
            middle.values.push((*index, found.value as f32));
            variance += (found.noise * source.radiosity).length_squared();
            let mean = 0.5 * (source.column.front(a) + source.column.front(b));
            middle.deviation += (found.value - mean) * source.radiosity;
        }
        if middle.deviation.length_squared() <= CERTAIN * variance {
            middle.deviation = DVec3::ZERO;
        }
        middle
    }

    /// The rms over the channels of what irradiance shows on a face, in wanted errors. Where nothing is lit there is
    /// nothing to refine for.
    fn in_wanted_errors(&self, irradiance: DVec3, face: usize) -> f64 {
        let shown = self.shown[self.world.faces[face].material as usize] * irradiance;
        if self.wanted_error > 0.0 { (shown.length_squared() / 3.0).sqrt() / self.wanted_error } else { 0.0 }
    }
}

/// The irradiance that the source brings to the brightest corner when nothing blocks it, W/m².
fn brightest(receivers: &[Receiver; 3], source: &GroupSource) -> DVec3 {
    let brightest = (receivers.iter())
        .filter(|receiver| faces(receiver, &source.polygon))
        .map(|receiver| unoccluded_form_factor(receiver, &source.polygon))
        .fold(0.0, f64::max);
    brightest * source.radiosity
}

/// The sample that splitting edge `k` of an element would make.
fn middle_sample(mesh: &Mesh, vertices: [VertexId; 3], ends: [SampleId; 2], k: usize) -> Sample {
    let [from, to, opposite] =
        [k, (k + 1) % 3, (k + 2) % 3].map(|i| mesh.vertices[vertices[i].index()].position);
    mesh.middle_sample(ends, 0.5 * (from + to), opposite)
}

/// Keeps the computed values of the middles of subdivided elements, and interpolates all other new samples.
fn keep_middles(mesh: &Mesh, group: &mut [GroupSource], subdivided: &[ElementId], middles: &Middles) {
    let first_new: Vec<usize> = group.iter().map(|source| source.column.values.len()).collect();
    group.par_iter_mut().for_each(|source| source.column.interpolate_new(mesh));
    for &element in subdivided {
        let samples = mesh.element(element).samples;
        for k in 0..3 {
            let (a, b) = edge_key(samples[k], samples[(k + 1) % 3]);
            let (Some(middle), Some(found)) = (mesh.sample_midpoint(a, b), middles.get(&(a, b))) else {
                continue;
            };
            for &(source, value) in &found.values {
                group[source as usize].column.set_front(middle, value);
            }
        }
    }
    // Now that their parents are final.
    group
        .par_iter_mut()
        .zip(first_new)
        .for_each(|(source, first)| source.column.interpolate_from(mesh, first));
}
