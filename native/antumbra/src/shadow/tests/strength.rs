//! Jumps of the form factor's derivatives against one-sided finite differences of the exact form factor.

use super::*;
use crate::shadow::strength::{Jump, jump};
use crate::shadow::wedge::WedgeKind;

/// Worst relative errors, of how many lines.
#[derive(Debug, Default)]
struct Tally {
    slope: (f64, usize),
    curvature: (f64, usize),
}

/// The jumps of slope and curvature at `x` along `direction`, extrapolated from two steps (Richardson).
fn measured(scene: &mut Scene, x: DVec3, direction: DVec3, step: f64) -> [f64; 2] {
    let [coarse, fine] = [step, 0.5 * step].map(|step| differences(scene, x, direction, step));
    [(8.0 * fine[0] - coarse[0]) / 7.0, (4.0 * fine[1] - coarse[1]) / 3.0].map(f64::abs)
}

/// The same from four points on each side.
fn differences(scene: &mut Scene, x: DVec3, direction: DVec3, step: f64) -> [f64; 2] {
    let mut one_sided = |sign: f64| {
        let f: [f64; 4] = std::array::from_fn(|k| scene.light_at(x + direction * (sign * step * k as f64)));
        [
            sign * (-11.0 * f[0] + 18.0 * f[1] - 9.0 * f[2] + 2.0 * f[3]) / (6.0 * step),
            (2.0 * f[0] - 5.0 * f[1] + 4.0 * f[2] - f[3]) / (step * step),
        ]
    };
    let (left, right) = (one_sided(-1.0), one_sided(1.0));
    [left[0] - right[0], left[1] - right[1]]
}

/// Compares at random points of every line, where no other line is near.
fn compare(scene: &mut Scene, random: &mut Random, tally: &mut Tally) {
    const STEP: f64 = 1e-4;
    let lines = scene.lines();
    for (i, line) in lines.iter().enumerate() {
        let [a, b] = line.ends;
        if a.distance(b) < 0.05 {
            continue;
        }
        let x = a.lerp(b, random.between(0.05, 0.95));
        if x.length() > 5.0 || scene.source.normal().dot(x - scene.source.vertices()[0]) < 0.1 {
            continue;
        }
        let direction = DVec3::Z.cross(b - a).normalize();
        let near: Vec<f64> = (lines.iter().enumerate())
            .filter_map(|(j, other)| if i == j { None } else { crossing(other.ends, x, direction) })
            .filter(|at| at.abs() < 8.0 * STEP)
            .collect();
        if near.iter().any(|at| at.abs() > 1e-9) {
            continue;
        }
        let receiver = Receiver::new(x, DVec3::Z);
        let predicted = jump(&line.wedge, &receiver, &scene.source, &scene.edges);
        let [slope, curvature] = measured(scene, x, direction, STEP);
        let error = (slope - predicted.slope).abs();
        if predicted.slope > 1e-4 {
            tally.slope = (tally.slope.0.max(error / predicted.slope), tally.slope.1 + 1);
            assert!(
                error < 1e-4 * predicted.slope,
                "{predicted:?}, slope {slope} at {x} of {:?}",
                line.wedge
            );
            continue;
        }
        assert!(
            error < 1e-6 * (1.0 + predicted.curvature),
            "{predicted:?}, slope {slope} at {x} of {:?}",
            line.wedge
        );
        // The curvature's jumps of coincident lines add up, and those of D1 lines are not computed.
        if !near.is_empty() || line.wedge.id.kind == WedgeKind::Face {
            continue;
        }
        let error = (curvature - predicted.curvature).abs();
        assert!(
            error < 0.01 * predicted.curvature + 1e-4,
            "{predicted:?}, curvature {curvature} at {x} of {:?}",
            line.wedge
        );
        if predicted.curvature > 1e-2 {
            tally.curvature = (tally.curvature.0.max(error / predicted.curvature), tally.curvature.1 + 1);
        }
    }
}

#[test]
fn jumps_of_turned_solids_are_those_of_the_exact_form_factor() {
    let mut random = Random(11);
    let mut tally = Tally::default();
    for i in 0..60 {
        let turn = random.rotation();
        let place =
            DVec3::new(random.between(-0.5, 0.5), random.between(-0.5, 0.5), random.between(1.0, 2.5));
        let at = |p: DVec3| place + 0.4 * (turn * p);
        let blockers = [cube(at), tetrahedron(at), card(at)][i % 3].clone();
        compare(&mut Scene::new(light(DVec3::Z * 4.0, 0.8), blockers), &mut random, &mut tally);
    }
    println!("{tally:?}");
    assert!(tally.slope.1 > 20 && tally.curvature.1 > 200, "{tally:?}");
}

#[test]
fn jumps_under_a_tilted_light_are_those_of_the_exact_form_factor() {
    let mut random = Random(12);
    let mut tally = Tally::default();
    for _ in 0..30 {
        let (turn, tilt) = (random.rotation(), DMat3::from_rotation_y(random.between(-0.8, 0.8)));
        let corners =
            light(DVec3::ZERO, 0.8).vertices().iter().map(|&p| DVec3::Z * 4.0 + tilt * p).collect::<Vec<_>>();
        let blockers = cube(|p| DVec3::new(0.2, 0.1, 1.6) + 0.4 * (turn * p));
        compare(&mut Scene::new(polygon(&corners), blockers), &mut random, &mut tally);
    }
    println!("{tally:?}");
    assert!(tally.curvature.1 > 100, "{tally:?}");
}

#[test]
fn parallel_edges_make_slopes_jump() {
    let mut random = Random(13);
    let mut tally = Tally::default();
    for i in 0..30 {
        let center =
            DVec3::new(random.between(-0.4, 0.4), random.between(-0.4, 0.4), random.between(1.0, 2.0));
        let half = DVec3::new(random.between(0.1, 0.6), random.between(0.1, 0.6), random.between(0.1, 0.4));
        // A card tilted about x keeps one pair of edges parallel to the light's, and one coplanar
        let tilt = DMat3::from_rotation_x(random.between(-1.0, 1.0));
        let blockers = if i % 2 == 0 { cuboid(center, half) } else { card(|p| center + tilt * (half * p)) };
        compare(&mut Scene::new(light(DVec3::Z * 4.0, 0.8), blockers), &mut random, &mut tally);
    }
    println!("{tally:?}");
    assert!(tally.slope.1 > 100, "{tally:?}");
}

#[test]
fn a_small_jump_is_never_charged_more_than_its_edges() {
    // A card turned by a hair against the light: nearly D1, and bounded as such
    let bound = |angle: f64| {
        let turn = DMat3::from_rotation_z(angle);
        let scene = Scene::new(
            light(DVec3::Z * 4.0, 0.5),
            card(|p| DVec3::Z * 1.5 + turn * (DVec3::new(2.0, 2.0, 0.0) * p)),
        );
        (scene.lines().iter())
            .filter(|line| line.wedge.id.kind == WedgeKind::VertexEdge)
            .map(|line| {
                let receiver = Receiver::new(line.ends[0].midpoint(line.ends[1]), DVec3::Z);
                jump(&line.wedge, &receiver, &scene.source, &scene.edges).bound(0.1)
            })
            .fold(0.0, f64::max)
    };
    let (parallel, nearly) = (bound(0.0), bound(1e-5));
    assert!(parallel > 0.0 && nearly > parallel && nearly < 3.0 * parallel, "{parallel} against {nearly}");
    assert_eq!(Jump { slope: 1.0, curvature: 0.0, slope_limit: f64::INFINITY }.bound(0.0), 0.0);
}

#[test]
fn the_bound_is_the_worst_error_of_a_linear_element() {
    let jump = Jump { slope: 3.0, curvature: 0.0, slope_limit: 0.0 };
    let bend = Jump { slope: 0.0, curvature: 5.0, slope_limit: f64::INFINITY };
    let size = 0.2;
    let worst = |f: &dyn Fn(f64, f64) -> f64| {
        let (mut worst, steps) = (0.0_f64, 200);
        for kink in (0..=steps).map(|k| size * f64::from(k) / f64::from(steps)) {
            for x in (0..=steps).map(|k| size * f64::from(k) / f64::from(steps)) {
                let line = f(0.0, kink) + (f(size, kink) - f(0.0, kink)) * (x / size);
                worst = worst.max((f(x, kink) - line).abs());
            }
        }
        worst
    };
    let slope = worst(&|x, kink| jump.slope * (x - kink).max(0.0));
    assert!((slope - jump.bound(size)).abs() < 1e-12);
    let curvature = worst(&|x, kink| 0.5 * bend.curvature * (x - kink).max(0.0).powi(2));
    assert!((curvature - bend.bound(size)).abs() < 1e-12);
}
