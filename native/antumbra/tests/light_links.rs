//! Lamps that light some objects only, and lamps whose light only some objects block.

mod common;

use antumbra::error::Error;
use antumbra::scene::{LampInput, LampShape};
use antumbra::settings::{Method, Settings, Transport};
use common::baked::{corners, light_over};
use common::scene::{Scene, adaptive, arriving, by, by_shooting, lamp};
use common::shape::Shape;
use glam::DVec3;

/// Two black floors side by side under a lamp, each under a card of its own, as objects 0 and 1, 2 and 3.
fn two_floors(shape: LampShape) -> Scene {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    for (name, x) in [("left", -1.0), ("right", 1.0)] {
        scene.object(name, Shape::square(DVec3::X * x, 1.0), black);
    }
    for (name, x) in [("left card", -1.0), ("right card", 1.0)] {
        scene.blocker(name, Shape::square(DVec3::new(x, 0.0, 0.3), 0.4), black);
    }
    scene.input.lamps.push(LampInput::new("lamp", shape));
    scene
}

fn lamps() -> Vec<LampShape> {
    let outline = lamp(DVec3::new(0.0, 0.0, 3.0), 0.1).to_vec();
    vec![
        LampShape::Sun { direction: DVec3::Z, angle: 0.0, irradiance_rgb: [1.0; 3] },
        LampShape::Sun { direction: DVec3::Z, angle: 0.05, irradiance_rgb: [1.0; 3] },
        LampShape::Panel { outline, exitance_rgb: [100.0; 3], spread: std::f64::consts::PI },
    ]
}

fn methods() -> Vec<Settings> {
    let rays = Settings { transport: Transport::Rays, ..adaptive() };
    let mut methods: Vec<Settings> = [Method::Uniform, Method::As].into_iter().map(by).collect();
    methods.extend([adaptive(), by_shooting(), rays]);
    methods.into_iter().map(arriving).collect()
}

#[test]
fn a_lamp_lights_what_it_is_linked_to_and_nothing_else() {
    for shape in lamps() {
        let all = two_floors(shape.clone()).bake(&arriving(adaptive()));
        let mut scene = two_floors(shape);
        scene.input.lamps[0].lit_objects = Some(vec![1]);
        for settings in methods() {
            let bake = scene.bake(&settings);
            assert!(corners(&bake.meshes[0]).all(|(_, light)| light == DVec3::ZERO));
            for (x, y) in [(1.9, 0.83), (1.2, 0.71), (0.13, -0.9)] {
                let [found, expected] = [&bake, &all].map(|bake| light_over(&bake.meshes[1], x, y));
                assert!(expected > 0.01);
                assert!((found / expected - 1.0).abs() < 0.05, "{found} instead of {expected} at ({x}, {y})");
            }
        }
    }
}

#[test]
fn a_lamp_is_blocked_by_what_it_is_linked_to_and_by_nothing_else() {
    for shape in lamps() {
        let mut scene = two_floors(shape);
        scene.input.lamps[0].blocking_objects = Some(vec![3]);
        for settings in methods() {
            let bake = scene.bake(&settings);
            let middles =
                [-1.0, 1.0].map(|x| light_over(&bake.meshes[usize::from(x > 0.0)], x + 0.011, 0.017));
            assert!(middles[0] > 0.1, "{middles:?}");
            assert!(middles[1] < 0.01 * middles[0], "{middles:?}");
        }
    }
}

/// The shadow of what blocks has its edges in the mesh, what does not block leaves none.
#[test]
fn only_what_blocks_leaves_lines() {
    let mut scene = two_floors(lamps().swap_remove(0));
    scene.input.lamps[0].blocking_objects = Some(vec![3]);
    let bake = scene.bake(&arriving(adaptive()));
    scene.input.lamps[0].blocking_objects = Some(Vec::new());
    let open = scene.bake(&arriving(adaptive()));
    assert_eq!(bake.meshes[0].positions, open.meshes[0].positions);
    assert_ne!(bake.meshes[1].positions, open.meshes[1].positions);
    for (x, expected) in [(1.3999, 0.0), (1.4001, 1.0)] {
        let found = light_over(&bake.meshes[1], x, 0.0123);
        assert!((found - expected).abs() < 1e-6, "{found} instead of {expected}");
    }
}

#[test]
fn links_to_what_is_not_there_are_refused() {
    for k in 0..2 {
        let mut scene = two_floors(lamps().swap_remove(0));
        let lamp = &mut scene.input.lamps[0];
        *[&mut lamp.lit_objects, &mut lamp.blocking_objects][k] = Some(vec![0, 4]);
        let refused = scene.try_bake(&adaptive()).expect_err("there are four objects");
        assert_eq!(refused, Error::LinkOutOfRange { light: "lamp".into(), object: 4, objects: 4 });
    }
}
