//! So many blockers, lights or triangles that whatever grows with their square shows.

mod common;

use std::f64::consts::PI;

use antumbra::settings::Settings;
use antumbra::weld::Bake;
use common::Random;
use common::baked::{all_light, assert_sound, light};
use common::scene::{Scene, adaptive, arriving, lamp, uniform};
use common::shape::Shape;
use glam::DVec3;

/// The most memory that this process has had, bytes; none where the system does not tell.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

/// Memory that a bake takes beyond what there was, bytes.
fn memory_of(scene: &Scene, settings: &Settings) -> (Bake, Option<u64>) {
    let before = peak_memory();
    let bake = scene.bake(settings);
    assert_sound(&scene.input, &bake);
    (bake, peak_memory().zip(before).map(|(after, before)| after - before))
}

/// Small triangles at random between floor and lamp.
fn confetti(count: usize) -> Shape {
    let mut random = Random(33);
    let mut shape = Shape::default();
    // Together they always cover about as much
    let size = 0.6 / (count as f64).sqrt();
    for _ in 0..count {
        let at = DVec3::new(0.0, 0.0, 1.0) + DVec3::new(0.5, 0.5, 0.3) * random.in_cube();
        let first = shape.positions.len() as u32;
        shape.positions.extend((0..3).map(|_| at + size * random.in_cube()));
        shape.triangles.push([first, first + 1, first + 2]);
    }
    shape
}

/// Between two triangles and their lamp: rays take over, are counted, and no more than so many are sent.
#[test]
fn thousands_of_blockers_before_one_lamp_take_bounded_memory_and_counted_rays() {
    assert_crowd_is_bounded(2_000);
}

#[test]
#[ignore = "long: 100,000 blockers"]
fn a_hundred_thousand_blockers_before_one_lamp_take_bounded_memory_and_counted_rays() {
    assert_crowd_is_bounded(100_000);
}

fn assert_crowd_is_bounded(count: usize) {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 0.2), black);
    scene.blocker("confetti", confetti(count), black);
    scene.light(&lamp(DVec3::Z * 2.0, 0.2), 10.0);
    let settings = Settings { tolerance: 0.1, verify_points: 0, ..arriving(uniform(0.2)) };
    let (bake, memory) = memory_of(&scene, &settings);
    let visibility = &bake.report.result.visibility;
    println!("{visibility:?}, {memory:?} bytes");
    assert!(visibility.sampled > 0, "rays were not needed");
    assert!(visibility.rays >= visibility.sampled && visibility.rays <= 128 * visibility.sampled);
    // In proportion to the blockers: measured 4,600 bytes for each
    let bound = (200 << 20) + 10_000 * count as u64;
    assert!(memory.is_none_or(|bytes| bytes < bound), "{memory:?} bytes");
    // The confetti covers some of the light
    let open = {
        let mut alone = scene.clone();
        alone.input.objects.pop();
        alone.bake(&settings)
    };
    let share = mean(&bake) / mean(&open);
    println!("{share} of the light comes through");
    assert!(share > 0.05 && share < 0.95, "{share}");
}

fn mean(bake: &Bake) -> f64 {
    let (sum, count) = all_light(bake).fold((0.0, 0.0), |(sum, count), light| (sum + light.y, count + 1.0));
    sum / count
}

/// A matrix between ten thousand lights would have 800 MB.
#[test]
fn ten_thousand_lights_take_no_memory_for_each_pair() {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 5.0), grey);
    scene.object("box", Shape::cuboid(DVec3::Z, DVec3::splat(0.5)), grey);
    let exitance = 1.0;
    for i in 0..10_000 {
        let at = DVec3::new(f64::from(i % 100) * 0.1 - 4.95, f64::from(i / 100) * 0.1 - 4.95, 3.0);
        scene.light(&lamp(at, 0.05), exitance);
    }
    let settings = Settings { tolerance: 0.1, verify_points: 0, ..arriving(uniform(5.0)) };
    let (bake, memory) = memory_of(&scene, &settings);
    println!("{:?}, {memory:?} bytes", bake.report.result.visibility);
    assert_eq!(bake.report.scene.lights, 10_000);
    assert!(memory.is_none_or(|bytes| bytes < 200 << 20), "{memory:?} bytes");
    // Side by side they are one light of 10 m
    let mut one = scene.clone();
    one.input.lights.clear();
    one.light(&lamp(DVec3::Z * 3.0, 5.0), exitance);
    for (many, one) in all_light(&bake).zip(all_light(&one.bake(&settings))) {
        assert!((many.y - one.y).abs() <= 0.01 * one.y.max(0.1), "{} instead of {}", many.y, one.y);
    }
}

/// A figure of 131,072 triangles on a floor of 100 m: the smaller its triangles, the sooner a bound on size would drop them.
#[test]
#[ignore = "long: 131,072 triangles"]
fn a_figure_of_a_hundred_thousand_triangles_beside_a_huge_floor_is_lit_everywhere() {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 50.0), black);
    let mut figure = Shape::sphere(0.4, 7).map(|p| p + DVec3::Z * 0.5);
    figure.corner_normals = None;
    scene.object("figure", figure, black);
    let at = DVec3::new(3.0, 2.0, 10.0);
    scene.light(&lamp(at, 1.0), 1000.0);
    let bake = scene.bake(&Settings { tolerance: 0.05, verify_points: 0, ..arriving(adaptive()) });
    assert_sound(&scene.input, &bake);
    let figure = &bake.meshes[1];
    let mut checked = 0;
    for (triangle, colours) in figure.triangles.iter().zip(&figure.corner_radiance) {
        let corners = triangle.map(|v| figure.positions[v as usize]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        for (p, colour) in corners.into_iter().zip(colours) {
            let to = at - p;
            let cosines = normal.dot(to) * to.z / to.length_squared();
            // Where all of the lamp is above the horizon
            if cosines > 0.4 {
                let expected = 4000.0 / PI * cosines / to.length_squared();
                let light = light(*colour).y;
                assert!((light / expected - 1.0).abs() < 0.05, "{light} instead of {expected} at {p}");
                checked += 1;
            }
        }
    }
    println!("{checked} corners");
    assert!(checked > 100_000);
}
