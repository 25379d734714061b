//! Refinement that follows the estimated error: which elements, how far, and when it is enough.
//!
//! The paper (§2.2, §3.2) refines where values at the vertices differ by more than a threshold. Here the light in the
//! middle of each edge is computed and compared with the mean of the edge's ends: a steady gradient costs nothing,
//! since a linear element holds it exactly. Round by round, the elements with the largest errors are refined until
//! the rms error over all baked surfaces is the wanted one; a fixed threshold would spend most vertices on edges of
//! shadows too fine to matter. A computed middle becomes the new vertex's value, so no evaluation is wasted.
//!
//! How an element is refined is the mesh's affair: [`crate::mesh::Mesh`] quarters it (the paper, §2.2),
//! [`crate::mesh::Tessellation`] bisects its worst edge and flips edges where that lowers the error.

use glam::DVec3;
use rayon::prelude::*;

use crate::adapt::layer::Layer;
use crate::adapt::patch_light::PatchLight;
use crate::adapt::refinable::{Flip, Leaf, Refinable};
use crate::error::Error;
use crate::index::{ElementId, SampleId};
use crate::mesh::{Sample, Side};
use crate::monitor::Progress;
use crate::scene::world::World;
use crate::threads::AT_A_TIME;
use crate::transport::gather::Gather;
use crate::visibility::Receiver;

/// In one round, elements with at least this share of the largest squared error are refined. More at once would
/// refine what the next round finds good enough; fewer cost a round of bookkeeping each.
const ROUND: f64 = 0.125;

/// A centroid is looked at where the light's differences at the corners, if they were an error, would make this share
/// of the allowed squared error: a bulge is a fraction of them. One more evaluation for every one and a half.
const WORTH_A_CENTROID: f64 = 1e-3;

/// Passes of flips in one round; each pass may make others worthwhile, ever fewer.
const MOST_FLIPS: usize = 4;

/// A flip must lower the error of its two elements at least to this share: no cycles, and no evaluations for nothing.
const WORTH_FLIPPING: f64 = 0.9;

/// The middle of an edge where the light is to be computed.
struct Unknown {
    edge: (SampleId, SampleId),
    middle: Sample,
    /// That it stands for, m².
    area: f64,
}

/// An element with the integral of its squared error, W²/m².
#[derive(Debug)]
struct Uneven {
    element: ElementId,
    squared_error: f64,
    /// Whether most of it is within, where no edge knows of it.
    within: bool,
}

/// What may lie between corners that are lit alike.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Hidden<'a> {
    /// Nothing that is worth looking for.
    Nowhere,
    /// Shadows of what stands between the element and an emitter.
    Shadows,
    /// Places where hardly any light gets to, between a picture and its wall; and light between them.
    Crevices {
        /// Mean radiosity that is shown, W/m².
        mean_radiosity: f64,
        /// What patches know of them.
        patches: &'a PatchLight,
    },
}

/// Where a refinement stands.
#[derive(Debug, Default)]
pub(crate) struct Standing {
    pool: Vec<Uneven>,
    /// Elements that were not looked at yet; none before anything was.
    fresh: Option<Vec<ElementId>>,
    first_error: Option<f64>,
    /// The integral of the squared error that is left by estimate, W²/m².
    pub(crate) error: f64,
}

/// Why a refinement ends or pauses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pause {
    /// The error has fallen by [`NOTED`].
    Noted,
    /// The triangle budget holds it back.
    HeldBack,
    /// The error is the wanted one, or the caller wants no more.
    Done,
}

/// A refinement pauses to be looked at whenever its squared error has fallen to this share.
const NOTED: f64 = 0.5;

/// The refinement of a mesh for one group of sources.
pub(crate) struct Refinement<'a> {
    pub(crate) world: &'a World,
    pub(crate) gather: Gather<'a>,
    /// Per material: the share of arriving light that is shown, per channel.
    pub(crate) shown: &'a [DVec3],
    /// The rms error that this group may leave, W/m².
    pub(crate) wanted_error: f64,
    /// The integral of the squared error that this group may leave over all baked surfaces, W²/m².
    pub(crate) allowed: f64,
    /// Triangles that the mesh may have.
    pub(crate) triangle_budget: usize,
    /// What is looked for where all corners of an element are lit alike.
    pub(crate) hidden: Hidden<'a>,
    /// The part of the whole bake, 0 to 1, that this is.
    pub(crate) progress: [f64; 2],
}

impl Refinement<'_> {
    /// Refines the mesh until the estimated rms error over it is the wanted one, in as many calls as it has pauses.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn refine(
        &self,
        mesh: &mut impl Refinable,
        layer: &mut Layer,
        standing: &mut Standing,
    ) -> Result<Pause, Error> {
        let mut noted = None;
        let Standing { pool, fresh, first_error, error: left } = standing;
        let fresh = fresh.get_or_insert_with(|| mesh.leaves());
        while !(self.gather.ends)() {
            self.compute_middles(mesh, layer, fresh)?;
            self.flip_edges(mesh, layer, fresh)?;
            self.compute_bulges(mesh, layer, fresh)?;
            pool.extend(fresh.drain(..).filter_map(|element| self.uneven(mesh, layer, element)));
            pool.retain(|uneven| mesh.leaf(uneven.element).is_some());
            pool.sort_unstable_by(|a, b| {
                b.squared_error.total_cmp(&a.squared_error).then(a.element.cmp(&b.element))
            });
            let error = pool.iter().map(|uneven| uneven.squared_error).sum::<f64>();
            *left = error;
            self.report(error, *first_error.get_or_insert(error));
            if error < NOTED * *noted.get_or_insert(error) {
                return Ok(Pause::Noted);
            }
            let excess = error - self.allowed;
            let largest = pool.iter().find(|uneven| mesh.may_refine(uneven.element));
            let Some(largest) = largest.map(|uneven| uneven.squared_error).filter(|_| excess > 0.0) else {
                break;
            };
            let mut removed = 0.0;
            for uneven in pool.iter().take_while(|uneven| uneven.squared_error >= ROUND * largest) {
                if mesh.triangles() + mesh.adds() > self.triangle_budget {
                    layer.extend(mesh.samples());
                    return Ok(Pause::HeldBack);
                }
                if removed > excess {
                    break;
                }
                // A neighbour may have refined it already.
                let Some(leaf) = mesh.leaf(uneven.element).filter(|_| mesh.may_refine(uneven.element)) else {
                    continue;
                };
                let deviations = if uneven.within { [0.0; 3] } else { self.wishes(mesh, layer, &leaf) };
                mesh.refine(uneven.element, deviations, fresh);
                removed += mesh.removes() * uneven.squared_error;
            }
            layer.extend(mesh.samples());
        }
        Ok(Pause::Done)
    }

    /// How much each edge of a leaf wants to be split.
    ///
    /// Shadows have an edge, along which elements are to be long. Where rays tell the light it is smooth, and what the rays
    /// err by would be followed: there, long edges are preferred.
    fn wishes(&self, mesh: &impl Refinable, layer: &Layer, leaf: &Leaf) -> [f64; 3] {
        leaf.edges().map(|edge| {
            let squared = self.shown(leaf, layer.deviation(edge)).length_squared();
            let [a, b] = [edge.0, edge.1].map(|s| mesh.samples()[s.index()].position);
            if matches!(self.hidden, Hidden::Crevices { .. }) {
                squared * a.distance_squared(b)
            } else {
                squared
            }
        })
    }

    /// Moves the progress bar: the logarithm of the error falls about as fast as the work gets done.
    fn report(&self, error: f64, first_error: f64) {
        let [from, to] = self.progress;
        let left = (error / self.allowed).max(1.0).ln() / (first_error / self.allowed).max(1.0).ln();
        let done = if left.is_finite() { 1.0 - left.clamp(0.0, 1.0) } else { 1.0 };
        let progress = self.gather.monitor.progress();
        let fraction = progress.fraction.max(from + (to - from) * done);
        self.gather.monitor.report(Progress { fraction, ..progress });
    }

    /// A leaf with its error, if it has one.
    fn uneven(&self, mesh: &impl Refinable, layer: &Layer, element: ElementId) -> Option<Uneven> {
        let leaf = mesh.leaf(element)?;
        let at_edges = self.squared_error(&leaf, layer, layer.bulge_of(element));
        let within = self.squared_error_within(mesh, layer, &leaf);
        let squared_error = at_edges.max(within);
        (squared_error > 0.0).then_some(Uneven { element, squared_error, within: within > at_edges })
    }

    /// The same by what patches know of the light on an element.
    pub(super) fn squared_error_within(&self, mesh: &impl Refinable, layer: &Layer, leaf: &Leaf) -> f64 {
        let Hidden::Crevices { patches, .. } = self.hidden else { return 0.0 };
        let corners = leaf.samples.map(|s| mesh.samples()[s.index()].position);
        let light = leaf.samples.map(|s| layer.irradiance[s.index()]);
        let shown = self.shown(leaf, DVec3::ONE);
        leaf.area * patches.squared_difference(self.world, leaf.face, corners, light, shown) / 3.0
    }

    /// [`Layer::squared_error`] of what is shown of the light.
    fn squared_error(&self, leaf: &Leaf, layer: &Layer, bulge: DVec3) -> f64 {
        let material = self.world.faces[leaf.face.index()].material as usize;
        layer.squared_error(leaf, bulge, self.shown[material])
    }

    /// Computes the light in the middle of every edge of suspect leaves, each edge once.
    fn compute_middles(
        &self,
        mesh: &impl Refinable,
        layer: &mut Layer,
        leaves: &[ElementId],
    ) -> Result<(), Error> {
        let mut wanted = Vec::new();
        let suspect: Vec<bool> = (leaves.par_iter().with_max_len(AT_A_TIME))
            .map(|&element| mesh.leaf(element).is_some_and(|leaf| self.is_suspect(mesh, layer, &leaf)))
            .collect();
        for (&element, _) in leaves.iter().zip(suspect).filter(|(_, suspect)| *suspect) {
            let Some(leaf) = mesh.leaf(element) else { continue };
            for (k, edge) in leaf.edges().into_iter().enumerate() {
                if !layer.knows_middle(edge) {
                    wanted.push(Unknown { edge, middle: mesh.middle(element, k), area: leaf.area / 3.0 });
                }
            }
        }
        self.compute(layer, wanted)
    }

    fn compute(&self, layer: &mut Layer, mut wanted: Vec<Unknown>) -> Result<(), Error> {
        wanted.sort_by_key(|unknown| unknown.edge);
        wanted.dedup_by_key(|unknown| unknown.edge);
        let approaches: Vec<_> = wanted.iter().map(|unknown| unknown.middle.approach(Side::Front)).collect();
        let seeds: Vec<u64> = (wanted.iter())
            .map(|unknown| ((unknown.edge.0.index() as u64) << 32) | unknown.edge.1.index() as u64)
            .collect();
        let areas: Vec<f64> = wanted.iter().map(|unknown| unknown.area).collect();
        let arrived = self.gather.limits(&approaches, &seeds, &areas)?;
        if (self.gather.ends)() {
            // What was not computed must not pass for darkness.
            return Ok(());
        }
        for (Unknown { edge, .. }, arrived) in wanted.into_iter().zip(arrived) {
            layer.learn_middle(edge, &arrived);
        }
        Ok(())
    }

    /// Computes the light at the centroids of leaves where it could hide an error that matters: three middles may lie
    /// on the linear interpolant by chance, most of all where edges were flipped for it.
    fn compute_bulges(
        &self,
        mesh: &impl Refinable,
        layer: &mut Layer,
        leaves: &[ElementId],
    ) -> Result<(), Error> {
        let wanted: Vec<(ElementId, Leaf)> = (leaves.iter())
            .filter_map(|&element| Some((element, mesh.leaf(element)?)))
            .filter(|(_, leaf)| {
                let light = leaf.samples.map(|s| layer.irradiance[s.index()]);
                let spread = (0..3).map(|k| self.shown(leaf, light[k] - light[(k + 1) % 3]).length_squared());
                let known = leaf.edges().iter().all(|edge| layer.knows_middle(*edge));
                known && spread.fold(0.0, f64::max) * leaf.area / 3.0 >= WORTH_A_CENTROID * self.allowed
            })
            .collect();
        let receivers: Vec<Receiver> = wanted.iter().map(|(element, _)| mesh.centroid(*element)).collect();
        let seeds: Vec<u64> = wanted.iter().map(|(element, _)| element.index() as u64 | (1 << 63)).collect();
        let areas: Vec<f64> = wanted.iter().map(|(_, leaf)| leaf.area).collect();
        let arrived = self.gather.at(&receivers, &seeds, &areas)?;
        if (self.gather.ends)() {
            return Ok(());
        }
        for ((element, leaf), arrived) in wanted.into_iter().zip(arrived) {
            layer.learn_centroid(element, &leaf, &arrived);
        }
        Ok(())
    }

    /// Flips edges where that lowers the error of the two elements beside them (data-dependent triangulation; Dyn,
    /// Levin, Rippa 1990), until none does.
    fn flip_edges(
        &self,
        mesh: &mut impl Refinable,
        layer: &mut Layer,
        fresh: &mut Vec<ElementId>,
    ) -> Result<(), Error> {
        let mut open = fresh.clone();
        for _ in 0..MOST_FLIPS {
            let flips: Vec<Flip> = (mesh.flips(&open).into_iter())
                .filter(|flip| flip.now.iter().any(|leaf| self.squared_error(leaf, layer, DVec3::ZERO) > 0.0))
                .collect();
            let unknown = flips.iter().filter(|flip| !layer.knows_middle(flip.edge));
            let middle = |flip: &Flip| {
                let area = flip.then.iter().map(|leaf| leaf.area).sum::<f64>() / 3.0;
                Unknown { edge: flip.edge, middle: flip.middle.clone(), area }
            };
            self.compute(layer, unknown.map(middle).collect())?;
            let error = |leaves: &[Leaf; 2], bulges: [DVec3; 2]| -> f64 {
                leaves.iter().zip(bulges).map(|(leaf, bulge)| self.squared_error(leaf, layer, bulge)).sum()
            };
            let promising: Vec<&Flip> = (flips.iter())
                .filter(|flip| {
                    let [now, then] = [&flip.now, &flip.then].map(|leaves| error(leaves, [DVec3::ZERO; 2]));
                    layer.knows_middle(flip.edge) && then < WORTH_FLIPPING * now
                })
                .collect();
            // A middle may lie on the new edge by chance; the centroids tell.
            let centroids: Vec<Receiver> = promising.iter().flat_map(|flip| flip.centroids).collect();
            let seeds: Vec<u64> =
                promising.iter().flat_map(|flip| flip.elements.map(|e| e.index() as u64)).collect();
            let areas: Vec<f64> = promising.iter().flat_map(|flip| flip.then.map(|leaf| leaf.area)).collect();
            let arrived = self.gather.at(&centroids, &seeds, &areas)?;
            if (self.gather.ends)() {
                break;
            }
            let mut chosen = Vec::new();
            for (flip, arrived) in promising.into_iter().zip(arrived.chunks_exact(2)) {
                let bulges = [0, 1].map(|k| layer.certain_bulge(&flip.then[k], &arrived[k]));
                if error(&flip.then, bulges) < WORTH_FLIPPING * error(&flip.now, [DVec3::ZERO; 2]) {
                    chosen.push(flip);
                }
            }
            open.clear();
            for flip in chosen {
                mesh.flip(flip, &mut open);
            }
            if open.is_empty() {
                break;
            }
            // Flipped leaves join diagonals that were looked at before with edges that were not.
            fresh.extend(&open);
        }
        fresh.retain(|&element| mesh.leaf(element).is_some());
        Ok(())
    }

    /// What irradiance shows on a leaf, W/m².
    pub(super) fn shown(&self, leaf: &Leaf, irradiance: DVec3) -> DVec3 {
        self.shown[self.world.faces[leaf.face.index()].material as usize] * irradiance
    }
}
