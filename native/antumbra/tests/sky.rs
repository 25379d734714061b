//! Light from the world's background against closed forms. Nothing reflects unless a test says so.

mod common;

use std::f64::consts::PI;

use antumbra::error::Error;
use antumbra::scene::SkyInput;
use common::baked::{assert_sound, corners};
use common::scene::{Scene, adaptive, arriving, uniform};
use common::shape::Shape;
use glam::DVec3;

fn even(scene: &mut Scene, exitance: f64) {
    scene.input.sky = Some(SkyInput::even("sky", [exitance, 2.0 * exitance, 0.0]));
}

#[test]
fn an_open_plane_gets_pi_times_the_radiance_whatever_way_it_faces() {
    for normal in [DVec3::Z, DVec3::new(0.3, -0.4, -0.6), DVec3::new(-1.0, 0.01, 0.0)] {
        let mut scene = Scene::default();
        let (u, v) = normal.normalize().any_orthonormal_pair();
        scene.object("plane", Shape::grid(u - v, 2.0 * u, 2.0 * v, [3, 3]), 0);
        scene.material(0.0, 0.0);
        even(&mut scene, 1.5);
        let bake = scene.bake(&arriving(adaptive()));
        assert_sound(&scene.input, &bake);
        for (p, light) in corners(&bake.meshes[0]) {
            assert!((light - DVec3::new(1.5, 3.0, 0.0)).abs().max_element() < 3e-7, "{light} at {p}");
        }
        assert_eq!(bake.report.result.visibility.sampled, 0);
    }
}

/// Beside a wall of height h, half of the sky goes and (1 - sin)/2 of it comes back over the wall's top: as for an endless
/// strip, what is seen past an edge at elevation e is (1 + cos e)/2.
#[test]
fn a_long_wall_takes_its_share_of_the_sky() {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("ground", Shape::quad(DVec3::new(0.2, -0.5, 0.0), DVec3::X * 3.0, DVec3::Y), black);
    scene.blocker("wall", Shape::quad(DVec3::new(0.0, -4e3, 0.0), DVec3::Y * 8e3, DVec3::Z * 0.7), black);
    even(&mut scene, 1.0);
    let bake = scene.bake(&arriving(uniform(0.1)));
    for (p, light) in corners(&bake.meshes[0]) {
        let expected = 0.5 * (1.0 + p.x / p.x.hypot(0.7));
        assert!((light.x - expected).abs() < 2e-6, "{} instead of {expected} at {p}", light.x);
    }
}

#[test]
fn a_box_open_above_is_lit_through_its_opening_only() {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    let (half, height) = (0.5, 1.0);
    scene.object("floor", Shape::square(DVec3::ZERO, half), black);
    for (u, v) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
        let middle = half * DVec3::new(u, v, 0.0);
        let along = half * DVec3::new(-v, u, 0.0);
        scene.blocker("wall", Shape::quad(middle - along, 2.0 * along, DVec3::Z * height), black);
    }
    even(&mut scene, 1.0);
    let bake = scene.bake(&arriving(uniform(0.2)));
    let corner = |a: f64, b: f64| {
        let (a, b) = (a / height, b / height);
        let (along, across) = (a.hypot(1.0), b.hypot(1.0));
        (a / along * (b / along).atan() + b / across * (a / across).atan()) / (2.0 * PI)
    };
    for (p, light) in corners(&bake.meshes[0]) {
        let expected =
            corner(p.x + half, p.y + half) - corner(p.x - half, p.y + half) - corner(p.x + half, p.y - half)
                + corner(p.x - half, p.y - half);
        assert!((light.x - expected).abs() < 2e-6, "{} instead of {expected} at {p}", light.x);
    }
    assert_eq!(bake.report.result.visibility.sampled, 0);
}

#[test]
fn inside_a_closed_box_it_is_exactly_dark() {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("room", Shape::room(DVec3::new(3.0, 4.0, 2.0)), black);
    scene.object("plate", Shape::square(DVec3::new(1.0, 1.0, 0.5), 0.2), black);
    even(&mut scene, 1.0);
    let bake = scene.bake(&arriving(uniform(0.5)));
    for mesh in &bake.meshes {
        for (p, light) in corners(mesh) {
            assert_eq!(light, DVec3::ZERO, "at {p}");
        }
    }
}

/// A surface that reflects all that it gets, under an even sky, looks like the sky: nothing can be told apart.
#[test]
fn white_things_under_an_even_sky_vanish() {
    let mut scene = Scene::default();
    let white = scene.material(1.0, 0.0);
    scene.object("ground", Shape::square(DVec3::ZERO, 40.0), white);
    scene.object("box", Shape::cuboid(DVec3::Z * 0.501, DVec3::splat(0.5)), white);
    scene.input.sky = Some(SkyInput::even("sky", [PI; 3]));
    let bake = scene.bake(&adaptive());
    for mesh in &bake.meshes {
        let mut area = 0.0;
        let mut squared = 0.0;
        for (p, light) in
            corners(mesh).filter(|(p, _)| p.truncate().abs().max_element() < 8.0 && p.z > 0.0001)
        {
            area += 1.0;
            squared += (light.y / PI - 1.0).powi(2);
            assert!((light.y / PI - 1.0).abs() < 0.05, "{} at {p}", light.y);
        }
        assert!(area == 0.0 || f64::sqrt(squared / area) < 0.02);
    }
}

/// A sky that is bright in one cell only is like a small sun there.
#[test]
fn a_bright_cell_is_a_sun() {
    let cells_per_side = 64;
    let mut exitance_rgb = vec![[0.0; 3]; 6 * 64 * 64];
    // Face 4 is towards +z; its columns run along x, its rows along y.
    let (column, row) = (40_usize, 20_usize);
    exitance_rgb[(4 * 64 + row) * 64 + column] = [1000.0; 3];
    let at = |k: usize| (k as f64 + 0.5) / 32.0 - 1.0;
    let towards = DVec3::new(at(column), at(row), 1.0);
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 1.0), black);
    scene.blocker("card", Shape::square(DVec3::Z * 0.5, 0.3), black);
    scene.input.sky = Some(SkyInput { name: "sky".into(), cells_per_side, exitance_rgb });
    let bake = scene.bake(&arriving(uniform(0.05)));
    let distance = towards.length();
    // Exitance times the cell's solid angle over pi, times the cosine
    let lit = 1000.0 * (2.0_f64 / 64.0).powi(2) / distance.powi(3) / PI / distance;
    let (mut dark, mut bright) = (0, 0);
    for (p, light) in corners(&bake.meshes[0]) {
        let past = p + 0.5 * towards;
        let outside = past.x.abs().max(past.y.abs()) - 0.3;
        if outside.abs() > 0.02 {
            let expected = if outside > 0.0 { lit } else { 0.0 };
            assert!((light.x - expected).abs() < 1e-3 * lit, "{} instead of {expected} at {p}", light.x);
            if outside > 0.0 { bright += 1 } else { dark += 1 }
        }
    }
    assert!(dark > 100 && bright > 100);
}

#[test]
fn a_sky_that_is_none_is_refused_by_name() {
    let refused = |change: fn(&mut SkyInput)| {
        let mut scene = Scene::default();
        scene.material(0.0, 0.0);
        scene.object("floor", Shape::square(DVec3::ZERO, 1.0), 0);
        even(&mut scene, 1.0);
        change(scene.input.sky.as_mut().expect("it has one"));
        scene.try_bake(&adaptive()).expect_err("it is not valid")
    };
    assert_eq!(
        refused(|sky| sky.exitance_rgb[3][1] = f64::NAN),
        Error::LightNotFinite { light: "sky".into() }
    );
    assert!(matches!(refused(|sky| sky.cells_per_side = 2), Error::SkyCells { .. }));
    assert!(matches!(refused(|sky| sky.cells_per_side = 0), Error::SkyCells { .. }));
    assert_eq!(refused(|sky| sky.exitance_rgb = vec![[0.0; 3]; 6]), Error::NoLight);
}
