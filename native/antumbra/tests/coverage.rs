//! How often the interval that a bake is verified to holds an error that is known.

mod common;

use antumbra::settings::{Method, Settings};
use antumbra::visibility::{ConvexPolygon, Receiver};
use common::baked::light_over;
use common::scene::{Scene, adaptive, arriving, lamp};
use common::shape::Shape;
use common::verified::{print, verified};
use common::{Random, polygon, visible};
use glam::{DMat3, DVec3};

/// A scene, and what its light is known from.
struct Chance {
    scene: Scene,
    /// Outlines and exitances.
    lights: Vec<([DVec3; 4], f64)>,
    blockers: Vec<ConvexPolygon>,
    settings: Settings,
}

/// A floor under a lamp or two, with boxes and plates over it, and how finely it is baked: all by chance.
fn by_chance(random: &mut Random) -> Chance {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 1.0), black);
    let mut lights = Vec::new();
    for _ in 0..=random.below(2) {
        let at = DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(1.0, 3.0));
        lights.push((lamp(at, random.between(0.05, 0.5)), random.between(5.0, 20.0)));
    }
    for (outline, exitance) in &lights {
        scene.light(outline, *exitance);
    }
    let mut blockers = Vec::new();
    for _ in 0..random.below(4) {
        let at = DVec3::new(random.between(-0.8, 0.8), random.between(-0.8, 0.8), random.between(0.3, 0.7));
        let size =
            DVec3::new(random.between(0.05, 0.3), random.between(0.05, 0.3), random.between(0.02, 0.25));
        let turn = DMat3::from_rotation_z(random.between(0.0, 1.5));
        let shape = Shape::cuboid(DVec3::ZERO, size).map(|p| turn * p + at);
        let corners = |t: &[u32; 3]| t.map(|v| shape.positions[v as usize]);
        blockers.extend(shape.triangles.iter().map(|t| polygon(&corners(t))));
        scene.blocker("box", shape, black);
    }
    let method = [Method::Adm, Method::Adm, Method::As, Method::Uniform][random.below(4)];
    let tolerance = [0.1, 0.05, 0.02, 0.01][random.below(4)];
    let element_size = if method == Method::Uniform { random.between(0.05, 0.4) } else { 0.0 };
    let settings = arriving(Settings { method, tolerance, element_size, ..adaptive() });
    Chance { scene, lights, blockers, settings }
}

/// The interval is for 95 of 100 bakes, so of 200 about 190 hold the error that is known from the kernel, and more since its
/// upper end is never told from below 0.
#[test]
#[ignore = "hundreds of bakes, and a million form factors for each"]
fn nineteen_of_twenty_intervals_hold_the_error() {
    let mut random = Random(2024);
    let (mut held, mut above, mut below) = (0, 0, 0);
    let mut held_bias = 0;
    for bake_number in 0..200 {
        let Chance { scene, lights, blockers, settings } = by_chance(&mut random);
        let bake = scene.bake(&settings);
        let mut squares = 0.0;
        let (mut sum, mut shown_sum) = (0.0, 0.0);
        let side = 200;
        for k in 0..side * side {
            let place = |k: i32, by: f64| (f64::from(k) + by) / f64::from(side) * 2.0 - 1.0;
            let [x, y] = [place(k % side, random.unit()), place(k / side, random.unit())];
            let receiver = Receiver::new(DVec3::new(x, y, 0.0), DVec3::Z);
            let exact: f64 = (lights.iter())
                .map(|(outline, exitance)| exitance * visible(&receiver, &polygon(outline), &blockers).value)
                .sum();
            let shown = light_over(&bake.meshes[0], x, y);
            squares += (shown - exact).powi(2);
            sum += exact;
            shown_sum += shown;
        }
        let count = f64::from(side * side);
        let error = (squares / count).sqrt() / (sum / count);
        let v = verified(&bake);
        let [_, low, high] = v.error;
        let bias = shown_sum / sum - 1.0;
        held_bias += i32::from(v.bias[1] <= bias && bias <= v.bias[2]);
        held += i32::from(low <= error && error <= high);
        above += i32::from(error > high);
        below += i32::from(error < low);
        print(&format!("{bake_number}: known to be {:.2} %", 100.0 * error), &bake);
    }
    println!(
        "{held} of 200 held the error, {below} lay above it, {above} below it; {held_bias} held the bias"
    );
    assert!(held >= 190, "{held} of 200");
}
