//! All lights of a scene: which one a path looks for, and which it may have run into.

use std::f64::consts::PI;

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
    /// Lights that are weighed together.
    groups: Vec<Group>,
    /// Per light: its group, and its share of the group's power.
    of_group: Vec<(u32, f64)>,
    /// Per face: its light, where it is one that paths can run into.
    of_face: Vec<Option<u32>>,
    sky: Option<usize>,
}

/// Groups of lights that are weighed against each other for each place. In a flat of 64 rooms a choice by power alone looked for
/// lamps of other rooms, behind walls, 63 times of 64.
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
        let area = world.surface_area();
        let powers: Vec<f64> = lights.iter().map(|light| light.power(area)).collect();
        let groups = grouped(&lights, &powers);
        let mut of_group = vec![(0, 0.0); lights.len()];
        for (index, group) in groups.iter().enumerate() {
            for &(light, _) in &group.members {
                of_group[light as usize] = (index as u32, powers[light as usize] / group.power);
            }
        }
        Self { all: lights, groups, of_group, of_face, sky }
    }

    /// What the lights of each group may be worth at a place, as shares of one.
    pub(super) fn weigh(&self, at: &Surface) -> Weights {
        let brightness = |group: &Group| match group.members[..] {
            [(light, _)] => self.all[light as usize].brightness(at),
            _ => group.brightness(at),
        };
        let mut weights: SmallVec<[f64; MOST_WEIGHED]> = self.groups.iter().map(brightness).collect();
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
        let mut left = by;
        let mut last = None;
        for (group, &weight) in weights.0.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            last = Some((group, left / weight));
            left -= weight;
            if left < 0.0 {
                break;
            }
        }
        // What is left of the number chooses within the group.
        let (group, by) = last?;
        let Group { members, power, .. } = &self.groups[group];
        let index = members.partition_point(|&(_, up_to)| up_to <= by * power).min(members.len() - 1);
        let light = members[index].0 as usize;
        Some((light, self.share(weights, light)))
    }

    /// The share of choices that falls on a light.
    fn share(&self, weights: &Weights, light: usize) -> f64 {
        let (group, share) = self.of_group[light];
        weights.0[group as usize] * share
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

/// Shares of the choice between groups of lights.
pub(super) struct Weights(SmallVec<[f64; MOST_WEIGHED]>);

/// Lights beside each other, among which a choice is made by their power alone.
struct Group {
    /// Lights, each with the power up to and with it, W.
    members: Vec<(u32, f64)>,
    power: f64,
    /// Where most of it comes from, and the mean square of how far away from there, m².
    centre: DVec3,
    spread: f64,
}

impl Group {
    fn new(lights: &[(u32, DVec3)], powers: &[f64]) -> Self {
        let mut power = 0.0;
        let members: Vec<(u32, f64)> = (lights.iter())
            .map(|&(light, _)| {
                power += powers[light as usize];
                (light, power)
            })
            .collect();
        let mean = |of: &dyn Fn(DVec3) -> DVec3| {
            lights.iter().map(|&(light, at)| powers[light as usize] * of(at)).sum::<DVec3>() / power
        };
        let centre = mean(&|at| at);
        let spread = mean(&|at| (at - centre) * (at - centre)).element_sum();
        Self { members, power, centre, spread }
    }

    /// [`Light::brightness`] of all of them, about.
    fn brightness(&self, at: &Surface) -> f64 {
        let way = self.centre.distance_squared(at.position) + self.spread;
        // All lights of the group in one point, and this on it: they light nothing there.
        if way > 0.0 { self.power / PI / way } else { 0.0 }
    }
}

/// Lights in no more groups than are weighed: those beyond everything by themselves, the others by where they are.
fn grouped(lights: &[Light], powers: &[f64]) -> Vec<Group> {
    let (mut near, mut beyond) = (Vec::new(), Vec::new());
    for (index, light) in lights.iter().enumerate().filter(|&(index, _)| powers[index] > 0.0) {
        match light.place() {
            Some(place) => near.push((index as u32, place)),
            None => beyond.push(Group::new(&[(index as u32, DVec3::ZERO)], powers)),
        }
    }
    let mut parts = vec![near];
    while parts.len() + beyond.len() < MOST_WEIGHED {
        // The one that is spread farthest, by its power, in two
        let spread = |part: &[(u32, DVec3)]| {
            let power: f64 = part.iter().map(|&(light, _)| powers[light as usize]).sum();
            power * extent(part).max_element()
        };
        let widest = (0..parts.len()).max_by(|&a, &b| spread(&parts[a]).total_cmp(&spread(&parts[b])));
        let Some(widest) = widest.filter(|&index| parts[index].len() > 1) else { break };
        let mut part = parts.swap_remove(widest);
        let axis = extent(&part).max_position();
        part.sort_by(|a, b| a.1[axis].total_cmp(&b.1[axis]).then(a.0.cmp(&b.0)));
        let other = part.split_off(part.len() / 2);
        parts.extend([part, other]);
    }
    let near = parts.iter().filter(|part| !part.is_empty()).map(|part| Group::new(part, powers));
    near.chain(beyond).collect()
}

/// How far lights are apart along each axis, metres.
fn extent(lights: &[(u32, DVec3)]) -> DVec3 {
    let places = || lights.iter().map(|&(_, place)| place);
    places().reduce(DVec3::max).unwrap_or_default() - places().reduce(DVec3::min).unwrap_or_default()
}
