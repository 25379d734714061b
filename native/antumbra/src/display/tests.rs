//! Values at contacts and creases, in f64: each is the limit from inside its own element.
//!
//! Baked colours are f32, known to 6e-8; here the irradiance that they are made of is held against closed forms.

use glam::{DMat4, DVec2, DVec3};

use super::*;
use crate::adapt::contact_lines::contacts;
use crate::adapt::refinement::Hidden;
use crate::mesh::tessellate;
use crate::monitor::Monitor;
use crate::scene::world::interpolated;
use crate::scene::{AreaLightInput, MaterialInput, ObjectInput, SceneInput};
use crate::transport::form_factors::{FormFactors, Shortcuts};
use crate::transport::gather::Lit;
use crate::transport::sources::{Emitters, blockers};
use crate::visibility::{ConvexPolygon, Receiver, unoccluded_form_factor};

/// What a limit may be off by, relative to the light there.
const LIMIT: f64 = 1e-9;

const LAMP_HEIGHT: f64 = 4.0;
const EXITANCE: f64 = 10.0;

/// A black object.
pub(crate) fn object(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> ObjectInput {
    ObjectInput {
        name: String::new(),
        positions,
        world_from_object: DMat4::IDENTITY,
        triangle_materials: vec![0; triangles.len()],
        triangles,
        corner_normals: None,
        receives: true,
        blocks: true,
        sends: true,
    }
}

fn parallelogram(corner: DVec3, u: DVec3, v: DVec3) -> ObjectInput {
    object(vec![corner, corner + u, corner + u + v, corner + v], vec![[0, 1, 2], [0, 2, 3]])
}

fn floor(half: f64) -> ObjectInput {
    parallelogram(DVec3::new(-half, -half, 0.0), DVec3::X * 2.0 * half, DVec3::Y * 2.0 * half)
}

/// A closed box that faces outwards.
fn cuboid(low: DVec3, high: DVec3) -> ObjectInput {
    let corner = |k: usize| DVec3::from_array(std::array::from_fn(|a| [low, high][k >> a & 1][a]));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    object((0..8).map(corner).collect(), triangles)
}

pub(crate) fn scene(objects: Vec<ObjectInput>, lamp: Option<[DVec2; 2]>) -> SceneInput {
    let material = |exitance| MaterialInput {
        name: String::new(),
        reflectance_rgb: [0.0; 3],
        exitance_rgb: [exitance; 3],
        transmittance_rgb: [0.0; 3],
    };
    let lights = lamp.map(|bounds| AreaLightInput {
        name: String::new(),
        outline: lamp_outline(bounds),
        exitance_rgb: [EXITANCE; 3],
    });
    SceneInput {
        materials: vec![material(0.0), material(1.0)],
        objects,
        lights: lights.into_iter().collect(),
        ..SceneInput::default()
    }
}

/// A horizontal rectangle that shines down.
fn lamp_outline([low, high]: [DVec2; 2]) -> Vec<DVec3> {
    let corner = |x: f64, y: f64| DVec3::new(x, y, LAMP_HEIGHT);
    vec![corner(low.x, low.y), corner(low.x, high.y), corner(high.x, high.y), corner(high.x, low.y)]
}

/// Unblocked light of a lamp, W/m².
fn light_of(bounds: [DVec2; 2], point: DVec3) -> f64 {
    let lamp = ConvexPolygon::new(&lamp_outline(bounds)).expect("it has an area");
    EXITANCE * unoccluded_form_factor(&Receiver::new(point, DVec3::Z), &lamp)
}

/// A corner of the display mesh.
struct CornerLight {
    object: usize,
    point: DVec3,
    /// Middle of its triangle.
    centroid: DVec3,
    /// Way of its sample's step, in any length.
    inward: DVec3,
    /// W/m².
    light: f64,
}

/// The direct light at all corners of elements of at most `size`, metres, refined until the rms error is `wanted`.
fn lit(input: &SceneInput, size: f64, wanted: f64) -> Vec<CornerLight> {
    let world = World::new(input).expect("the scene is valid");
    let shift = input.objects[0].positions[0] - world.vertices[0];
    let display = display(&world, size, wanted);
    let [irradiance, _] = display.layers(DVec3::ONE);
    let samples = display.samples();
    let mut found = Vec::new();
    for Shown { face, corners, .. } in display.triangles() {
        let face = &world.faces[face.index()];
        let ends = world.corners(face);
        let points = corners.each_ref().map(|corner| shift + interpolated(ends, corner.barycentric));
        for (corner, point) in corners.iter().zip(points) {
            let sample = corner.samples[0].index();
            let Receiver { position, normal, .. } = samples[sample].receiver(Side::Front);
            let step = position - samples[sample].position;
            found.push(CornerLight {
                object: face.object.index(),
                point,
                centroid: (points[0] + points[1] + points[2]) / 3.0,
                inward: step - step.dot(normal) * normal,
                light: irradiance[sample].y,
            });
        }
    }
    found
}

/// Elements of at most `size`, metres, refined for direct light until the rms error is `wanted`.
fn display(world: &World, size: f64, wanted: f64) -> Display<'_> {
    let emitters = Emitters::new(world);
    let blockers = blockers(world);
    let form_factors = FormFactors::new(&blockers, Shortcuts::default());
    let lines = contacts(world, &blockers, |_| true, 0.0, 0.0);
    let (mut mesh, _) = tessellate(world, &lines, |face| world.receives(face), 20, None);
    mesh.bisect_to(size, 100_000, &|| false);
    let monitor = Monitor::new();
    let gather = || Gather {
        form_factors: &form_factors,
        monitor: &monitor,
        sources: Lit::Sources(&emitters.tree),
        wanted_error: wanted,
        ends: &|| false,
    };
    let mut display = Display::new(DisplayMesh::Tessellated(mesh), Vec::new(), &gather(), |_| DVec3::ZERO)
        .expect("not cancelled");
    let refinement = Refinement {
        world,
        gather: gather(),
        shown: &[DVec3::ONE; 2],
        wanted_error: wanted,
        allowed: wanted * wanted * baked_area(world),
        triangle_budget: 20_000,
        hidden: Hidden::Shadows,
        progress: [0.0, 1.0],
    };
    display.refine(Light::Direct, &refinement, |_, _| ()).expect("not cancelled");
    display
}

/// The larger of the errors, relative to the limits.
fn worst(lit: impl Iterator<Item = (f64, f64)>) -> (f64, usize) {
    lit.fold((0.0, 0), |(worst, seen), (light, limit)| {
        (f64::max(worst, (light / limit - 1.0).abs()), seen + 1)
    })
}

/// Vertices lie within two cells of the grid of a face of 10 m beside a contact.
fn is_at(x: f64, contact: f64) -> bool {
    (x - contact).abs() < 3e-6
}

/// The part of a lamp that a wall of a height leaves visible from a point at its foot, where the wall is in the plane
/// x = `foot` and the point on the side of larger x. A vertex that is rounded to the wrong side has the light that the
/// right one has, continued to it.
fn beyond_wall([low, high]: [DVec2; 2], x: f64, foot: f64, height: f64) -> [DVec2; 2] {
    let edge = x + (foot - x) * LAMP_HEIGHT / height;
    [DVec2::new(low.x.max(edge), low.y), high]
}

#[test]
fn the_foot_of_a_cube_has_the_limit_from_outside_and_no_light_inside() {
    let lamp = [DVec2::new(-0.2, -0.3), DVec2::new(0.8, 0.7)];
    // On a floor of 8 m the cube's outline lies on the grid, on 6 m and on 7.3 m it is rounded.
    for (half, size, wanted) in [(4.0, 0.2, 1e-2), (3.0, 0.2, 1e-2), (3.65, 0.1, 1e-3), (30.0, 0.5, 1e-2)] {
        let cube = cuboid(DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 1.0));
        let lit = lit(&scene(vec![floor(half), cube], Some(lamp)), size, wanted);
        let floor = || lit.iter().filter(|lit| lit.object == 0);
        let outside = |lit: &&CornerLight| lit.centroid.truncate().abs().max_element() > 0.5;
        let foot = floor().filter(outside).filter(|lit| is_at(lit.point.x, 0.5) && lit.point.y.abs() < 0.499);
        let (error, seen) = worst(foot.map(|lit| {
            let visible = beyond_wall(lamp, lit.point.x, 0.5, 1.0);
            (lit.light, light_of(visible, lit.point))
        }));
        println!("floor of {half}, elements of {size} m: {seen} corners, off by {error:.2e} of the limit");
        assert!(seen > 2 && error < LIMIT, "floor of {half}: {error:e}");
        // At a corner of the cube light depends on the direction, but what lies beyond both walls is always seen.
        let corner = |lit: &&CornerLight| is_at(lit.point.x, 0.5) && is_at(lit.point.y, 0.5);
        assert!(floor().filter(outside).filter(corner).all(|lit| lit.light > 0.01), "a dark corner");
        // Slivers of a cell or two may lie beside the contact.
        let inside = |lit: &&CornerLight| lit.centroid.truncate().abs().max_element() < 0.5 - 1e-6;
        let brightest = floor().filter(inside).map(|lit| lit.light).fold(0.0, f64::max);
        assert_eq!(brightest, 0.0, "floor of {half}: light under the cube");
    }
}

/// A wall without thickness, across the whole floor: two limits at every point of its foot.
#[test]
fn both_sides_of_a_wall_have_their_own_limits() {
    let lamp = [DVec2::new(-0.6, -0.4), DVec2::new(0.8, 0.5)];
    for (foot, size) in [(0.0, 0.5), (0.3, 0.5), (0.3, 0.1)] {
        let wall = parallelogram(DVec3::new(foot, -3.5, 0.0), DVec3::Y * 7.0, DVec3::Z * 2.0);
        let lit = lit(&scene(vec![floor(3.0), wall], Some(lamp)), size, 1e-2);
        for side in [1.0, -1.0] {
            let mirror = |p: DVec3| DVec3::new(side * p.x, p.y, p.z);
            let seen_from_here = if side > 0.0 {
                lamp
            } else {
                [DVec2::new(-lamp[1].x, lamp[0].y), DVec2::new(-lamp[0].x, lamp[1].y)]
            };
            let beside = lit.iter().filter(|lit| {
                lit.object == 0 && is_at(lit.point.x, foot) && side * (lit.centroid.x - foot) > 0.0
            });
            let (error, seen) = worst(beside.map(|lit| {
                let point = mirror(lit.point);
                let limit = light_of(beyond_wall(seen_from_here, point.x, side * foot, 2.0), point);
                (lit.light, limit)
            }));
            println!("wall at {foot}, side {side}, elements of {size} m: {seen} corners, off by {error:.2e}");
            assert!(seen > 10 && error < LIMIT, "wall at {foot}, side {side}: {error:e}");
        }
    }
}

/// A wall that shines and a floor in one mesh: at the crease half of the hemisphere is the wall, and where both end it
/// is as much as the angle between the sample's step and the wall makes it.
#[test]
fn a_floor_that_meets_a_shining_wall_has_the_limit_at_the_crease() {
    let positions = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 3.0, 0.0],
        [0.0, 3.0, 0.0],
        [0.0, 0.0, 1.5],
        [2.0, 0.0, 1.5],
    ];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 5, 1], [0, 4, 5]];
    let mut corner = object(positions.map(DVec3::from_array).into(), triangles);
    corner.triangle_materials = vec![0, 0, 1, 1];
    let lit = lit(&scene(vec![corner], None), 0.4, 1e-2);
    let crease = lit.iter().filter(|lit| lit.point.y == 0.0 && lit.centroid.z == 0.0);
    let (error, seen) = worst(crease.map(|lit| {
        // The ends of the wall, seen from the side
        let side = |end: f64| {
            let along = end - lit.point.x;
            if along.abs() < 1e-12 {
                -lit.inward.x.atan2(lit.inward.y)
            } else {
                along.signum() * std::f64::consts::FRAC_PI_2
            }
        };
        (lit.light, (side(2.0) - side(0.0)) / std::f64::consts::TAU)
    }));
    println!("{seen} corners at the crease, off by {error:.2e} of the limit");
    assert!(seen > 10 && error < LIMIT, "{error:e}");
}

/// A small box half sunk into the top of a big one.
#[test]
fn boxes_that_intersect_have_limits_where_they_meet() {
    let lamp = [DVec2::new(-0.2, -0.3), DVec2::new(0.8, 0.7)];
    let big = cuboid(DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 2.0));
    let small = cuboid(DVec3::new(-0.2, -0.1, 1.7), DVec3::new(0.4, 0.5, 2.3));
    let lit = lit(&scene(vec![floor(3.0), big, small], Some(lamp)), 0.3, 1e-2);
    let top = lit.iter().filter(|lit| lit.object == 1 && lit.point.z == 2.0);
    let foot = top.filter(|lit| {
        is_at(lit.point.x, 0.4) && lit.point.y > -0.099 && lit.point.y < 0.499 && lit.centroid.x > 0.4
    });
    let (error, seen) = worst(foot.map(|lit| {
        let edge = lit.point.x + (0.4 - lit.point.x) * (LAMP_HEIGHT - 2.0) / 0.3;
        (lit.light, light_of([DVec2::new(edge, lamp[0].y), lamp[1]], lit.point))
    }));
    println!("{seen} corners on the top, off by {error:.2e} of the limit");
    assert!(seen > 5 && error < LIMIT, "{error:e}");
}

/// A bump of light bends one way in its midst, where interpolation is too dark everywhere.
#[test]
fn fitted_elements_are_nearer_to_the_light_than_interpolation() {
    let lamp = [DVec2::new(-0.5, -0.5), DVec2::new(0.5, 0.5)];
    let input = scene(vec![floor(3.0)], Some(lamp));
    let world = World::new(&input).expect("the scene is valid");
    let shift = input.objects[0].positions[0] - world.vertices[0];
    let display = display(&world, 1.5, 0.01);
    let errors = |irradiance: &[DVec3]| {
        let (mut squared, mut bias, mut area) = (0.0, 0.0, 0.0);
        for Shown { face, corners, .. } in display.triangles() {
            let ends = world.corners(&world.faces[face.index()]);
            let points = corners.each_ref().map(|corner| shift + interpolated(ends, corner.barycentric));
            let light = corners.each_ref().map(|k| irradiance[k.samples[0].index()].y);
            let element = 0.5 * (points[1] - points[0]).cross(points[2] - points[0]).length();
            // A rule of degree two on each of sixteen parts
            let n = 4;
            for i in 0..2 * n * n {
                let (row, column) = (i / (2 * n), i % (2 * n));
                let (u, v) =
                    ((f64::from(row) + 0.5) / f64::from(n), (f64::from(column) + 0.5) / f64::from(2 * n));
                let (s, t) = (1.0 - u.sqrt(), v * u.sqrt());
                let weights = [s, t, 1.0 - s - t];
                let point = (0..3).map(|k| weights[k] * points[k]).sum::<DVec3>();
                let shown: f64 = (0..3).map(|k| weights[k] * light[k]).sum();
                let error = shown - light_of(lamp, point);
                let share = element / f64::from(2 * n * n);
                squared += share * error * error;
                bias += share * error;
                area += share;
            }
        }
        ((squared / area).sqrt(), (bias / area).abs())
    };
    let (interpolated, dark) = errors(&display.direct.irradiance);
    let (fitted, fitted_dark) = errors(&display.fitted[Light::Direct as usize]);
    println!("rms error {interpolated:.2e} -> {fitted:.2e}, bias {dark:.2e} -> {fitted_dark:.2e} W/m²");
    assert!(fitted < 0.7 * interpolated && fitted_dark < 0.2 * dark);
}

/// The penumbra behind a half-plane is that of a light cut by a line: known at every sample, refined as it may be.
/// What is shown is fitted to these.
#[test]
fn every_sample_behind_a_half_plane_has_the_closed_form() {
    let lamp = [DVec2::new(-0.2, -0.5), DVec2::new(0.8, 0.5)];
    let board = parallelogram(DVec3::new(-9.0, -9.0, 1.0), DVec3::X * 9.0, DVec3::Y * 18.0);
    let input = scene(vec![floor(3.0), board], Some(lamp));
    let world = World::new(&input).expect("the scene is valid");
    let shift = input.objects[0].positions[0] - world.vertices[0];
    let display = display(&world, 0.5, 1e-3);
    let (mut worst, mut seen) = (0.0_f64, 0);
    for Shown { face, corners, .. } in display.triangles() {
        let face = &world.faces[face.index()];
        if face.object.index() != 0 {
            continue;
        }
        for corner in &corners {
            let point = shift + interpolated(world.corners(face), corner.barycentric);
            // What is right of the plane through the point and the board's edge
            let left = (-3.0 * point.x).clamp(lamp[0].x, lamp[1].x);
            let visible = [DVec2::new(left, lamp[0].y), lamp[1]];
            let expected = if left < lamp[1].x { light_of(visible, point) } else { 0.0 };
            let found = display.direct.irradiance[corner.samples[0].index()].y;
            worst = worst.max((found - expected).abs() / light_of(lamp, point));
            seen += usize::from(left > lamp[0].x && left < lamp[1].x);
        }
    }
    println!("{seen} corners in the penumbra, off by {worst:.2e} of the unblocked light");
    // A sample on a line is lit a millionth of its elements beside it.
    assert!(seen > 50 && worst < 1e-6, "{seen} corners, off by {worst:e}");
}
