//! What patches know of the light on an element: darkness and light that none of its corners sees.
//!
//! Patches are many, and each looked around when light was exchanged: coarsely, but everywhere. Where a picture hangs before a
//! wall, the wall's corners are in the open and so may be the middles of all edges; the patches behind it are dark. Elements
//! that differ from their patches by more than their rays err by are refined, and the light that is shown is then computed
//! where it was not looked for: what is coarse leads, what is fine is believed (as in the final gathering of Lischinski,
//! Tampieri, Greenberg 1993, where coarse links tell where fine visibility is needed).

use glam::{DVec2, DVec3};

use crate::index::FaceId;
use crate::scene::world::{World, interpolated};

/// Mean irradiance of a patch.
#[derive(Debug, Clone)]
pub(crate) struct PatchIrradiance {
    pub(crate) face: FaceId,
    /// Its centroid, world space, metres.
    pub(crate) at: DVec3,
    /// On the front, W/m².
    pub(crate) irradiance: DVec3,
    /// That rays leave in it, per channel, W²/m⁴.
    pub(crate) variance: DVec3,
    /// m².
    pub(crate) area: f64,
}

/// The light on all patches, by the faces that they lie on.
#[derive(Debug)]
pub(crate) struct PatchLight {
    /// Face by face, and on each from side to side.
    known: Vec<Known>,
    /// Per face: where its patches begin; and where the last end.
    starts: Vec<u32>,
}

#[derive(Debug, Clone)]
struct Known {
    /// On the face: coordinates along its two edges from its first corner.
    place: DVec2,
    irradiance: DVec3,
    variance: DVec3,
    area: f64,
    /// Sine of the most that shading normals lean from the face's.
    lean: f64,
}

/// Patches that tell something of an element are at most this share of it: of larger ones it is not known which part of
/// their light falls on it.
const LARGEST: f64 = 0.5;

/// Standard errors of the mean square of noise by which a mean square must exceed it. The squares of few rays have a long
/// tail.
const CERTAIN: f64 = 4.0;

/// Share of the light of an element below which a patch of it lies in the dark.
const DARK: f64 = 0.25;

impl PatchLight {
    pub(crate) fn new(world: &World, patches: &[PatchIrradiance]) -> Self {
        let mut known: Vec<(FaceId, Known)> = (patches.iter())
            .map(|patch| {
                let face = &world.faces[patch.face.index()];
                let lean = |normals: [DVec3; 3]| {
                    normals.map(|normal| normal.cross(face.normal).length()).into_iter().fold(0.0, f64::max)
                };
                let known = Known {
                    place: on_face(world.corners(face), patch.at),
                    irradiance: patch.irradiance,
                    variance: patch.variance,
                    area: patch.area,
                    lean: face.corner_normals.map_or(0.0, lean),
                };
                (patch.face, known)
            })
            .collect();
        known.sort_by(|(a, at_a), (b, at_b)| a.cmp(b).then(at_a.place.x.total_cmp(&at_b.place.x)));
        let mut starts = vec![0; world.faces.len() + 1];
        for (face, _) in &known {
            starts[face.index() + 1] += 1;
        }
        for face in 0..world.faces.len() {
            starts[face + 1] += starts[face];
        }
        Self { known: known.into_iter().map(|(_, known)| known).collect(), starts }
    }

    /// The mean square by which the light of an element's patches differs from the linear interpolant, beyond what their
    /// rays err by, W²/m⁴, summed over the channels; 0 where they tell nothing.
    ///
    /// `corners`: of the element, world space, metres. `light`: there, W/m². `shown`: the share of it that counts.
    pub(crate) fn squared_difference(
        &self,
        world: &World,
        face: FaceId,
        corners: [DVec3; 3],
        light: [DVec3; 3],
        shown: DVec3,
    ) -> f64 {
        let [start, end] = [0, 1].map(|k| self.starts[face.index() + k] as usize);
        if end - start < 2 {
            return 0.0;
        }
        let of_face = world.corners(&world.faces[face.index()]);
        let places = corners.map(|corner| on_face(of_face, corner));
        let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
        let [low, high] = [places[0].min(places[1]).min(places[2]), places[0].max(places[1]).max(places[2])];
        let of_face = &self.known[start..end];
        let first = of_face.partition_point(|known| known.place.x < low.x);
        let [mut covered, mut squares, mut noise, mut in_the_dark] = [0.0; 4];
        let (mut count, mut dark) = (0, 0);
        for known in of_face[first..].iter().take_while(|known| known.place.x <= high.x) {
            let weights = weights(places, known.place);
            if known.area > LARGEST * area || weights.min_element() < 0.0 {
                continue;
            }
            let linear = interpolated(light, weights);
            // A patch is flat: where normals lean, it gets something else than is shown.
            let most = known.lean * known.irradiance.abs().max(linear.abs());
            let beyond = ((known.irradiance - linear).abs() - most).max(DVec3::ZERO);
            let squared = known.area * (shown * beyond).length_squared();
            covered += known.area;
            squares += squared;
            noise += known.area * (shown * shown * known.variance).element_sum();
            if known.is_dark(linear) {
                in_the_dark += squared;
                dark += 1;
            }
            count += 1;
        }
        let tail = CERTAIN * (2.0 / f64::from(count)).sqrt();
        let certain = if count < 2 { 0.0 } else { squares - (1.0 + tail) * noise };
        let in_the_dark = if dark < 2 { 0.0 } else { in_the_dark };
        if covered > 0.0 { certain.max(in_the_dark) / covered } else { 0.0 }
    }
}

impl Known {
    /// Whether hardly any light gets here, compared with some other.
    ///
    /// Rays that rarely meet a window leave a large variance wherever one did; that none of them met anything bright is
    /// another matter.
    fn is_dark(&self, light: DVec3) -> bool {
        let most = self.irradiance.abs() + 3.0 * self.variance.map(f64::sqrt);
        most.element_sum() < DARK * light.abs().element_sum()
    }
}

/// Coordinates of a point of a triangle along its edges from its first corner.
fn on_face([a, b, c]: [DVec3; 3], point: DVec3) -> DVec2 {
    let [along, across, to] = [b - a, c - a, point - a];
    let normal = along.cross(across);
    DVec2::new(to.cross(across).dot(normal), along.cross(to).dot(normal)) / normal.length_squared()
}

/// Barycentric weights of a place in a triangle.
fn weights([a, b, c]: [DVec2; 3], place: DVec2) -> DVec3 {
    let double_area = (b - a).perp_dot(c - a);
    let second = (place - a).perp_dot(c - a) / double_area;
    let third = (b - a).perp_dot(place - a) / double_area;
    DVec3::new(1.0 - second - third, second, third)
}
