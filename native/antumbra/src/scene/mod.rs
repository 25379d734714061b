//! What the caller hands in.

mod lamps;
pub(crate) mod quads;
mod validation;
pub(crate) mod world;

use glam::{DMat4, DVec3};

pub use lamps::{ConeInput, LampInput, LampShape, SkyInput};

/// A whole scene: everything that lights, shadows, reflects or receives.
#[derive(Debug, Clone, Default)]
pub struct SceneInput {
    /// Surface materials; triangles refer to them by index.
    pub materials: Vec<MaterialInput>,
    /// Mesh objects. Every one blocks and reflects unless it says otherwise; those with `receives` are baked.
    pub objects: Vec<ObjectInput>,
    /// Panels that send to all of one side.
    pub lights: Vec<AreaLightInput>,
    /// All other lights that are not meshes.
    pub lamps: Vec<LampInput>,
    /// What shines where there is nothing else.
    pub sky: Option<SkyInput>,
}

/// A diffuse surface.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialInput {
    /// For messages.
    pub name: String,
    /// Reflectance per channel, 0 to 1, scene-linear.
    pub reflectance_rgb: [f64; 3],
    /// Exitance `pi·L` per channel in W/m², on both sides of the surface.
    pub exitance_rgb: [f64; 3],
    /// Share of light per channel, 0 (opaque) to 1, that goes on straight behind it. It reflects at most the rest to
    /// others: more would make light of nothing. What lets everything through is lit and shown all the same.
    pub transmittance_rgb: [f64; 3],
}

/// A triangle mesh in its own space.
#[derive(Debug, Clone)]
pub struct ObjectInput {
    /// For messages.
    pub name: String,
    /// Vertices in object space, metres.
    pub positions: Vec<DVec3>,
    /// Affine transform; may mirror.
    pub world_from_object: DMat4,
    /// Corner vertices, counter-clockwise seen from the front in object space.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`SceneInput::materials`], one per triangle.
    pub triangle_materials: Vec<u32>,
    /// Shading normals in object space, three per triangle; `None` shades every triangle flat.
    pub corner_normals: Option<Vec<[DVec3; 3]>>,
    /// Whether this object is baked.
    pub receives: bool,
    /// Whether it stops light, where its materials do.
    pub blocks: bool,
    /// Whether others get light from it.
    pub sends: bool,
}

/// A flat light that does not block and sends light to one side.
#[derive(Debug, Clone)]
pub struct AreaLightInput {
    /// For messages.
    pub name: String,
    /// A convex outline in world space, metres, counter-clockwise seen from the lit side.
    pub outline: Vec<DVec3>,
    /// Exitance `pi·L` per channel in W/m²; may be negative, as in Blender.
    pub exitance_rgb: [f64; 3],
}
