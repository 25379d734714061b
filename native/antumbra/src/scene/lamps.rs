//! Lights that are neither meshes nor plain panels: the sun, points and spots, panels with a spread, and the sky.
//!
//! With Blender's power P (energy · colour · 2^exposure …) in W: a point's radiant intensity is P/(4 pi) and the
//! irradiance from a sun its strength; a radiance L is handed in as pi·L, like every exitance.

use glam::{DMat3, DVec3};

use crate::error::Error;
use crate::scene::validation::{FARTHEST, validate_outline, validate_points, validate_strength};

/// A light that is not a mesh and does not block.
#[derive(Debug, Clone)]
pub struct LampInput {
    /// For messages.
    pub name: String,
    /// Whether surfaces block its light.
    pub casts_shadows: bool,
    /// The objects that it lights; `None` for all.
    pub lit_objects: Option<Vec<u32>>,
    /// The objects that block its light, where they block any; `None` for all.
    pub blocking_objects: Option<Vec<u32>>,
    /// What and where it is.
    pub shape: LampShape,
}

/// What a lamp is. Colours may be negative, as in Blender.
#[derive(Debug, Clone)]
pub enum LampShape {
    /// Light from far away.
    Sun {
        /// Towards the sun; of any length but 0.
        direction: DVec3,
        /// Angular diameter of its disc, radians, 0 (no disc) to pi.
        angle: f64,
        /// Irradiance of a surface that faces it, W/m² per channel.
        irradiance_rgb: [f64; 3],
    },
    /// Light from a point, or from something round about it.
    Point {
        /// World space, metres.
        position: DVec3,
        /// Metres; 0 for a point.
        radius: f64,
        /// Seen as a disc of that radius that always faces the receiver (Blender's soft falloff); else as a sphere.
        faces_receiver: bool,
        /// Radiant intensity, W/sr per channel; something round has the radiance of it over `pi·radius²`.
        intensity_rgb: [f64; 3],
        /// What a spot light keeps of it.
        cone: Option<ConeInput>,
    },
    /// A flat light that sends to one side.
    Panel {
        /// A convex outline in world space, metres, counter-clockwise seen from the lit side.
        outline: Vec<DVec3>,
        /// Exitance per channel, W/m², of light that is sent to all of that side.
        exitance_rgb: [f64; 3],
        /// Full angle of what light is kept to, radians, above 0 to pi (everything).
        spread: f64,
    },
}

/// A spot light's cone: times `smoothstep((cos a - c) / ((1 - c)·blend))`, with c the cosine at its border.
#[derive(Debug, Clone, Copy)]
pub struct ConeInput {
    /// Turns a direction of light into the cone's own space, where the cone is round about +z: an ellipse in the world
    /// where the light is scaled.
    pub cone_from_world: DMat3,
    /// Full angle, radians, 0 to pi.
    pub angle: f64,
    /// Share of the cone over which it fades, 0 to 1.
    pub blend: f64,
}

/// Light from all around, the background of the world, on the faces of a cube of directions.
///
/// Face `2a + s` is towards +axis a (s = 0) or -axis a (s = 1), of x, y and z. Its columns run along the next axis and its
/// rows along the one after that, both from -1 to 1 where the face is 1 away.
#[derive(Debug, Clone)]
pub struct SkyInput {
    /// For messages.
    pub name: String,
    /// A power of two; 1 for a sky that is even on each face.
    pub cells_per_side: usize,
    /// pi times the mean radiance of each cell, W/m² per channel: face by face, row by row.
    pub exitance_rgb: Vec<[f64; 3]>,
}

impl LampInput {
    /// A lamp that lights everything, which blocks its light.
    pub fn new(name: &str, shape: LampShape) -> Self {
        Self { name: name.to_owned(), casts_shadows: true, lit_objects: None, blocking_objects: None, shape }
    }

    /// The points that must move with the world.
    pub(crate) fn points_mut(&mut self) -> &mut [DVec3] {
        match &mut self.shape {
            LampShape::Sun { .. } => &mut [],
            LampShape::Point { position, .. } => std::slice::from_mut(position),
            LampShape::Panel { outline, .. } => outline,
        }
    }

    /// The same to look at.
    pub(crate) fn points(&self) -> &[DVec3] {
        match &self.shape {
            LampShape::Sun { .. } => &[],
            LampShape::Point { position, .. } => std::slice::from_ref(position),
            LampShape::Panel { outline, .. } => outline,
        }
    }

    /// Strength per channel, whatever its unit.
    pub(crate) fn strength_rgb(&self) -> [f64; 3] {
        match self.shape {
            LampShape::Sun { irradiance_rgb: rgb, .. }
            | LampShape::Point { intensity_rgb: rgb, .. }
            | LampShape::Panel { exitance_rgb: rgb, .. } => rgb,
        }
    }

    pub(super) fn validate(&self) -> Result<(), Error> {
        let name = || self.name.clone();
        validate_strength(&self.name, &self.strength_rgb())?;
        validate_points(&self.name, self.points())?;
        let within = |what, value: f64, most: f64| {
            if (0.0..=most).contains(&value) {
                Ok(())
            } else {
                Err(Error::LightOutOfRange { light: name(), what, value, most })
            }
        };
        match &self.shape {
            LampShape::Sun { direction, angle, .. } => {
                if !(direction.is_finite() && direction.length_squared() > 0.0) {
                    return Err(Error::LightNotFinite { light: name() });
                }
                within("angle", *angle, std::f64::consts::PI)
            }
            LampShape::Point { radius, cone, .. } => {
                within("radius", *radius, FARTHEST)?;
                let Some(cone) = cone else { return Ok(()) };
                if !cone.cone_from_world.is_finite() {
                    return Err(Error::LightNotFinite { light: name() });
                }
                within("cone angle", cone.angle, std::f64::consts::PI)?;
                within("blend", cone.blend, 1.0)
            }
            LampShape::Panel { outline, spread, .. } => {
                validate_outline(&self.name, outline)?;
                within("spread", *spread, std::f64::consts::PI)
            }
        }
    }
}

impl SkyInput {
    /// An even sky.
    pub fn even(name: &str, exitance_rgb: [f64; 3]) -> Self {
        Self { name: name.to_owned(), cells_per_side: 1, exitance_rgb: vec![exitance_rgb; 6] }
    }

    pub(super) fn validate(&self) -> Result<(), Error> {
        validate_strength(&self.name, self.exitance_rgb.as_flattened())?;
        let expected = self.cells_per_side.checked_pow(2).and_then(|cells| cells.checked_mul(6));
        if !self.cells_per_side.is_power_of_two() || expected != Some(self.exitance_rgb.len()) {
            let got = self.exitance_rgb.len();
            return Err(Error::SkyCells { light: self.name.clone(), got, per_side: self.cells_per_side });
        }
        Ok(())
    }
}
