//! A closed furnace: walls that emit `E` and reflect `rho` have the radiosity `E/(1 - rho)` everywhere, whatever the
//! mesh, the room's shape, its size or its place.

mod common;

use antumbra::settings::Settings;
use common::baked::{all_light, assert_sound, light};
use common::scene::{Scene, adaptive, arriving, by_shooting, uniform};
use common::shape::Shape;
use glam::{DMat4, DQuat, DVec3};

/// Relative to the answer: rounding of the colours to f32 and of single-precision form factors.
const TOLERANCE: f64 = 1e-6;

fn furnace(shape: Shape, reflectance: f64, exitance: f64) -> Scene {
    let mut scene = Scene::default();
    let wall = scene.material(reflectance, exitance);
    scene.object("furnace", shape, wall);
    scene
}

fn assert_even(scene: &Scene, settings: &Settings, expected: f64) {
    assert_even_within(TOLERANCE, scene, settings, expected);
}

fn assert_even_within(tolerance: f64, scene: &Scene, settings: &Settings, expected: f64) {
    let bake = scene.bake(settings);
    assert_sound(&scene.input, &bake);
    assert_eq!(bake.report.result.ended_by, "converged");
    for light in all_light(&bake) {
        let worst = (light - DVec3::splat(expected)).abs().max_element();
        assert!(worst <= tolerance * expected, "{light} instead of {expected}");
    }
}

fn cube() -> Shape {
    Shape::room(DVec3::ONE)
}

#[test]
fn a_cube_that_reflects_half_is_twice_as_bright_as_it_emits() {
    assert_even(&furnace(cube(), 0.5, 1.0), &adaptive(), 2.0);
}

#[test]
fn so_it_is_on_a_uniform_mesh() {
    assert_even(&furnace(cube(), 0.5, 1.0), &uniform(0.2), 2.0);
}

#[test]
fn a_cube_that_reflects_nine_tenths_is_ten_times_as_bright_as_it_emits() {
    assert_even(&furnace(cube(), 0.9, 0.1), &adaptive(), 1.0);
}

#[test]
fn its_irradiance_is_its_radiosity() {
    assert_even(&furnace(cube(), 0.5, 1.0), &arriving(adaptive()), 2.0);
}

#[test]
fn its_layers_are_what_walls_emit_and_reflect_once_and_what_was_reflected_before() {
    let scene = furnace(cube(), 0.5, 1.0);
    for (quantity, direct, indirect) in [(adaptive(), 1.5, 0.5), (arriving(adaptive()), 1.0, 1.0)] {
        let bake = scene.bake(&Settings { separate_layers: true, ..quantity });
        assert_sound(&scene.input, &bake);
        for mesh in &bake.meshes {
            let layers = mesh.corner_layers.as_ref().expect("layers were asked for");
            for (layer, expected) in [(&layers.direct, direct), (&layers.indirect, indirect)] {
                assert_eq!(layer.len(), mesh.triangles.len());
                for colour in layer.as_flattened() {
                    let worst = (light(*colour) - DVec3::splat(expected)).abs().max_element();
                    assert!(worst <= TOLERANCE * expected, "{colour:?} instead of {expected}/pi");
                }
            }
        }
    }
    assert!(scene.bake(&adaptive()).meshes[0].corner_layers.is_none());
}

#[test]
fn channels_do_not_mix() {
    let mut scene = furnace(cube(), 0.5, 1.0);
    scene.input.materials[0].reflectance_rgb = [0.0, 0.5, 0.75];
    scene.input.materials[0].exitance_rgb = [1.0, 0.0, 2.0];
    for light in all_light(&scene.bake(&adaptive())) {
        assert!((light - DVec3::new(1.0, 0.0, 8.0)).abs().max_element() <= 8.0 * TOLERANCE, "{light}");
        assert_eq!(light.y, 0.0);
    }
}

#[test]
fn size_changes_nothing() {
    for scale in [1e-6, 1e-3, 1e3, 1e6] {
        let scene = furnace(cube(), 0.5, 1.0).placed(DMat4::from_scale(DVec3::splat(scale)));
        assert_even(&scene, &adaptive(), 2.0);
    }
}

#[test]
fn place_and_orientation_change_nothing() {
    let turned = DMat4::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7));
    // A thousand kilometres off, coordinates are rounded so that rays find cracks between the walls.
    let offsets =
        [(DVec3::ZERO, TOLERANCE), (DVec3::new(1e4, -2e4, 5e3), TOLERANCE), (DVec3::splat(1e6), 2e-5)];
    for (offset, tolerance) in offsets {
        let scene = furnace(cube(), 0.5, 1.0).placed(DMat4::from_translation(offset) * turned);
        assert_even_within(tolerance, &scene, &adaptive(), 2.0);
        assert_even(&scene, &by_shooting(), 2.0);
    }
}

#[test]
fn a_turned_cube_a_kilometre_wide_and_one_a_millimetre_wide() {
    let turned = DMat4::from_quat(DQuat::from_axis_angle(DVec3::new(3.0, -1.0, 2.0).normalize(), 1.1));
    for scale in [1e-3, 1e3] {
        let scene = furnace(cube(), 0.5, 1.0).placed(turned * DMat4::from_scale(DVec3::splat(scale)));
        assert_even(&scene, &uniform(0.25 * scale), 2.0);
    }
}

#[test]
fn a_long_room_is_as_even_as_a_cube() {
    assert_even(&furnace(Shape::room(DVec3::new(2.0, 1.0, 0.7)), 0.5, 1.0), &adaptive(), 2.0);
}

/// What stands in a furnace and is like its walls cannot be seen.
#[test]
fn a_box_in_a_furnace_is_as_bright_as_the_walls() {
    let mut scene = furnace(cube(), 0.5, 1.0);
    let place = DMat4::from_rotation_translation(DQuat::from_rotation_z(0.3), DVec3::new(0.4, 0.5, 0.6));
    scene.object("box", Shape::cuboid(DVec3::ZERO, DVec3::splat(0.15)), 0).world_from_object = place;
    assert_even(&scene, &adaptive(), 2.0);
}

/// A wall that shines on its back too must not light the furnace twice.
#[test]
fn a_furnace_inside_a_dark_room_stays_as_it_is() {
    let mut scene = furnace(cube(), 0.5, 1.0);
    let dark = scene.material(0.0, 0.0);
    scene.blocker("outer room", Shape::room(DVec3::splat(5.0)).map(|p| p - DVec3::splat(2.0)), dark);
    // Light of a furnace that emits to the outside as well is not scaled to what it emits.
    assert_even_within(2e-5, &scene, &adaptive(), 2.0);
    assert_even(&scene, &by_shooting(), 2.0);
}
