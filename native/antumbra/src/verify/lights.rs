//! All lights of a scene: which one a path looks for, and which it may have run into.

use glam::DVec3;
use smallvec::SmallVec;

use crate::scene::world::World;
use crate::verify::light::{Incoming, Kind, Light};
use crate::verify::paths::Surface;
use crate::verify::sky::Sky;
use crate::visibility::ConvexPolygon;

/// All lights of a scene.
pub(super) struct Lights {
    all: Vec<Light>,
    /// Power up to and with each light, where there are too many to look at each.
    powers: Vec<f64>,
    /// Per face: its light, where it is one that paths can run into.
    of_face: Vec<Option<u32>>,
    sky: Option<usize>,
}

/// Lights that are weighed against each other for each place; of more, the brightest are chosen for all places.
const MOST_WEIGHED: usize = 32;

/// Share of the choices that is the same for all lights, so that none is forgotten where its weight misjudges it.
const ALIKE: f64 = 0.1;

impl Lights {
    pub(super) fn new(world: &World) -> Self {
        let mut lights = Vec::new();
        let mut of_face = vec![None; world.faces.len()];
        for (index, face) in world.faces.iter().enumerate() {
            let material = &world.materials[face.material as usize];
            let [a, b, c] = world.corners(face);
            if material.exitance_rgb != [0.0; 3]
                && let Some(polygon) = ConvexPolygon::triangle(a, b, c)
            {
                let met = material.transmittance_rgb != [1.0; 3];
                of_face[index] = met.then_some(lights.len() as u32);
                let exitance = DVec3::from_array(material.exitance_rgb);
                let kind = Kind::Polygon { polygon, exitance, both_sides: true, met };
                lights.push(Light::of_all(kind));
            }
        }
        for light in world.lights.iter().filter(|light| light.exitance_rgb != [0.0; 3]) {
            if let Some(polygon) = ConvexPolygon::new(&light.outline) {
                let exitance = DVec3::from_array(light.exitance_rgb);
                let kind = Kind::Polygon { polygon, exitance, both_sides: false, met: false };
                lights.push(Light::of_all(kind));
            }
        }
        lights.extend(world.lamps.iter().filter_map(|lamp| Light::of_lamp(lamp, world)));
        let sky = world.sky.as_ref().and_then(Sky::new).map(|sky| {
            lights.push(Light::of_all(Kind::Sky(sky)));
            lights.len() - 1
        });
        let mut sum = 0.0;
        let area = world.surface_area();
        let powers = (lights.iter())
            .map(|light| {
                sum += light.power(area);
                sum
            })
            .collect();
        Self { all: lights, powers, of_face, sky }
    }

    /// What each light may be worth at a place, as shares of one.
    pub(super) fn weigh(&self, at: &Surface) -> Weights {
        if self.all.len() > MOST_WEIGHED {
            return Weights(SmallVec::new());
        }
        let mut weights: SmallVec<[f64; MOST_WEIGHED]> =
            self.all.iter().map(|light| light.brightness(at)).collect();
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 {
            let seen = weights.iter().filter(|&&weight| weight > 0.0).count() as f64;
            for weight in weights.iter_mut().filter(|weight| **weight > 0.0) {
                *weight = (1.0 - ALIKE) * *weight / sum + ALIKE / seen;
            }
        }
        Weights(weights)
    }

    /// Chooses a light by a number from 0 to 1, and a direction towards it by two more.
    pub(super) fn choose(
        &self,
        at: &Surface,
        weights: &Weights,
        by: f64,
        place: [f64; 2],
    ) -> Option<Incoming<'_>> {
        let (index, share) = self.pick(weights, by)?;
        let light = &self.all[index];
        let mut incoming = light.towards(at, place)?;
        incoming.worth /= share;
        incoming.density = incoming.density.map(|density| density * share);
        Some(incoming)
    }

    fn pick(&self, weights: &Weights, by: f64) -> Option<(usize, f64)> {
        let total = *self.powers.last()?;
        if weights.0.is_empty() {
            let index = self.powers.partition_point(|&power| power <= by * total).min(self.powers.len() - 1);
            return Some((index, self.share(weights, index)));
        }
        let mut left = by;
        let mut last = None;
        for (index, &weight) in weights.0.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            last = Some((index, weight));
            left -= weight;
            if left < 0.0 {
                break;
            }
        }
        last
    }

    /// The share of choices that falls on a light.
    fn share(&self, weights: &Weights, index: usize) -> f64 {
        if let Some(&weight) = weights.0.get(index) {
            return weight;
        }
        let before = if index > 0 { self.powers[index - 1] } else { 0.0 };
        (self.powers[index] - before) / self.powers[self.powers.len() - 1]
    }

    /// Density per solid angle with which the light that a path ran into would have been chosen; 0 where it is none.
    pub(super) fn density_of_face(&self, weights: &Weights, face: usize, distance: f64, cosine: f64) -> f64 {
        let Some(index) = self.of_face[face] else { return 0.0 };
        let Kind::Polygon { polygon, .. } = &self.all[index as usize].kind else { return 0.0 };
        self.share(weights, index as usize) * distance * distance / (cosine * polygon.area())
    }

    /// What comes from beyond everything, W/m², and the density with which it would have been chosen.
    pub(super) fn beyond(&self, weights: &Weights, direction: DVec3) -> (DVec3, f64) {
        let Some(index) = self.sky else { return (DVec3::ZERO, 0.0) };
        let Kind::Sky(sky) = &self.all[index].kind else { return (DVec3::ZERO, 0.0) };
        let (cell, density) = sky.cell(direction);
        (sky.sends(cell), self.share(weights, index) * density)
    }
}

/// Shares of the choice between lights; none where there are too many.
pub(super) struct Weights(SmallVec<[f64; MOST_WEIGHED]>);
