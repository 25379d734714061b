//! Surfaces that let a share of the light through, per channel: what is behind them gets that share, of every light.

mod common;

use std::f64::consts::FRAC_PI_4;

use antumbra::error::Error;
use antumbra::scene::{ConeInput, LampInput, LampShape, SkyInput};
use antumbra::settings::{Settings, Transport};
use antumbra::weld::Bake;
use common::baked::{all_light, area, corners, light, light_over};
use common::scene::{Scene, adaptive, arriving, by_shooting, lamp, uniform};
use common::shape::Shape;
use glam::{DMat3, DMat4, DVec3};

const BLUISH: [f64; 3] = [0.25, 0.5, 0.75];
const OPAQUE: [f64; 3] = [0.0; 3];
const CLEAR: [f64; 3] = [1.0; 3];

/// Adds a black sheet that lets this share through, turned and half a metre wide, over the origin.
fn sheet(scene: &mut Scene, at: DVec3, transmittance_rgb: [f64; 3]) {
    let material = scene.material(0.0, 0.0);
    scene.input.materials[material as usize].transmittance_rgb = transmittance_rgb;
    scene.blocker("sheet", Shape::square(DVec3::ZERO, 0.5), material).world_from_object =
        DMat4::from_translation(at) * DMat4::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.4);
}

/// The floor of a scene with a light and sheets, at its vertices.
fn floor_under(light: &dyn Fn(&mut Scene), sheets: &[(DVec3, [f64; 3])]) -> Vec<DVec3> {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), black);
    light(&mut scene);
    for (at, transmittance_rgb) in sheets {
        sheet(&mut scene, *at, *transmittance_rgb);
    }
    corners(&scene.bake(&arriving(uniform(0.25))).meshes[0]).map(|(_, light)| light).collect()
}

fn add(scene: &mut Scene, shape: LampShape) {
    scene.input.lamps.push(LampInput::new("lamp", shape));
}

fn spot(radius: f64, cone: bool) -> LampShape {
    let cone_from_world = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    LampShape::Point {
        position: DVec3::new(0.1, 0.2, 3.0),
        radius,
        faces_receiver: true,
        intensity_rgb: [9.0; 3],
        cone: cone.then_some(ConeInput { cone_from_world, angle: 1.2, blend: 0.4 }),
    }
}

type Named = (&'static str, Box<dyn Fn(&mut Scene)>);

/// Every kind of light.
fn lights() -> Vec<Named> {
    let sun =
        |angle: f64| LampShape::Sun { direction: DVec3::new(0.1, 0.3, 1.0), angle, irradiance_rgb: [3.0; 3] };
    vec![
        ("area", Box::new(|scene: &mut Scene| scene.light(&lamp(DVec3::new(0.0, 0.0, 3.0), 0.4), 10.0))),
        ("point", Box::new(|scene: &mut Scene| add(scene, spot(0.0, false)))),
        ("disc", Box::new(|scene: &mut Scene| add(scene, spot(0.3, false)))),
        ("spot", Box::new(|scene: &mut Scene| add(scene, spot(0.3, true)))),
        ("sun", Box::new(move |scene: &mut Scene| add(scene, sun(0.0)))),
        ("wide sun", Box::new(move |scene: &mut Scene| add(scene, sun(0.2)))),
        ("sky", Box::new(|scene: &mut Scene| scene.input.sky = Some(SkyInput::even("sky", [2.0, 1.0, 0.5])))),
    ]
}

/// What parts of a light add up to, relative to the brightest: the rule for a spot's fading cone may err by 1e-5 of each.
fn precision(name: &str) -> f64 {
    if name == "spot" { 1e-4 } else { 1e-6 }
}

/// What a sheet covers of a light is the difference that an opaque one makes, and of that its share gets through.
#[test]
fn a_sheet_lets_its_share_of_every_light_through() {
    let at = DVec3::new(0.0, 0.0, 1.0);
    for (name, light) in lights() {
        let [open, filtered, opaque] =
            [CLEAR, BLUISH, OPAQUE].map(|share| floor_under(&light, &[(at, share)]));
        let share = DVec3::from_array(BLUISH);
        let brightest = open.iter().map(|light| light.max_element()).fold(0.0, f64::max);
        let within = precision(name);
        let mut covered = 0;
        for ((open, filtered), opaque) in open.iter().zip(&filtered).zip(&opaque) {
            let expected = *opaque + share * (*open - *opaque);
            let off = (*filtered - expected).abs().max_element();
            assert!(off <= within * brightest, "{name}: {filtered} instead of {expected}");
            covered += usize::from(open.distance(*opaque) > 0.01 * brightest);
        }
        assert!(covered > 10, "{name}: the sheet covers nothing");
    }
}

/// By inclusion and exclusion of what two opaque sheets leave of a light, alone and together.
#[test]
fn shares_of_sheets_behind_each_other_multiply() {
    let [low, high] = [DVec3::new(0.1, 0.0, 1.0), DVec3::new(-0.1, 0.1, 1.5)];
    let [first, second] = [BLUISH, [0.9, 0.2, 0.6]];
    for (name, light) in lights() {
        let floor = |a, b| floor_under(&light, &[(low, a), (high, b)]);
        let found = floor(first, second);
        let swapped = floor_under(&light, &[(high, second), (low, first)]);
        let [open, only_low, only_high, both] =
            [(CLEAR, CLEAR), (OPAQUE, CLEAR), (CLEAR, OPAQUE), (OPAQUE, OPAQUE)].map(|(a, b)| floor(a, b));
        let [t, u] = [first, second].map(DVec3::from_array);
        let one = DVec3::ONE;
        let brightest = open.iter().map(|light| light.max_element()).fold(0.0, f64::max);
        for k in 0..found.len() {
            let expected = t * u * open[k]
                + (one - t) * u * only_low[k]
                + t * (one - u) * only_high[k]
                + (one - t) * (one - u) * both[k];
            let off = (found[k] - expected).abs().max_element();
            assert!(off <= precision(name) * brightest, "{name}: {} instead of {expected}", found[k]);
            assert!((found[k] - swapped[k]).abs().max_element() <= precision(name) * brightest, "{name}");
        }
    }
}

/// The sun stands right over the edges of a pane of sixteen squares: no line of sight goes through two of them, or none.
#[test]
fn where_faces_of_a_pane_meet_one_of_them_counts() {
    for direction in [DVec3::Z, DVec3::new(0.5, 0.25, 1.0)] {
        let mut scene = Scene::default();
        let black = scene.material(0.0, 0.0);
        scene.object("floor", Shape::square(DVec3::ZERO, 1.0), black);
        let glass = scene.material(0.0, 0.0);
        scene.input.materials[glass as usize].transmittance_rgb = BLUISH;
        // Its inner edges are over the floor's vertices, as the sun sees them.
        let corner = direction - DVec3::new(2.0, 2.0, 0.0);
        scene.blocker("pane", Shape::grid(corner, 4.0 * DVec3::X, 4.0 * DVec3::Y, [4, 4]), glass);
        add(&mut scene, LampShape::Sun { direction, angle: 0.0, irradiance_rgb: [1.0; 3] });
        let bake = scene.bake(&arriving(uniform(0.25)));
        let expected = direction.normalize().z * DVec3::from_array(BLUISH);
        for (at, light) in corners(&bake.meshes[0]) {
            assert!((light - expected).abs().max_element() < 1e-6, "{light} instead of {expected} at {at}");
        }
    }
}

/// A closed room that emits 1 W/m² and reflects half, so that B = 2 everywhere, with a sheet that is seen as bright as what
/// it hides: what it does not let through it sends.
fn furnace_with_sheet(share: f64, exitance: f64) -> Scene {
    let mut scene = Scene::default();
    let wall = scene.material(0.5, 1.0);
    let pane = scene.material(1.0 - share - 0.5 * exitance, exitance);
    scene.input.materials[pane as usize].transmittance_rgb = [share; 3];
    scene.object("walls", Shape::room(DVec3::ONE), wall);
    scene.object("pane", Shape::square(DVec3::ZERO, 0.3), pane).world_from_object =
        DMat4::from_translation(DVec3::new(0.5, 0.45, 0.55)) * DMat4::from_rotation_x(0.3);
    scene
}

fn assert_even(scene: &Scene, share: f64, settings: &Settings, within: f64) {
    for mesh in &scene.bake(settings).meshes {
        let expected = if mesh.object == 0 { 2.0 } else { 2.0 * (1.0 - share) };
        for (_, light) in corners(mesh) {
            let off = (light / expected - 1.0).abs().max_element();
            assert!(off < within, "{:?}, {share}: off by {off:e}", settings.transport);
        }
    }
}

#[test]
fn a_furnace_does_not_notice_a_sheet_that_lets_a_share_through() {
    let rays = Settings { transport: Transport::Rays, ..adaptive() };
    for (settings, within, shares) in
        [(adaptive(), 1e-6, &[0.25, 0.75][..]), (by_shooting(), 1e-6, &[0.25, 0.75]), (rays, 1e-5, &[0.5])]
    {
        for &share in shares {
            // The light of emitters is even as well, so that nothing is interpolated.
            assert_even(&furnace_with_sheet(share, 1.0 - share), share, &settings, within);
        }
    }
    // All that the sheet sends is reflected, and it absorbs nothing.
    assert_even(&furnace_with_sheet(0.75, 0.0), 0.75, &adaptive(), adaptive().tolerance);
}

/// A room with a lamp is divided by a pane; what one half sends the other goes through it.
fn divided_room(transmittance_rgb: [f64; 3], settings: &Settings) -> Bake {
    let mut scene = Scene::default();
    let wall = scene.material(0.5, 0.0);
    let pane = scene.material(0.0, 0.0);
    scene.input.materials[pane as usize].transmittance_rgb = transmittance_rgb;
    scene.object("walls", Shape::room(DVec3::new(2.0, 1.0, 1.0)), wall);
    scene.blocker("pane", Shape::square(DVec3::ZERO, 0.5), pane).world_from_object =
        DMat4::from_translation(DVec3::new(1.0, 0.5, 0.5)) * DMat4::from_rotation_y(2.0 * FRAC_PI_4);
    scene.light(&lamp(DVec3::new(0.4, 0.5, 0.99), 0.2), 10.0);
    scene.bake(settings)
}

/// The light of the far wall comes through the pane, reflected on both sides of it many times.
#[test]
fn light_between_surfaces_is_filtered_alike_by_all_transports() {
    let far_wall = |transmittance_rgb: [f64; 3], settings: &Settings| {
        let bake = divided_room(transmittance_rgb, settings);
        let mesh = &bake.meshes[0];
        let (mut sum, mut whole) = (DVec3::ZERO, 0.0);
        for (triangle, colours) in mesh.triangles.iter().zip(&mesh.corner_radiance) {
            let places = triangle.map(|v| mesh.positions[v as usize]);
            if places.iter().all(|at| at.x > 2.0 - 1e-9) {
                sum += area(places) * colours.map(light).into_iter().sum::<DVec3>() / 3.0;
                whole += area(places);
            }
        }
        sum / whole
    };
    let coarse = Settings { tolerance: 0.02, ..uniform(0.25) };
    let open = far_wall(CLEAR, &coarse);
    // Patches of a uniform mesh reach from one half into the other, and carry a little light there.
    let opaque = far_wall(OPAQUE, &coarse);
    assert!(opaque.y < 0.03 * open.y, "{opaque} of {open}");
    let rays = Settings { transport: Transport::Rays, ..coarse.clone() };
    let shooting = Settings { transport: Transport::Shooting, ..coarse.clone() };
    let share = 0.7;
    let through = far_wall([share; 3], &coarse);
    // Light goes through once at least, and what goes back and forth does so more often.
    assert!(through.y < share * open.y && through.y > 0.6 * share * open.y, "{through} of {open}");
    for other in [&shooting, &rays] {
        let found = far_wall([share; 3], other);
        let off = (found / through - 1.0).abs().max_element();
        assert!(off < 0.05, "{:?}: {found} instead of {through}", other.transport);
    }
}

#[test]
fn shadows_behind_a_pane_are_as_sharp_as_without_it() {
    let under = |(half, share): (f64, f64)| {
        let mut scene = Scene::default();
        let black = scene.material(0.0, 0.0);
        scene.object("floor", Shape::square(DVec3::ZERO, 2.0), black);
        scene.blocker("card", Shape::square(DVec3::new(0.13, 0.07, 0.5), 0.4), black);
        add(&mut scene, LampShape::Sun { direction: DVec3::Z, angle: 0.0, irradiance_rgb: [1.0; 3] });
        let glass = scene.material(0.0, 0.0);
        scene.input.materials[glass as usize].transmittance_rgb = [share; 3];
        scene.blocker("pane", Shape::square(DVec3::Z, half), glass);
        scene.bake(&arriving(adaptive()))
    };
    let [without, behind] = [1.0, 0.5].map(|share| under((5.0, share)));
    assert_eq!(without.meshes[0].positions, behind.meshes[0].positions);
    for (open, behind) in all_light(&without).zip(all_light(&behind)) {
        assert!((behind - 0.5 * open).abs().max_element() < 1e-6);
    }
    let edged = under((1.1, 0.5));
    assert!(edged.report.result.triangles < 400, "{}", edged.report.result.triangles);
    for (x, expected) in [(1.0999, 0.5), (1.1001, 1.0), (0.5299, 0.0), (0.5301, 0.5)] {
        let found = light_over(&edged.meshes[0], x, 0.0123);
        assert!((found - expected).abs() < 1e-3, "{found} instead of {expected} at {x}");
    }
}

#[test]
fn what_lets_more_through_than_there_is_is_refused() {
    let mut scene = Scene::default();
    let material = scene.material(0.5, 1.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), material);
    scene.input.materials[0].transmittance_rgb = [0.5, 1.5, 0.0];
    let refused = scene.try_bake(&adaptive()).expect_err("it makes light");
    let expected =
        Error::TransmittanceOutOfRange { material: "material 0".into(), channel: "green", value: 1.5 };
    assert_eq!(refused, expected);
}
