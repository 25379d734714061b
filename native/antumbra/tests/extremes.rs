//! Stiff and extreme scenes: what must come out of them all the same.

mod common;

use std::f64::consts::PI;

use antumbra::scene::{LampInput, LampShape};
use antumbra::settings::{Method, Settings};
use common::baked::{all_light, assert_sound, corners, light_over};
use common::scene::{Scene, adaptive, arriving, by, lamp, uniform};
use common::shape::Shape;
use glam::DVec3;

/// A black floor of 2 m × 2 m under nothing yet.
fn black_floor() -> Scene {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 1.0), black);
    scene
}

#[test]
fn a_sliver_is_lit_and_not_refined() {
    let mut scene = black_floor();
    let sliver = Shape {
        positions: vec![DVec3::new(-0.5, 0.0, 0.2), DVec3::new(0.5, 0.0, 0.2), DVec3::new(0.1, 2e-9, 0.2)],
        triangles: vec![[0, 1, 2]],
        corner_normals: None,
    };
    scene.object("sliver", sliver, 0);
    scene.light(&lamp(DVec3::Z * 2.0, 0.2), 10.0);
    let bake = scene.bake(&arriving(adaptive()));
    assert_sound(&scene.input, &bake);
    let triangles = bake.meshes[1].triangles.len();
    // Its coarse elements follow its length; light alone adds none.
    assert!(triangles <= 64, "a sliver of 1e-9 m² became {triangles} triangles");
    assert!(corners(&bake.meshes[1]).all(|(_, light)| light.y > 0.1), "it is black");
}

#[test]
fn a_sliver_that_blocks_hides_next_to_nothing() {
    let light = |sliver: bool| -> Vec<f64> {
        let mut scene = black_floor();
        if sliver {
            let blade = Shape::quad(DVec3::new(-1.0, 0.1, 0.5), DVec3::X * 2.0, DVec3::Y * 1e-9);
            scene.blocker("sliver", blade, 0);
        }
        scene.light(&lamp(DVec3::Z, 0.2), 10.0);
        all_light(&scene.bake(&arriving(uniform(0.25)))).map(|light| light.y).collect()
    };
    for (with, without) in light(true).into_iter().zip(light(false)) {
        assert!((with - without).abs() <= 1e-6, "{with} instead of {without}");
    }
}

/// One sheet twice blocks and reflects as one, and both sheets get the light.
#[test]
fn duplicate_faces_block_once() {
    let bake = |copies: usize| {
        let mut scene = black_floor();
        let grey = scene.material(0.5, 0.0);
        let sheet = Shape::square(DVec3::new(0.2, 0.0, 0.5), 0.3);
        for _ in 0..copies {
            scene.object("sheet", sheet.clone(), grey);
        }
        scene.light(&lamp(DVec3::Z, 0.2), 10.0);
        scene.bake(&arriving(uniform(0.125)))
    };
    let (one, two) = (bake(1), bake(2));
    for ((_, a), (_, b)) in corners(&two.meshes[1]).zip(corners(&two.meshes[2])) {
        assert_eq!(a, b);
        assert!(a.y > 0.3);
    }
    let [warning] = &two.report.warnings[..] else { panic!("{:?}", two.report.warnings) };
    assert!(warning.contains("2 faces of “sheet”") && warning.contains("exactly on others"), "{warning}");
    assert!(one.report.warnings.is_empty());
    let dark = |bake: &antumbra::weld::Bake| {
        corners(&bake.meshes[0]).filter(|(_, light)| light.y < 0.05).map(|(p, _)| p).collect::<Vec<_>>()
    };
    assert!(!dark(&one).is_empty());
    assert_eq!(dark(&one), dark(&two));
    for ((p, once), (_, twice)) in corners(&one.meshes[0]).zip(corners(&two.meshes[0])) {
        assert!((once - twice).length() <= 1e-6, "{twice} instead of {once} at {p}");
    }
}

/// Faces that overlap in one plane neither light nor shadow one another, the same on every run.
#[test]
fn coplanar_overlapping_faces_ignore_one_another() {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 1.0), grey);
    scene.object("rug", Shape::square(DVec3::new(0.3, 0.2, 0.0), 0.5), grey);
    scene.light(&lamp(DVec3::Z, 0.2), 10.0);
    let bake = scene.bake(&arriving(uniform(0.25)));
    let mut alone = scene.clone();
    alone.input.objects.pop();
    for ((p, got), (_, expected)) in
        corners(&bake.meshes[0]).zip(corners(&alone.bake(&arriving(uniform(0.25))).meshes[0]))
    {
        // The floor's elements are the same: light differs by how far a sample is off the floor.
        assert!((got.y - expected.y).abs() <= 1e-5, "{} instead of {} at {p}", got.y, expected.y);
    }
    assert!(corners(&bake.meshes[1]).all(|(_, light)| light.y > 0.1));
    assert!(all_light(&bake).eq(all_light(&scene.bake(&arriving(uniform(0.25))))));
}

#[test]
fn a_light_of_no_size_is_a_point() {
    for half in [5e-4, 5e-7] {
        let mut scene = black_floor();
        scene.light(&lamp(DVec3::Z, half), 1.0 / (4.0 * half * half));
        let bake = scene.bake(&arriving(uniform(0.25)));
        for (p, light) in corners(&bake.meshes[0]) {
            let distance_squared = p.distance_squared(DVec3::Z);
            let expected = 1.0 / (PI * distance_squared * distance_squared);
            assert!((light.y / expected - 1.0).abs() < 1e-5, "{} instead of {expected} at {p}", light.y);
        }
    }
}

/// A sky of a thousand kilometres over a floor fills its hemisphere.
#[test]
fn a_light_without_end_fills_the_hemisphere() {
    let mut scene = black_floor();
    scene.light(&lamp(DVec3::Z, 5e5), 2.0);
    let bake = scene.bake(&arriving(uniform(0.5)));
    assert_sound(&scene.input, &bake);
    for light in all_light(&bake) {
        assert!((light.y - 2.0).abs() < 1e-5, "{}", light.y);
    }
}

#[test]
fn black_surfaces_take_one_direct_pass() {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("room", Shape::room(DVec3::splat(2.0)), black);
    scene.object("box", Shape::cuboid(DVec3::new(0.6, 0.7, 0.5), DVec3::splat(0.2)), black);
    scene.light(&lamp(DVec3::new(1.0, 1.0, 1.9), 0.2), 10.0);
    scene.light(&lamp(DVec3::new(0.5, 1.5, 1.5), 0.1), 5.0);
    let bake = scene.bake(&arriving(adaptive()));
    let last = bake.report.timeline.last().expect("two lights shoot");
    assert_eq!(last.shots, 2, "one shot a light and no more");
    assert_eq!(bake.report.result.unshot, 0.0);
    assert!(all_light(&scene.bake(&adaptive())).all(|light| light == DVec3::ZERO), "black sends nothing");
}

/// A floor and a wall under a weak lamp; beside them a lamp a million million times as strong, which faces away or is
/// shut in a black box.
fn beside_a_strong_light(reflectance: f64, strong: Option<bool>) -> Vec<DVec3> {
    let mut scene = Scene::default();
    let (grey, black) = (scene.material(reflectance, 0.0), scene.material(0.0, 0.0));
    scene.object("floor", Shape::square(DVec3::ZERO, 1.0), grey);
    scene.object("wall", Shape::quad(DVec3::new(-1.0, -1.0, 0.0), DVec3::Y * 2.0, DVec3::Z * 2.0), grey);
    scene.blocker("box", Shape::cuboid(DVec3::new(3.0, 0.0, 0.5), DVec3::splat(0.4)), black);
    scene.light(&lamp(DVec3::Z, 0.2), 1e-6);
    match strong {
        Some(true) => scene.light(&lamp(DVec3::new(3.0, 0.0, 0.6), 0.2), 1e6),
        Some(false) => {
            let up: Vec<DVec3> = lamp(DVec3::Z * 2.5, 0.2).into_iter().rev().collect();
            scene.light(&up, 1e6);
        }
        None => {}
    }
    all_light(&scene.bake(&arriving(uniform(0.5)))).collect()
}

fn assert_strong_light_changes_nothing(reflectance: f64, within: f64) {
    let alone = beside_a_strong_light(reflectance, None);
    assert!(alone.iter().any(|light| light.y > 1e-8));
    for shut_in in [false, true] {
        for (got, expected) in beside_a_strong_light(reflectance, Some(shut_in)).iter().zip(&alone) {
            assert!((got - expected).length() <= within * expected.length(), "{got} instead of {expected}");
        }
    }
}

#[test]
fn a_weak_light_beside_a_strong_one_lights_as_if_it_were_alone() {
    assert_strong_light_changes_nothing(0.0, 1e-6);
}

/// The first guess of how much light there is counts the strong one, so that links are told apart in another order: the
/// difference is far within the tolerance of 0.01.
#[test]
fn what_a_weak_light_beside_a_strong_one_reflects_is_right_within_the_tolerance() {
    assert_strong_light_changes_nothing(0.5, 1e-3);
}

/// A figure of three thousand triangles of a square millimetre, next to a floor of 100 m.
#[test]
fn tiny_triangles_beside_a_huge_floor_all_get_their_light() {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 50.0), grey);
    let cells = Shape::grid(DVec3::new(0.0, 0.0, 0.3), DVec3::X * 0.04, DVec3::Y * 0.04, [40, 40]);
    scene.object("cloth", cells, grey);
    scene.light(&lamp(DVec3::new(3.0, 2.0, 10.0), 1.0), 1000.0);
    let bake = scene.bake(&arriving(adaptive()));
    assert_sound(&scene.input, &bake);
    let direct = 1000.0 * 4.0 / PI;
    for (p, light) in corners(&bake.meshes[1]) {
        let to = DVec3::new(3.0, 2.0, 10.0) - p;
        let expected = direct * to.z * to.z / to.length_squared().powi(2);
        assert!((light.y / expected - 1.0).abs() < 0.02, "{} instead of {expected} at {p}", light.y);
    }
}

/// A white room that is open is no furnace: it converges.
#[test]
fn white_surfaces_in_the_open_are_fine() {
    let mut scene = Scene::default();
    let white = scene.material(1.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 1.0), white);
    scene.object("wall", Shape::quad(DVec3::new(-1.0, -1.0, 0.0), DVec3::Y * 2.0, DVec3::Z * 2.0), white);
    scene.light(&lamp(DVec3::Z, 0.2), 10.0);
    let bake = scene.bake(&adaptive());
    assert_sound(&scene.input, &bake);
    assert_eq!(bake.report.result.ended_by, "converged");
}

/// A blocker in the light's own plane, or behind it, does nothing at all.
#[test]
fn blockers_beside_and_behind_a_light_change_nothing() {
    let light = |z: f64| -> Vec<DVec3> {
        let mut scene = black_floor();
        scene.blocker("sheet", Shape::square(DVec3::new(0.1, 0.0, z), 0.5), 0);
        scene.light(&lamp(DVec3::Z, 0.2), 10.0);
        all_light(&scene.bake(&arriving(uniform(0.25)))).collect()
    };
    assert_eq!(light(1.0), light(1.1));
    assert_ne!(light(0.9), light(1.1));
}

/// A sheet with a square hole, 4 m wide, at a height.
fn pinhole(size: f64, height: f64) -> Shape {
    let (near, far) = (0.5 * size, 2.0);
    let strip = |x: [f64; 2], y: [f64; 2]| {
        let corner = DVec3::new(x[0], y[0], height);
        Shape::quad(corner, DVec3::X * (x[1] - x[0]), DVec3::Y * (y[1] - y[0]))
    };
    strip([-far, far], [-far, -near])
        .and(&strip([-far, far], [near, far]))
        .and(&strip([-far, -near], [-near, near]))
        .and(&strip([near, far], [-near, near]))
}

fn below_a_pinhole(size: f64) -> Scene {
    let mut scene = black_floor();
    scene.blocker("sheet", pinhole(size, 0.5), 0);
    scene
}

/// The image of a lamp, as bright as its radiance times the solid angle of the hole.
#[test]
fn the_spot_behind_a_pinhole_is_found() {
    for size in [1e-2, 1e-4] {
        let mut scene = below_a_pinhole(size);
        scene.light(&lamp(DVec3::Z, 0.2), 10.0);
        for method in [Method::Adm, Method::Dm, Method::As] {
            let settings = Settings { triangle_budget: 5000, ..arriving(by(method)) };
            let bake = scene.bake(&settings);
            let at = |x: f64, y: f64| light_over(&bake.meshes[0], x, y);
            let expected = 10.0 / PI * size * size / 0.25;
            let spot = at(0.01, 0.02);
            println!("{size:e}, {method:?}: {spot:e} of {expected:e}");
            assert!((spot / expected - 1.0).abs() < 0.02, "{method:?}: {spot:e} instead of {expected:e}");
            // A lamp 0.2 to each side has an image as large.
            assert_eq!(at(0.5, 0.5), 0.0, "{method:?}");
        }
    }
}

/// A sharp sun's spot is as small as the hole. DM draws its border whatever it is worth, ADM where it can be noticed, or where
/// no other light is known.
#[test]
fn the_spot_of_a_sharp_sun_behind_a_pinhole_is_found() {
    for (method, size) in [(Method::Dm, 1e-2), (Method::Dm, 1e-4), (Method::Adm, 1e-2), (Method::Adm, 1e-4)] {
        assert_sun_spot_is_found(method, size);
    }
}

fn assert_sun_spot_is_found(method: Method, size: f64) {
    let direction = DVec3::new(0.1, 0.2, 1.0);
    let mut scene = below_a_pinhole(size);
    let sun = LampShape::Sun { direction, angle: 0.0, irradiance_rgb: [1.0; 3] };
    scene.input.lamps.push(LampInput::new("sun", sun));
    let bake = scene.bake(&arriving(by(method)));
    let spot = light_over(&bake.meshes[0], -0.05, -0.1);
    let expected = direction.normalize().z;
    println!("{method:?}, {size}: {spot} of {expected}, {} triangles", bake.meshes[0].triangles.len());
    assert!((spot - expected).abs() < 1e-6, "{method:?}: {spot} instead of {expected} behind {size}");
    // A spot as large as the hole, and dark beside it
    assert_eq!(light_over(&bake.meshes[0], -0.05 + 0.6 * size, -0.1), 0.0, "{method:?}, {size}");
}

/// Slats that are 1e-9 rad apart as the lamp's corners see them: their lines become one, and nobody hangs.
#[test]
fn shadow_lines_a_billionth_apart_are_merged() {
    let bake = |slats: i32| {
        let mut scene = black_floor();
        for i in 0..slats {
            let edge = 0.1 + 5e-10 * f64::from(i);
            let height = 0.5 + 1e-3 * f64::from(i);
            // Each ends in the same plane through the lamp's edge, but for a billionth
            let end = 0.2 + (edge - 0.2) * (1.0 - height) / 0.5;
            let slat = Shape::quad(DVec3::new(end - 0.4, -0.4, height), DVec3::X * 0.4, DVec3::Y * 0.8);
            scene.blocker("slat", slat, 0);
        }
        scene.light(&lamp(DVec3::Z, 0.2), 10.0);
        let bake = scene.bake(&arriving(by(Method::Dm)));
        assert_sound(&scene.input, &bake);
        bake
    };
    let [one, twelve] = [1, 12].map(bake);
    println!("{:?} and {:?}", one.report.result.lines, twelve.report.result.lines);
    assert_eq!(twelve.report.result.lines.plain_faces, 0, "they could not be arranged");
    assert!(twelve.report.result.lines.drawn > one.report.result.lines.drawn);
}

/// Thirty blades through one axis throw thirty lines through one point below it.
#[test]
fn thirty_shadow_lines_through_one_point_turn_no_face_over() {
    let mut scene = black_floor();
    for i in 0..30 {
        let along =
            DVec3::new(f64::from(i).mul_add(0.1, 0.05).cos(), f64::from(i).mul_add(0.1, 0.05).sin(), 0.0);
        let blade = Shape::quad(DVec3::Z * 0.5 - 0.3 * along, 0.6 * along, DVec3::Z * 0.2);
        scene.blocker("blade", blade, 0);
    }
    let point = LampShape::Point {
        position: DVec3::new(0.1, 0.05, 1.5),
        radius: 0.0,
        faces_receiver: true,
        intensity_rgb: [1.0; 3],
        cone: None,
    };
    scene.input.lamps.push(LampInput::new("point", point));
    for method in [Method::Adm, Method::Dm] {
        let bake = scene.bake(&arriving(by(method)));
        // Winding, areas, watertightness
        assert_sound(&scene.input, &bake);
        println!("{method:?}: {:?}, {} triangles", bake.report.result.lines, bake.report.result.triangles);
        assert!(bake.report.result.lines.drawn >= 60, "{:?}", bake.report.result.lines);
    }
}

/// Both ends of what single precision can hold: a scene as large as a galaxy, one as small as an atom's part.
#[test]
fn lengths_and_strengths_near_the_ends_of_single_precision() {
    for (scale, strength) in [(1e14, 1e-30), (1e-14, 1e30), (1e-20, 1.0), (1.0, 1e-37), (1.0, 1e29)] {
        let mut scene = Scene::default();
        let grey = scene.material(0.5, 0.0);
        scene.object("room", Shape::room(DVec3::ONE), grey);
        scene.object("box", Shape::cuboid(DVec3::new(0.4, 0.5, 0.3), DVec3::splat(0.1)), grey);
        scene.light(&lamp(DVec3::new(0.5, 0.5, 0.9), 0.1), strength);
        let settings = Settings { tolerance: 0.1, verify_points: 100, ..adaptive() };
        let plain = scene.bake(&settings);
        let scene = scene.placed(glam::DMat4::from_scale(DVec3::splat(scale)));
        let bake = scene.bake(&settings);
        assert_sound(&scene.input, &bake);
        let mean = |bake: &antumbra::weld::Bake| {
            all_light(bake).map(|light| light.y).sum::<f64>() / all_light(bake).count() as f64
        };
        println!(
            "{scale:e} m, {strength:e} W/m²: mean {:e}, verified {:?}",
            mean(&bake),
            bake.report.result.verification.as_ref().map(|v| v.error)
        );
        assert!((mean(&bake) / mean(&plain) - 1.0).abs() < 0.05 && mean(&bake) > 1e-3 * strength);
    }
}
