//! Light that is not sent alike in all directions: spot lights' cones and area lights' spread, by Blender's formulas.

use glam::{DMat3, DVec3};
use smallvec::SmallVec;

use crate::scene::ConeInput;
use crate::visibility::ConvexPolygon;

/// What a spot light keeps of a point's light.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "a transform is named by the spaces it joins")]
pub(super) struct Cone {
    cone_from_world: DMat3,
    /// Cosine at the border.
    border: f64,
    /// Difference of the cosine over which it fades.
    fades_over: f64,
}

impl Cone {
    pub(super) fn new(input: &ConeInput) -> Self {
        let border = (0.5 * input.angle).cos();
        Self { cone_from_world: input.cone_from_world, border, fades_over: (1.0 - border) * input.blend }
    }

    /// The share that is kept of light which goes in a direction of any length.
    pub(super) fn keeps(&self, direction: DVec3) -> f64 {
        let cosine = (self.cone_from_world * direction).normalize_or_zero().z;
        let inside = cosine - self.border;
        if inside <= 0.0 {
            return 0.0;
        }
        // Without a blend the border is sharp.
        let t = if inside >= self.fades_over { 1.0 } else { inside / self.fades_over };
        t * t * (3.0 - 2.0 * t)
    }

    /// Whether light is kept as it is in all of these directions, and in all between them: the kept ones are convex.
    pub(super) fn keeps_all(&self, mut directions: impl Iterator<Item = DVec3>) -> bool {
        directions.all(|direction| self.keeps(direction) == 1.0)
    }
}

/// What an area light keeps of its light: `max(0, (tan h - tan a)/(tan h - h))` at an angle a from its normal, h being
/// half of its spread.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    tangent: f64,
    scale: f64,
}

/// Half of a spread up to which it is everything: Blender's 180 degrees as a 32-bit number of radians and less.
const EVERYTHING: f64 = 0.5 * std::f64::consts::PI - 1e-6;

/// The least half of a spread, radians: 1/100 of a degree. Light of none would go straight ahead only, to an irradiance
/// that does not depend on the distance.
const LEAST: f64 = 1.7e-4;

impl Spread {
    /// Of a full angle; nothing when that keeps everything.
    pub(super) fn new(spread: f64) -> Option<Self> {
        let half = (0.5 * spread).max(LEAST);
        if half >= EVERYTHING {
            return None;
        }
        let tangent = half.tan();
        // tan h - h, without cancellation
        let excess = if half < 0.05 {
            half.powi(3) * (1.0 / 3.0 + half * half * (2.0 / 15.0))
        } else {
            tangent - half
        };
        Some(Self { tangent, scale: 1.0 / excess })
    }

    /// The share that is kept of light which goes in a direction of any length from a light of this normal.
    pub(super) fn keeps(&self, direction: DVec3, normal: DVec3) -> f64 {
        let ahead = normal.dot(direction);
        if ahead <= 0.0 {
            return 0.0;
        }
        let aside = (direction - ahead * normal).length();
        ((self.tangent - aside / ahead) * self.scale).max(0.0)
    }

    /// The part of the light that sends to a place at all, and some more: a square about the point above it.
    pub(super) fn reaches(&self, light: &ConvexPolygon, place: DVec3) -> Option<ConvexPolygon> {
        let normal = light.normal();
        let height = normal.dot(place - light.vertices()[0]);
        let foot = place - height * normal;
        let reach = 1.001 * height * self.tangent;
        let (u, v) = normal.any_orthonormal_pair();
        let mut outline: SmallVec<[DVec3; 8]> = light.vertices().iter().copied().collect();
        for side in [u, v, -u, -v] {
            outline = cut(&outline, |point| reach - side.dot(point - foot));
            if outline.len() < 3 {
                return None;
            }
        }
        ConvexPolygon::new(&outline)
    }
}

/// The part of a convex outline where a linear height is not negative.
fn cut(outline: &[DVec3], height: impl Fn(DVec3) -> f64) -> SmallVec<[DVec3; 8]> {
    let mut kept = SmallVec::new();
    for (k, &a) in outline.iter().enumerate() {
        let b = outline[(k + 1) % outline.len()];
        let (from, to) = (height(a), height(b));
        if from >= 0.0 {
            kept.push(a);
        }
        if from * to < 0.0 {
            kept.push(a.lerp(b, from / (from - to)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn a_cone_fades_as_a_smoothstep_of_the_cosine() {
        let input = ConeInput { cone_from_world: DMat3::IDENTITY, angle: 1.2, blend: 0.5 };
        let cone = Cone::new(&input);
        let at = |angle: f64| cone.keeps(3.0 * DVec3::new(angle.sin(), 0.0, angle.cos()));
        let border = 0.6_f64.cos();
        let middle = (border + 0.25 * (1.0 - border)).acos();
        assert_eq!((at(0.0), at(0.61), at(PI)), (1.0, 0.0, 0.0));
        assert!((at(middle) - 0.5).abs() < 1e-12);
        let sharp = Cone::new(&ConeInput { blend: 0.0, ..input });
        assert_eq!(
            (sharp.keeps(DVec3::new(0.6_f64.tan() * 0.999, 0.0, 1.0)), sharp.keeps(DVec3::X)),
            (1.0, 0.0)
        );
    }

    /// What a small light sends does not depend on its spread: it is only kept together.
    #[test]
    fn a_spread_keeps_the_power() {
        for spread in [0.003, 0.5, 1.5, 3.0] {
            let kept = Spread::new(spread).expect("it keeps less than all");
            let steps = 200_000;
            let h = 0.5 * spread;
            // Per steradian, times the cosine at the light; all of it sends pi
            let power: f64 = (0..steps)
                .map(|k| {
                    let a = h * (f64::from(k) + 0.5) / f64::from(steps);
                    let keeps = kept.keeps(DVec3::new(a.sin(), 0.0, a.cos()), DVec3::Z);
                    2.0 * PI * keeps * a.sin() * a.cos() * h / f64::from(steps)
                })
                .sum();
            assert!((power / PI - 1.0).abs() < 1e-6, "{spread}: {power}");
        }
        assert!(Spread::new(PI).is_none());
    }
}
