//! Shadow boundaries in the mesh: methods ADM and DM put mesh edges where light changes its slope.
//!
//! The boundaries are known by similar triangles. Tolerances are small where lines are looked for, so that these lines
//! are worth their place, and nothing is refined beyond the lines.

mod common;

use antumbra::settings::{Method, Settings};
use antumbra::visibility::{ConvexPolygon, Receiver};
use common::baked::{all_light, assert_sound, corners, light_over};
use common::lines::{outline, uncovered};
use common::scene::{Scene, arriving, by, lamp};
use common::shape::Shape;
use common::{Random, polygon, visible};
use glam::{DMat4, DVec3};

const WITH_LINES: [Method; 2] = [Method::Adm, Method::Dm];

/// Mesh edges lie this near to the lines, relative to the receiver. Its grid is 2^26 cells wide.
const ON_THE_LINE: f64 = 1e-6;

/// The lines of faces and nothing else: a tolerance at which every line below is worth its place, and no refinement.
fn lines_only(method: Method) -> Settings {
    arriving(Settings { tolerance: 1e-3, element_size: 1e4, max_level: 0, ..by(method) })
}

/// A black floor, 6 m wide, at z = 0.
fn black_floor() -> Scene {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 3.0), black);
    scene
}

/// A board that ends at x = 0, at z = 1, so large that the rest of its border throws no shadow on the floor; a light
/// at z = 4 from x = -0.2 to 0.8.
fn half_plane() -> Scene {
    let mut scene = black_floor();
    let board = Shape::quad(DVec3::new(-9.0, -9.0, 1.0), DVec3::X * 9.0, DVec3::Y * 18.0);
    scene.blocker("board", board, 0);
    scene.light(&lamp(DVec3::new(0.3, 0.0, 4.0), 0.5), 10.0);
    scene
}

/// A cube of side 1 with its bottom at z = 0.5, under a square light of side 1 at z = 4.
fn floating_cube() -> Scene {
    let mut scene = black_floor();
    scene.blocker("cube", Shape::cuboid(DVec3::Z, DVec3::splat(0.5)), 0);
    scene.light(&lamp(DVec3::Z * 4.0, 0.5), 10.0);
    scene
}

/// Where the light's edges at x = 0.8 and -0.2 throw the board's edge, three times as far above it as it is above the
/// floor.
fn half_plane_lines() -> Vec<[DVec3; 2]> {
    [-0.8 / 3.0, 0.2 / 3.0].map(|x| [DVec3::new(x, -3.0, 0.0), DVec3::new(x, 3.0, 0.0)]).to_vec()
}

/// Outer border of the penumbra: the far edges of the light throw the cube's top edges 0.6 m out. Of the umbra: the
/// light is as wide as the cube.
fn floating_cube_lines() -> Vec<[DVec3; 2]> {
    [1.1, 0.5].into_iter().flat_map(|half| outline([[-half; 2], [half; 2]], 0.0)).collect()
}

fn assert_lines(scene: &Scene, lines: &[[DVec3; 2]], what: &str) {
    for method in WITH_LINES {
        let bake = scene.bake(&lines_only(method));
        assert_sound(&scene.input, &bake);
        let floor = &bake.meshes[0];
        for &[from, to] in lines {
            let open = uncovered(floor, [from, to], 6.0 * ON_THE_LINE);
            assert_eq!(open, 0.0, "{what}, {method:?}: share of {from} to {to} without mesh edges");
        }
        println!("{what}, {method:?}: {} triangles", floor.triangles.len());
    }
}

#[test]
fn behind_a_half_plane_mesh_edges_lie_on_both_borders_of_the_penumbra() {
    assert_lines(&half_plane(), &half_plane_lines(), "half-plane");
}

#[test]
fn under_a_cube_mesh_edges_lie_on_the_borders_of_umbra_and_penumbra() {
    assert_lines(&floating_cube(), &floating_cube_lines(), "cube");
}

/// Shadows are central projections, which affine maps of the whole scene keep.
#[test]
fn shadow_lines_move_with_the_scene() {
    let turned = DMat4::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    let moved = DMat4::from_translation(DVec3::new(30.0, -20.0, 10.0)) * turned;
    let sheared = DMat4::from_cols_array(&[
        1.0, 0.2, 0.0, 0.0, 0.1, 0.7, 0.3, 0.0, -0.3, 0.0, 1.2, 0.0, 0.0, 0.0, 0.0, 1.0,
    ]);
    for (what, place) in [
        ("large", moved * DMat4::from_scale(DVec3::splat(37.0))),
        ("small", moved * DMat4::from_scale(DVec3::splat(0.01))),
        ("sheared", turned * sheared),
    ] {
        assert_lines(&half_plane().placed(place), &half_plane_lines(), what);
        assert_lines(&floating_cube().placed(place), &floating_cube_lines(), what);
    }
}

/// A big cube under a small light; the full shadow is 0.74 m to each side, thrown by its top.
#[test]
fn full_umbra_is_exactly_dark() {
    for method in WITH_LINES {
        let mut scene = black_floor();
        scene.blocker("cube", Shape::cuboid(DVec3::Z, DVec3::splat(0.5)), 0);
        scene.light(&lamp(DVec3::Z * 4.0, 0.1), 100.0);
        let bake = scene.bake(&arriving(by(method)));
        assert_sound(&scene.input, &bake);
        let (mut dark, mut dim) = (0, 0);
        for (p, light) in corners(&bake.meshes[0]) {
            if p.truncate().abs().max_element() < 0.74 - 1e-6 {
                assert_eq!(light, DVec3::ZERO, "{method:?}: at {p}");
                dark += 1;
            } else if p.truncate().abs().max_element() > 0.74 + 1e-3 {
                assert!(light.y > 0.0, "{method:?}: at {p}");
                dim += 1;
            }
        }
        // Lines lie around the umbra; nothing need lie in it.
        assert!(dim > 100, "{method:?}: {dark} corners in the umbra, {dim} outside");
        for [x, y] in [[0.0, 0.0], [0.7, 0.7], [-0.73, 0.3], [0.1, -0.735]] {
            assert_eq!(light_over(&bake.meshes[0], x, y), 0.0, "{method:?}: ({x}, {y})");
        }
    }
}

/// A small square below a big light darkens the floor everywhere a little and nowhere wholly.
#[test]
fn an_antumbra_is_smooth_and_symmetrical() {
    let sheet = Shape::square(DVec3::Z, 0.1);
    let outline = lamp(DVec3::Z * 2.0, 1.0);
    let blockers: Vec<ConvexPolygon> =
        (sheet.triangles.iter()).map(|t| polygon(&t.map(|v| sheet.positions[v as usize]))).collect();
    let exact = |x: f64, y: f64| {
        let receiver = Receiver::new(DVec3::new(x, y, 0.0), DVec3::Z);
        visible(&receiver, &polygon(&outline), &blockers).value
    };
    for method in WITH_LINES {
        let mut scene = black_floor();
        scene.blocker("sheet", sheet.clone(), 0);
        scene.light(&outline, 1.0);
        let bake = scene.bake(&arriving(Settings { tolerance: 5e-4, ..by(method) }));
        assert_sound(&scene.input, &bake);
        let floor = &bake.meshes[0];
        let middle = exact(0.0, 0.0);
        let mut random = Random(3);
        let (mut wrong, mut lopsided) = (0.0_f64, 0.0_f64);
        for _ in 0..1000 {
            let [x, y] = [random.between(-1.2, 1.2), random.between(-1.2, 1.2)];
            let light = light_over(floor, x, y);
            wrong = wrong.max((light - exact(x, y)).abs());
            for [x, y] in [[-x, y], [x, -y], [y, x]] {
                lopsided = lopsided.max((light - light_over(floor, x, y)).abs());
            }
        }
        println!(
            "{method:?}: {:.2e} of {middle} off, {:.2e} from its mirror images, {} triangles",
            wrong / middle,
            lopsided / middle,
            floor.triangles.len()
        );
        assert!(wrong <= 1.5e-3 * middle && lopsided <= 3e-3 * middle);
        assert!(all_light(&bake).all(|light| light.y > 0.0), "{method:?}: it is dark somewhere");
    }
}

/// The rms difference between mirrored points of a scene that is its own mirror image is an error, and so small.
#[test]
fn a_symmetric_scene_is_lit_symmetrically() {
    for method in [Method::Adm, Method::Dm, Method::As] {
        let settings = arriving(by(method));
        let bake = floating_cube().bake(&settings);
        let floor = &bake.meshes[0];
        let mut random = Random(4);
        let (mut squares, mut sum) = ([0.0; 3], 0.0);
        let points = 1000;
        for _ in 0..points {
            let [x, y] = [random.between(-3.0, 3.0), random.between(-3.0, 3.0)];
            let light = light_over(floor, x, y);
            sum += light;
            for (square, [x, y]) in squares.iter_mut().zip([[-x, y], [x, -y], [y, x]]) {
                *square += (light - light_over(floor, x, y)).powi(2);
            }
        }
        let points = f64::from(points);
        let errors = squares.map(|square: f64| (square / points).sqrt() / (sum / points));
        println!("{method:?}: {errors:.5?} of the mean light, {} triangles", floor.triangles.len());
        // Two errors that have nothing to do with each other
        assert!(
            errors.iter().all(|&error| error <= 2.0_f64.sqrt() * settings.tolerance),
            "{method:?}: {errors:?}"
        );
    }
}
