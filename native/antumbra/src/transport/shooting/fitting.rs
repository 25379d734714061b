//! Patches that fit the light: where it is too uneven for a patch to send its mean, it is cut, and shooting starts again.

use glam::DVec3;

use crate::display::Display;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::settings::Method;
use crate::transport::columns::Column;
use crate::transport::patches::{Fit, direct_means};
use crate::transport::shooting::{MANY_SAMPLES, Shooting, light};
use crate::transport::sources::Sources;

impl Shooting<'_> {
    /// Once the display mesh knows the emitters' light: cuts patches that are lit too unevenly to send their mean, and
    /// takes over what they receive.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn fit_to_direct_light(
        &mut self,
        display: &Display,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Error> {
        let gather = self.problem.gather_direct(self.wanted_error(), ends);
        if self.problem.settings.method != Method::Uniform {
            self.patch_elements = self.fit().cut(
                &mut self.mesh,
                self.problem.world,
                Some(display),
                &mut self.direct,
                &self.patch_elements,
                |mesh, direct| light(&gather, mesh, direct),
            )?;
            self.sources = Sources::new(self.problem.world, &self.mesh, &self.patch_elements);
        }
        let means =
            direct_means(&self.mesh, self.problem.world, Some(display), &self.direct, &self.patch_elements);
        self.start(means)?;
        Ok(())
    }

    /// Once everything has shot: cuts patches whose indirect light is too uneven to send its mean, and starts again.
    /// Returns whether there were any.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn fit_to_indirect_light(
        &mut self,
        display: &Display,
        ends: &(dyn Fn() -> bool + Sync),
    ) -> Result<bool, Error> {
        // Where columns are many or dear, starting again costs more than it brings.
        let known = |(sent, kept): (&DVec3, &Option<Column>)| *sent == DVec3::ZERO || kept.is_some();
        let affordable = self.mesh.samples.len() as f64 <= MANY_SAMPLES
            && self.sent.iter().zip(&self.kept).all(known)
            && self.problem.settings.method != Method::Uniform;
        if !affordable || ends() {
            return Ok(false);
        }
        let mut indirect = vec![[DVec3::ZERO; 2]; self.mesh.samples.len()];
        for (column, &radiosity) in self.kept.iter().zip(&self.sent) {
            let Some(column) = column else { continue };
            for (light, values) in indirect.iter_mut().zip(&column.samples) {
                light[0] += f64::from(values[0]) * radiosity;
                light[1] += f64::from(values[1]) * radiosity;
            }
        }
        let interpolate = |mesh: &Mesh, light: &mut Vec<[DVec3; 2]>| {
            for sample in &mesh.samples[light.len()..] {
                let [a, b] = sample.parents.expect("subdivision made it; this is a bug in antumbra");
                let [a, b] = [a, b].map(|s| light[s.index()]);
                light.push([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]);
            }
            Ok(())
        };
        let before = self.patch_elements.len();
        let patches = &self.patch_elements;
        self.patch_elements =
            self.fit().cut(&mut self.mesh, self.problem.world, None, &mut indirect, patches, interpolate)?;
        if self.patch_elements.len() == before {
            return Ok(false);
        }
        let gather = self.problem.gather_direct(self.wanted_error(), ends);
        light(&gather, &self.mesh, &mut self.direct)?;
        self.sources = Sources::new(self.problem.world, &self.mesh, &self.patch_elements);
        let means =
            direct_means(&self.mesh, self.problem.world, Some(display), &self.direct, &self.patch_elements);
        self.start(means)?;
        Ok(true)
    }

    /// How patches are cut for their light.
    fn fit(&self) -> Fit {
        // A column of many samples costs more, so patches may be larger.
        let many = (self.mesh.samples.len() as f64 / MANY_SAMPLES).max(1.0).sqrt();
        Fit {
            // Where the baked surfaces are dark, the light is elsewhere, and patches there need not be finer for it.
            mean_radiosity: (self.balance.mean_baked(&self.sources, false))
                .max(self.balance.mean_reflected(&self.sources)),
            patch_size: self.patch_size * many,
            triangle_limit: self.problem.settings.triangle_limit(self.mesh.triangles),
        }
    }
}
