//! What a bake says about its own error, against errors that are known.

mod common;

use antumbra::report::Verification;
use antumbra::scene::{ConeInput, LampInput, LampShape, SkyInput};
use antumbra::settings::{Method, Settings};
use antumbra::visibility::{ConvexPolygon, Receiver};
use antumbra::weld::Bake;
use common::baked::light_over;
use common::scene::{Scene, adaptive, arriving, lamp, uniform};
use common::shape::Shape;
use common::verified::{print, verified};
use common::{Random, polygon, visible};
use glam::{DMat3, DVec3};

/// Settings with which paths enough are looked along to tell an error of half a per cent.
fn thorough(settings: &Settings) -> Settings {
    Settings { verify_points: 20_000, ..settings.clone() }
}

/// A floor with a turned cube on it, and nothing that shines.
fn stage() -> Scene {
    let mut scene = Scene::default();
    let (grey, dark) = (scene.material(0.5, 0.0), scene.material(0.2, 0.0));
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), grey);
    let turn = DMat3::from_rotation_z(0.4);
    let cube = Shape::cuboid(DVec3::ZERO, DVec3::splat(0.4)).map(|p| turn * p + DVec3::new(0.3, 0.1, 0.4));
    scene.object("cube", cube, dark);
    scene
}

fn lamps() -> Vec<(&'static str, bool, LampShape)> {
    let rgb = [30.0, 20.0, 10.0];
    let above = DVec3::new(-0.7, 0.4, 2.0);
    let point = |radius: f64, faces_receiver: bool, cone: Option<ConeInput>| LampShape::Point {
        position: above,
        radius,
        faces_receiver,
        intensity_rgb: rgb,
        cone,
    };
    let down = DMat3::from_cols(DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z);
    let cone = |angle: f64, blend: f64| Some(ConeInput { cone_from_world: down, angle, blend });
    let sun =
        |angle: f64| LampShape::Sun { direction: DVec3::new(0.5, 0.3, 1.0), angle, irradiance_rgb: rgb };
    let panel =
        |spread: f64| LampShape::Panel { outline: lamp(above, 0.3).to_vec(), exitance_rgb: rgb, spread };
    vec![
        ("point", true, point(0.0, true, None)),
        ("disc", true, point(0.3, true, None)),
        ("sphere", true, point(0.3, false, None)),
        ("point without shadow", false, point(0.0, true, None)),
        ("spot", true, point(0.0, true, cone(1.2, 0.5))),
        ("round spot", true, point(0.2, false, cone(1.5, 1.0))),
        ("sun", true, sun(0.0)),
        ("broad sun", true, sun(0.4)),
        ("half a sky of sun", true, sun(3.0)),
        ("panel", true, panel(std::f64::consts::PI)),
        ("panel with a spread", true, panel(1.5)),
        ("panel kept together", true, panel(0.5)),
        (
            "sphere around the cube",
            true,
            LampShape::Point {
                position: DVec3::new(0.3, 0.1, 0.5),
                radius: 1.0,
                faces_receiver: false,
                intensity_rgb: rgb,
                cone: None,
            },
        ),
    ]
}

/// Paths know lights by formulas of their own; the solver's must give the same.
#[test]
fn every_light_is_the_same_along_paths_as_in_a_bake() {
    for (name, casts_shadows, shape) in lamps() {
        let mut scene = stage();
        scene.input.lamps.push(LampInput { casts_shadows, ..LampInput::new(name, shape) });
        // Light kept together takes refinement minutes, and on the sphere's surface light jumps where there is no line.
        let hard = ["panel kept together", "sphere around the cube"].contains(&name);
        let settings = if hard { uniform(0.05) } else { adaptive() };
        let bake = scene.bake(&thorough(&Settings { tolerance: 0.02, ..settings }));
        print(name, &bake);
        assert_agree(&bake, if hard { 0.2 } else { 0.03 }, name);
    }
}

/// A sky with a bright corner; surfaces that emit, among them one that does not block; a film that colours what it lets
/// through; lamps that light, or are blocked by, some objects only.
#[test]
fn skies_emitting_surfaces_filters_and_links_are_the_same_along_paths_as_in_a_bake() {
    let mut even = stage();
    even.input.sky = Some(SkyInput::even("even", [3.0, 2.0, 1.0]));
    let mut uneven = stage();
    let mut sky =
        SkyInput { name: "uneven".to_owned(), cells_per_side: 8, exitance_rgb: vec![[1.0; 3]; 6 * 64] };
    sky.exitance_rgb[4 * 64 + 20] = [300.0, 200.0, 100.0];
    sky.exitance_rgb[0..64].fill([0.0, 0.0, 4.0]);
    uneven.input.sky = Some(sky);
    let mut emitting = stage();
    let glowing = emitting.material(0.3, 5.0);
    let airy = emitting.material(0.0, 8.0);
    emitting.input.materials[airy as usize].transmittance_rgb = [1.0; 3];
    emitting.object("wall", Shape::quad(DVec3::new(-1.5, -1.0, 0.0), DVec3::Y * 2.0, DVec3::Z), glowing);
    emitting.object("veil", Shape::square(DVec3::new(0.5, -1.0, 1.2), 0.4), airy);
    let mut filtered = stage();
    filtered.light(&lamp(DVec3::new(-0.5, 0.3, 2.0), 0.3), 20.0);
    let film = filtered.material(0.1, 0.0);
    filtered.input.materials[film as usize].transmittance_rgb = [0.8, 0.5, 0.2];
    filtered.object("film", Shape::square(DVec3::new(-0.5, -0.4, 1.0), 0.5), film);
    let mut linked = stage();
    linked.light(&lamp(DVec3::new(0.9, 0.9, 2.0), 0.2), 5.0);
    let point = lamps().swap_remove(1).2;
    linked
        .input
        .lamps
        .push(LampInput { lit_objects: Some(vec![0]), ..LampInput::new("of the floor", point) });
    let point = lamps().swap_remove(0).2;
    let blocking_objects = Some(vec![0]);
    linked.input.lamps.push(LampInput { blocking_objects, ..LampInput::new("through the cube", point) });
    let scenes = [
        ("even", even),
        ("uneven", uneven),
        ("emitting", emitting),
        ("filtered", filtered),
        ("linked", linked),
    ];
    for (name, scene) in scenes {
        let bake = scene.bake(&thorough(&Settings { tolerance: 0.02, ..adaptive() }));
        print(name, &bake);
        assert_agree(&bake, 0.03, name);
    }
}

/// The bake is right within a bound, and on the whole within its interval; twice as wide a one, for dozens of tests.
fn assert_agree(bake: &Bake, most: f64, what: &str) {
    let Verification { error, bias, .. } = verified(bake);
    assert!(error[0] < most, "{what}: error {error:?}");
    let wide = 2.0 * (bias[2] - bias[0]);
    assert!(bias[0].abs() < wide + 0.002, "{what}: bias {bias:?}");
}

/// Closed, and the same everywhere: B = E/(1 - rho) exactly, and paths of dozens of bounces must find it.
#[test]
fn a_furnace_is_right_along_paths() {
    for reflectance in [0.5, 0.9] {
        let mut scene = Scene::default();
        let glowing = scene.material(reflectance, 1.0);
        scene.object("furnace", Shape::room(DVec3::new(1.0, 2.0, 1.5)), glowing);
        let bake = scene.bake(&thorough(&adaptive()));
        print("furnace", &bake);
        assert_agree(&bake, 0.04, "furnace");
        assert!(verified(&bake).energy_defect.abs() < 0.01);
    }
}

/// A floor under a lamp and a plate, nothing reflecting: the exact light is known from the kernel.
fn plate_over_floor() -> (Scene, [DVec3; 4], Vec<ConvexPolygon>) {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    let outline = lamp(DVec3::new(0.4, 0.2, 1.5), 0.3);
    let plate = Shape::square(DVec3::new(0.0, 0.0, 0.6), 0.3);
    let blockers = plate.triangles.iter().map(|t| polygon(&t.map(|v| plate.positions[v as usize]))).collect();
    scene.object("floor", Shape::square(DVec3::ZERO, 1.0), black);
    scene.blocker("plate", plate, black);
    scene.light(&outline, 10.0);
    (scene, outline, blockers)
}

#[test]
fn the_interval_holds_an_error_that_is_known() {
    let (scene, outline, blockers) = plate_over_floor();
    for size in [0.5, 0.2, 0.05] {
        let bake = scene.bake(&arriving(thorough(&uniform(size))));
        let error = known_error(&bake, &outline, &blockers);
        print(&format!("known to be {:.2} %", 100.0 * error), &bake);
        let [_, low, high] = verified(&bake).error;
        // One in twenty intervals does not hold what it is for: half as much on both sides holds these three.
        let margin = 0.5 * (high - low);
        assert!(low - margin < error && error < high + margin, "{error} is not in {low} to {high}");
    }
}

/// A floor under a lamp and a plate, nothing reflecting: the error by the kernel, at random points.
fn known_error(bake: &Bake, outline: &[DVec3; 4], blockers: &[ConvexPolygon]) -> f64 {
    let mut random = Random(7);
    let (mut squares, mut sum) = (0.0, 0.0);
    for _ in 0..10_000 {
        let [x, y] = [random.between(-1.0, 1.0), random.between(-1.0, 1.0)];
        let receiver = Receiver::new(DVec3::new(x, y, 0.0), DVec3::Z);
        let exact = 10.0 * visible(&receiver, &polygon(outline), blockers).value;
        squares += (light_over(&bake.meshes[0], x, y) - exact).powi(2);
        sum += exact;
    }
    (squares / 1e4).sqrt() / (sum / 1e4)
}

/// What refinement estimates is of the elements as they touch the light; fitted to it they err less, at best by the root of
/// six (of a parabola, the line through its ends against the best line). It claims no bound: light that bends within an
/// element, where nothing is looked at, is missed.
#[test]
fn the_solvers_estimate_tells_the_size_of_an_error_that_is_known() {
    let (scene, outline, blockers) = plate_over_floor();
    for method in [Method::Adm, Method::As] {
        for tolerance in [0.05, 0.02, 0.01, 0.005] {
            let bake = scene.bake(&arriving(Settings { method, tolerance, ..adaptive() }));
            let known = known_error(&bake, &outline, &blockers);
            let estimated = bake.report.result.estimated_error.expect("the mesh was refined");
            println!("{method:?} at {tolerance}: known {known:.5}, estimated {estimated:.5}");
            assert!(known < estimated && estimated < 2.0 * known, "{known}, {estimated}");
            assert!(estimated <= 0.4 * tolerance || bake.report.result.ended_by != "converged");
        }
    }
    let uniform = scene.bake(&uniform(0.2));
    assert_eq!(uniform.report.result.estimated_error, None);
}

#[test]
fn the_course_of_the_error_falls_to_its_end() {
    let mut scene = stage();
    scene.light(&lamp(DVec3::new(-0.5, 0.3, 2.0), 0.3), 20.0);
    let bake = scene.bake(&thorough(&adaptive()));
    let errors: Vec<f64> = bake.report.timeline.iter().filter_map(|i| i.error).map(|[e, ..]| e).collect();
    println!("{errors:.4?}");
    assert!(errors.len() >= 4, "{errors:?}");
    assert!(errors[errors.len() - 1] < 0.2 * errors[0], "{errors:?}");
    // It is looked at while the mesh is refined, too.
    let told = bake.report.timeline.iter().filter(|iteration| iteration.error.is_some());
    let elements: Vec<usize> = told.map(|iteration| iteration.elements).collect();
    assert!(elements.windows(2).filter(|pair| pair[1] > pair[0]).count() >= 3, "{elements:?}");
    // The mesh that comes out shows what the last iteration showed.
    let end = verified(&bake).error[0];
    assert!((end - errors[errors.len() - 1]).abs() < 1e-6, "{end} after {errors:?}");
}

#[test]
fn verification_changes_nothing_and_is_the_same_for_any_number_of_threads() {
    let mut scene = stage();
    scene.light(&lamp(DVec3::new(-0.5, 0.3, 2.0), 0.3), 20.0);
    let one = scene.bake(&Settings { threads: 1, ..adaptive() });
    let many = scene.bake(&Settings { threads: 5, ..adaptive() });
    let without_time = |bake: &Bake| Verification { time_s: 0.0, ..verified(bake).clone() };
    assert_eq!(without_time(&one), without_time(&many));
    let none = scene.bake(&Settings { verify_points: 0, ..adaptive() });
    assert!(none.report.result.verification.is_none());
    assert!(none.report.timeline.iter().all(|iteration| iteration.error.is_none()));
    for (with, without) in one.meshes.iter().zip(&none.meshes) {
        assert_eq!(with.triangles, without.triangles);
        assert_eq!(with.corner_radiance, without.corner_radiance);
    }
}

#[test]
fn the_dark_has_no_relative_error() {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), black);
    scene.light(&lamp(DVec3::new(0.0, 0.0, 1.0), 0.3), 20.0);
    let bake = scene.bake(&adaptive());
    assert_eq!(bake.report.result.verification, None);
}

/// Closed rooms in a row, each with a lamp of its own: a path that looks for the lamp of another finds a wall.
#[test]
fn many_rooms_are_no_noisier_than_one() {
    let noise_of_a_path = |rooms: u32| {
        let mut scene = Scene::default();
        let grey = scene.material(0.3, 0.0);
        for room in 0..rooms {
            let place = 3.0 * f64::from(room) * DVec3::X;
            scene.object(&format!("room {room}"), Shape::room(DVec3::splat(2.0)).map(|p| p + place), grey);
            scene.light(&lamp(place + DVec3::new(1.0, 1.0, 1.9), 0.2), 100.0);
        }
        let bake = scene.bake(&uniform(2.0));
        print(&format!("{rooms} rooms"), &bake);
        let verification = verified(&bake);
        verification.noise * f64::from(verification.paths as u32).sqrt()
    };
    let [one, many] = [1, 100].map(noise_of_a_path);
    assert!(many < 4.0 * one, "{many} of many, {one} of one; by power alone it would be ten times as much");
}

/// Rays are spent by what the solver counted, not by a clock.
#[test]
fn a_larger_bake_is_worth_more_rays() {
    let mut scene = stage();
    scene.light(&lamp(DVec3::new(-0.5, 0.3, 2.0), 0.3), 20.0);
    let white = scene.material(0.7, 0.0);
    scene.object(
        "room",
        Shape::room(DVec3::new(4.0, 4.0, 2.5)).map(|p| p - DVec3::new(2.0, 2.0, 0.1)),
        white,
    );
    let rays = [0.1, 0.01].map(|tolerance| {
        let bake = scene.bake(&Settings { tolerance, ..adaptive() });
        print(&format!("tolerance {tolerance}"), &bake);
        verified(&bake).rays
    });
    assert!(rays[1] > 2 * rays[0], "{rays:?}");
}
