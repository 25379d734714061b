//! The exact visible form factor against closed forms: from a point, and from area to area by quadrature.

mod common;

use std::f64::consts::PI;

use antumbra::visibility::{ConvexPolygon, Receiver, unoccluded_form_factor};
use common::{Solid, gauss_legendre, graded_towards_0, polygon, receiver, rectangle, visible};
use glam::DVec3;

fn assert_close(what: &str, got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() <= tolerance, "{what}: {got} instead of {expected}");
}

#[test]
fn rectangle_parallel_to_the_receiver() {
    for (a, b, c, expected) in [
        (1.0, 1.0, 1.0, 0.138_531_605_994_893),
        (2.0, 1.0, 1.0, 0.167_375_009_914_384),
        (10.0, 10.0, 1.0, 0.247_971_408_295_310),
    ] {
        let source = rectangle(DVec3::Z * c, DVec3::X * a, DVec3::Y * b);
        let form_factor = unoccluded_form_factor(&receiver([0.0; 3], [0.0, 0.0, 1.0]), &source);
        assert_close(&format!("{a}×{b} at {c}"), form_factor, expected, 1e-15);
    }
}

/// Width, height and distance of a rectangle whose lower edge is on the receiver's plane.
#[test]
fn rectangle_perpendicular_to_the_receiver() {
    for (width, height, distance, expected) in [
        (1.0, 1.0, 1.0, 0.055_734_197_002_553_5),
        (2.0, 1.0, 1.0, 0.068_697_298_875_593),
        (1.0, 2.0, 0.5, 0.158_774_804_514_300),
    ] {
        let source = rectangle(DVec3::X * distance, DVec3::Y * width, DVec3::Z * height);
        let form_factor = unoccluded_form_factor(&receiver([0.0; 3], [0.0, 0.0, 1.0]), &source);
        assert_close(&format!("{width}×{height} at {distance}"), form_factor, expected, 1e-15);
    }
}

#[test]
fn a_rectangle_below_the_horizon_adds_nothing() {
    let upper = rectangle(DVec3::X, DVec3::Y, DVec3::Z);
    let both = rectangle(DVec3::new(1.0, 0.0, -1.0), DVec3::Y, DVec3::Z * 2.0);
    let receiver = receiver([0.0; 3], [0.0, 0.0, 1.0]);
    assert_close(
        "clipped",
        unoccluded_form_factor(&receiver, &both),
        unoccluded_form_factor(&receiver, &upper),
        1e-16,
    );
}

#[test]
fn coaxial_disk_as_a_polygon_of_equal_area() {
    const SIDES: usize = 64;
    let step = 2.0 * PI / SIDES as f64;
    let radius = (PI / (0.5 * SIDES as f64 * step.sin())).sqrt();
    let corner =
        |i: usize| DVec3::new(radius * (step * i as f64).cos(), radius * (step * i as f64).sin(), 1.0);
    let disk = polygon(&(0..SIDES).map(corner).collect::<Vec<_>>());
    let form_factor = unoccluded_form_factor(&receiver([0.0; 3], [0.0, 0.0, 1.0]), &disk);

    // Each side subtends the same angle at the same elevation
    let apothem = radius * (0.5 * step).cos();
    let slant = apothem.hypot(1.0);
    let sides = SIDES as f64 * (apothem / slant) * (radius * (0.5 * step).sin() / slant).atan() / PI;
    assert_close("polygon", form_factor, sides, 1e-15);
    assert_close("disk, relative", form_factor / 0.5 - 1.0, -1.3e-7, 1e-8);
}

/// The mean of the visible form factor over a parallelogram with this corner and these sides.
fn area_to_area(
    [corner, u, v]: [DVec3; 3],
    nodes: [&[(f64, f64)]; 2],
    source: &ConvexPolygon,
    blockers: &[ConvexPolygon],
) -> f64 {
    let normal = u.cross(v).normalize();
    let mut mean = 0.0;
    for &(s, weight_s) in nodes[0] {
        for &(t, weight_t) in nodes[1] {
            let receiver = Receiver::new(corner + s * u + t * v, normal);
            mean += weight_s * weight_t * visible(&receiver, source, blockers).value;
        }
    }
    mean
}

/// Nodes on 0..1 for what is not smooth at both ends.
fn graded_towards_both_ends(count: usize, levels: i32) -> Vec<(f64, f64)> {
    let half = graded_towards_0(count, levels);
    half.iter().flat_map(|&(x, w)| [(0.5 * x, 0.5 * w), (1.0 - 0.5 * x, 0.5 * w)]).collect()
}

const FLOOR: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

#[test]
fn opposite_and_adjacent_faces_of_a_cube() {
    let smooth = gauss_legendre(12);
    let ceiling = rectangle(DVec3::Z, DVec3::Y, DVec3::X);
    let opposite = area_to_area(FLOOR, [&smooth, &smooth], &ceiling, &[]);
    assert_close("opposite", opposite, 0.199_824_895_698_387, 1e-13);

    let (towards_wall, along_wall) = (graded_towards_0(8, 40), graded_towards_both_ends(8, 30));
    let wall = rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z);
    let adjacent = area_to_area(FLOOR, [&towards_wall, &along_wall], &wall, &[]);
    assert_close("adjacent", adjacent, 0.200_043_776_075_403, 1e-11);
}

#[test]
fn parallel_rectangles() {
    let smooth = gauss_legendre(12);
    let graded = graded_towards_both_ends(10, 6);
    for (width, distance, nodes, expected) in [
        (2.0, 1.0, &graded, 0.285_875_384_850_715),
        (1.0, 0.1, &graded, 0.826_994_522_397_257),
        (1.0, 10.0, &smooth, 0.003_162_056_838_754),
    ] {
        let source = rectangle(DVec3::Z * distance, DVec3::X * width, DVec3::Y);
        let form_factor =
            area_to_area([DVec3::ZERO, DVec3::X * width, DVec3::Y], [nodes, nodes], &source, &[]);
        assert_close(&format!("{width}×1 at {distance}"), form_factor, expected, 1e-12);
    }
}

/// A floor of width W and a wall of height H along a common edge of length 1.
#[test]
fn perpendicular_rectangles() {
    let (towards_wall, along_wall) = (graded_towards_0(8, 40), graded_towards_both_ends(8, 30));
    for (height, width, expected) in [(2.0, 1.0, 0.232_852_602_795_362), (1.0, 2.0, 0.116_426_301_397_681)] {
        let wall = rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z * height);
        let floor = [DVec3::ZERO, DVec3::X * width, DVec3::Y];
        let form_factor = area_to_area(floor, [&towards_wall, &along_wall], &wall, &[]);
        assert_close(&format!("H = {height}, W = {width}"), form_factor, expected, 1e-11);
    }
}

/// Form factor between unit squares with a common edge at an angle of this cosine, by the double contour integral
/// `F = |∮∮ ln r dx·dx'| / 2pi`, which shares nothing with the code under test.
fn hinged_squares_by_contours(cosine: f64) -> f64 {
    let nodes = gauss_legendre(100);
    let over_both = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        nodes.iter().flat_map(|&(s, ws)| nodes.iter().map(move |&(t, wt)| ws * wt * f(s, t))).sum()
    };
    let parallel_edges = |distance2: f64| over_both(&|s, t| 0.5 * (distance2 + (s - t).powi(2)).ln());
    // The common edge with itself, and edges that share a corner, in polar coordinates about it
    let common_edge = -1.5;
    let corner: f64 =
        nodes.iter().map(|&(v, weight)| weight * 0.5 * (1.0 + v * v - 2.0 * v * cosine).ln()).sum::<f64>()
            - 0.5;
    let opposite = over_both(&|s, t| 0.5 * (1.0 + s * s + t * t - 2.0 * s * t * cosine).ln());
    let sum = parallel_edges(2.0 - 2.0 * cosine) - 2.0 * parallel_edges(1.0)
        + common_edge
        + 2.0 * cosine * (corner - opposite);
    sum.abs() / (2.0 * PI)
}

#[test]
fn unit_squares_with_a_hinge() {
    let (towards_hinge, along_hinge) = (graded_towards_0(16, 36), graded_towards_both_ends(16, 26));
    for (degrees, expected) in [
        (30.0_f64, 0.619_028_323_091),
        (45.0, 0.483_347_695_479),
        (60.0, 0.370_905_321_150),
        (120.0, 0.086_615_001_118),
        (135.0, 0.048_309_447_802),
        (150.0, 0.021_345_325_413),
    ] {
        let angle = degrees.to_radians();
        assert_close("by contours", hinged_squares_by_contours(angle.cos()), expected, 1e-12);
        let leaf = rectangle(DVec3::ZERO, DVec3::Y, DVec3::new(angle.cos(), 0.0, angle.sin()));
        let form_factor = area_to_area(FLOOR, [&towards_hinge, &along_hinge], &leaf, &[]);
        assert_close(&format!("{degrees} degrees"), form_factor, expected, 1e-11);
    }
}

/// A quarter of the mid-plane blocks a quarter of all exchange: by symmetry, each of its four quarters holds the
/// midpoint of as many pairs of points (the square obstruction of NIST's `View3D`).
#[test]
fn a_quarter_of_the_mid_plane_blocks_a_quarter() {
    let nodes = gauss_legendre(16);
    let ceiling = rectangle(DVec3::Z, DVec3::X, DVec3::Y);
    let obstruction = rectangle(DVec3::Z * 0.5, DVec3::X * 0.5, DVec3::Y * 0.5);
    let form_factor = area_to_area(FLOOR, [&nodes, &nodes], &ceiling, &[obstruction]);
    assert_close("three quarters", form_factor, 0.149_868_671_774, 5e-13);
    assert_close("three quarters", form_factor, 0.75 * 0.199_824_895_698_387, 1e-12);
}

#[test]
fn penumbra_of_a_cube_under_a_square_light() {
    let light = rectangle(DVec3::new(-0.5, -0.5, 4.0), DVec3::Y, DVec3::X);
    let cube = Solid::cube().map(|corner| DVec3::Z + 0.5 * corner).polygons();
    for (x, expected) in [
        (0.5, 0.0),
        (0.6, 0.003_267_066_912),
        (0.8, 0.009_463_448_561),
        (1.0, 0.014_748_406_728),
        (1.1, 0.016_935_677_787),
    ] {
        let form_factor = visible(&receiver([x, 0.0, 0.0], [0.0, 0.0, 1.0]), &light, &cube);
        assert_close(&format!("x = {x}"), form_factor.value, expected, 5e-13);
    }
}
