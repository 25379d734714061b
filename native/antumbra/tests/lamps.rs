//! Points, spots, suns and panels with a spread against closed forms. Nothing reflects, and the irradiance is baked.

mod common;

use std::f64::consts::PI;

use antumbra::error::Error;
use antumbra::scene::{ConeInput, LampInput, LampShape};
use antumbra::weld::Bake;
use common::baked::{assert_sound, corners, light_over};
use common::scene::{Scene, adaptive, arriving, lamp, uniform};
use common::shape::Shape;
use glam::{DMat3, DMat4, DVec3};

const FULL: f64 = PI;

fn black_floor(scene: &mut Scene) {
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), black);
}

fn add(scene: &mut Scene, shape: LampShape) -> &mut LampInput {
    let name = format!("lamp {}", scene.input.lamps.len());
    scene.input.lamps.push(LampInput::new(&name, shape));
    scene.input.lamps.last_mut().expect("it was just added")
}

fn sun(direction: DVec3, angle: f64) -> LampShape {
    LampShape::Sun { direction, angle, irradiance_rgb: [3.0, 2.0, 1.0] }
}

/// A point or a ball of 1 W/sr per steradian in green.
fn point(position: DVec3, radius: f64, faces_receiver: bool) -> LampShape {
    LampShape::Point { position, radius, faces_receiver, intensity_rgb: [2.0, 1.0, 0.5], cone: None }
}

/// A spot that shines down.
fn spot(position: DVec3, radius: f64, angle: f64, blend: f64) -> LampShape {
    let cone_from_world = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let cone = Some(ConeInput { cone_from_world, angle, blend });
    LampShape::Point { position, radius, faces_receiver: true, intensity_rgb: [1.0; 3], cone }
}

/// A floor under one lamp, at its vertices.
fn under(shape: LampShape) -> Vec<(DVec3, DVec3)> {
    let mut scene = Scene::default();
    black_floor(&mut scene);
    add(&mut scene, shape);
    let bake = scene.bake(&arriving(uniform(0.25)));
    assert_sound(&scene.input, &bake);
    corners(&bake.meshes[0]).collect()
}

/// Holds green light against what is expected at each place, relative to the largest.
fn assert_is(found: &[(DVec3, DVec3)], within: f64, expected: impl Fn(DVec3) -> f64) {
    let largest = found.iter().map(|(p, _)| expected(*p).abs()).fold(0.0, f64::max);
    assert!(found.len() > 100 && largest > 0.0);
    for (p, light) in found {
        let expected = expected(*p);
        assert!((light.y - expected).abs() <= within * largest, "{} instead of {expected} at {p}", light.y);
    }
}

fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[test]
fn a_sun_brings_its_irradiance_times_the_cosine_whatever_its_angle() {
    for angle in [0.0, 0.009, 1.0] {
        for tilt in [0.0, 0.4, 0.9] {
            let direction = 7.0 * DVec3::new(f64::sin(tilt), 0.0, f64::cos(tilt));
            let found = under(sun(direction, angle));
            assert_is(&found, 2e-7, |_| 2.0 * f64::cos(tilt));
            assert!(found.iter().all(|(_, light)| (light.x - 3.0 * light.z).abs() < 1e-6));
        }
        // Below the horizon
        assert!(under(sun(DVec3::new(1.0, 0.0, -1.2), angle)).iter().all(|(_, light)| *light == DVec3::ZERO));
    }
}

/// Half of a disc that is cut by the horizon in its middle, whose own plane is edge-on: `L sin²(h)·(…)` from Lambert.
#[test]
fn a_large_sun_sets_gradually() {
    let half = 0.3_f64;
    let found = under(sun(DVec3::X, 2.0 * half));
    // The integral of the cosine over the half of a cone about the horizon: radiance times (h - sin h cos h)
    let radiance = 2.0 / (PI * half.sin().powi(2));
    assert_is(&found, 1e-4, |_| radiance * (half - half.sin() * half.cos()));
}

#[test]
fn a_point_falls_with_the_square_of_the_distance_and_the_cosine() {
    let at = DVec3::new(0.3, -0.2, 0.7);
    assert_is(&under(point(at, 0.0, true)), 2e-5, |p| at.z / p.distance(at).powi(3));
}

#[test]
fn a_disc_that_faces_its_receiver_and_a_sphere() {
    let at = DVec3::new(0.3, -0.2, 0.7);
    let r2 = 0.25_f64.powi(2);
    let facing = under(point(at, 0.25, true));
    assert_is(&facing, 2e-5, |p| at.z / p.distance(at) / (p.distance_squared(at) + r2));
    let sphere = under(point(at, 0.25, false));
    assert_is(&sphere, 2e-5, |p| at.z / p.distance(at).powi(3));
}

#[test]
fn inside_a_sphere_light_comes_from_everywhere() {
    let found = under(point(DVec3::Z * 0.5, 4.0, false));
    // pi·L with L = I/(pi r²)
    assert_is(&found, 1e-6, |_| 1.0 / 16.0);
}

#[test]
fn a_spot_fades_as_a_smoothstep_of_the_cosine() {
    let at = DVec3::new(0.1, 0.2, 1.5);
    for (angle, blend) in [(1.2_f64, 0.3), (0.8, 1.0), (2.5, 0.01)] {
        let border = (0.5 * angle).cos();
        let expected = |p: DVec3| {
            let cosine = at.z / p.distance(at);
            cosine / p.distance_squared(at) * smoothstep((cosine - border) / ((1.0 - border) * blend))
        };
        assert_is(&under(spot(at, 0.0, angle, blend)), 2e-4, expected);
        // A little disc shines like a point: what bends over it is of second order.
        assert_is(&under(spot(at, 1e-3, angle, blend)), 2e-3, expected);
    }
}

/// A disc spot in its fading part is the sum of the point spots it is made of.
#[test]
fn a_spots_disc_is_the_sum_of_its_points() {
    let (at, radius, angle, blend) = (DVec3::new(0.0, 0.0, 1.5), 0.4, 1.0_f64, 0.7);
    let border = (0.5 * angle).cos();
    let found = under(spot(at, radius, angle, blend));
    let expected = |p: DVec3| {
        let axis = (p - at).normalize();
        let (u, v) = axis.any_orthonormal_pair();
        let (rings, spokes) = (60, 60);
        let mut sum = 0.0;
        for i in 0..rings {
            let r = radius * ((f64::from(i) + 0.5) / f64::from(rings)).sqrt();
            for j in 0..spokes {
                let (sine, cosine) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(spokes)).sin_cos();
                let from = at + r * (cosine * u + sine * v);
                let way = p - from;
                let distance = way.length();
                let cosines = (-way.z / distance).max(0.0) * axis.dot(way).max(0.0) / distance;
                let kept = smoothstep((-way.z / distance - border) / ((1.0 - border) * blend));
                sum += kept * cosines / (distance * distance);
            }
        }
        sum / f64::from(rings * spokes)
    };
    assert_is(&found, 5e-4, expected);
}

#[test]
fn a_spread_keeps_an_area_lights_light_together() {
    for spread in [0.6_f64, 2.0, 3.1] {
        let h = 0.5 * spread;
        let (at, half) = (DVec3::Z * 1.5, 1e-4);
        let shape = LampShape::Panel { outline: lamp(at, half).to_vec(), exitance_rgb: [1.0; 3], spread };
        let area = 4.0 * half * half;
        let expected = |p: DVec3| {
            let cosine = at.z / p.distance(at);
            let tangent = (1.0 - cosine * cosine).sqrt() / cosine;
            let kept = ((h.tan() - tangent) / (h.tan() - h)).max(0.0);
            area * kept * cosine * cosine / (PI * p.distance_squared(at))
        };
        assert_is(&under(shape), 1e-3, expected);
    }
    // Without one it is the same light as ever.
    let outline = lamp(DVec3::Z, 0.4).to_vec();
    let with = under(LampShape::Panel { outline: outline.clone(), exitance_rgb: [1.0; 3], spread: FULL });
    let mut scene = Scene::default();
    black_floor(&mut scene);
    scene.light(&outline, 1.0);
    let without = scene.bake(&arriving(uniform(0.25)));
    for ((_, a), (_, b)) in with.iter().zip(corners(&without.meshes[0])) {
        assert_eq!(*a, b);
    }
}

/// A large light with a narrow spread: behind a point's own cone nothing of it is seen.
#[test]
fn a_narrow_spread_of_a_large_light_is_even_below_it() {
    let outline = lamp(DVec3::Z, 1.5).to_vec();
    let found = under(LampShape::Panel { outline, exitance_rgb: [2.0; 3], spread: 0.02 });
    for (p, light) in found {
        let beside = p.x.abs().max(p.y.abs()) - 1.5;
        if beside.abs() > 0.011 {
            let expected = if beside < 0.0 { 2.0 } else { 0.0 };
            assert!((light.y - expected).abs() < 2e-3, "{} instead of {expected} at {p}", light.y);
        }
    }
}

/// Every kind of lamp above a floor.
fn every_lamp() -> Vec<LampShape> {
    let above = DVec3::new(0.2, 0.1, 2.0);
    let sharp = [sun(DVec3::new(0.1, 0.2, 1.0), 0.0), point(above, 0.0, true), spot(above, 0.0, 2.0, 0.5)];
    sharp.into_iter().chain(soft_lamps()).collect()
}

/// Those with penumbrae.
fn soft_lamps() -> Vec<LampShape> {
    let above = DVec3::new(0.2, 0.1, 2.0);
    let outline = lamp(above, 0.3).to_vec();
    vec![
        sun(DVec3::new(0.1, 0.2, 1.0), 0.3),
        point(above, 0.3, true),
        point(above, 0.3, false),
        spot(above, 0.3, 2.0, 0.5),
        LampShape::Panel { outline: outline.clone(), exitance_rgb: [1.0; 3], spread: 2.0 },
        LampShape::Panel { outline, exitance_rgb: [1.0; 3], spread: FULL },
    ]
}

fn total(bake: &Bake) -> f64 {
    corners(&bake.meshes[0]).map(|(_, light)| light.y.abs()).sum()
}

#[test]
fn behind_a_closed_box_it_is_exactly_dark_unless_the_lamp_casts_no_shadows() {
    for shape in every_lamp() {
        let mut scene = Scene::default();
        black_floor(&mut scene);
        scene.blocker("bell", Shape::cuboid(DVec3::Z * 0.5, DVec3::new(2.1, 2.1, 0.7)), 0);
        add(&mut scene, shape.clone());
        let settings = arriving(uniform(0.5));
        assert_eq!(total(&scene.bake(&settings)), 0.0, "{shape:?}");
        scene.input.lamps[0].casts_shadows = false;
        let mut open = Scene::default();
        black_floor(&mut open);
        add(&mut open, shape);
        assert_eq!(total(&scene.bake(&settings)), total(&open.bake(&settings)));
    }
}

#[test]
fn a_negative_lamp_takes_away_what_its_positive_brings() {
    for shape in every_lamp() {
        let mut scene = Scene::default();
        black_floor(&mut scene);
        scene.blocker("card", Shape::square(DVec3::Z * 0.5, 0.3), 0);
        add(&mut scene, shape);
        let bright = total(&scene.bake(&arriving(uniform(0.5))));
        let negated = scene.input.lamps[0].clone();
        add(&mut scene, negated.shape);
        match &mut scene.input.lamps[1].shape {
            LampShape::Sun { irradiance_rgb: rgb, .. }
            | LampShape::Point { intensity_rgb: rgb, .. }
            | LampShape::Panel { exitance_rgb: rgb, .. } => *rgb = rgb.map(|v| -v),
        }
        assert!(bright > 1e-3);
        assert!(total(&scene.bake(&arriving(uniform(0.5)))) < 1e-12 * bright);
    }
}

/// Half a disc sun behind a wall: its middle is hidden from the points in line with the wall's top.
#[test]
fn the_penumbra_of_a_disc_sun_is_a_share_of_its_disc() {
    let (half, height) = (0.02_f64, 1.0);
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 0.03), black);
    // From x = 0 on to the right and beyond the floor
    let roof = Shape::quad(DVec3::new(0.0, -9.0, height), DVec3::X * 9.0, DVec3::Y * 18.0);
    scene.blocker("roof", roof, 0);
    add(&mut scene, sun(DVec3::Z, 2.0 * half));
    let bake = scene.bake(&arriving(uniform(0.004)));
    let found: Vec<_> = corners(&bake.meshes[0]).collect();
    assert_is(&found, 2e-4, |p| {
        // What is left of the disc, seen edge by edge: a half-plane through the edge
        let at = ((p.x / height).atan().tan() / half.tan()).clamp(-1.0, 1.0);
        2.0 * (at.acos() - at * (1.0 - at * at).sqrt()) / PI
    });
}

#[test]
fn scale_and_place_change_nothing() {
    for shape in every_lamp() {
        let bake = |scale: f64, offset: DVec3| {
            let mut scene = Scene::default();
            black_floor(&mut scene);
            scene.blocker("card", Shape::square(DVec3::Z * 0.5, 0.3), 0);
            let mut scene =
                scene.placed(DMat4::from_translation(offset) * DMat4::from_scale(DVec3::splat(scale)));
            let place = |p: &mut DVec3| *p = scale * *p + offset;
            let mut shape = shape.clone();
            match &mut shape {
                LampShape::Sun { .. } => {}
                LampShape::Point { position, radius, intensity_rgb, .. } => {
                    place(position);
                    *radius *= scale;
                    *intensity_rgb = intensity_rgb.map(|v| v * scale * scale);
                }
                LampShape::Panel { outline, .. } => outline.iter_mut().for_each(place),
            }
            add(&mut scene, shape);
            scene.bake(&arriving(uniform(0.25 * scale)))
        };
        let reference: Vec<f64> = light(&bake(1.0, DVec3::ZERO));
        for (scale, offset) in [(1e-4, DVec3::ZERO), (1e4, DVec3::new(3e4, -2e4, 1e5))] {
            for (a, b) in light(&bake(scale, offset)).iter().zip(&reference) {
                assert!(
                    (a - b).abs() < 1e-5 * reference.iter().copied().fold(0.0, f64::max),
                    "{a} {b} {shape:?}"
                );
            }
        }
    }
}

fn light(bake: &Bake) -> Vec<f64> {
    corners(&bake.meshes[0]).map(|(_, light)| light.y).collect()
}

/// A crowd of blockers: what points and directions see stays exact, and discs are as good as their rays.
#[test]
fn a_crowd_of_blockers_hides_points_exactly() {
    for shape in every_lamp() {
        let mut scene = Scene::default();
        black_floor(&mut scene);
        // 400 strips that together are a roof without gaps over the right half
        let roof = Shape::grid(DVec3::new(0.0, -9.0, 0.5), DVec3::X * 9.0, DVec3::Y * 18.0, [20, 20]);
        scene.blocker("roof", roof.map(|p| p + DVec3::Z * 0.02 * (7.0 * p.x + 3.0 * p.y).sin()), 0);
        add(&mut scene, shape);
        let bake = scene.bake(&arriving(uniform(0.25)));
        let (dark, lit): (Vec<_>, Vec<_>) =
            corners(&bake.meshes[0]).filter(|(p, _)| p.x.abs() > 0.5).partition(|(p, _)| p.x > 0.0);
        assert!(dark.iter().all(|(_, light)| *light == DVec3::ZERO));
        assert!(lit.iter().any(|(_, light)| light.y > 0.0));
    }
}

#[test]
fn adaptive_bakes_follow_lamps_to_the_tolerance() {
    for shape in soft_lamps() {
        let mut scene = Scene::default();
        black_floor(&mut scene);
        scene.blocker("card", Shape::square(DVec3::Z * 0.5, 0.3), 0);
        add(&mut scene, shape.clone());
        let bake = scene.bake(&arriving(adaptive()));
        assert_sound(&scene.input, &bake);
        let fine = scene.bake(&arriving(uniform(0.04)));
        let places: Vec<[f64; 2]> =
            (0..400).map(|k| [f64::from(k % 20) * 0.199 - 1.9, f64::from(k / 20) * 0.1989 - 1.9]).collect();
        let (mut squared, mut mean) = (0.0, 0.0);
        for &[x, y] in &places {
            let [found, reference] = [&bake, &fine].map(|bake| light_over(&bake.meshes[0], x, y));
            squared += (found - reference).powi(2);
            mean += reference;
        }
        let count = places.len() as f64;
        let error = (squared / count).sqrt() / (mean / count);
        println!("{:.3} % with {} vertices: {shape:?}", 100.0 * error, bake.meshes[0].positions.len());
        assert!(error < 0.012, "{error}: {shape:?}");
    }
}

#[test]
fn what_no_lamp_can_be_is_refused_by_name() {
    let refused = |shape: LampShape| {
        let mut scene = Scene::default();
        black_floor(&mut scene);
        add(&mut scene, shape);
        let error = scene.try_bake(&adaptive()).expect_err("it is not valid");
        assert!(error.to_string().contains("“lamp 0”"), "{error}");
        error
    };
    let not_finite = Error::LightNotFinite { light: "lamp 0".into() };
    assert_eq!(refused(sun(DVec3::ZERO, 0.0)), not_finite);
    assert_eq!(refused(sun(DVec3::NAN, 0.0)), not_finite);
    assert_eq!(refused(point(DVec3::new(0.0, f64::INFINITY, 0.0), 0.0, true)), not_finite);
    for shape in [
        sun(DVec3::Z, -1.0),
        sun(DVec3::Z, f64::NAN),
        point(DVec3::Z, -0.1, true),
        point(DVec3::Z, f64::NAN, true),
        spot(DVec3::Z, 0.0, 4.0, 0.5),
        spot(DVec3::Z, 0.0, 1.0, 1.5),
        LampShape::Panel { outline: lamp(DVec3::Z, 1.0).to_vec(), exitance_rgb: [1.0; 3], spread: -1.0 },
    ] {
        assert!(matches!(refused(shape), Error::LightOutOfRange { .. }));
    }
}
