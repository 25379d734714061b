//! The same bytes for any number of threads, and again on the next run.

mod common;

use antumbra::scene::{LampInput, LampShape, SkyInput};
use antumbra::settings::{Method, Settings, Transport};
use antumbra::weld::Bake;
use common::Random;
use common::scene::{Scene, adaptive, by, lamp, uniform};
use common::shape::Shape;
use glam::DVec3;

/// A room with a lamp behind hundreds of leaves: enough of them to need rays.
fn crowded_room() -> Scene {
    let mut scene = Scene::default();
    let (white, green) = (scene.material(0.6, 0.0), scene.material(0.3, 0.0));
    scene.object("room", Shape::room(DVec3::new(2.0, 2.0, 2.0)), white);
    let mut random = Random(11);
    let mut leaves = Shape::default();
    for _ in 0..300 {
        let corner = DVec3::ONE + DVec3::new(0.5, 0.5, 0.3) * random.in_cube();
        let u = 0.1 * random.direction();
        leaves = leaves.and(&Shape::quad(corner, u, 0.1 * u.any_orthonormal_vector()));
    }
    scene.blocker("leaves", leaves, green);
    scene.light(&lamp(DVec3::new(1.0, 1.0, 1.8), 0.3), 10.0);
    scene
}

fn plain_room() -> Scene {
    let mut scene = Scene::default();
    let white = scene.material(0.6, 0.0);
    scene.object("room", Shape::room(DVec3::new(2.0, 3.0, 2.0)), white);
    scene.object("ball", Shape::sphere(0.4, 1).map(|p| p + DVec3::new(1.2, 1.4, 0.5)), white);
    scene.light(&lamp(DVec3::new(0.7, 1.0, 1.8), 0.3), 10.0);
    scene
}

/// Leaves over a floor, under the sky, a sharp sun and a round lamp.
fn under_the_sky() -> Scene {
    let mut scene = crowded_room();
    scene.input.objects[0].positions.iter_mut().for_each(|p| p.z = 0.0);
    scene.input.lights.clear();
    scene.input.sky = Some(SkyInput::even("sky", [1.0, 2.0, 3.0]));
    let mut add = |shape| scene.input.lamps.push(LampInput::new("lamp", shape));
    add(LampShape::Sun { direction: DVec3::new(0.2, 0.1, 1.0), angle: 0.0, irradiance_rgb: [3.0; 3] });
    add(LampShape::Point {
        position: DVec3::new(1.0, 1.2, 2.0),
        radius: 0.2,
        faces_receiver: true,
        intensity_rgb: [1.0; 3],
        cone: None,
    });
    scene
}

/// Bit for bit: everything but the times.
fn assert_same(a: &Bake, b: &Bake, what: &str) {
    assert_eq!(a.meshes.len(), b.meshes.len());
    for (a, b) in a.meshes.iter().zip(&b.meshes) {
        assert_eq!(a.triangles, b.triangles, "{what}");
        assert_eq!(a.source_triangle, b.source_triangle, "{what}");
        assert_eq!(a.source_edge, b.source_edge, "{what}");
        assert!(a.positions == b.positions, "{what}: positions");
        assert!(a.vertex_barycentric == b.vertex_barycentric, "{what}: barycentrics");
        assert!(a.corner_barycentric == b.corner_barycentric, "{what}: barycentrics");
        let bits = |colours: &[[[f32; 3]; 3]]| -> Vec<u32> {
            colours.as_flattened().as_flattened().iter().map(|v| v.to_bits()).collect()
        };
        assert!(bits(&a.corner_radiance) == bits(&b.corner_radiance), "{what}: colours");
    }
    let counts = |bake: &Bake| {
        let visibility = &bake.report.result.visibility;
        let iterations: Vec<_> = (bake.report.timeline.iter())
            .map(|i| (i.shots, i.elements, i.vertices, i.unshot.to_bits()))
            .collect();
        (visibility.exact, visibility.sampled, visibility.rays, iterations)
    };
    assert_eq!(counts(a), counts(b), "{what}");
}

fn assert_deterministic(scene: &Scene, settings: &Settings) -> Bake {
    let on = |threads| scene.bake(&Settings { threads, ..settings.clone() });
    let one = on(1);
    for threads in [2, 4, 16] {
        assert_same(&one, &on(threads), &format!("{threads} threads"));
    }
    assert_same(&one, &on(1), "a second run");
    one
}

#[test]
fn an_adaptive_bake_is_the_same_on_any_number_of_threads() {
    for method in [Method::Adm, Method::Dm, Method::As] {
        let bake = assert_deterministic(&plain_room(), &Settings { tolerance: 0.05, ..by(method) });
        assert!(bake.report.result.visibility.exact > 0);
    }
}

#[test]
fn a_uniform_bake_is_the_same_on_any_number_of_threads() {
    assert_deterministic(&plain_room(), &uniform(0.4));
}

#[test]
fn surfaces_that_look_around_see_the_same_on_any_number_of_threads() {
    let settings = Settings { tolerance: 0.1, transport: Transport::Rays, ..adaptive() };
    assert_deterministic(&plain_room(), &settings);
}

#[test]
fn rays_are_the_same_on_any_number_of_threads() {
    let bake = assert_deterministic(&crowded_room(), &Settings { tolerance: 0.2, ..by(Method::As) });
    println!("{:?}", bake.report.result.visibility);
    assert!(bake.report.result.visibility.rays > 0, "the crowd is too thin to test rays");
}

#[test]
fn lamps_and_the_sky_are_the_same_on_any_number_of_threads() {
    let settings = Settings { tolerance: 0.2, triangle_budget: 4000, ..adaptive() };
    let bake = assert_deterministic(&under_the_sky(), &settings);
    println!("{:?}", bake.report.result.visibility);
    assert!(bake.report.result.visibility.rays > 0, "the crowd is too thin to test rays");
}

/// What the caller calls its objects is not light.
#[test]
fn names_change_nothing() {
    let (scene, mut renamed) = (plain_room(), plain_room());
    renamed.input.objects.iter_mut().for_each(|object| object.name.push('!'));
    renamed.input.materials.iter_mut().for_each(|material| material.name.clear());
    let settings = Settings { tolerance: 0.1, ..adaptive() };
    assert_same(&scene.bake(&settings), &renamed.bake(&settings), "renamed");
}
