//! Shadows of suns and points: mesh edges on their borders, and, where they are sharp, both sides' light right.

mod common;

use antumbra::scene::{ConeInput, LampInput, LampShape};
use antumbra::settings::{Method, Settings};
use common::baked::{assert_sound, corners, light_over};
use common::lines::uncovered;
use common::scene::{Scene, adaptive, arriving, by};
use common::shape::Shape;
use glam::{DMat3, DMat4, DVec3};

/// Mesh edges lie this near to the lines, relative to the receiver. Its grid is 2^26 cells wide.
const ON_THE_LINE: f64 = 1e-6;

const WITH_LINES: [Method; 2] = [Method::Adm, Method::Dm];

/// The lines of faces and nothing else.
fn lines_only(method: Method) -> Settings {
    arriving(Settings { tolerance: 1e-3, element_size: 1e4, max_level: 0, ..by(method) })
}

/// A floor 6 m wide and a cube of side 1 that floats half a metre above it.
fn floating_cube(shape: LampShape) -> Scene {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 3.0), black);
    scene.blocker("cube", Shape::cuboid(DVec3::Z, DVec3::splat(0.5)), black);
    scene.input.lamps.push(LampInput::new("lamp", shape));
    scene
}

const TOWARDS: DVec3 = DVec3::new(0.25, 0.5, 1.0);

fn sun() -> LampShape {
    LampShape::Sun { direction: TOWARDS, angle: 0.0, irradiance_rgb: [3.0; 3] }
}

const ABOVE: DVec3 = DVec3::new(0.0, 0.0, 3.0);

fn point() -> LampShape {
    LampShape::Point {
        position: ABOVE,
        radius: 0.0,
        faces_receiver: true,
        intensity_rgb: [2.0; 3],
        cone: None,
    }
}

fn spot() -> LampShape {
    let LampShape::Point { position, radius, faces_receiver, intensity_rgb, .. } = point() else {
        unreachable!("it is a point")
    };
    let cone_from_world = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let cone = Some(ConeInput { cone_from_world, angle: 2.6, blend: 0.2 });
    LampShape::Point { position, radius, faces_receiver, intensity_rgb, cone }
}

/// The cube's shadow under the sun: the union of its bottom's and its top's, drawn out by the direction.
fn sun_shadow() -> Vec<DVec3> {
    let throw = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) - z * TOWARDS;
    let (bottom, top) = (0.5, 1.5);
    vec![
        throw(0.5, -0.5, bottom),
        throw(0.5, 0.5, bottom),
        throw(-0.5, 0.5, bottom),
        throw(-0.5, 0.5, top),
        throw(-0.5, -0.5, top),
        throw(0.5, -0.5, top),
    ]
}

/// Under the point: its top's, twice as large at half the height of the light.
fn point_shadow() -> Vec<DVec3> {
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec()
}

fn cases() -> [(LampShape, Vec<DVec3>); 3] {
    [(sun(), sun_shadow()), (point(), point_shadow()), (spot(), point_shadow())]
}

fn border(shadow: &[DVec3]) -> Vec<[DVec3; 2]> {
    (0..shadow.len()).map(|k| [shadow[k], shadow[(k + 1) % shadow.len()]]).collect()
}

/// Distance beyond the border of a convex shadow, negative within.
fn outside(shadow: &[DVec3], p: DVec3) -> f64 {
    (border(shadow).iter())
        .map(|[a, b]| (p - *a).dot((*b - *a).cross(DVec3::Z).normalize()))
        .fold(f64::NEG_INFINITY, f64::max)
}

/// What the floor gets where it gets any.
fn open(shape: &LampShape, p: DVec3) -> f64 {
    match shape {
        LampShape::Sun { .. } => 3.0 / TOWARDS.length(),
        LampShape::Point { .. } | LampShape::Panel { .. } => {
            let cosine = ABOVE.z / p.distance(ABOVE);
            let kept = match shape {
                LampShape::Point { cone: Some(cone), .. } => {
                    let border = (0.5 * cone.angle).cos();
                    let t = ((cosine - border) / ((1.0 - border) * cone.blend)).clamp(0.0, 1.0);
                    t * t * (3.0 - 2.0 * t)
                }
                _ => 1.0,
            };
            2.0 * kept * cosine / p.distance_squared(ABOVE)
        }
    }
}

#[test]
fn mesh_edges_lie_on_the_border_of_a_sharp_shadow_and_both_sides_have_their_own_light() {
    for (shape, shadow) in cases() {
        let scene = floating_cube(shape.clone());
        for method in WITH_LINES {
            let bake = scene.bake(&lines_only(method));
            assert_sound(&scene.input, &bake);
            let mesh = &bake.meshes[0];
            for line in border(&shadow) {
                let missing = uncovered(mesh, line, ON_THE_LINE * 6.0);
                assert_eq!(missing, 0.0, "{method:?}, {shape:?}: share of {line:?} without mesh edges");
            }
            // Every triangle is all in light or all in shadow, and its corners are lit as it is.
            for (triangle, colours) in mesh.triangles.iter().zip(&mesh.corner_radiance) {
                let places = triangle.map(|v| mesh.positions[v as usize]);
                let middle = (places[0] + places[1] + places[2]) / 3.0;
                let lit = outside(&shadow, middle) > 0.0;
                for (place, colour) in places.iter().zip(colours) {
                    let found = f64::from(colour[1]) * std::f64::consts::PI;
                    let expected = if lit { open(&shape, *place) } else { 0.0 };
                    assert!(
                        (found - expected).abs() < 2e-5 * 3.0,
                        "{found} instead of {expected} at {place} of {places:?}, {method:?}, {shape:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn sharp_shadows_move_with_the_scene() {
    let (_, shadow) = &cases()[0];
    for (place, scale) in [(DVec3::new(3e3, -2e3, 1e3), 1.0), (DVec3::new(-7.0, 5.0, 2.0), 1e-3)] {
        let turn = DMat4::from_rotation_z(0.4) * DMat4::from_rotation_x(0.7);
        let moved = DMat4::from_translation(place) * DMat4::from_scale(DVec3::splat(scale)) * turn;
        let mut scene = floating_cube(sun());
        if let LampShape::Sun { direction, .. } = &mut scene.input.lamps[0].shape {
            *direction = turn.transform_vector3(*direction);
        }
        let scene = scene.placed(moved);
        let bake = scene.bake(&lines_only(Method::Adm));
        for line in border(shadow) {
            let missing = uncovered(&bake.meshes[0], line, ON_THE_LINE * 6.0);
            assert_eq!(missing, 0.0, "share of {line:?} without mesh edges");
        }
    }
}

/// With lines, a hundred vertices show what no fine mesh can without.
#[test]
fn default_bakes_show_sharp_shadows_exactly() {
    for (shape, shadow) in cases() {
        let scene = floating_cube(shape.clone());
        let bake = scene.bake(&arriving(adaptive()));
        assert_sound(&scene.input, &bake);
        let (mut squared, mut sum, mut count) = (0.0, 0.0, 0.0);
        for i in 0..60 {
            for j in 0..60 {
                let p = DVec3::new(f64::from(i) * 0.099 - 2.93, f64::from(j) * 0.0991 - 2.93, 0.0);
                let expected = if outside(&shadow, p) > 0.0 { open(&shape, p) } else { 0.0 };
                squared += (light_over(&bake.meshes[0], p.x, p.y) - expected).powi(2);
                sum += expected;
                count += 1.0;
            }
        }
        let error = f64::sqrt(squared / count) / (sum / count);
        println!("{:.3} % with {} vertices: {shape:?}", 100.0 * error, bake.meshes[0].positions.len());
        assert!(error < 0.01, "{error}: {shape:?}");
        assert!(bake.meshes[0].positions.len() < 1500);
    }
}

/// A ball of two thousand triangles throws a round shadow; its inner edges throw nothing.
#[test]
fn a_balls_shadow_is_drawn_by_its_outline_alone() {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 3.0), black);
    scene.blocker("ball", Shape::sphere(0.5, 4).map(|p| p + DVec3::Z), black);
    scene.input.lamps.push(LampInput::new("lamp", sun()));
    let bake = scene.bake(&arriving(Settings { max_level: 0, ..adaptive() }));
    assert_sound(&scene.input, &bake);
    let lines = bake.report.result.lines.drawn;
    println!("{lines} lines");
    assert!((20..300).contains(&lines), "{lines}");
    let towards = TOWARDS.normalize();
    for (p, light) in corners(&bake.meshes[0]) {
        let from_axis = (p - DVec3::Z).cross(towards).length();
        if (from_axis - 0.5).abs() > 0.01 {
            let expected = if from_axis > 0.5 { 3.0 * towards.z } else { 0.0 };
            assert!((light.y - expected).abs() < 1e-4, "{} instead of {expected} at {p}", light.y);
        }
    }
}

/// A wall that stands on the floor: its shadow begins at its foot.
#[test]
fn the_shadow_of_what_stands_on_the_floor_begins_at_its_foot() {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 3.0), black);
    scene.blocker("cube", Shape::cuboid(DVec3::Z * 0.5, DVec3::splat(0.5)), black);
    scene.input.lamps.push(LampInput::new("lamp", sun()));
    let bake = scene.bake(&lines_only(Method::Adm));
    let mesh = &bake.meshes[0];
    for line in [
        [DVec3::new(0.5, -0.5, 0.0), DVec3::new(0.25, -1.0, 0.0)],
        [DVec3::new(0.25, -1.0, 0.0), DVec3::new(-0.75, -1.0, 0.0)],
        [DVec3::new(-0.75, -1.0, 0.0), DVec3::new(-0.75, 0.0, 0.0)],
        [DVec3::new(-0.75, 0.0, 0.0), DVec3::new(-0.5, 0.5, 0.0)],
    ] {
        let missing = uncovered(mesh, line, ON_THE_LINE * 6.0);
        assert_eq!(missing, 0.0, "share of {line:?} without mesh edges");
    }
    for (p, light) in corners(mesh) {
        let lit = 3.0 / TOWARDS.length();
        assert!(light.y == 0.0 || (light.y - lit).abs() < 1e-5, "{} at {p}", light.y);
    }
}

/// A board that ends at x = 0, a metre above a floor, below a round lamp: the borders of its penumbra are where the lamp's
/// border is seen past its edge.
#[test]
fn mesh_edges_lie_on_the_borders_of_a_round_lamps_penumbra() {
    let half = 0.1_f64;
    let soft_sun = LampShape::Sun { direction: DVec3::Z, angle: 2.0 * half, irradiance_rgb: [3.0; 3] };
    let round = |faces_receiver: bool| LampShape::Point {
        position: ABOVE,
        radius: 0.3,
        faces_receiver,
        intensity_rgb: [20.0; 3],
        cone: None,
    };
    // Past the edge, 2 m below its middle, the sphere is as wide as its tangents.
    let sphere = (0.3_f64 / 2.0).asin().tan();
    for (shape, border) in [(soft_sun, half.tan()), (round(true), 0.15), (round(false), sphere)] {
        let mut scene = Scene::default();
        let black = scene.material(0.0, 0.0);
        scene.object("floor", Shape::square(DVec3::ZERO, 3.0), black);
        let board = Shape::quad(DVec3::new(-9.0, -9.0, 1.0), DVec3::X * 9.0, DVec3::Y * 18.0);
        scene.blocker("board", board, black);
        scene.input.lamps.push(LampInput::new("lamp", shape.clone()));
        for method in WITH_LINES {
            let bake = scene.bake(&lines_only(method));
            assert_sound(&scene.input, &bake);
            for x in [-border, border] {
                let line = [DVec3::new(x, -3.0, 0.0), DVec3::new(x, 3.0, 0.0)];
                let missing = uncovered(&bake.meshes[0], line, ON_THE_LINE * 6.0);
                assert_eq!(missing, 0.0, "{method:?}, {shape:?}: share of {line:?} without mesh edges");
            }
        }
    }
}

/// Blender's default sun, half a degree wide: penumbrae of a centimetre.
#[test]
fn a_narrow_penumbra_takes_few_vertices() {
    let scene = |angle: f64| {
        let LampShape::Sun { direction, irradiance_rgb, .. } = sun() else { unreachable!("it is a sun") };
        floating_cube(LampShape::Sun { direction, angle, irradiance_rgb })
    };
    let bake = scene(0.00918).bake(&arriving(adaptive()));
    assert_sound(&scene(0.00918).input, &bake);
    let shadow = sun_shadow();
    for (p, light) in corners(&bake.meshes[0]) {
        let beside = outside(&shadow, p);
        if beside.abs() > 0.02 {
            let expected = if beside > 0.0 { 3.0 / TOWARDS.length() } else { 0.0 };
            assert!((light.y - expected).abs() < 0.01 * 3.0, "{} instead of {expected} at {p}", light.y);
        }
    }
    let vertices = bake.meshes[0].positions.len();
    println!("{vertices} vertices, {} lines", bake.report.result.lines.drawn);
    assert!(vertices < 400, "{vertices}");
}

#[test]
fn edges_on_the_border_of_a_sharp_shadow_say_so() {
    for method in WITH_LINES {
        let bake = floating_cube(point()).bake(&lines_only(method));
        let floor = &bake.meshes[0];
        let on_border = |p: DVec3| (p.truncate().abs().max_element() - 1.0).abs() < 6.0 * ON_THE_LINE;
        let mut sharp = 0;
        for (triangle, kinds) in floor.triangles.iter().zip(&floor.edge_line) {
            for (k, &kind) in kinds.iter().enumerate() {
                let ends = [triangle[k], triangle[(k + 1) % 3]].map(|v| floor.positions[v as usize]);
                let middle = 0.5 * (ends[0] + ends[1]);
                let lies_there = ends.into_iter().chain([middle]).all(on_border);
                assert_eq!(kind == 2, lies_there, "{method:?}: {ends:?} is {kind}");
                sharp += i32::from(kind == 2);
            }
        }
        assert!(sharp >= 8, "{method:?}");
    }
}
