//! `Scene`: collects what the solver will own.

use std::sync::{Mutex, MutexGuard};

use antumbra::scene::{
    AreaLightInput, ConeInput, LampInput, LampShape, MaterialInput, ObjectInput, SceneInput, SkyInput,
};
use bytemuck::allocation::cast_vec;
use glam::{DMat3, DMat4, DVec3};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::arrays::{Expected, floats, integers};
use crate::errors::invalid_scene;

/// Everything that lights, shadows, reflects or receives. `start` takes its content.
#[pyclass(frozen, module = "antumbra_native")]
pub(crate) struct Scene {
    /// `None` once a bake has taken it.
    input: Mutex<Option<SceneInput>>,
}

impl Scene {
    /// Moves the content out, for a bake.
    pub(crate) fn take(&self) -> PyResult<SceneInput> {
        self.lock().take().ok_or_else(taken)
    }

    fn lock(&self) -> MutexGuard<'_, Option<SceneInput>> {
        self.input.lock().expect("nothing panics under this lock; this is a bug in antumbra")
    }

    fn add_lamp(&self, name: String, casts_shadows: bool, links: Links, shape: LampShape) -> PyResult<()> {
        let Links { lit_objects, blocking_objects } = links;
        let lamp = LampInput { name, casts_shadows, lit_objects, blocking_objects, shape };
        self.push(|input| &mut input.lamps, lamp)?;
        Ok(())
    }

    /// Adds to one of the scene's lists and returns the new entry's index.
    fn push<T>(&self, list: impl FnOnce(&mut SceneInput) -> &mut Vec<T>, entry: T) -> PyResult<usize> {
        let mut input = self.lock();
        let list = list(input.as_mut().ok_or_else(taken)?);
        list.push(entry);
        Ok(list.len() - 1)
    }
}

/// The objects that a light has to do with, by the numbers that `add_object` returned; all where there are none given.
struct Links {
    lit_objects: Option<Vec<u32>>,
    blocking_objects: Option<Vec<u32>>,
}

#[pymethods]
impl Scene {
    #[new]
    fn new() -> Self {
        Self { input: Mutex::new(Some(SceneInput::default())) }
    }

    /// Adds a diffuse material, rgb and scene-linear; exitance is `pi` times the emitted radiance, in W/m².
    #[pyo3(signature = (name, reflectance, exitance, *, transmittance = [0.0; 3]))]
    fn add_material(
        &self,
        name: String,
        reflectance: [f64; 3],
        exitance: [f64; 3],
        transmittance: [f64; 3],
    ) -> PyResult<usize> {
        let material = MaterialInput {
            name,
            reflectance_rgb: reflectance,
            exitance_rgb: exitance,
            transmittance_rgb: transmittance,
        };
        self.push(|input| &mut input.materials, material)
    }

    /// Adds a triangle mesh; the arrays are copied. Normals and positions are in object space.
    #[expect(
        clippy::too_many_arguments,
        reason = "one argument per array of a mesh, given by name in Python"
    )]
    #[pyo3(signature = (
        name, positions, triangles, materials, world_from_object, corner_normals, receives, *, blocks = true,
        sends = true
    ))]
    fn add_object(
        &self,
        py: Python<'_>,
        name: String,
        positions: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
        materials: &Bound<'_, PyAny>,
        world_from_object: &Bound<'_, PyAny>,
        corner_normals: Option<&Bound<'_, PyAny>>,
        receives: bool,
        blocks: bool,
        sends: bool,
    ) -> PyResult<usize> {
        // Own the arrays.
        let positions = floats::<3>(positions, &Expected::of(&name, "positions", &[None, Some(3)]))?;
        let triangles = integers::<3>(triangles, &Expected::of(&name, "triangles", &[None, Some(3)]))?;
        let count = Some(triangles.len());
        let materials = integers::<1>(materials, &Expected::of(&name, "materials", &[count]))?;
        let matrix =
            floats::<4>(world_from_object, &Expected::of(&name, "world_from_object", &[Some(4), Some(4)]))?;
        let corner_normals = corner_normals
            .map(|normals| {
                floats::<9>(normals, &Expected::of(&name, "corner_normals", &[count, Some(3), Some(3)]))
            })
            .transpose()?;

        // Refuse the indices that the solver's unsigned types cannot even hold; it checks the others itself.
        let triangles = unsigned(py, &name, "vertex", &triangles)?;
        let materials = unsigned(py, &name, "material", &materials)?;

        let object = ObjectInput {
            positions: cast_vec::<[f64; 3], DVec3>(positions),
            // numpy and Blender write matrices row by row, glam stores columns.
            world_from_object: DMat4::from_cols_slice(matrix.as_flattened()).transpose(),
            triangles,
            triangle_materials: materials.into_flattened(),
            corner_normals: corner_normals.map(cast_vec::<[f64; 9], [DVec3; 3]>),
            receives,
            blocks,
            sends,
            name,
        };
        self.push(|input| &mut input.objects, object)
    }

    /// Adds a flat one-sided light; its convex outline is in world space, counter-clockwise seen from the lit side.
    #[expect(clippy::too_many_arguments, reason = "what Blender's lights have, given by name in Python")]
    #[pyo3(signature = (
        name, outline, exitance, spread=std::f64::consts::PI, casts_shadows=true, *, lit_objects=None,
        blocking_objects=None
    ))]
    fn add_area_light(
        &self,
        name: String,
        outline: &Bound<'_, PyAny>,
        exitance: [f64; 3],
        spread: f64,
        casts_shadows: bool,
        lit_objects: Option<Vec<u32>>,
        blocking_objects: Option<Vec<u32>>,
    ) -> PyResult<()> {
        let outline = floats::<3>(outline, &Expected::of(&name, "outline", &[None, Some(3)]))?;
        let outline = cast_vec::<[f64; 3], DVec3>(outline);
        // All of a plain one's light is sent as one surface's.
        let is_linked = lit_objects.is_some() || blocking_objects.is_some();
        if spread == std::f64::consts::PI && casts_shadows && !is_linked {
            self.push(|input| &mut input.lights, AreaLightInput { name, outline, exitance_rgb: exitance })?;
            return Ok(());
        }
        let links = Links { lit_objects, blocking_objects };
        self.add_lamp(
            name,
            casts_shadows,
            links,
            LampShape::Panel { outline, exitance_rgb: exitance, spread },
        )
    }

    /// Adds a sun; `direction` is towards it, `irradiance` what faces it gets.
    #[expect(clippy::too_many_arguments, reason = "what Blender's lights have, given by name in Python")]
    #[pyo3(signature = (
        name, direction, angle, irradiance, casts_shadows=true, *, lit_objects=None, blocking_objects=None
    ))]
    fn add_sun(
        &self,
        name: String,
        direction: [f64; 3],
        angle: f64,
        irradiance: [f64; 3],
        casts_shadows: bool,
        lit_objects: Option<Vec<u32>>,
        blocking_objects: Option<Vec<u32>>,
    ) -> PyResult<()> {
        let direction = DVec3::from_array(direction);
        let shape = LampShape::Sun { direction, angle, irradiance_rgb: irradiance };
        self.add_lamp(name, casts_shadows, Links { lit_objects, blocking_objects }, shape)
    }

    /// Adds a light from a point, or, with a radius, from a disc that faces its receiver or a sphere; with a cone, a spot.
    #[expect(clippy::too_many_arguments, reason = "what Blender's lights have, given by name in Python")]
    #[pyo3(signature = (
        name, position, radius, intensity, faces_receiver=true, casts_shadows=true, cone=None, *, lit_objects=None,
        blocking_objects=None
    ))]
    fn add_point_light(
        &self,
        name: String,
        position: [f64; 3],
        radius: f64,
        intensity: [f64; 3],
        faces_receiver: bool,
        casts_shadows: bool,
        cone: Option<(Bound<'_, PyAny>, f64, f64)>,
        lit_objects: Option<Vec<u32>>,
        blocking_objects: Option<Vec<u32>>,
    ) -> PyResult<()> {
        let cone = cone
            .map(|(matrix, angle, blend)| -> PyResult<ConeInput> {
                let rows =
                    floats::<3>(&matrix, &Expected::of(&name, "cone_from_world", &[Some(3), Some(3)]))?;
                let cone_from_world = DMat3::from_cols_slice(rows.as_flattened()).transpose();
                Ok(ConeInput { cone_from_world, angle, blend })
            })
            .transpose()?;
        let position = DVec3::from_array(position);
        let shape = LampShape::Point { position, radius, faces_receiver, intensity_rgb: intensity, cone };
        self.add_lamp(name, casts_shadows, Links { lit_objects, blocking_objects }, shape)
    }

    /// Sets what shines from all around: exitance on six faces of a cube of directions, in cells.
    fn set_sky(&self, name: String, exitance: &Bound<'_, PyAny>) -> PyResult<()> {
        let cells = exitance.getattr("shape")?.get_item(1)?.extract::<usize>().unwrap_or(0);
        let shape = [Some(6), Some(cells), Some(cells), Some(3)];
        let exitance_rgb = floats::<3>(exitance, &Expected::of(&name, "exitance", &shape))?;
        let sky = SkyInput { name, cells_per_side: cells, exitance_rgb };
        self.lock().as_mut().ok_or_else(taken)?.sky = Some(sky);
        Ok(())
    }

    fn __repr__(&self) -> String {
        match &*self.lock() {
            None => "Scene(taken by a bake)".to_owned(),
            Some(input) => format!(
                "Scene({} objects, {} materials, {} lights)",
                input.objects.len(),
                input.materials.len(),
                input.lights.len() + input.lamps.len() + usize::from(input.sky.is_some())
            ),
        }
    }
}

fn unsigned<const N: usize>(
    py: Python<'_>,
    object: &str,
    what: &str,
    rows: &[[i64; N]],
) -> PyResult<Vec<[u32; N]>> {
    let mut converted = Vec::with_capacity(rows.len());
    for (triangle, row) in rows.iter().enumerate() {
        let mut indices = [0; N];
        for (index, value) in indices.iter_mut().zip(row) {
            *index = u32::try_from(*value).map_err(|_| {
                let message = format!(
                    "object “{object}”: triangle {triangle} refers to {what} {value}, which is no valid index"
                );
                invalid_scene(py, message, Some(object), Some(triangle))
            })?;
        }
        converted.push(indices);
    }
    Ok(converted)
}

fn taken() -> PyErr {
    PyRuntimeError::new_err("this scene was taken by a bake: build a new one")
}
