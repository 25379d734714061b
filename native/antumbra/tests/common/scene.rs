//! Small scenes, built a line at a time.

use antumbra::Error;
use antumbra::monitor::Monitor;
use antumbra::scene::{AreaLightInput, MaterialInput, ObjectInput, SceneInput};
use antumbra::settings::{Method, Quantity, Settings, Transport};
use antumbra::solve::bake;
use antumbra::weld::Bake;
use glam::{DMat4, DVec3};

use super::shape::Shape;

/// A scene under construction.
#[derive(Default, Clone)]
pub(crate) struct Scene {
    pub(crate) input: SceneInput,
}

impl Scene {
    /// Adds a grey material and returns its index.
    pub(crate) fn material(&mut self, reflectance: f64, exitance: f64) -> u32 {
        let index = self.input.materials.len() as u32;
        self.input.materials.push(MaterialInput {
            name: format!("material {index}"),
            reflectance_rgb: [reflectance; 3],
            exitance_rgb: [exitance; 3],
            transmittance_rgb: [0.0; 3],
        });
        index
    }

    /// Adds an object that receives, at the origin, of one material.
    pub(crate) fn object(&mut self, name: &str, shape: Shape, material: u32) -> &mut ObjectInput {
        self.input.objects.push(ObjectInput {
            name: name.to_owned(),
            positions: shape.positions,
            world_from_object: DMat4::IDENTITY,
            triangle_materials: vec![material; shape.triangles.len()],
            triangles: shape.triangles,
            corner_normals: shape.corner_normals,
            receives: true,
            blocks: true,
            sends: true,
        });
        self.input.objects.last_mut().expect("it was just added")
    }

    /// Adds an object that blocks and reflects but is not baked.
    pub(crate) fn blocker(&mut self, name: &str, shape: Shape, material: u32) -> &mut ObjectInput {
        let object = self.object(name, shape, material);
        object.receives = false;
        object
    }

    /// Adds a white light of this exitance, counter-clockwise seen from its lit side.
    pub(crate) fn light(&mut self, outline: &[DVec3], exitance: f64) {
        self.input.lights.push(AreaLightInput {
            name: format!("light {}", self.input.lights.len()),
            outline: outline.to_vec(),
            exitance_rgb: [exitance; 3],
        });
    }

    /// Places every object and light.
    pub(crate) fn placed(mut self, world_from_scene: DMat4) -> Self {
        for object in &mut self.input.objects {
            object.world_from_object = world_from_scene * object.world_from_object;
        }
        for p in self.input.lights.iter_mut().flat_map(|light| &mut light.outline) {
            *p = world_from_scene.transform_point3(*p);
        }
        self
    }

    pub(crate) fn try_bake(&self, settings: &Settings) -> Result<Bake, Error> {
        bake(&self.input, settings, &Monitor::new())
    }

    pub(crate) fn bake(&self, settings: &Settings) -> Bake {
        self.try_bake(settings).expect("the scene is valid")
    }
}

/// The outline of a horizontal square that shines down.
pub(crate) fn lamp(center: DVec3, half: f64) -> [DVec3; 4] {
    [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]].map(|[x, y]| center + half * DVec3::new(x, y, 0.0))
}

/// The default settings.
pub(crate) fn adaptive() -> Settings {
    Settings::default()
}

/// The same with the paper's way to exchange light.
pub(crate) fn by_shooting() -> Settings {
    Settings { transport: Transport::Shooting, ..adaptive() }
}

/// The default settings of a method; uniform meshes choose their own size.
pub(crate) fn by(method: Method) -> Settings {
    Settings { method, ..Settings::default() }
}

/// A uniform mesh with edges of at most this length, metres.
pub(crate) fn uniform(element_size: f64) -> Settings {
    Settings { method: Method::Uniform, element_size, ..Settings::default() }
}

/// The same settings, for the light that arrives instead of what is reflected.
pub(crate) fn arriving(mut settings: Settings) -> Settings {
    settings.quantity = Quantity::Irradiance;
    settings
}
