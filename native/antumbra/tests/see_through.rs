//! What does not block, and what does not send: light behind it and around it is as if it were not there.

mod common;

use antumbra::settings::Settings;
use antumbra::weld::Bake;
use common::baked::{corners, light};
use common::scene::{Scene, adaptive, arriving, by_shooting, lamp};
use common::shape::Shape;
use glam::{DMat4, DVec3};

/// Walls that emit 1 W/m² and reflect half of what arrives, with a sheet of three quarters in the middle.
fn furnace_with_sheet() -> Scene {
    let mut scene = Scene::default();
    let wall = scene.material(0.5, 1.0);
    let sheet = scene.material(0.75, 0.0);
    scene.object("walls", Shape::room(DVec3::ONE), wall);
    scene.object("sheet", Shape::square(DVec3::ZERO, 0.3), sheet).world_from_object =
        DMat4::from_translation(DVec3::new(0.5, 0.5, 0.5));
    scene
}

fn assert_even(bake: &Bake, object: usize, expected: f64) {
    let mesh = bake.meshes.iter().find(|mesh| mesh.object == object).expect("it is baked");
    for colour in mesh.corner_radiance.as_flattened() {
        let worst = (light(*colour) - DVec3::splat(expected)).abs().max_element();
        assert!(worst <= 1e-6 * expected, "object {object}: {colour:?} instead of {expected}/pi");
    }
}

/// The sheet shows three quarters of what arrives on it, and takes nothing from the walls, nor gives it to them.
fn assert_only_looked_at(scene: &Scene, settings: &Settings) {
    let bake = scene.bake(settings);
    assert_eq!(bake.report.result.ended_by, "converged");
    assert_even(&bake, 0, 2.0);
    assert_even(&bake, 1, 1.5);
}

#[test]
fn a_furnace_does_not_notice_a_sheet_that_does_not_block() {
    for settings in [adaptive(), by_shooting()] {
        let mut scene = furnace_with_sheet();
        scene.input.materials[1].transmittance_rgb = [1.0; 3];
        assert_only_looked_at(&scene, &settings);
    }
}

#[test]
fn nor_an_object_that_only_receives() {
    for settings in [adaptive(), by_shooting()] {
        let mut scene = furnace_with_sheet();
        scene.input.objects[1].blocks = false;
        scene.input.objects[1].sends = false;
        // Its light is shown, but nobody gets it.
        scene.input.materials[1].exitance_rgb = [0.25; 3];
        let bake = scene.bake(&settings);
        assert_even(&bake, 0, 2.0);
        assert_even(&bake, 1, 1.75);
    }
}

/// Light at the four corners of a black floor under a lamp, with something half-way.
fn under_a_lamp(between: impl FnOnce(&mut Scene, u32)) -> f64 {
    let mut scene = Scene::default();
    let [white, black] = [1.0, 0.0].map(|rho| scene.material(rho, 0.0));
    scene.object("floor", Shape::square(DVec3::ZERO, 1.0), black);
    scene.light(&lamp(DVec3::new(0.0, 0.0, 2.0), 0.25), 10.0);
    between(&mut scene, white);
    let bake = scene.bake(&arriving(adaptive()));
    let (mut sum, mut count) = (0.0, 0);
    for (position, light) in corners(&bake.meshes[0]) {
        if position.truncate().abs().min_element() > 0.99 {
            sum += light.x;
            count += 1;
        }
    }
    sum / f64::from(count)
}

#[test]
fn behind_what_does_not_block_all_light_arrives() {
    let sheet = |blocks: bool| {
        under_a_lamp(|scene, white| {
            let sheet = scene.blocker("sheet", Shape::square(DVec3::ZERO, 5.0), white);
            sheet.world_from_object = DMat4::from_translation(DVec3::new(0.0, 0.0, 1.0));
            sheet.blocks = blocks;
        })
    };
    let open = under_a_lamp(|_, _| ());
    assert!(open > 0.01, "{open}");
    assert_eq!(sheet(true), 0.0);
    assert!((sheet(false) / open - 1.0).abs() < 1e-6, "{} instead of {open}", sheet(false));
}

#[test]
fn what_does_not_send_blocks_but_neither_reflects_nor_glows() {
    let wall = |sends: bool| {
        under_a_lamp(|scene, _| {
            let glowing = scene.material(1.0, 1.0);
            // Beside the floor, upright, in nobody's way.
            let wall = scene.blocker("wall", Shape::square(DVec3::ZERO, 1.0), glowing);
            wall.world_from_object = DMat4::from_translation(DVec3::new(3.0, 0.0, 1.0))
                * DMat4::from_rotation_y(std::f64::consts::FRAC_PI_2);
            wall.sends = sends;
        })
    };
    let open = under_a_lamp(|_, _| ());
    assert!((wall(false) / open - 1.0).abs() < 1e-6, "{} instead of {open}", wall(false));
    assert!(wall(true) > 1.05 * open);
}

/// Errors count by what is shown, not by what is sent: a floor that sends nothing is refined for a shadow as any other.
#[test]
fn what_only_receives_is_refined_for_its_light() {
    for settings in [adaptive(), by_shooting()] {
        let triangles = |part: bool| {
            let mut scene = Scene::default();
            let [grey, black] = [0.8, 0.0].map(|rho| scene.material(rho, 0.0));
            let floor = scene.object("floor", Shape::square(DVec3::ZERO, 2.0), grey);
            floor.blocks = part;
            floor.sends = part;
            scene.blocker("card", Shape::square(DVec3::Z, 0.5), black);
            scene.light(&lamp(DVec3::new(0.0, 0.0, 3.0), 0.5), 10.0);
            scene.bake(&settings).report.result.triangles
        };
        let (usual, only_receiving) = (triangles(true), triangles(false));
        assert!(usual > 200, "{usual}");
        assert!(only_receiving > usual * 9 / 10, "{only_receiving} triangles instead of {usual}");
    }
}
