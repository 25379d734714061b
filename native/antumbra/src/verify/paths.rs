//! Light along random paths: at each surface a look at one light and one more direction, until chance ends the path.
//!
//! A light that a path may both look for and run into counts by the balance of the two (Veach, Guibas 1995).

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::world::World;
use crate::transport::sources::whole_faces;
use crate::verify::light::{Incoming, Stopped};
use crate::verify::lights::Lights;
use crate::visibility::blockers::Blockers;
use crate::visibility::rays::{splitmix, unit};
use crate::visibility::trace::Hit;

/// What a path stands on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    pub(super) position: DVec3,
    /// Unit vector about which light is received.
    pub(super) normal: DVec3,
    /// Unit normal of the face itself: from behind it nothing arrives.
    pub(super) flat_normal: DVec3,
    /// The object that it is of, which lights may leave out.
    pub(super) object: u32,
}

/// An estimate, and what it took.
#[derive(Debug, Clone, Copy)]
pub(super) struct Traced {
    /// W/m².
    pub(super) irradiance: DVec3,
    pub(super) rays: u64,
}

/// What paths run through.
pub(super) struct Paths<'a> {
    world: &'a World,
    blockers: &'a Blockers,
    lights: &'a Lights,
    /// Per blocker, its one or two faces.
    faces: Vec<[u32; 2]>,
}

/// The most that a path goes on with at a surface. White surfaces would else hold it for ever; what goes on counts for more.
const MOST_SURVIVAL: f64 = 0.98;

/// Inverse powers of the generalised golden ratios (Roberts 2018), whose multiples cover two and three dimensions evenly.
const EVEN_2D: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
const EVEN_3D: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];

impl<'a> Paths<'a> {
    pub(super) fn new(world: &'a World, blockers: &'a Blockers, lights: &'a Lights) -> Self {
        let faces = (whole_faces(world).iter())
            .map(|whole| [whole.halves[0] as u32, whole.halves[whole.halves.len() - 1] as u32])
            .collect();
        Self { world, blockers, lights, faces }
    }

    /// The mean of so many paths from a surface. `seed`: another one, another estimate.
    ///
    /// The first looks are spread evenly, all by one random shift: each path by itself is as random as any.
    pub(super) fn irradiance(&self, from: &Surface, seed: u64, count: usize) -> Traced {
        let mut chance = Chance::new(seed);
        let shift: [f64; 5] = std::array::from_fn(|_| chance.next());
        let mut walk = Walk { paths: self, chance, rays: 0 };
        let mut sum = DVec3::ZERO;
        for k in 1..=count {
            let even = |shift: f64, step: f64| (shift + step * k as f64).fract();
            let first = First {
                direction: std::array::from_fn(|axis| even(shift[axis], EVEN_2D[axis])),
                light: std::array::from_fn(|axis| even(shift[2 + axis], EVEN_3D[axis])),
            };
            sum += walk.go(from, first);
        }
        Traced { irradiance: sum / count as f64, rays: walk.rays }
    }

    /// The face that was met.
    fn face(&self, hit: Hit, at: DVec3) -> usize {
        let [one, other] = self.faces[hit.polygon as usize];
        if one == other {
            return one as usize;
        }
        let face = &self.world.faces[one as usize];
        let corners = self.world.corners(face);
        let inside = (0..3).all(|k| {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            let turn = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            (to - from).cross(at - from).dot(turn) >= 0.0
        });
        if inside { one as usize } else { other as usize }
    }
}

/// The numbers that a path begins by.
#[derive(Clone, Copy)]
struct First {
    direction: [f64; 2],
    light: [f64; 3],
}

struct Walk<'a> {
    paths: &'a Paths<'a>,
    chance: Chance,
    rays: u64,
}

impl Walk<'_> {
    /// The light that one path brings to a surface, W/m².
    fn go(&mut self, from: &Surface, first: First) -> DVec3 {
        let Paths { world, blockers, lights, .. } = *self.paths;
        let mut here = *from;
        let mut numbers = first;
        let mut arrived = DVec3::ZERO;
        let mut carried = DVec3::ONE;
        loop {
            // One look at a light
            let weights = lights.weigh(&here);
            let [by, place @ ..] = numbers.light;
            if let Some(light) = lights.choose(&here, &weights, by, place) {
                let cosine = here.normal.dot(light.direction);
                if cosine > 0.0 && here.flat_normal.dot(light.direction) > 0.0 {
                    let balance = light.density.map_or(1.0, |density| density / (density + cosine / PI));
                    let through = self.through(here.position, &light);
                    arrived += carried * (through * balance * cosine * light.worth);
                }
            }

            // One direction, as often as light from there counts
            let direction = about(here.normal, numbers.direction);
            if here.flat_normal.dot(direction) <= 0.0 {
                return arrived;
            }
            let own_density = here.normal.dot(direction) / PI;
            let mut travelled = 0.0;
            let (face, material, position, normal) = loop {
                self.rays += 1;
                let Some(hit) = blockers.first_hit(here.position + travelled * direction, direction) else {
                    let (light, density) = lights.beyond(&weights, direction);
                    return arrived + carried * (own_density / (own_density + density) * light);
                };
                travelled += hit.distance;
                let position = here.position + travelled * direction;
                let face = self.paths.face(hit, position);
                let material = &world.materials[world.faces[face].material as usize];
                let normal = blockers.polygons()[hit.polygon as usize].normal();
                let normal = if hit.front { normal } else { -normal };
                if material.exitance_rgb != [0.0; 3] {
                    let cosine = -normal.dot(direction);
                    let density = lights.density_of_face(&weights, face, travelled, cosine);
                    let balance = own_density / (own_density + density);
                    arrived += carried * (balance * DVec3::from_array(material.exitance_rgb));
                }
                // What lets light through is passed as often as it does, or stops the path.
                let through = DVec3::from_array(material.transmittance_rgb);
                let passes = through.element_sum() / 3.0;
                if passes == 0.0 {
                    break (face, material, position, normal);
                }
                if self.chance.next() >= passes {
                    carried /= 1.0 - passes;
                    break (face, material, position, normal);
                }
                carried *= through / passes;
            };

            // On from there, or not
            carried *= DVec3::from_array(material.reflectance_rgb);
            let survival = carried.max_element().min(MOST_SURVIVAL);
            if self.chance.next() >= survival {
                return arrived;
            }
            carried /= survival;
            let object = world.faces[face].object.index() as u32;
            here = Surface { position, normal, flat_normal: normal, object };
            numbers = First {
                direction: std::array::from_fn(|_| self.chance.next()),
                light: std::array::from_fn(|_| self.chance.next()),
            };
        }
    }

    /// The share of a light that nothing stops on its way, per channel.
    fn through(&mut self, from: DVec3, light: &Incoming) -> DVec3 {
        let blockers = match light.stopped_by {
            Stopped::Never => return DVec3::ONE,
            Stopped::ByAll => self.paths.blockers,
            Stopped::Among(blockers) => blockers,
        };
        self.rays += 1;
        // What is endlessly far away is beyond everything.
        let distance = light.distance.min(BEYOND * blockers.diagonal());
        blockers.between(from, from + distance * light.direction)
    }
}

/// A distance beyond everything, in diagonals of the scene.
const BEYOND: f64 = 4.0;

/// A direction about a normal, by the cosine (Malley's method).
fn about(normal: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let (x, y) = normal.any_orthonormal_pair();
    let (sine, cosine) = (TAU * v).sin_cos();
    (u.sqrt() * (cosine * x + sine * y) + (1.0 - u).max(0.0).sqrt() * normal).normalize()
}

/// Random numbers from 0 to 1 that depend on a seed alone.
struct Chance(u64);

impl Chance {
    fn new(seed: u64) -> Self {
        Self(splitmix(seed ^ 0xD1B5_4A32_D192_ED03))
    }

    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        unit(splitmix(self.0))
    }
}
