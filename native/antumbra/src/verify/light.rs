//! One light as random paths look for it: a direction, and what it is worth.
//!
//! By Blender's formulas, written down once more: what `lamps` makes of a light is under test here too.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::index::FaceId;
use crate::scene::world::World;
use crate::scene::{ConeInput, LampInput, LampShape};
use crate::transport::gather::rms;
use crate::transport::sources::blockers_among;
use crate::verify::beams::{LEAST_SPREAD, in_disc, kept_by_cone, kept_by_spread, panel_point};
use crate::verify::paths::Surface;
use crate::verify::sky::Sky;
use crate::visibility::ConvexPolygon;
use crate::visibility::blockers::Blockers;
use crate::visibility::rays::point_on;

/// A light.
pub(super) struct Light {
    pub(super) kind: Kind,
    /// Whether each object is lit, where not all are.
    lights: Option<Vec<bool>>,
    stopped_by: Stops,
}

/// What stops a light.
enum Stops {
    Nothing,
    All,
    Some(Box<Blockers>),
}

pub(super) enum Kind {
    /// Sends to the side of its normal, or to both.
    Polygon {
        polygon: ConvexPolygon,
        exitance: DVec3,
        both_sides: bool,
        met: bool,
    },
    Panel {
        polygon: ConvexPolygon,
        exitance: DVec3,
        half_spread: f64,
    },
    Sun {
        towards: DVec3,
        half_angle: f64,
        irradiance: DVec3,
    },
    Round {
        centre: DVec3,
        radius: f64,
        faces_receiver: bool,
        intensity: DVec3,
        cone: Option<ConeInput>,
    },
    Sky(Sky),
}

/// What stops the light from a direction.
pub(super) enum Stopped<'a> {
    Never,
    ByAll,
    Among(&'a Blockers),
}

/// Where light may come from.
pub(super) struct Incoming<'a> {
    /// Unit vector.
    pub(super) direction: DVec3,
    /// How far away it is; infinite for what lies beyond everything.
    pub(super) distance: f64,
    /// Irradiance of what faces it, over the density with which it was chosen, W/m².
    pub(super) worth: DVec3,
    /// Density per solid angle with which it was chosen, where a path could have run into it.
    pub(super) density: Option<f64>,
    /// What can hide it.
    pub(super) stopped_by: Stopped<'a>,
}

impl Light {
    /// One that lights all and is stopped by all.
    pub(super) fn of_all(kind: Kind) -> Self {
        Self { kind, lights: None, stopped_by: Stops::All }
    }

    fn lights(&self, object: u32) -> bool {
        self.lights.as_ref().is_none_or(|lights| lights[object as usize])
    }

    pub(super) fn of_lamp(input: &LampInput, world: &World) -> Option<Self> {
        let kind = match &input.shape {
            LampShape::Sun { direction, angle, irradiance_rgb } => Kind::Sun {
                towards: direction.normalize(),
                half_angle: (0.5 * angle).min(0.5 * PI),
                irradiance: DVec3::from_array(*irradiance_rgb),
            },
            LampShape::Point { position, radius, faces_receiver, intensity_rgb, cone } => Kind::Round {
                centre: *position,
                radius: *radius,
                faces_receiver: *faces_receiver,
                intensity: DVec3::from_array(*intensity_rgb),
                cone: *cone,
            },
            LampShape::Panel { outline, exitance_rgb, spread } => Kind::Panel {
                polygon: ConvexPolygon::new(outline)?,
                exitance: DVec3::from_array(*exitance_rgb),
                half_spread: (0.5 * spread).max(LEAST_SPREAD),
            },
        };
        if input.strength_rgb() == [0.0; 3] {
            return None;
        }
        let among = |objects: &Option<Vec<u32>>| {
            let mut is_among = vec![false; world.objects.len()];
            for &object in objects.as_ref()? {
                is_among[object as usize] = true;
            }
            Some(is_among)
        };
        let stopped_by = match among(&input.blocking_objects) {
            _ if !input.casts_shadows => Stops::Nothing,
            None => Stops::All,
            Some(blocks) => {
                let stops = |face: FaceId| blocks[world.faces[face.index()].object.index()];
                Stops::Some(Box::new(blockers_among(world, stops)))
            }
        };
        Some(Self { kind, lights: among(&input.lit_objects), stopped_by })
    }

    /// Power that it sends into a scene of so much surface, about, W.
    pub(super) fn power(&self, surface_area: f64) -> f64 {
        match &self.kind {
            Kind::Polygon { polygon, exitance, both_sides, .. } => {
                polygon.area() * rms(*exitance) * if *both_sides { 2.0 } else { 1.0 }
            }
            Kind::Panel { polygon, exitance, .. } => polygon.area() * rms(*exitance),
            Kind::Sun { irradiance, .. } => 0.25 * surface_area * rms(*irradiance),
            Kind::Round { intensity, .. } => 4.0 * PI * rms(*intensity),
            Kind::Sky(sky) => 0.5 * surface_area * sky.brightness(),
        }
    }

    /// Where it is; none for what lies beyond everything.
    pub(super) fn place(&self) -> Option<DVec3> {
        match &self.kind {
            Kind::Polygon { polygon, .. } | Kind::Panel { polygon, .. } => Some(polygon.centroid()),
            Kind::Round { centre, .. } => Some(*centre),
            Kind::Sun { .. } | Kind::Sky(_) => None,
        }
    }

    /// What it could be worth at a place: above 0 wherever it is worth anything.
    pub(super) fn brightness(&self, surface: &Surface) -> f64 {
        if !self.lights(surface.object) {
            return 0.0;
        }
        let (at, normal) = (surface.position, surface.normal);
        match &self.kind {
            Kind::Polygon { polygon, exitance, both_sides, .. } => {
                let ahead = *both_sides || polygon.normal().dot(at - polygon.vertices()[0]) > 0.0;
                let above = polygon.vertices().iter().any(|v| normal.dot(v - at) > 0.0);
                let size = polygon.area() / PI;
                let way = (polygon.centroid() - at).length_squared();
                if ahead && above { rms(*exitance) * size / (way + size) } else { 0.0 }
            }
            Kind::Panel { polygon, exitance, half_spread } => {
                // What is kept together is as much brighter ahead.
                let size = polygon.area() / PI / half_spread.sin().powi(2);
                let way = (polygon.centroid() - at).length_squared();
                rms(*exitance) * size / (way + size)
            }
            Kind::Sun { irradiance, .. } => rms(*irradiance),
            Kind::Round { centre, radius, intensity, .. } => {
                let way = (centre - at).length_squared();
                if normal.dot(centre - at) > -1.01 * radius && way > 0.0 {
                    rms(*intensity) / (way + radius * radius)
                } else {
                    0.0
                }
            }
            Kind::Sky(sky) => 0.5 * sky.brightness(),
        }
    }

    /// A direction towards it.
    pub(super) fn towards(&self, surface: &Surface, place: [f64; 2]) -> Option<Incoming<'_>> {
        if !self.lights(surface.object) {
            return None;
        }
        let (at, normal) = (surface.position, surface.normal);
        let incoming = |way: DVec3, worth: DVec3| {
            let distance = way.length();
            let stopped_by = match &self.stopped_by {
                Stops::Nothing => Stopped::Never,
                Stops::All => Stopped::ByAll,
                Stops::Some(blockers) => Stopped::Among(blockers),
            };
            Incoming { direction: way / distance, distance, worth, density: None, stopped_by }
        };
        match &self.kind {
            Kind::Polygon { polygon, exitance, both_sides, met } => {
                let way = point_on(polygon, place) - at;
                let cosine = -polygon.normal().dot(way) / way.length();
                let cosine = if *both_sides { cosine.abs() } else { cosine };
                (cosine > 0.0).then(|| {
                    let density = way.length_squared() / (cosine * polygon.area());
                    let density_if_met = met.then_some(density);
                    Incoming { density: density_if_met, ..incoming(way, *exitance / (PI * density)) }
                })
            }
            Kind::Panel { polygon, exitance, half_spread } => {
                let (point, area) = panel_point(polygon, *half_spread, at, place)?;
                let way = point - at;
                let cosine = -polygon.normal().dot(way) / way.length();
                let kept = kept_by_spread(*half_spread, cosine);
                (kept > 0.0)
                    .then(|| incoming(way, kept * cosine * area / (PI * way.length_squared()) * *exitance))
            }
            Kind::Sun { towards, half_angle, irradiance } => {
                // All of it over the part of the hemisphere that the disc fills, uniform in solid angle
                let least = half_angle.cos();
                let worth = 2.0 / (1.0 + least) * *irradiance;
                let way = in_cone(*towards, 1.0 - least, place);
                Some(Incoming { distance: f64::INFINITY, ..incoming(way, worth) })
            }
            Kind::Round { centre, radius, faces_receiver, intensity, cone } => {
                let way = centre - at;
                let distance = way.length();
                let kept = |way: DVec3| cone.as_ref().map_or(1.0, |cone| kept_by_cone(cone, -way));
                if distance == 0.0 {
                    return None;
                }
                if *radius == 0.0 {
                    return Some(incoming(way, kept(way) / (distance * distance) * *intensity));
                }
                if *faces_receiver {
                    // Of a disc, its radiance being the intensity over its area
                    let (u, v) = (way / distance).any_orthonormal_pair();
                    let [x, y] = in_disc(place);
                    let way = way + radius * (x * u + y * v);
                    let cosine = distance / way.length();
                    return Some(incoming(way, kept(way) * cosine / way.length_squared() * *intensity));
                }
                if distance <= *radius {
                    // Inside, all of the hemisphere shines, and nothing blocks it.
                    let worth = kept(way) / (radius * radius) * *intensity;
                    return Some(Incoming { stopped_by: Stopped::Never, ..incoming(normal, worth) });
                }
                let sine2 = (radius / distance).powi(2);
                let open = sine2 / (1.0 + (1.0 - sine2).sqrt());
                let direction = in_cone(way / distance, open, place);
                let radiance = *intensity / (PI * radius * radius);
                // To the disc inside the circle where lines of sight touch it
                let reach = distance * (1.0 - sine2) / direction.dot(way / distance);
                Some(incoming(reach * direction, kept(direction) * TAU * open * radiance))
            }
            Kind::Sky(sky) => {
                let (direction, cell, density) = sky.choose(place);
                let worth = sky.sends(cell) / (PI * density);
                let distance = f64::INFINITY;
                Some(Incoming { distance, density: Some(density), ..incoming(direction, worth) })
            }
        }
    }
}

/// Uniform in solid angle about an axis; `open`: one less the cosine of half the cone's angle.
fn in_cone(axis: DVec3, open: f64, [u, v]: [f64; 2]) -> DVec3 {
    let below = u * open;
    let sine = (below * (2.0 - below)).sqrt();
    let (x, y) = axis.any_orthonormal_pair();
    let (s, c) = (TAU * v).sin_cos();
    sine * (c * x + s * y) + (1.0 - below) * axis
}
