//! The error of the direct light falls as the user asks for less of it.
//!
//! The scene is the paper's: a cube, turned by 20°, on a plane that is 6 m wide, under two lights. Nothing reflects;
//! the exact light at points between the vertices comes from the kernel.

mod common;

use antumbra::settings::{Method, Settings};
use antumbra::visibility::{ConvexPolygon, Receiver};
use common::baked::{assert_sound, light_over};
use common::scene::{Scene, adaptive, arriving, by, lamp, uniform};
use common::shape::Shape;
use common::{Random, polygon, visible};
use glam::{DMat3, DVec3};

const POINTS: usize = 1000;

struct PaperScene {
    scene: Scene,
    lights: [[DVec3; 4]; 2],
    exitances: [f64; 2],
    blockers: Vec<ConvexPolygon>,
}

impl PaperScene {
    fn new() -> Self {
        let mut scene = Scene::default();
        let black = scene.material(0.0, 0.0);
        let turn = DMat3::from_rotation_z(20_f64.to_radians());
        let cube = Shape::cuboid(DVec3::ZERO, DVec3::splat(0.5)).map(|p| turn * p + DVec3::Z * 0.5);
        let lights = [lamp(DVec3::new(-2.0, 1.0, 3.0), 0.3), lamp(DVec3::new(1.5, 2.0, 2.5), 0.2)];
        let exitances = [20.0, 15.0];
        scene.object("floor", Shape::square(DVec3::ZERO, 3.0), black);
        for (outline, exitance) in lights.iter().zip(exitances) {
            scene.light(outline, exitance);
        }
        let corners = |t: &[u32; 3]| t.map(|v| cube.positions[v as usize]);
        let blockers = cube.triangles.iter().map(|t| polygon(&corners(t))).collect();
        scene.blocker("cube", cube, black);
        Self { scene, lights, exitances, blockers }
    }

    fn exact(&self, x: f64, y: f64) -> f64 {
        let receiver = Receiver::new(DVec3::new(x, y, 0.0), DVec3::Z);
        (self.lights.iter().zip(self.exitances))
            .map(|(outline, exitance)| exitance * visible(&receiver, &polygon(outline), &self.blockers).value)
            .sum()
    }

    /// Random points of the floor with their light; under the cube it is dark.
    fn probes(&self) -> Vec<([f64; 2], f64)> {
        let mut random = Random(1994);
        (0..POINTS)
            .map(|_| {
                let [x, y] = [random.between(-3.0, 3.0), random.between(-3.0, 3.0)];
                ([x, y], self.exact(x, y))
            })
            .collect()
    }

    /// The rms error over the probes relative to their mean light, and the vertices that took.
    fn error(&self, settings: &Settings) -> (f64, usize) {
        let bake = self.scene.bake(&arriving(settings.clone()));
        assert_sound(&self.scene.input, &bake);
        let floor = &bake.meshes[0];
        let probes = self.probes();
        let mean = probes.iter().map(|(_, exact)| exact).sum::<f64>() / POINTS as f64;
        let squares: f64 =
            probes.iter().map(|&([x, y], exact)| (light_over(floor, x, y) - exact).powi(2)).sum();
        ((squares / POINTS as f64).sqrt() / mean, bake.report.result.vertices)
    }
}

#[test]
fn the_error_follows_the_tolerance() {
    let paper = PaperScene::new();
    for method in [Method::Adm, Method::Dm, Method::As] {
        let mut last = f64::INFINITY;
        for tolerance in [0.04, 0.02, 0.01, 0.005] {
            let (error, vertices) = paper.error(&Settings { tolerance, ..by(method) });
            println!("{method:?}, tolerance {tolerance}: error {error:.5} with {vertices} vertices");
            assert!(error <= 1.5 * tolerance, "{method:?}: error {error} at tolerance {tolerance}");
            assert!(error < last, "{method:?}: error {error} after {last}");
            last = error;
        }
    }
}

#[test]
fn adaptive_subdivision_beats_a_uniform_mesh_of_more_vertices() {
    let paper = PaperScene::new();
    let (uniform, many) = paper.error(&uniform(0.08));
    let (adaptive, few) = paper.error(&by(Method::As));
    println!("uniform: {uniform:.5} with {many} vertices; adaptive: {adaptive:.5} with {few}");
    assert!(few < many && adaptive < uniform);
}

/// What the paper is about: edges on the shadow boundaries are worth more than small elements.
#[test]
fn shadow_boundaries_take_a_fifth_of_the_vertices_of_subdivision_for_the_same_error() {
    let paper = PaperScene::new();
    for tolerance in [0.04, 0.02, 0.01] {
        let (wanted, many) = paper.error(&Settings { tolerance, ..by(Method::As) });
        let finer = [1.4, 1.0, 0.7, 0.5, 0.35].map(|part| part * tolerance);
        let bakes = finer.map(|tolerance| paper.error(&Settings { tolerance, ..by(Method::Adm) }));
        let (error, few) = *bakes.iter().find(|(error, _)| *error <= wanted).expect("one is fine enough");
        println!("AS: {wanted:.5} with {many} vertices; ADM: {error:.5} with {few}");
        assert!(5 * few <= many, "{few} vertices with shadow boundaries, {many} without");
    }
}

#[test]
fn a_finer_uniform_mesh_is_better() {
    let paper = PaperScene::new();
    let errors: Vec<f64> = [1.2, 0.6, 0.3, 0.15].iter().map(|&size| paper.error(&uniform(size)).0).collect();
    println!("{errors:.5?}");
    assert!(errors.is_sorted_by(|coarse, fine| fine < coarse), "{errors:?}");
}

#[test]
fn without_the_cube_the_light_is_smooth_and_cheap() {
    let mut paper = PaperScene::new();
    let (_, with_shadows) = paper.error(&adaptive());
    paper.scene.input.objects.pop();
    paper.blockers.clear();
    let (error, without) = paper.error(&adaptive());
    assert!(error <= 0.015, "{error}");
    assert!(without < with_shadows, "{without} vertices without shadows, {with_shadows} with them");
}
