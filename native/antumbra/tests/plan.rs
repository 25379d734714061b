//! What a bake leaves out changes nothing, or no more than it says; and only where the scene does not need it.

mod common;

use antumbra::scene::{LampInput, LampShape};
use antumbra::settings::{Anyway, Method, Settings, Transport};
use antumbra::weld::Bake;
use common::scene::{Scene, adaptive, arriving, lamp};
use common::shape::Shape;
use glam::{DMat3, DVec3};

/// Whether a bake left something out.
fn leaves_out(bake: &Bake, name: &str) -> bool {
    bake.report.result.plan.iter().any(|left_out| left_out.name == name)
}

/// Bit for bit.
fn assert_same(a: &Bake, b: &Bake, what: &str) {
    assert_eq!(a.meshes.len(), b.meshes.len(), "{what}");
    for (a, b) in a.meshes.iter().zip(&b.meshes) {
        assert_eq!(a.triangles, b.triangles, "{what}");
        assert_eq!(a.source_triangle, b.source_triangle, "{what}");
        assert!(a.positions == b.positions, "{what}: positions");
        let bits = |colours: &[[[f32; 3]; 3]]| -> Vec<u32> {
            colours.as_flattened().as_flattened().iter().map(|v| v.to_bits()).collect()
        };
        assert!(bits(&a.corner_radiance) == bits(&b.corner_radiance), "{what}: colours");
    }
}

fn percent_of_time(without: &Bake, with: &Bake) -> f64 {
    100.0 * without.report.timings.solve_s / with.report.timings.solve_s
}

/// A floor with a box over it, of these reflectances, under a lamp.
fn floor_and_box(floor: f64, on_it: f64) -> Scene {
    let mut scene = Scene::default();
    let materials = [floor, on_it].map(|reflectance| scene.material(reflectance, 0.0));
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), materials[0]);
    let turn = DMat3::from_rotation_z(0.4);
    let cube = Shape::cuboid(DVec3::ZERO, DVec3::splat(0.4)).map(|p| turn * p + DVec3::new(0.3, 0.1, 0.4));
    scene.object("box", cube, materials[1]);
    scene.light(&lamp(DVec3::new(-0.5, 0.3, 2.0), 0.3), 20.0);
    scene
}

fn floor_alone(reflectance: f64) -> Scene {
    let mut scene = floor_and_box(reflectance, 0.0);
    scene.input.objects.pop();
    scene
}

fn in_a_room() -> Scene {
    let mut scene = floor_and_box(0.5, 0.3);
    let white = scene.material(0.7, 0.0);
    scene.input.objects.remove(0);
    scene.object(
        "room",
        Shape::room(DVec3::new(4.0, 4.0, 2.5)).map(|p| p - DVec3::new(2.0, 2.0, 0.0)),
        white,
    );
    scene
}

fn empty_room() -> Scene {
    let mut scene = in_a_room();
    scene.input.objects.remove(0);
    scene
}

/// Smooth balls under lamps of all shapes.
fn balls() -> Scene {
    let mut scene = floor_and_box(0.5, 0.3);
    let red = scene.material(0.6, 0.0);
    for x in [-1.2, -0.4] {
        scene.object("ball", Shape::sphere(0.3, 2).map(|p| p + DVec3::new(x, -0.8, 0.4)), red);
    }
    let mut add = |shape| scene.input.lamps.push(LampInput::new("lamp", shape));
    add(LampShape::Sun {
        direction: DVec3::new(0.5, 0.3, 1.0),
        angle: 0.01,
        irradiance_rgb: [1.0, 2.0, 3.0],
    });
    add(LampShape::Point {
        position: DVec3::new(1.0, -1.0, 1.5),
        radius: 0.1,
        faces_receiver: true,
        intensity_rgb: [3.0, 2.0, 1.0],
        cone: None,
    });
    scene
}

fn all_scenes() -> Vec<(&'static str, Scene)> {
    vec![
        ("black floor and box", floor_and_box(0.0, 0.0)),
        ("floor and box", floor_and_box(0.5, 0.3)),
        ("floor alone", floor_alone(0.8)),
        ("box in a room", in_a_room()),
        ("empty room", empty_room()),
        ("balls", balls()),
    ]
}

#[test]
fn without_reflection_nothing_is_exchanged_and_nothing_changes() {
    let settings = Settings { verify_points: 0, tolerance: 0.05, ..adaptive() };
    for transport in [Transport::Hierarchical, Transport::Shooting, Transport::Rays] {
        for (name, scene) in all_scenes() {
            let needed = !["black floor and box", "floor alone"].contains(&name);
            if transport == Transport::Rays && needed {
                // It takes a minute, and is told by the same look.
                continue;
            }
            for settings in [settings.clone(), arriving(settings.clone())] {
                let settings = Settings { transport, ..settings };
                let anyway = Anyway { reflection: true, ..Anyway::default() };
                let without = scene.bake(&settings);
                let with = scene.bake(&Settings { anyway, ..settings });
                assert_eq!(leaves_out(&without, "reflection"), !needed, "{transport:?}, {name}");
                assert!(!leaves_out(&with, "reflection"));
                assert_same(&without, &with, &format!("{transport:?}, {name}"));
                if !needed {
                    println!("{transport:?}, {name}: {:.0} % of the time", percent_of_time(&without, &with));
                }
            }
        }
    }
}

/// A plate a hair above the floor sees it.
#[test]
fn surfaces_that_nearly_lie_in_one_plane_exchange_light() {
    let mut scene = floor_alone(0.5);
    let grey = scene.material(0.5, 0.0);
    scene.object("plate", Shape::square(DVec3::new(0.5, 0.5, 0.001), 0.5), grey);
    assert!(!leaves_out(&scene.bake(&adaptive()), "reflection"));
}

/// With everything for a candidate, the kernel finds that most of it hides nothing.
#[test]
fn what_stands_elsewhere_hides_nothing() {
    for method in [Method::Adm, Method::As] {
        let settings = Settings { verify_points: 0, tolerance: 0.05, method, ..adaptive() };
        for (name, scene) in all_scenes() {
            let anyway = Anyway { open_visibility: true, ..Anyway::default() };
            let without = scene.bake(&settings);
            let with = scene.bake(&Settings { anyway, ..settings.clone() });
            assert!(leaves_out(&without, "open_visibility"), "{name}");
            assert!(!leaves_out(&with, "open_visibility"), "{name}: {:?}", with.report.result.plan);
            let counts = [&without, &with].map(|bake| bake.report.result.visibility.sampled);
            println!(
                "{method:?}, {name}: {:.0} % of the time; {}; {counts:?} by rays",
                percent_of_time(&without, &with),
                without.report.result.plan.iter().map(|l| l.saved.as_str()).collect::<Vec<_>>().join(", ")
            );
            if counts == [0, 0] {
                assert_same(&without, &with, name);
            }
        }
    }
}

/// Walls, floors and what else has everything on one side.
#[test]
fn outer_faces_hide_nothing() {
    for method in [Method::Adm, Method::As] {
        for (name, scene) in all_scenes() {
            // The sun shines from the other side of something.
            let has_outer_faces = name != "balls";
            let settings = Settings { verify_points: 0, tolerance: 0.05, method, ..adaptive() };
            let anyway = Anyway { outer_faces: true, ..Anyway::default() };
            let without = scene.bake(&settings);
            let with = scene.bake(&Settings { anyway, ..settings });
            assert_eq!(leaves_out(&without, "outer_faces"), has_outer_faces, "{name}");
            assert!(!leaves_out(&with, "outer_faces"), "{name}");
            println!("{method:?}, {name}: {:.0} % of the time", percent_of_time(&without, &with));
            assert_same(&without, &with, name);
        }
    }
}
