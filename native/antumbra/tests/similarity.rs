//! The same scene a million times as large, as small, or far away: the same light.

mod common;

use antumbra::scene::{LampInput, LampShape, SceneInput};
use antumbra::settings::Settings;
use antumbra::weld::Bake;
use common::Random;
use common::baked::{assert_sound, light_at};
use common::point_in;
use common::scene::{Scene, adaptive, lamp};
use common::shape::Shape;
use glam::{DMat4, DQuat, DVec3};

/// A room with a turned box, a lamp below its ceiling and a bulb: everything a scene has a length in.
fn room() -> Scene {
    let mut scene = Scene::default();
    let (wall, wood) = (scene.material(0.6, 0.0), scene.material(0.3, 0.0));
    scene.object("room", Shape::room(DVec3::new(3.0, 4.0, 2.5)), wall);
    let place = DMat4::from_rotation_translation(DQuat::from_rotation_z(0.5), DVec3::new(1.8, 2.5, 0.5));
    scene.object("box", Shape::cuboid(DVec3::ZERO, DVec3::new(0.5, 0.3, 0.3)), wood).world_from_object =
        place;
    scene.light(&lamp(DVec3::new(1.2, 2.0, 2.3), 0.3), 10.0);
    scene
}

/// The same scene in another size; a bulb's intensity is a power, and grows with the square of lengths.
fn scaled(scale: f64) -> Scene {
    let mut scene = room().placed(DMat4::from_scale(DVec3::splat(scale)));
    scene.input.lamps.push(LampInput::new(
        "bulb",
        LampShape::Point {
            position: scale * DVec3::new(2.5, 1.0, 1.5),
            radius: scale * 0.05,
            faces_receiver: false,
            intensity_rgb: [scale * scale; 3],
            cone: None,
        },
    ));
    scene
}

fn bake(scene: &Scene) -> Bake {
    let bake = scene.bake(&Settings { verify_points: 0, ..adaptive() });
    assert_sound(&scene.input, &bake);
    bake
}

/// The rms difference of light at random points of what was baked, relative to the mean there. Objects know nothing of
/// where they are, so that the points are the same.
fn difference(input: &SceneInput, a: &Bake, b: &Bake) -> f64 {
    let mut random = Random(5);
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for (one, other) in a.meshes.iter().zip(&b.meshes) {
        let object = &input.objects[one.object];
        for triangle in &object.triangles {
            let corners = triangle.map(|v| object.positions[v as usize]);
            for _ in 0..20 {
                let at = point_in(&corners, &mut random);
                let [x, y] = [one, other].map(|mesh| light_at(mesh, at).expect("it is baked there").y);
                (squares, sum, count) = (squares + (x - y).powi(2), sum + x, count + 1.0);
            }
        }
    }
    f64::sqrt(squares / count) / (sum / count)
}

fn bits(bake: &Bake) -> Vec<u32> {
    bake.meshes
        .iter()
        .flat_map(|mesh| mesh.corner_radiance.as_flattened().as_flattened())
        .map(|c| c.to_bits())
        .collect()
}

/// No length is known to the solver but those of the scene: by a power of two, not one bit changes.
#[test]
fn a_scene_a_million_times_as_large_or_as_small_is_the_same_to_the_last_bit() {
    let plain = bake(&scaled(1.0));
    for power in [20, -20] {
        let there = bake(&scaled(2.0_f64.powi(power)));
        for (here, there) in plain.meshes.iter().zip(&there.meshes) {
            assert_eq!(here.triangles, there.triangles);
            assert!(here.positions == there.positions);
        }
        assert!(bits(&plain) == bits(&there), "scaled by 2^{power}");
    }
}

/// By powers of ten coordinates are rounded anew, and where two choices are equally good the other may be taken.
#[test]
fn a_scene_scaled_by_1e6_or_1e_minus_6_has_the_same_light() {
    let plain = bake(&scaled(1.0));
    for scale in [1e6, 1e-6] {
        let off = difference(&room().input, &plain, &bake(&scaled(scale)));
        println!("scaled by {scale:e}: {off:.1e}");
        assert!(off <= 1e-3, "scaled by {scale:e}: {off:e}");
    }
}

#[test]
fn a_scene_moved_1e6_away_has_the_same_light() {
    let plain = bake(&room());
    assert!(plain.report.warnings.is_empty(), "{:?}", plain.report.warnings);
    for offset in [1e4, 1e6] {
        let away = DMat4::from_translation(offset * DVec3::new(1.0, -2.0, 0.5));
        let there = bake(&room().placed(away));
        let off = difference(&room().input, &plain, &there);
        println!("moved by {offset:e}: {off:.1e}");
        assert!(off <= 1e-6, "moved by {offset:e}: {off:e}");
        // Who made its mesh in single precision may have lost more than that before.
        let [warning] = &there.report.warnings[..] else { panic!("{:?}", there.report.warnings) };
        let apart = format!("{:.1e} m apart", 2.0 * offset * f64::from(f32::EPSILON) / 2.0);
        assert!(warning.contains("single-precision") && warning.contains(&apart), "{warning}: not {apart}");
    }
}
