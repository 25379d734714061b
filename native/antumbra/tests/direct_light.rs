//! Direct light against closed forms. Nothing reflects here, and the irradiance is baked.
//!
//! Samples lie a millionth of their element off its surface and its edges: errors of `1e-6 E` are right.

mod common;

use std::f64::consts::PI;

use antumbra::settings::{Method, Settings};
use antumbra::weld::Bake;
use common::baked::{all_light, assert_sound, corners, light_over};
use common::scene::{Scene, adaptive, arriving, by, lamp, uniform};
use common::shape::Shape;
use glam::{DMat4, DVec3};

/// A black floor, 4 m wide, facing up at z = 0, of `cells` by `cells` squares.
fn floor(scene: &mut Scene, cells: u32) {
    let black = scene.material(0.0, 0.0);
    let shape = Shape::grid(DVec3::new(-2.0, -2.0, 0.0), DVec3::X * 4.0, DVec3::Y * 4.0, [cells, cells]);
    scene.object("floor", shape, black);
}

/// Form factor from a point to a parallel square of side `2 half` at `height`, its centre `[x, y]` away.
fn parallel_square([x, y]: [f64; 2], half: f64, height: f64) -> f64 {
    // From a point below a corner, with a and b the sides (Howell, *A Catalog of Radiation Heat Transfer
    // Configuration Factors*, B-4); odd in both, so that corners can be combined.
    let corner = |a: f64, b: f64| {
        let (a, b) = (a / height, b / height);
        let (along, across) = (a.hypot(1.0), b.hypot(1.0));
        (a / along * (b / along).atan() + b / across * (a / across).atan()) / (2.0 * PI)
    };
    corner(x + half, y + half) - corner(x - half, y + half) - corner(x + half, y - half)
        + corner(x - half, y - half)
}

/// The single light of the corners of a bake, which is the same in every channel.
fn greens(bake: &Bake) -> Vec<f64> {
    all_light(bake)
        .map(|light| {
            assert_eq!(light.x, light.y);
            assert_eq!(light.y, light.z);
            light.y
        })
        .collect()
}

#[test]
fn under_a_square_light_every_vertex_has_the_closed_form() {
    let mut scene = Scene::default();
    floor(&mut scene, 1);
    scene.light(&lamp(DVec3::Z * 1.5, 0.4), 10.0);
    let bake = scene.bake(&arriving(uniform(0.25)));
    assert_sound(&scene.input, &bake);
    assert!(bake.meshes[0].positions.len() > 250);
    for (p, light) in corners(&bake.meshes[0]) {
        let expected = 10.0 * parallel_square([p.x, p.y], 0.4, 1.5);
        assert!((light.y - expected).abs() <= 1e-5, "{} instead of {expected} at {p}", light.y);
    }
}

#[test]
fn a_light_twice_as_strong_is_twice_as_bright_and_two_lights_add_up() {
    let bake = |strengths: [f64; 2]| {
        let mut scene = Scene::default();
        floor(&mut scene, 1);
        for (x, exitance) in [-1.0, 0.5].into_iter().zip(strengths) {
            scene.light(&lamp(DVec3::new(x, 0.1, 1.0), 0.3), exitance);
        }
        greens(&scene.bake(&arriving(uniform(0.5))))
    };
    let [first, second, both] = [[2.0, 0.0], [0.0, 3.0], [4.0, 3.0]].map(bake);
    for k in 0..both.len() {
        assert!((2.0 * first[k] + second[k] - both[k]).abs() < 1e-6);
    }
}

#[test]
fn far_away_light_falls_with_the_square_of_the_distance() {
    let black_floor = |half: f64, distance: f64| {
        let mut scene = Scene::default();
        let black = scene.material(0.0, 0.0);
        scene.object("speck", Shape::square(DVec3::ZERO, 0.01), black);
        scene.light(&lamp(DVec3::Z * distance, half), 1.0);
        let bake = scene.bake(&arriving(uniform(0.1)));
        greens(&bake).into_iter().fold(0.0, f64::max) / (4.0 * half * half / (PI * distance * distance))
    };
    // The light's and the speck's sizes change it by about their squares.
    for (half, distance, tolerance) in [(0.05, 10.0, 4e-5), (0.05, 100.0, 1e-6), (5e-7, 10.0, 4e-6)] {
        let ratio = black_floor(half, distance);
        assert!((ratio - 1.0).abs() < tolerance, "{ratio} at {distance} m");
    }
}

#[test]
fn an_area_light_shines_to_one_side() {
    let mut scene = Scene::default();
    floor(&mut scene, 1);
    let ceiling = Shape::square(DVec3::Z * 2.0, 2.0).inside_out();
    scene.object("ceiling", ceiling, 0);
    scene.light(&lamp(DVec3::Z, 0.3), 1.0);
    let bake = scene.bake(&arriving(adaptive()));
    let least = corners(&bake.meshes[0]).map(|(_, light)| light.y).fold(f64::INFINITY, f64::min);
    assert!(least > 0.0);
    assert!(corners(&bake.meshes[1]).all(|(_, light)| light == DVec3::ZERO));
}

/// A surface that emits does so on both sides, whichever way it is wound.
#[test]
fn an_emitting_surface_shines_to_both_sides() {
    for flipped in [false, true] {
        let mut scene = Scene::default();
        floor(&mut scene, 1);
        scene.object("ceiling", Shape::square(DVec3::Z * 2.0, 2.0).inside_out(), 0);
        let glow = scene.material(0.0, 10.0);
        let panel = Shape::square(DVec3::Z, 0.3);
        scene.blocker("panel", if flipped { panel.inside_out() } else { panel }, glow);
        let bake = scene.bake(&arriving(uniform(0.5)));
        assert_eq!(bake.report.scene.lights, 1);
        for (p, light) in bake.meshes.iter().flat_map(corners) {
            let expected = 10.0 * parallel_square([p.x, p.y], 0.3, 1.0);
            assert!((light.y - expected).abs() <= 1e-5, "{} instead of {expected} at {p}", light.y);
        }
    }
}

#[test]
fn a_surface_shows_its_own_emission_and_does_not_light_itself() {
    let mut scene = Scene::default();
    let glow = scene.material(0.5, 3.0);
    scene.object("panel", Shape::square(DVec3::ZERO, 1.0), glow);
    for light in all_light(&scene.bake(&adaptive())) {
        assert!((light - DVec3::splat(3.0)).abs().max_element() < 1e-6);
    }
    assert!(all_light(&scene.bake(&arriving(adaptive()))).all(|light| light == DVec3::ZERO));
}

#[test]
fn light_shut_in_a_closed_box_leaves_exactly_nothing_outside() {
    for turn in [0.0, 0.4] {
        let mut scene = Scene::default();
        floor(&mut scene, 1);
        let grey = scene.material(0.5, 0.0);
        let place = DMat4::from_translation(DVec3::Z * 0.8) * DMat4::from_rotation_y(turn);
        let shut = Shape::cuboid(DVec3::ZERO, DVec3::splat(0.3));
        scene.object("box", shut, grey).world_from_object = place;
        scene.light(&lamp(DVec3::Z * 0.9, 0.1), 100.0);
        let bake = scene.bake(&arriving(Settings { tolerance: 0.1, ..adaptive() }));
        assert!(greens(&bake).into_iter().all(|light| light == 0.0), "at a turn of {turn}");
    }
}

/// Whether the blocking square at `height` hides every corner of the light, and so all of it.
fn in_umbra(p: DVec3, light: &[DVec3], height: f64, half: f64) -> bool {
    light.iter().all(|&corner| {
        let at = p.lerp(corner, (height - p.z) / (corner.z - p.z));
        at.x.abs() < half - 1e-5 && at.y.abs() < half - 1e-5
    })
}

#[test]
fn full_umbra_is_exactly_black() {
    let outline = lamp(DVec3::Z * 2.0, 0.2);
    let mut scene = Scene::default();
    floor(&mut scene, 1);
    scene.blocker("blocker", Shape::square(DVec3::Z, 0.5), 0);
    scene.light(&outline, 10.0);
    let bake = scene.bake(&arriving(uniform(0.1)));
    let (mut dark, mut lit) = (0, 0);
    for (p, light) in corners(&bake.meshes[0]) {
        if in_umbra(p, &outline, 1.0, 0.5) {
            assert_eq!(light, DVec3::ZERO, "at {p}");
            dark += 1;
        } else if p.truncate().abs().max_element() > 1.25 {
            let expected = 10.0 * parallel_square([p.x, p.y], 0.2, 2.0);
            assert!((light.y - expected).abs() <= 1e-5, "outside the penumbra, at {p}");
            lit += 1;
        }
    }
    assert!(dark > 100 && lit > 100);
}

#[test]
fn adaptive_refinement_keeps_full_umbra_exactly_black() {
    let outline = lamp(DVec3::Z * 2.0, 0.2);
    let mut scene = Scene::default();
    floor(&mut scene, 1);
    scene.blocker("blocker", Shape::square(DVec3::Z, 0.5), 0);
    scene.light(&outline, 10.0);
    let bake = scene.bake(&arriving(by(Method::As)));
    let floor = &bake.meshes[0];
    let umbra: Vec<f64> = (corners(floor))
        .filter(|&(p, _)| in_umbra(p, &outline, 1.0, 0.5))
        .map(|(_, light)| light.y)
        .collect();
    assert!(umbra.len() > 20);
    assert!(umbra.iter().all(|&light| light == 0.0), "{umbra:?}");
    assert_eq!(light_over(floor, 0.0, 0.0), 0.0);
}

/// Where a glowing wall meets the floor, the floor sees half of its hemisphere filled: the limit from its own side.
#[test]
fn at_the_foot_of_a_glowing_wall_the_floor_gets_half_its_exitance() {
    let mut scene = Scene::default();
    let (black, glow) = (scene.material(0.0, 0.0), scene.material(0.0, 10.0));
    scene.object("floor", Shape::grid(DVec3::NEG_Y, DVec3::X, DVec3::Y * 2.0, [2, 4]), black);
    scene.blocker("wall", Shape::quad(DVec3::NEG_Y, DVec3::Y * 2.0, DVec3::Z), glow);
    let bake = scene.bake(&arriving(uniform(0.25)));
    let mut feet = 0;
    for (p, light) in corners(&bake.meshes[0]).filter(|(p, _)| p.x == 0.0) {
        if p.y.abs() == 1.0 {
            // At the wall's end the limit depends on the direction that one comes from.
            assert!((2.5..5.0).contains(&light.y), "{} at {p}", light.y);
        } else {
            assert!((light.y - 5.0).abs() < 1e-4, "{} instead of 5 at {p}", light.y);
        }
        feet += 1;
    }
    assert!(feet > 8);
}

/// The same corner inside one welded mesh, where the light's own object must not shadow it.
#[test]
fn in_the_corner_of_a_glowing_box_every_face_gets_the_one_sided_limit() {
    let mut scene = Scene::default();
    let (black, glow) = (scene.material(0.0, 0.0), scene.material(0.0, 10.0));
    let room = scene.object("room", Shape::room(DVec3::ONE), black);
    // The first two triangles are the floor.
    room.triangle_materials[..2].fill(glow);
    let bake = scene.bake(&arriving(uniform(0.25)));
    let mesh = &bake.meshes[0];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for (k, &vertex) in triangle.iter().enumerate() {
            let p = mesh.positions[vertex as usize];
            let light = common::baked::light(mesh.corner_radiance[t][k]).y;
            let on_wall = mesh.source_triangle[t] >= 4;
            let along = (p.x.min(1.0 - p.x) == 0.0, p.y.min(1.0 - p.y) == 0.0);
            if mesh.source_triangle[t] < 2 {
                assert_eq!(light, 0.0, "a flat light does not light itself");
            } else if on_wall && p.z == 0.0 {
                let at_end = along == (true, true);
                let right = if at_end { (2.5..5.0).contains(&light) } else { (light - 5.0).abs() < 1e-4 };
                assert!(right, "{light} at {p}");
            }
        }
    }
}

/// Only the front is baked, but both sides reflect: turning a floor over changes nothing on the ceiling above it.
#[test]
fn a_floor_that_is_wound_backwards_is_dark_in_front_and_reflects_all_the_same() {
    let bake = |flipped: bool| {
        let mut scene = Scene::default();
        let white = scene.material(0.8, 0.0);
        let floor = Shape::square(DVec3::ZERO, 2.0);
        scene.object("floor", if flipped { floor.inside_out() } else { floor }, white);
        scene.object("ceiling", Shape::square(DVec3::Z * 2.0, 2.0).inside_out(), white);
        scene.light(&lamp(DVec3::Z, 0.3), 10.0);
        scene.bake(&arriving(uniform(0.5)))
    };
    let (upright, flipped) = (bake(false), bake(true));
    assert!(corners(&flipped.meshes[0]).all(|(_, light)| light == DVec3::ZERO));
    let ceiling = |bake: &Bake| corners(&bake.meshes[1]).map(|(_, light)| light.y).sum::<f64>();
    let (expected, got) = (ceiling(&upright), ceiling(&flipped));
    assert!(expected > 1.0 && (got / expected - 1.0).abs() < 1e-2, "{got} instead of {expected}");
}
