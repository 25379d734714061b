//! Scenes with more shadow boundaries than anyone wants: what comes out of the discontinuity methods is still sound.
//!
//! Tolerances are low; budgets and large patches keep it fast.

mod common;

use std::f64::consts::TAU;

use antumbra::scene::{LampInput, LampShape};
use antumbra::settings::{Effort, Method, Settings, Transport};
use antumbra::weld::Bake;
use common::Random;
use common::baked::{all_light, assert_sound, corners};
use common::scene::{Scene, arriving, by, lamp};
use common::shape::Shape;
use glam::{DMat3, DVec3};

/// Triangles that a bake may have.
const BUDGET: usize = 5000;

/// Bakes a scene by both methods and checks what every bake promises; some light must arrive.
fn assert_bakes(scene: &Scene) -> [Bake; 2] {
    [Method::Adm, Method::Dm].map(|method| assert_bakes_by(scene, method))
}

fn assert_bakes_by(scene: &Scene, method: Method) -> Bake {
    let settings =
        Settings { tolerance: 0.003, element_size: 1.0, triangle_budget: BUDGET as u64, ..by(method) };
    let start = std::time::Instant::now();
    let bake = scene.bake(&settings);
    println!("{method:?}: {} triangles in {:.2?}", bake.report.result.triangles, start.elapsed());
    assert_sound(&scene.input, &bake);
    // One step may cut all triangles on an edge.
    assert!(
        bake.report.result.triangles <= BUDGET + 2,
        "{method:?}: {} triangles",
        bake.report.result.triangles
    );
    assert!(all_light(&bake).any(|light| light.y > 0.0), "{method:?}: it is dark");
    bake
}

/// A grey floor, 4 m wide, at z = 0, under a lamp at z = 3.
fn lit_floor() -> Scene {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), grey);
    scene.light(&lamp(DVec3::new(0.3, 0.1, 3.0), 0.3), 20.0);
    scene
}

fn all_of(shapes: impl IntoIterator<Item = Shape>) -> Shape {
    shapes.into_iter().fold(Shape::default(), |all, shape| all.and(&shape))
}

#[test]
fn blinds() {
    let mut scene = lit_floor();
    let slat = |i: u32| {
        let tilt = DMat3::from_rotation_y(0.5);
        let center = DVec3::new(-1.0 + 0.05 * f64::from(i), 0.0, 1.0);
        Shape::cuboid(DVec3::ZERO, DVec3::new(0.02, 1.0, 0.001)).map(|p| center + tilt * p)
    };
    scene.object("blinds", all_of((0..40).map(slat)), 0);
    assert_bakes(&scene);
}

#[test]
fn a_fence() {
    let mut scene = lit_floor();
    let post = |i: u32| {
        let center = DVec3::new(-1.9 + 0.2 * f64::from(i), 0.5, 0.5);
        Shape::cuboid(center, DVec3::new(0.04, 0.02, 0.5))
    };
    let rail = |z: f64| Shape::cuboid(DVec3::new(0.0, 0.53, z), DVec3::new(2.0, 0.01, 0.03));
    scene.object("fence", all_of((0..20).map(post).chain([0.3, 0.7].map(rail))), 0);
    assert_bakes(&scene);
}

#[test]
fn a_spoked_wheel() {
    let mut scene = lit_floor();
    let spoke = |i: u32| {
        let turn = DMat3::from_rotation_z(TAU * f64::from(i) / 64.0);
        Shape::cuboid(DVec3::X * 0.5, DVec3::new(0.45, 0.003, 0.003)).map(|p| DVec3::Z + turn * p)
    };
    scene.object("wheel", all_of((0..64).map(spoke)), 0);
    assert_bakes(&scene);
}

#[test]
fn a_tree_of_random_cards() {
    let mut scene = lit_floor();
    let mut random = Random(5);
    let mut card = || {
        let corner = DVec3::Z * 1.2 + 0.6 * random.in_cube();
        let u = 0.15 * random.direction();
        Shape::quad(corner, u, 0.6 * u.any_orthogonal_vector())
    };
    let cards: Vec<Shape> = (0..200).map(|_| card()).collect();
    scene.object("tree", all_of(cards), 0);
    assert_bakes(&scene);
}

#[test]
fn boxes_that_intersect() {
    let mut scene = lit_floor();
    let mut random = Random(6);
    for _ in 0..6 {
        let turn = random.rotation();
        let center = DVec3::Z * 0.4 + 0.5 * random.in_cube();
        scene.object(
            "box",
            Shape::cuboid(DVec3::ZERO, DVec3::new(0.4, 0.25, 0.3)).map(|p| center + turn * p),
            0,
        );
    }
    assert_bakes(&scene);
}

#[test]
fn a_blocker_that_touches_the_light() {
    for z in [2.5, 2.75] {
        // A post up to the lamp's plane, and one through it
        let mut scene = lit_floor();
        scene.object("post", Shape::cuboid(DVec3::new(0.4, 0.2, z), DVec3::new(0.05, 0.05, 0.5)), 0);
        assert_bakes(&scene);
    }
}

#[test]
fn a_light_through_the_floor() {
    let mut scene = lit_floor();
    let upright = [[0.0, -0.5, -0.5], [0.0, 0.5, -0.5], [0.0, 0.5, 0.5], [0.0, -0.5, 0.5]].map(DVec3::from);
    scene.light(&upright, 10.0);
    scene.object("box", Shape::cuboid(DVec3::new(0.7, 0.1, 0.2), DVec3::splat(0.2)), 0);
    assert_bakes(&scene);
}

/// Two floors in one plane, cut differently.
#[test]
fn coplanar_floors() {
    let mut scene = lit_floor();
    scene.object("rug", Shape::square(DVec3::ZERO, 2.0), 0);
    let turn = DMat3::from_rotation_z(0.3);
    scene.object("mat", Shape::square(DVec3::ZERO, 1.0).map(|p| turn * p), 0);
    scene.object("box", Shape::cuboid(DVec3::new(0.1, 0.2, 0.5), DVec3::splat(0.2)), 0);
    for bake in assert_bakes(&scene) {
        assert!(bake.meshes.iter().all(|mesh| corners(mesh).any(|(_, light)| light.y > 0.1)), "one is dark");
    }
}

#[test]
fn slivers_that_receive_and_block() {
    let mut scene = lit_floor();
    let mut random = Random(8);
    let mut sliver = |width: f64| {
        let a = DVec3::Z + 0.8 * random.in_cube();
        let along = random.direction();
        let positions = vec![a, a + along, a + 0.3 * along + width * along.any_orthonormal_vector()];
        Shape { positions, triangles: vec![[0, 1, 2]], corner_normals: None }
    };
    let widths = [1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10];
    let slivers: Vec<Shape> = (0..18).map(|i| sliver(widths[i % widths.len()])).collect();
    scene.object("slivers", all_of(slivers), 0);
    assert_bakes(&scene);
}

/// Hairs and nothing else, each half a metre long and a hundredth of a millimetre wide: squares of their area are so small
/// that their length was once cut to a thousandth, and each of these in four.
#[test]
fn a_scene_of_nothing_but_hairs_is_not_cut_by_their_length() {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    let hair = |x: f64| Shape::quad(DVec3::X * x, DVec3::X * 1e-5, DVec3::Y * 0.5);
    scene.object("hairs", all_of([0.0, 0.01].map(hair)), grey);
    scene.light(&lamp(DVec3::new(0.0, 0.2, 1.0), 0.2), 20.0);
    let ways = [
        (Method::Adm, Transport::Hierarchical, 20_000),
        (Method::As, Transport::Hierarchical, 20_000),
        // Both sides of patches, which are 20,000 squares or up to four times as many
        (Method::Adm, Transport::Rays, 2 * 80_000),
        (Method::As, Transport::Rays, 2 * 80_000),
    ];
    for (method, transport, most) in ways {
        let bake = scene.bake(&Settings { transport, tolerance: 0.3, verify_points: 0, ..by(method) });
        assert_sound(&scene.input, &bake);
        let elements = bake.report.result.transport.elements;
        println!("{method:?}, {transport:?}: {elements} patches");
        assert!(elements <= most, "{method:?}, {transport:?}: {elements} patches");
        assert!(all_light(&bake).all(|light| light.y > 0.0), "{method:?}: one is dark");
    }
}

/// A needle and nothing else: its sides were halved until they were no longer than squares of their area would be, into 65 thousand
/// pieces, and into eight million when it was a billionth of a millimetre wide.
#[test]
fn a_scene_of_nothing_but_a_needle_is_not_cut_by_its_length() {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    scene.object("needle", Shape::cuboid(DVec3::ZERO, DVec3::new(5e-9, 5e-9, 0.25)), grey);
    scene.light(&lamp(DVec3::new(0.5, 0.0, 1.0), 0.2), 20.0);
    for transport in [Transport::Hierarchical, Transport::Shooting] {
        let settings =
            Settings { transport, tolerance: 0.3, verify_points: 0, max_level: 2, ..by(Method::Dm) };
        let bake = scene.bake(&settings);
        assert_sound(&scene.input, &bake);
        let elements = bake.report.result.transport.elements;
        println!("{transport:?}: {elements} patches");
        assert!(elements <= 40_000, "{transport:?}: {elements} patches");
    }
}

/// The same of triangles: clusters of what is linked are divided by a rule of their own, and took gigabytes.
#[test]
fn a_scene_of_nothing_but_slender_triangles_is_not_cut_by_their_length() {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    let hair = |x: f64| Shape {
        positions: vec![DVec3::X * x, DVec3::X * (x + 1e-5), DVec3::new(x, 0.5, 0.0)],
        triangles: vec![[0, 1, 2]],
        corner_normals: None,
    };
    scene.object("hairs", all_of([0.0, 0.01].map(hair)), grey);
    scene.light(&lamp(DVec3::new(0.0, 0.2, 1.0), 0.2), 20.0);
    for transport in [Transport::Hierarchical, Transport::Shooting, Transport::Rays] {
        let bake = scene.bake(&Settings { transport, tolerance: 0.3, verify_points: 0, ..by(Method::As) });
        assert_sound(&scene.input, &bake);
        let elements = bake.report.result.transport.elements;
        println!("{transport:?}: {elements} patches");
        assert!(elements <= 2 * 80_000, "{transport:?}: {elements} patches");
        assert!(all_light(&bake).all(|light| light.y > 0.0), "{transport:?}: one is dark");
    }
}

/// Strips just above a floor: every patch of it lies half below one, down to a 256th of a patch.
#[test]
fn a_scene_of_nothing_but_crevices_is_cut_so_far_only() {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 0.5), grey);
    let strip = |k: i32| Shape::quad(DVec3::new(-0.5, 0.02 * f64::from(k), 1e-4), DVec3::X, DVec3::Y * 0.01);
    scene.object("strips", all_of((-25..25).map(strip)), grey);
    scene.light(&lamp(DVec3::new(0.0, 0.2, 1.0), 0.2), 20.0);
    let effort = Effort { patches: 200.0, rays: 1e4, ..Effort::default() };
    let bake = scene.bake(&Settings {
        transport: Transport::Rays,
        tolerance: 0.3,
        verify_points: 0,
        effort,
        ..by(Method::As)
    });
    assert_sound(&scene.input, &bake);
    let elements = bake.report.result.transport.elements;
    println!("{elements} sides of patches");
    // Squares, and 64 times as many again
    assert!(elements <= 2 * (4 + 64) * 200, "{elements} patches");
}

/// White boxes turned inside out, all but one of whose walls overlap: each of two that do reflects what falls on either, and by
/// shooting the light between them grew until it was infinite.
#[test]
fn light_between_white_walls_that_overlap_does_not_grow() {
    let turned_box = |from: DVec3, to: DVec3| Shape::cuboid(0.5 * (from + to), 0.5 * (to - from));
    let mut scene = Scene::default();
    let (white, grey) = (scene.material(1.0, 0.0), scene.material(0.5, 0.0));
    let corner = DVec3::new(0.5, 0.5, 0.0);
    scene.object("inner", turned_box(corner, DVec3::new(-1.0, -0.5, -1.0)), white);
    for triangle in [4, 7, 9, 10] {
        scene.input.objects[0].triangle_materials[triangle] = grey;
    }
    scene.blocker("outer", turned_box(corner, DVec3::NEG_ONE), white);
    let sun = LampShape::Sun { direction: DVec3::NEG_ONE, angle: 0.0, irradiance_rgb: [1.0; 3] };
    scene.input.lamps.push(LampInput::new("sun", sun));
    for transport in [Transport::Shooting, Transport::Hierarchical, Transport::Rays] {
        let bake = scene.bake(&Settings {
            transport,
            tolerance: 1.0,
            element_size: 1.0,
            max_level: 1,
            triangle_budget: 40,
            verify_points: 0,
            effort: Effort { patches: 30.0, rays: 1e3, links: 100 },
            ..arriving(by(Method::Dm))
        });
        assert_sound(&scene.input, &bake);
        let most = all_light(&bake).map(DVec3::max_element).fold(0.0, f64::max);
        println!("{transport:?}: at most {most}");
        assert!(most < 1e-6, "{transport:?}: {most} W/m² where no light gets in");
    }
}

/// What is baked shows no light at all: no error relative to that is small enough, and all links there can be were once made.
#[test]
fn what_shows_no_light_makes_few_links() {
    let mut scene = Scene::default();
    let (black, grey) = (scene.material(0.0, 0.0), scene.material(0.5, 0.0));
    scene.object("black", Shape::square(DVec3::Z, 1.0), black);
    scene.blocker("floor", Shape::square(DVec3::ZERO, 2.0), grey);
    scene.blocker("wall", Shape::quad(DVec3::new(-2.0, -2.0, 0.0), DVec3::Y * 4.0, DVec3::Z * 2.0), grey);
    scene.light(&lamp(DVec3::new(0.3, 0.1, 3.0), 0.3), 20.0);
    let bake = scene.bake(&by(Method::Adm));
    assert!(all_light(&bake).all(|light| light == DVec3::ZERO));
    let links = bake.report.result.transport.links;
    assert!(links < 100_000, "{links} links");
}

/// A soup of triangles that share vertices, slivers among them, over a floor.
fn soup(seed: u64) -> Scene {
    let mut random = Random(seed);
    let mut scene = lit_floor();
    let positions: Vec<DVec3> = (0..12).map(|_| DVec3::Z + random.in_cube()).collect();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    while triangles.len() < 10 {
        let mut t: [u32; 3] = std::array::from_fn(|_| random.below(12) as u32);
        let turn = random.below(3);
        t.sort_unstable();
        // Of two triangles with the same corners, every edge would count twice.
        let known = |other: &[u32; 3]| {
            let mut other = *other;
            other.sort_unstable();
            other == t
        };
        if t[0] < t[1] && t[1] < t[2] && !triangles.iter().any(known) {
            t.rotate_left(turn);
            triangles.push(t);
        }
    }
    scene.object("soup", Shape { positions, triangles, corner_normals: None }, 0);
    scene
}

#[test]
fn some_soups() {
    for seed in 0..5 {
        assert_bakes(&soup(seed));
    }
}

#[test]
#[ignore = "long: 200 soups by two methods"]
fn many_soups() {
    for seed in 0..200 {
        println!("soup {seed}");
        assert_bakes(&soup(seed));
    }
}
