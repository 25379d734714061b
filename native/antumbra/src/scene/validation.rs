//! What a scene must be to be baked: every number finite and within reach, every index in range.

use glam::DVec3;

use crate::error::Error;
use crate::scene::{AreaLightInput, LampInput, MaterialInput, ObjectInput};
use crate::visibility::ConvexPolygon;

/// Coordinates beyond it are refused, metres. Their squares are areas in the single precision of the search tree, which
/// ends at 3e38; a light-year is 1e16 m.
pub(super) const FARTHEST: f64 = 1e15;

/// The same for strengths, W/m² or W/sr: colours are single precision.
pub(super) const STRONGEST: f64 = 1e30;

/// How far an outline may be from flat and convex, of its size. What comes in single precision and was turned is off by
/// 1e-7; what errs by 1e-4 is lit wrong by about as much.
const FLAT: f64 = 1e-4;

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

pub(super) fn validate_material(material: &MaterialInput) -> Result<(), Error> {
    let name = || material.name.clone();
    for (channel, &value) in CHANNELS.into_iter().zip(&material.reflectance_rgb) {
        if !(0.0..=1.0).contains(&value) {
            return Err(Error::ReflectanceOutOfRange { material: name(), channel, value });
        }
    }
    for (channel, &value) in CHANNELS.into_iter().zip(&material.transmittance_rgb) {
        if !(0.0..=1.0).contains(&value) {
            return Err(Error::TransmittanceOutOfRange { material: name(), channel, value });
        }
    }
    for (channel, &value) in CHANNELS.into_iter().zip(&material.exitance_rgb) {
        if !(0.0..=STRONGEST).contains(&value) {
            return Err(Error::ExitanceInvalid { material: name(), channel, value });
        }
    }
    Ok(())
}

pub(super) fn validate_light(light: &AreaLightInput) -> Result<(), Error> {
    validate_strength(&light.name, &light.exitance_rgb)?;
    validate_points(&light.name, &light.outline)?;
    validate_outline(&light.name, &light.outline)
}

/// Strength per channel, whatever its unit.
pub(super) fn validate_strength(light: &str, strength_rgb: &[f64]) -> Result<(), Error> {
    let light = || light.to_owned();
    match strength_rgb.iter().copied().find(|v| !v.is_finite() || v.abs() > STRONGEST) {
        None => Ok(()),
        Some(value) if !value.is_finite() => Err(Error::LightNotFinite { light: light() }),
        Some(value) => {
            let (what, value) = ("strength", value.abs());
            Err(Error::LightOutOfRange { light: light(), what, value, most: STRONGEST })
        }
    }
}

/// Where a light is, world space, metres.
pub(super) fn validate_points(light: &str, points: &[DVec3]) -> Result<(), Error> {
    let light = || light.to_owned();
    if !points.iter().all(|p| p.is_finite()) {
        return Err(Error::LightNotFinite { light: light() });
    }
    let value = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    if value > FARTHEST {
        let what = "distance from the origin";
        return Err(Error::LightOutOfRange { light: light(), what, value, most: FARTHEST });
    }
    Ok(())
}

/// Flat, convex, and once around. What has no area is no light, which is said elsewhere.
pub(super) fn validate_outline(light: &str, outline: &[DVec3]) -> Result<(), Error> {
    let Some(polygon) = ConvexPolygon::new(outline) else { return Ok(()) };
    let (vertices, normal) = (polygon.vertices(), polygon.normal());
    let offsets = || vertices.iter().map(|&v| v - polygon.centroid());
    let size = offsets().map(DVec3::length).fold(0.0, f64::max);
    let farthest = vertices.iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
    let rounding = f64::from(f32::EPSILON) * farthest;
    let slack = FLAT * size + rounding;
    // Of what is no wider than its corners are known, the normal is not known.
    let narrow = polygon.area() <= rounding * size;
    let flat = narrow || offsets().all(|offset| normal.dot(offset).abs() <= slack);
    let (mut convex, mut turned) = (true, 0.0);
    for i in 0..vertices.len() {
        let [a, b, c] = [0, 1, 2].map(|k| vertices[(i + k) % vertices.len()]);
        let (to, on) = (b - a, c - b);
        let turn = normal.dot(to.cross(on));
        convex &= turn >= -slack * to.length().max(on.length());
        turned += turn.atan2(to.dot(on));
    }
    // A star turns to one side all the way, and twice around.
    let once = turned < 1.5 * std::f64::consts::TAU;
    if flat && convex && once { Ok(()) } else { Err(Error::LightOutline { light: light.to_owned() }) }
}

pub(super) fn validate_links(lamp: &LampInput, objects: usize) -> Result<(), Error> {
    let linked = [&lamp.lit_objects, &lamp.blocking_objects];
    match linked.into_iter().flatten().flatten().find(|&&object| object as usize >= objects) {
        None => Ok(()),
        Some(&object) => Err(Error::LinkOutOfRange { light: lamp.name.clone(), object, objects }),
    }
}

pub(super) fn validate_object(object: &ObjectInput, materials: usize) -> Result<(), Error> {
    let name = || object.name.clone();
    let expect = |array, got, expected| {
        if got == expected {
            Ok(())
        } else {
            Err(Error::LengthMismatch { object: name(), array, got, expected })
        }
    };
    expect("triangle_materials", object.triangle_materials.len(), object.triangles.len())?;
    if let Some(normals) = &object.corner_normals {
        expect("corner_normals", normals.len(), object.triangles.len())?;
        if let Some(corner) = normals.as_flattened().iter().position(|n| !n.is_finite()) {
            return Err(Error::NormalNotFinite { object: name(), corner });
        }
    }
    if !object.world_from_object.is_finite() {
        return Err(Error::TransformNotFinite { object: name() });
    }
    let transform = &object.world_from_object;
    let vertices = object.positions.len();
    if let Some(vertex) = object.positions.iter().position(|&p| !transform.transform_point3(p).is_finite()) {
        return Err(Error::VertexNotFinite { object: name(), vertex });
    }
    let is_far = |&p: &DVec3| transform.transform_point3(p).abs().max_element() > FARTHEST;
    if let Some(vertex) = object.positions.iter().position(is_far) {
        return Err(Error::VertexTooFar { object: name(), vertex, most: FARTHEST });
    }
    for (triangle, corners) in object.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
            return Err(Error::VertexOutOfRange { object: name(), triangle, vertex, vertices });
        }
    }
    for (triangle, &material) in object.triangle_materials.iter().enumerate() {
        if material as usize >= materials {
            return Err(Error::MaterialOutOfRange { object: name(), triangle, material, materials });
        }
    }
    Ok(())
}
