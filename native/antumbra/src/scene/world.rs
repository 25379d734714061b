//! The validated scene in one frame: world space, moved so that its centre is the origin.
//!
//! Validation happens here and only here; later stages trust what they find. Guarantees: every coordinate is finite,
//! every index in range, every [`Face`] has an area and a unit normal on its front side, mirrored objects included.

use std::collections::BTreeSet;
use std::hash::{Hash, Hasher};

use glam::{DMat3, DVec3};
use rustc_hash::{FxHashMap, FxHasher};

use crate::error::{Error, some_of};
use crate::index::{FaceId, typed_index};
use crate::scene::validation::{validate_light, validate_links, validate_material, validate_object};
use crate::scene::{AreaLightInput, LampInput, LampShape, MaterialInput, ObjectInput, SceneInput, SkyInput};
use crate::visibility::{ConvexPolygon, grey};

typed_index! {
    /// Index of an object in [`SceneInput::objects`].
    ObjectId
}

/// A triangle with an area.
#[derive(Debug, Clone)]
pub(crate) struct Face {
    pub(crate) object: ObjectId,
    /// Index into the object's triangles.
    pub(crate) source_triangle: u32,
    /// Global vertices, in the order of the source triangle (wound backwards in a mirrored object).
    pub(crate) vertices: [u32; 3],
    /// Unit normal of the front side.
    pub(crate) normal: DVec3,
    pub(crate) area: f64,
    /// Index into [`World::materials`], which has more of them than the input.
    pub(crate) material: u32,
    /// Unit shading normals; `None` on flat faces.
    pub(crate) corner_normals: Option<[DVec3; 3]>,
}

/// Where an object's parts lie in the world's arrays.
#[derive(Debug, Clone)]
pub(crate) struct WorldObject {
    pub(crate) name: String,
    pub(crate) first_vertex: u32,
    pub(crate) faces: std::ops::Range<usize>,
    pub(crate) receives: bool,
}

/// The scene that the solver works on.
#[derive(Debug)]
pub(crate) struct World {
    /// Materials as they take part in the exchange of light: one that reflects what also goes on behind it, or whose
    /// object lets light through or sends nothing to others, is there once more without what it does not send.
    pub(crate) materials: Vec<MaterialInput>,
    /// The same materials as they are shown.
    pub(crate) shown_materials: Vec<MaterialInput>,
    pub(crate) objects: Vec<WorldObject>,
    pub(crate) vertices: Vec<DVec3>,
    pub(crate) faces: Vec<Face>,
    /// Lights with their outlines moved like everything else.
    pub(crate) lights: Vec<AreaLightInput>,
    /// All other lights, moved as well.
    pub(crate) lamps: Vec<LampInput>,
    pub(crate) sky: Option<SkyInput>,
    /// Where the frame's origin is in the scene.
    pub(crate) origin: DVec3,
    /// Diagonal of the bounding box of all surfaces and lights.
    pub(crate) diagonal: f64,
    pub(crate) warnings: Vec<String>,
}

impl World {
    /// Validates the input and moves it into the solver's frame.
    ///
    /// # Errors
    /// The first thing found wrong, naming object and index.
    pub(crate) fn new(input: &SceneInput) -> Result<Self, Error> {
        input.materials.iter().try_for_each(validate_material)?;
        input.lights.iter().try_for_each(validate_light)?;
        input.lamps.iter().try_for_each(LampInput::validate)?;
        input.sky.iter().try_for_each(SkyInput::validate)?;
        for object in &input.objects {
            validate_object(object, input.materials.len())?;
        }
        input.lamps.iter().try_for_each(|lamp| validate_links(lamp, input.objects.len()))?;
        let mut world = Self {
            materials: input.materials.clone(),
            shown_materials: input.materials.clone(),
            objects: Vec::with_capacity(input.objects.len()),
            vertices: Vec::new(),
            faces: Vec::new(),
            lights: input.lights.clone(),
            lamps: input.lamps.clone(),
            sky: input.sky.clone(),
            origin: DVec3::ZERO,
            diagonal: 0.0,
            warnings: Vec::new(),
        };
        for object in &input.objects {
            let transform = &object.world_from_object;
            let first_vertex = world.vertices.len() as u32;
            world.vertices.extend(object.positions.iter().map(|&p| transform.transform_point3(p)));
            world.objects.push(WorldObject {
                name: object.name.clone(),
                first_vertex,
                faces: 0..0,
                receives: object.receives,
            });
        }
        world.centre();
        let mut twins = FxHashMap::default();
        for (id, object) in input.objects.iter().enumerate() {
            world.add_faces(ObjectId::new(id), object, &mut twins);
        }
        world.drop_lights_without_area();
        world.settle_duplicates(input, &mut twins);
        Ok(world)
    }

    /// The corners of a face, in the order of the source triangle.
    pub(crate) fn corners(&self, face: &Face) -> [DVec3; 3] {
        face.vertices.map(|v| self.vertices[v as usize])
    }

    /// The object that a vertex belongs to.
    pub(crate) fn object_of_vertex(&self, vertex: u32) -> u32 {
        self.objects.partition_point(|object| object.first_vertex <= vertex) as u32 - 1
    }

    /// The material of a face as it takes part in the exchange of light.
    pub(crate) fn material(&self, face: FaceId) -> &MaterialInput {
        &self.materials[self.faces[face.index()].material as usize]
    }

    /// Share of light that goes on behind a face, per channel.
    pub(crate) fn transmittance(&self, face: FaceId) -> DVec3 {
        DVec3::from_array(self.material(face).transmittance_rgb)
    }

    /// The material of a face as it is shown.
    pub(crate) fn shown_material(&self, face: FaceId) -> &MaterialInput {
        &self.shown_materials[self.faces[face.index()].material as usize]
    }

    /// Whether a face belongs to an object that is baked.
    pub(crate) fn receives(&self, face: FaceId) -> bool {
        self.objects[self.faces[face.index()].object.index()].receives
    }

    /// Far from the origin f64 loses what f32 input still had; about its own centre a scene keeps all of it.
    fn centre(&mut self) {
        let outlines = self.lights.iter().flat_map(|l| &l.outline);
        let lamps = self.lamps.iter().flat_map(LampInput::points);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in self.vertices.iter().chain(outlines).chain(lamps) {
            low = low.min(p);
            high = high.max(p);
        }
        if low.x > high.x {
            return;
        }
        let centre = 0.5 * (low + high);
        self.origin = centre;
        self.diagonal = (high - low).length();
        self.vertices.iter_mut().for_each(|p| *p -= centre);
        self.lights.iter_mut().flat_map(|l| &mut l.outline).for_each(|p| *p -= centre);
        self.lamps.iter_mut().flat_map(LampInput::points_mut).for_each(|p| *p -= centre);
        // An f32 coordinate of size c is known to c * 2^-24; below a millionth of the scene nobody can see it.
        let resolution = centre.abs().max_element() * f64::from(f32::EPSILON) * 0.5;
        if resolution > 1e-6 * self.diagonal {
            self.warnings.push(format!(
                "the scene lies {:.3e} m from the origin: single-precision coordinates there are {resolution:.1e} m \
                 apart, {:.1e} of the scene's size; move it closer for exact contacts",
                centre.length(),
                resolution / self.diagonal
            ));
        }
    }

    /// The number of a material as an object that takes this part in the exchange has it.
    fn material_taking(&mut self, part: Part, material: u32, twins: &mut Twins) -> u32 {
        let shown = &self.shown_materials[material as usize];
        let transmittance_rgb = if part.blocks { shown.transmittance_rgb } else { [1.0; 3] };
        let stopped = stopped(transmittance_rgb);
        let sent = |k: usize| if part.sends { shown.reflectance_rgb[k].min(stopped[k]) } else { 0.0 };
        let reflectance_rgb = std::array::from_fn(sent);
        if part.blocks && part.sends && reflectance_rgb == shown.reflectance_rgb {
            return material;
        }
        if let Some(&twin) = twins.get(&(material, part)) {
            return twin;
        }
        let shown = shown.clone();
        let exitance_rgb = if part.sends { shown.exitance_rgb } else { [0.0; 3] };
        let twin = self.materials.len() as u32;
        self.materials.push(MaterialInput {
            name: shown.name.clone(),
            reflectance_rgb,
            exitance_rgb,
            transmittance_rgb,
        });
        self.shown_materials.push(shown);
        twins.insert((material, part), twin);
        twin
    }

    fn add_faces(&mut self, id: ObjectId, object: &ObjectInput, twins: &mut Twins) {
        let part = Part { blocks: object.blocks, sends: object.sends };
        let first_face = self.faces.len();
        let first_vertex = self.objects[id.index()].first_vertex;
        let linear = DMat3::from_mat4(object.world_from_object);
        let mirror = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        // The cofactor matrix turns normals even where the transform has no inverse.
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        ) * mirror;
        for (t, triangle) in object.triangles.iter().enumerate() {
            let vertices = triangle.map(|v| first_vertex + v);
            let [a, b, c] = vertices.map(|v| self.vertices[v as usize]);
            let Some(polygon) = ConvexPolygon::triangle(a, b, c) else { continue };
            let normal = mirror * polygon.normal();
            let corner_normals = object.corner_normals.as_ref().and_then(|all| {
                let mut turned = [normal; 3];
                for (turned, n) in turned.iter_mut().zip(all[t]) {
                    *turned = (cofactors * n).try_normalize().unwrap_or(normal);
                }
                // A flat face given with corner normals is a flat face.
                let flat = turned.iter().all(|n| n.distance_squared(normal) < SAME_NORMAL);
                (!flat).then_some(turned)
            });
            let material = self.material_taking(part, object.triangle_materials[t], twins);
            self.faces.push(Face {
                object: id,
                source_triangle: t as u32,
                vertices,
                normal,
                area: polygon.area(),
                material,
                corner_normals,
            });
        }
        self.objects[id.index()].faces = first_face..self.faces.len();
        if !object.triangles.is_empty() && first_face == self.faces.len() {
            self.warnings.push(format!("object “{}” has no face with an area and is left out", object.name));
        }
    }

    fn drop_lights_without_area(&mut self) {
        let warnings = &mut self.warnings;
        let mut has_area = |name: &str, outline: &[DVec3]| {
            let has_area = ConvexPolygon::new(outline).is_some();
            if !has_area {
                warnings.push(format!("light “{name}” has no area and is left out"));
            }
            has_area
        };
        self.lights.retain(|light| has_area(&light.name, &light.outline));
        self.lamps.retain(|lamp| match &lamp.shape {
            LampShape::Panel { outline, .. } => has_area(&lamp.name, outline),
            LampShape::Sun { .. } | LampShape::Point { .. } => true,
        });
    }

    /// Whether a light takes light away, as Blender lets it.
    pub(crate) fn has_negative_light(&self) -> bool {
        let panels = self.lights.iter().flat_map(|light| light.exitance_rgb);
        let lamps = self.lamps.iter().flat_map(LampInput::strength_rgb);
        let cells = self.sky.iter().flat_map(|sky| sky.exitance_rgb.as_flattened().iter().copied());
        panels.chain(lamps).chain(cells).any(|strength| strength < 0.0)
    }

    /// Faces that have all corners in common are one: each is lit, and one of them lights others. Both would reflect what falls
    /// on either, and from walls that reflect more than half there would be more light after every reflection.
    fn settle_duplicates(&mut self, input: &SceneInput, twins: &mut Twins) {
        let corners = |face: &Face| {
            // -0 is where 0 is.
            let mut corners = self.corners(face).map(|p| (p + DVec3::ZERO).to_array().map(f64::to_bits));
            corners.sort_unstable();
            corners
        };
        let mut hashed: Vec<(u64, u32)> = Vec::with_capacity(self.faces.len());
        for (index, face) in (0..).zip(&self.faces) {
            let mut hasher = FxHasher::default();
            corners(face).hash(&mut hasher);
            hashed.push((hasher.finish(), index));
        }
        hashed.sort_unstable();
        let (mut copies, mut names) = (Vec::new(), BTreeSet::new());
        for pair in hashed.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|(_, index)| &self.faces[index as usize]);
            if pair[0].0 == pair[1].0 && corners(a) == corners(b) {
                copies.push([pair[0].1, pair[1].1].map(|index| index as usize));
                names.extend([a, b].map(|face| self.objects[face.object.index()].name.clone()));
            }
        }
        if copies.is_empty() {
            return;
        }
        self.warnings.push(format!(
            "{} faces of {} lie exactly on others: all are lit, and one in each place blocks and reflects",
            copies.len(),
            some_of(&names)
        ));
        // Those that let light through or send none hide none of the other's
        let takes_part = |world: &Self, face: usize| {
            let face = &world.faces[face];
            let object = &input.objects[face.object.index()];
            let material = &world.materials[face.material as usize];
            object.blocks && object.sends && material.transmittance_rgb == [0.0; 3]
        };
        for [kept, copy] in copies {
            if takes_part(self, kept) && takes_part(self, copy) {
                let Face { object, source_triangle, .. } = self.faces[copy];
                let material = input.objects[object.index()].triangle_materials[source_triangle as usize];
                let silent = Part { blocks: true, sends: false };
                self.faces[copy].material = self.material_taking(silent, material, twins);
            }
        }
    }

    /// Area of all faces, each with one of its sides, m².
    pub(crate) fn surface_area(&self) -> f64 {
        self.faces.iter().map(|face| face.area).sum()
    }
}

/// Which part an object takes in the exchange of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Part {
    blocks: bool,
    sends: bool,
}

/// Materials of the input that are there once more, by the part that they take.
type Twins = FxHashMap<(u32, Part), u32>;

/// Squared distance below which two unit normals are the same: an angle of 1e-5, a hundred roundings of f32. Smaller
/// would split the corners of one smooth fan, larger would melt facets of a 100,000-gon together.
pub(crate) const SAME_NORMAL: f64 = 1e-10;

/// The value at a point of a triangle that has these values at its corners.
///
/// `weights`: the point's barycentric coordinates.
pub(crate) fn interpolated([a, b, c]: [DVec3; 3], weights: DVec3) -> DVec3 {
    weights.x * a + weights.y * b + weights.z * c
}

/// Share of light per channel that a surface stops, of which a part is reflected. Between surfaces only the mean over the
/// channels is known.
fn stopped(transmittance_rgb: [f64; 3]) -> [f64; 3] {
    let through = grey(DVec3::from_array(transmittance_rgb));
    transmittance_rgb.map(|share| 1.0 - share.max(through))
}
