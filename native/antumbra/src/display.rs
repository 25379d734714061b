//! The mesh that is shown, with the light on it: what the methods refine, each in its way.
//!
//! It is apart from the patches that exchange light (Lischinski, Tampieri, Greenberg 1993): its elements follow the
//! shadows, theirs follow the faces. Direct and indirect light are two layers, since they are refined one after the
//! other and only one of them has sharp shadows.

mod lighting;

use glam::DVec3;

use crate::adapt::fit::fitted;
use crate::adapt::layer::Layer;
use crate::adapt::refinable::Refinable;
use crate::adapt::refinement::{Hidden, Pause, Refinement, Standing};
use crate::error::Error;
use crate::index::{ElementId, FaceId};
use crate::mesh::arrangement::LineKind;
use crate::mesh::{Corner, Quartering, Sample, Side, Tessellation, anchored};
use crate::scene::world::World;
use crate::transport::gather::Gather;
use crate::visibility::Receiver;

/// Where rays tell the light, no flip makes a triangle of less height than this share of its longest edge: what they err by
/// differs from corner to corner, and shows as streaks along thin triangles.
const FLATTEST_BY_RAYS: f64 = 0.2;

/// How the mesh is refined.
pub(crate) enum DisplayMesh<'a> {
    /// Uniform meshes and adaptive subdivision.
    Quartered(Quartering<'a>),
    /// The discontinuity methods.
    Tessellated(Tessellation<'a>),
}

/// Where light comes from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Light {
    /// Emitters.
    Direct,
    /// What surfaces reflect.
    Indirect,
}

/// A triangle of the mesh that is shown.
pub(crate) struct Shown {
    pub(crate) face: FaceId,
    pub(crate) corners: [Corner; 3],
    /// Per edge (corner k to k + 1): the line it lies on.
    pub(crate) lines: [Option<LineKind>; 3],
}

/// The mesh that is shown, with its light.
pub(crate) struct Display<'a> {
    pub(crate) mesh: DisplayMesh<'a>,
    direct: Layer,
    indirect: Layer,
    /// Per [`Light`]: irradiance of the samples with which the linear elements fit it best, W/m².
    fitted: [Vec<DVec3>; 2],
    /// Samples that were there before any light was looked at.
    coarse: usize,
    /// Samples whose indirect light is the mean of their parents'.
    interpolated: Vec<bool>,
    /// Per [`Light`]: samples at which it ended before anybody looked.
    guessed: [usize; 2],
}

impl<'a> Display<'a> {
    /// Gathers the emitters' light.
    ///
    /// `known`: direct irradiance of the first samples, W/m². `else_at`: about what arrives where it ended before anybody
    /// looked.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn new(
        mesh: DisplayMesh<'a>,
        known: Vec<DVec3>,
        gather: &Gather,
        else_at: impl Fn(&Receiver) -> DVec3 + Sync,
    ) -> Result<Self, Error> {
        let mut display = Self {
            mesh,
            direct: Layer::default(),
            indirect: Layer::default(),
            fitted: Default::default(),
            coarse: 0,
            interpolated: Vec::new(),
            guessed: [0; 2],
        };
        display.coarse = display.samples().len();
        let mut irradiance = known;
        let samples = display.samples();
        irradiance.truncate(samples.len());
        let unknown: Vec<usize> = (irradiance.len()..samples.len()).collect();
        let (values, guessed) = lighting::gathered(gather, samples, &unknown, &[], Some(&else_at))?;
        irradiance.extend(values);
        display.guessed[Light::Direct as usize] = guessed;
        display.direct = Layer::new(irradiance);
        display.fit(Light::Direct);
        Ok(display)
    }

    /// Refines the mesh for the light of emitters or of patches. Returns whether the triangle budget held it back.
    ///
    /// `look`: is shown the mesh now and then and in the end, with the integral of the squared error that this light is
    /// estimated to have, W²/m².
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn refine(
        &mut self,
        light: Light,
        refinement: &Refinement,
        mut look: impl FnMut(&Self, f64),
    ) -> Result<bool, Error> {
        if let (DisplayMesh::Tessellated(mesh), Hidden::Crevices { .. }) = (&mut self.mesh, refinement.hidden)
        {
            mesh.flattest = FLATTEST_BY_RAYS;
        }
        let mut standing = Standing::default();
        loop {
            let Self { mesh, direct, indirect, .. } = self;
            let layer = match light {
                Light::Direct => &mut *direct,
                Light::Indirect => indirect,
            };
            let pause = match mesh {
                DisplayMesh::Quartered(mesh) => refinement.refine(mesh, layer, &mut standing),
                DisplayMesh::Tessellated(mesh) => refinement.refine(mesh, layer, &mut standing),
            }?;
            if let Light::Indirect = light {
                direct.extend(samples_of(mesh));
                let fits = rayon::join(|| self.fit_to(Light::Direct), || self.fit_to(Light::Indirect));
                self.fitted = fits.into();
            } else {
                self.fit(Light::Direct);
            }
            look(self, standing.error);
            if pause != Pause::Noted {
                return Ok(pause == Pause::HeldBack);
            }
        }
    }

    /// Fits the linear elements to what is known of the light.
    fn fit(&mut self, light: Light) {
        self.fitted[light as usize] = self.fit_to(light);
    }

    fn fit_to(&self, light: Light) -> Vec<DVec3> {
        let layer = match light {
            Light::Direct => &self.direct,
            Light::Indirect => &self.indirect,
        };
        match &self.mesh {
            DisplayMesh::Quartered(mesh) => fitted(mesh, layer),
            DisplayMesh::Tessellated(mesh) => fitted(mesh, layer),
        }
    }

    /// Irradiance of every displayed triangle: its face, its corners' barycentric coordinates there, W/m².
    pub(crate) fn for_each_lit(&self, light: Light, mut emit: impl FnMut(FaceId, [DVec3; 3], [DVec3; 3])) {
        let irradiance = &self.fitted[light as usize];
        let at = |corner: &Corner| {
            0.5 * (irradiance[corner.samples[0].index()] + irradiance[corner.samples[1].index()])
        };
        for Shown { face, corners, .. } in self.triangles() {
            emit(face, corners.each_ref().map(|c| c.barycentric), corners.each_ref().map(at));
        }
    }

    /// All triangles of the mesh as it is shown, face by face.
    pub(crate) fn triangles(&self) -> Vec<Shown> {
        let mut triangles = Vec::new();
        match &self.mesh {
            DisplayMesh::Quartered(Quartering { mesh, world, .. }) => {
                for face in FaceId::range(0..world.faces.len()).filter(|&face| world.receives(face)) {
                    anchored(mesh, ElementId::new(face.index()), |corners| {
                        triangles.push(Shown { face, corners, lines: [None; 3] });
                    });
                }
            }
            DisplayMesh::Tessellated(mesh) => {
                let live = mesh.tiles.iter().filter(|tile| tile.live);
                triangles.extend(live.map(|tile| Shown {
                    face: tile.face,
                    corners: Tessellation::corners(tile),
                    lines: tile.lines,
                }));
                triangles.sort_by_key(|shown| shown.face);
            }
        }
        triangles
    }

    /// Per [`Light`]: what arrives on the samples' fronts, W/m², with the indirect light scaled per channel.
    pub(crate) fn layers(&self, indirect_scale: DVec3) -> [Vec<DVec3>; 2] {
        let [direct, indirect] = &self.fitted;
        let scaled = indirect.iter().map(|&arriving| indirect_scale * arriving);
        let mut indirect: Vec<DVec3> = scaled.collect();
        indirect.resize(direct.len(), DVec3::ZERO);
        [direct.clone(), indirect]
    }

    /// Share of the places where light is known that have only a guess of it, since it ended before anybody looked.
    pub(crate) fn guessed(&self, light: Light) -> f64 {
        self.guessed[light as usize] as f64 / self.samples().len().max(1) as f64
    }

    /// Per sample: the rms error that refinement estimates of the elements around it, as they are shown, W/m².
    ///
    /// `shown`: per material, the share of arriving light that is shown.
    pub(crate) fn errors(&self, world: &World, shown: &[DVec3]) -> Vec<f64> {
        let layers = [&self.direct, &self.indirect];
        match &self.mesh {
            DisplayMesh::Quartered(mesh) => sample_errors(mesh, layers, world, shown),
            DisplayMesh::Tessellated(mesh) => sample_errors(mesh, layers, world, shown),
        }
    }

    /// Leaves, and points of the mesh.
    pub(crate) fn counts(&self) -> [usize; 2] {
        match &self.mesh {
            DisplayMesh::Quartered(Quartering { mesh, .. }) => [mesh.leaves, mesh.vertices.len()],
            DisplayMesh::Tessellated(mesh) => [mesh.live, mesh.positions.len()],
        }
    }

    /// Triangles of the mesh as it is shown.
    pub(crate) fn triangle_count(&self) -> usize {
        match &self.mesh {
            DisplayMesh::Quartered(mesh) => mesh.triangles(),
            DisplayMesh::Tessellated(mesh) => mesh.triangles(),
        }
    }

    /// Where light is gathered.
    pub(crate) fn receivers(&self) -> Vec<Receiver> {
        self.samples().iter().map(|sample| sample.receiver(Side::Front)).collect()
    }

    /// The area that each sample stands for, m².
    pub(crate) fn sample_areas(&self) -> Vec<f64> {
        match &self.mesh {
            DisplayMesh::Quartered(mesh) => sample_areas(mesh),
            DisplayMesh::Tessellated(mesh) => sample_areas(mesh),
        }
    }

    fn samples(&self) -> &[Sample] {
        samples_of(&self.mesh)
    }
}

fn samples_of<'m>(mesh: &'m DisplayMesh) -> &'m [Sample] {
    match mesh {
        DisplayMesh::Quartered(mesh) => mesh.samples(),
        DisplayMesh::Tessellated(mesh) => mesh.samples(),
    }
}

/// The area that each sample stands for, m².
fn sample_areas(mesh: &impl Refinable) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.samples().len()];
    for leaf in mesh.leaves().into_iter().filter_map(|element| mesh.leaf(element)) {
        leaf.samples.iter().for_each(|sample| areas[sample.index()] += leaf.area / 3.0);
    }
    areas
}

/// [`Display::errors`].
fn sample_errors(mesh: &impl Refinable, layers: [&Layer; 2], world: &World, shown: &[DVec3]) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; mesh.samples().len()];
    for element in mesh.leaves() {
        let Some(leaf) = mesh.leaf(element) else { continue };
        let shown = shown[world.faces[leaf.face.index()].material as usize];
        let squared: f64 =
            layers.iter().map(|layer| layer.squared_error(&leaf, layer.bulge_of(element), shown)).sum();
        for sample in leaf.samples {
            let [error, area] = &mut sums[sample.index()];
            *error += squared;
            *area += leaf.area;
        }
    }
    sums.into_iter().map(|[error, area]| if area > 0.0 { (error / area).sqrt() } else { 0.0 }).collect()
}

/// Area of everything that is baked, m².
pub(crate) fn baked_area(world: &World) -> f64 {
    (world.faces.iter().enumerate())
        .filter(|(index, _)| world.receives(FaceId::new(*index)))
        .map(|(_, face)| face.area)
        .sum()
}

#[cfg(test)]
pub(crate) mod tests;
