//! Conservation: what the lights of a closed room emit, its surfaces absorb.

mod common;

use antumbra::settings::Settings;
use antumbra::weld::Bake;
use common::baked::{area, assert_sound, light};
use common::scene::{Scene, adaptive, arriving, lamp, uniform};
use common::shape::Shape;
use glam::{DMat4, DQuat, DVec3};

/// A room of 3 m × 4 m × 2.5 m with a turned box and a standing board, none of them alike.
fn room() -> Scene {
    let mut scene = Scene::default();
    let [pale, red, dark] = [0.7, 0.5, 0.1].map(|rho| scene.material(rho, 0.0));
    scene.input.materials[red as usize].reflectance_rgb = [0.8, 0.2, 0.05];
    let walls = scene.object("walls", Shape::room(DVec3::new(3.0, 4.0, 2.5)), pale);
    walls.triangle_materials[4..6].fill(red);
    let turned = DMat4::from_rotation_translation(DQuat::from_rotation_z(0.5), DVec3::new(1.8, 2.5, 0.4));
    scene.object("box", Shape::cuboid(DVec3::ZERO, DVec3::new(0.5, 0.3, 0.3)), dark).world_from_object =
        turned;
    scene.object("pillar", Shape::cuboid(DVec3::new(0.8, 1.0, 0.7), DVec3::new(0.2, 0.1, 0.5)), red);
    scene
}

/// The sum over all baked triangles of what they do not reflect, W.
fn absorbed(scene: &Scene, bake: &Bake) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for mesh in &bake.meshes {
        let source = &scene.input.objects[mesh.object];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let material = source.triangle_materials[mesh.source_triangle[t] as usize];
            let reflectance = DVec3::from_array(scene.input.materials[material as usize].reflectance_rgb);
            let mean = mesh.corner_radiance[t].map(light).into_iter().sum::<DVec3>() / 3.0;
            let area = area(triangle.map(|v| mesh.positions[v as usize]));
            sum += (DVec3::ONE - reflectance) * mean * area;
        }
    }
    sum
}

fn assert_balanced(scene: &Scene, bake: &Bake, emitted: f64, tolerance: f64) {
    assert_sound(&scene.input, bake);
    assert_eq!(bake.report.result.ended_by, "converged");
    let share = absorbed(scene, bake) / emitted;
    println!("absorbed / emitted = {share}");
    assert!((share - DVec3::ONE).abs().max_element() < tolerance, "{share} of the light was absorbed");
}

#[test]
fn a_room_absorbs_what_its_lamp_emits() {
    let mut scene = room();
    scene.light(&lamp(DVec3::new(1.2, 2.0, 2.3), 0.4), 10.0);
    assert_balanced(&scene, &scene.bake(&arriving(adaptive())), 6.4, 0.02);
}

#[test]
fn so_it_does_on_a_uniform_mesh() {
    let mut scene = room();
    scene.light(&lamp(DVec3::new(1.2, 2.0, 2.3), 0.4), 10.0);
    assert_balanced(&scene, &scene.bake(&arriving(uniform(0.2))), 6.4, 0.03);
}

/// The insides of the slab light only each other.
#[test]
fn a_room_absorbs_what_a_glowing_slab_in_it_emits() {
    let mut scene = room();
    let glow = scene.material(0.3, 5.0);
    let slab = Shape::cuboid(DVec3::new(1.0, 2.6, 1.7), DVec3::new(0.3, 0.3, 0.02));
    scene.object("slab", slab, glow);
    let emitted = 5.0 * (2.0 * 0.36 + 4.0 * 0.6 * 0.04);
    assert_balanced(&scene, &scene.bake(&arriving(adaptive())), emitted, 0.02);
}

/// Whatever the scene, direct and indirect light make up all light at every corner.
#[test]
fn layers_add_up_to_the_whole() {
    let mut scene = room();
    scene.light(&lamp(DVec3::new(1.5, 2.0, 2.49), 0.4), 20.0);
    let bake = scene.bake(&Settings { separate_layers: true, tolerance: 0.05, ..adaptive() });
    let mut reflected = 0.0_f64;
    for mesh in &bake.meshes {
        let layers = mesh.corner_layers.as_ref().expect("layers were asked for");
        let parts = layers.direct.as_flattened().iter().zip(layers.indirect.as_flattened());
        for (whole, (direct, indirect)) in mesh.corner_radiance.as_flattened().iter().zip(parts) {
            let [whole, direct, indirect] = [*whole, *direct, *indirect].map(light);
            assert!((whole - direct - indirect).abs().max_element() <= 1e-6 * whole.max_element().max(1.0));
            reflected = reflected.max(indirect.max_element());
        }
    }
    assert!(reflected > 0.1, "the walls reflect");
}
