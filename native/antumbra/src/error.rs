//! Everything that can be wrong with what the caller handed in, each naming the object and the index.

use std::collections::BTreeSet;

use thiserror::Error;

/// Why a bake was refused or ended early. The caller's data is never changed by a failed bake.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each field's name and the message of its variant say what it is")]
pub enum Error {
    /// A vertex coordinate is NaN or infinite.
    #[error("object “{object}”: vertex {vertex} has a coordinate that is not finite")]
    VertexNotFinite { object: String, vertex: usize },
    /// A vertex so far away that single precision cannot hold the square of it.
    #[error("object “{object}”: vertex {vertex} is more than {most:e} m from the origin")]
    VertexTooFar { object: String, vertex: usize, most: f64 },
    /// A corner normal is NaN or infinite.
    #[error("object “{object}”: the normal of corner {corner} is not finite")]
    NormalNotFinite { object: String, corner: usize },
    /// The object-to-world matrix holds NaN or infinity.
    #[error("object “{object}”: its transform is not finite")]
    TransformNotFinite { object: String },
    /// A triangle names a vertex that is not there.
    #[error(
        "object “{object}”: triangle {triangle} refers to vertex {vertex}, but there are only {vertices}"
    )]
    VertexOutOfRange { object: String, triangle: usize, vertex: u32, vertices: usize },
    /// A triangle names a material that is not there.
    #[error(
        "object “{object}”: triangle {triangle} refers to material {material}, but there are only {materials}"
    )]
    MaterialOutOfRange { object: String, triangle: usize, material: u32, materials: usize },
    /// Two arrays that must go together do not.
    #[error("object “{object}”: {array} has {got} entries, expected {expected}")]
    LengthMismatch { object: String, array: &'static str, got: usize, expected: usize },
    /// A reflectance outside 0..1 would create light.
    #[error("material “{material}”: reflectance {value} ({channel}) is outside 0 to 1")]
    ReflectanceOutOfRange { material: String, channel: &'static str, value: f64 },
    /// A transmittance outside 0..1 would create light.
    #[error("material “{material}”: transmittance {value} ({channel}) is outside 0 to 1")]
    TransmittanceOutOfRange { material: String, channel: &'static str, value: f64 },
    /// An emission that is NaN, negative, or more than single precision can hold what comes of it.
    #[error("material “{material}”: emission {value:?} ({channel}) is not a number from 0 to 1e30")]
    ExitanceInvalid { material: String, channel: &'static str, value: f64 },
    /// A light's emission is NaN or infinite.
    #[error("light “{light}”: its strength is not finite")]
    LightNotFinite { light: String },
    /// A size or an angle of a light that is outside its range.
    #[error("light “{light}”: its {what} {value:?} is outside 0 to {most:?}")]
    LightOutOfRange { light: String, what: &'static str, value: f64, most: f64 },
    /// The outline of a light that has dents, crosses itself, or does not lie in a plane.
    #[error("light “{light}”: its outline is not flat and convex")]
    LightOutline { light: String },
    /// A light is linked to an object that is not there.
    #[error("light “{light}” is linked to object {object}, but there are only {objects}")]
    LinkOutOfRange { light: String, object: u32, objects: usize },
    /// A sky that is not six squares of cells, a power of two along each side.
    #[error("light “{light}”: {got} cells are no six squares of {per_side} by {per_side}, a power of two")]
    SkyCells { light: String, got: usize, per_side: usize },
    /// Nothing in the scene sends light.
    #[error("nothing in the scene sends light: add a light or a background, or give a material an emission")]
    NoLight,
    /// A closed space whose surfaces reflect everything, with light emitted into it: it would get brighter for ever.
    #[error(
        "light can neither leave the space enclosed by {surfaces} nor be absorbed there, because everything in it \
         reflects all of it: give a surface a reflectance below 1"
    )]
    EndlessLight { surfaces: String },
    /// No object was marked to receive light, or none of them has a face with area.
    #[error("there is no surface to bake: no receiving object has a face with area")]
    NoReceiver,
    /// A setting outside its range.
    #[error("setting {name} = {value}: {reason}")]
    InvalidSetting { name: &'static str, value: String, reason: &'static str },
    /// The system gave no threads.
    #[error("cannot start worker threads: {reason}")]
    Threads { reason: String },
    /// The caller asked to cancel.
    #[error("the bake was cancelled")]
    Cancelled,
}

/// Objects that an error names, at most.
const MOST_NAMES: usize = 5;

impl Error {
    /// [`Self::EndlessLight`] between surfaces of these objects, in any order and as often as they come.
    pub(crate) fn endless_light(objects: impl Iterator<Item = String>) -> Self {
        Self::EndlessLight { surfaces: some_of(&objects.collect()) }
    }
}

/// Names for a message, the first of them if they are many.
pub(crate) fn some_of(names: &BTreeSet<String>) -> String {
    let shown: Vec<String> = names.iter().take(MOST_NAMES).map(|name| format!("“{name}”")).collect();
    match names.len().saturating_sub(MOST_NAMES) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}
