//! Where things touch: light jumps across the line of contact, and every corner has the value of its own side.
//!
//! Nothing is refined beyond the lines, except where that is said.

mod common;

use std::collections::HashMap;

use antumbra::settings::{Method, Settings};
use antumbra::visibility::{Receiver, unoccluded_form_factor};
use antumbra::weld::BakedMesh;
use common::baked::{assert_sound, corners, light};
use common::lines::{outline, uncovered};
use common::rectangle;
use common::scene::{Scene, arriving, by, lamp};
use common::shape::Shape;
use glam::DVec3;

const WITH_LINES: [Method; 2] = [Method::Adm, Method::Dm];

/// Mesh edges lie this near to contacts, metres: a millionth of a floor of 6 m.
const ON_THE_LINE: f64 = 6e-6;

/// A tolerance at which every contact is worth its place, and pieces of half a metre.
fn fine(method: Method) -> Settings {
    arriving(Settings { tolerance: 1e-3, element_size: 0.5, max_level: 0, ..by(method) })
}

/// A floor, 6 m wide, at z = 0.
fn floor(reflectance: f64) -> Scene {
    let mut scene = Scene::default();
    let material = scene.material(reflectance, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 3.0), material);
    scene
}

fn assert_covered(mesh: &BakedMesh, lines: &[[DVec3; 2]], what: &str) {
    for &[from, to] in lines {
        let open = uncovered(mesh, [from, to], ON_THE_LINE);
        assert_eq!(open, 0.0, "{what}: share of {from} to {to} without mesh edges");
    }
}

/// The mesh's triangles: their corners, and the green light there.
fn triangles(mesh: &BakedMesh) -> impl Iterator<Item = ([DVec3; 3], [f64; 3])> {
    (mesh.triangles.iter().zip(&mesh.corner_radiance))
        .map(|(t, colours)| (t.map(|v| mesh.positions[v as usize]), colours.map(|c| light(c).y)))
}

fn centroid(corners: [DVec3; 3]) -> DVec3 {
    (corners[0] + corners[1] + corners[2]) / 3.0
}

/// What is under a box of half size 0.5 that stands at the origin. Lines that coincide are rounded to the grid each in its
/// own way, so slivers of a cell or two may lie beside the contact.
fn is_covered(corners: [DVec3; 3]) -> bool {
    centroid(corners).truncate().abs().max_element() < 0.5 - ON_THE_LINE
}

#[test]
fn a_cube_on_a_floor_has_its_outline_in_the_mesh_and_is_dark_below() {
    for method in WITH_LINES {
        let mut scene = floor(0.0);
        scene.object("cube", Shape::cuboid(DVec3::Z * 0.5, DVec3::splat(0.5)), 0);
        scene.light(&lamp(DVec3::new(0.3, 0.2, 4.0), 0.5), 10.0);
        let bake = scene.bake(&fine(method));
        assert_sound(&scene.input, &bake);
        let floor = &bake.meshes[0];
        assert_covered(floor, &outline([[-0.5; 2], [0.5; 2]], 0.0), &format!("{method:?}"));
        let mut dark = 0;
        for (_, light) in triangles(floor).filter(|(corners, _)| is_covered(*corners)) {
            assert_eq!(light, [0.0; 3], "{method:?}: under the cube");
            dark += 1;
        }
        assert!(dark > 0);
        // Corners along one edge, two colours
        let mut colours: HashMap<u32, Vec<f64>> = HashMap::new();
        for (triangle, values) in floor.triangles.iter().zip(&floor.corner_radiance) {
            for (&vertex, &value) in triangle.iter().zip(values) {
                colours.entry(vertex).or_default().push(light(value).y);
            }
        }
        let on_lit_edge = |p: DVec3| (p.x - 0.5).abs() < ON_THE_LINE && p.y.abs() < 0.49;
        let mut seen = 0;
        for (&vertex, colours) in colours.iter().filter(|(v, _)| on_lit_edge(floor.positions[**v as usize])) {
            let at = floor.positions[vertex as usize];
            assert!(
                colours.contains(&0.0) && colours.iter().any(|&c| c > 0.01),
                "{method:?}, {at}: {colours:?}"
            );
            seen += 1;
        }
        assert!(seen > 0, "{method:?}: no vertex on the contact");
    }
}

/// A metre wide and a tenth high, on the floor; its edges below are cut into `cells`.
fn slab(cells: u32) -> Shape {
    let [low, high] = [DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 0.1)];
    let (x, y, up) = (DVec3::X, DVec3::Y, 0.1 * DVec3::Z);
    Shape::grid(low, y, x, [cells; 2])
        .and(&Shape::grid(low, x, up, [cells, 1]))
        .and(&Shape::grid(low, up, y, [1, cells]))
        .and(&Shape::quad(high, -x, -y))
        .and(&Shape::grid(high, -up, -x, [1, cells]))
        .and(&Shape::grid(high, -y, -up, [cells, 1]))
}

/// What lies on the floor parts light from darkness along its outline, however many faces it is made of, and however little the
/// edge of each is worth.
#[test]
fn a_slab_of_many_small_faces_has_the_outline_of_one_large_face() {
    for method in WITH_LINES {
        let drawn = [1, 12].map(|cells| {
            let mut scene = floor(0.0);
            scene.object("slab", slab(cells), 0);
            scene.light(&lamp(DVec3::new(0.3, 0.2, 4.0), 0.5), 10.0);
            let bake = scene.bake(&arriving(Settings { tolerance: 0.05, max_level: 0, ..by(method) }));
            assert_sound(&scene.input, &bake);
            let floor = &bake.meshes[0];
            assert_covered(floor, &outline([[-0.5; 2], [0.5; 2]], 0.0), &format!("{method:?}, {cells}"));
            for (corners, light) in triangles(floor) {
                if is_covered(corners) {
                    assert_eq!(light, [0.0; 3], "{method:?}, {cells}: under the slab");
                } else if corners.iter().all(|p| p.x > 0.5 - ON_THE_LINE) {
                    assert!(light.iter().all(|&light| light > 0.01), "{method:?}, {cells}: beside it");
                }
            }
            bake.report.result.lines.drawn
        });
        // Of shadows some more: one side alone would be cut into twelve.
        assert!(drawn[1] < drawn[0] + 12, "{method:?}: {drawn:?}");
    }
}

/// Under a closed box no light comes from anywhere, however bright the room is.
#[test]
fn the_floor_under_a_box_is_exactly_dark_in_a_bright_room() {
    for method in WITH_LINES {
        let mut scene = Scene::default();
        let white = scene.material(0.8, 0.0);
        scene.object("room", Shape::room(DVec3::splat(4.0)).map(|p| p - DVec3::new(2.0, 2.0, 0.0)), white);
        scene.object("cube", Shape::cuboid(DVec3::Z * 0.5, DVec3::splat(0.5)), white);
        scene.light(&lamp(DVec3::new(0.3, 0.2, 3.9), 0.5), 10.0);
        let bake = scene.bake(&arriving(by(method)));
        assert_sound(&scene.input, &bake);
        let room = &bake.meshes[0];
        let on_floor = |corners: [DVec3; 3]| corners.iter().all(|p| p.z == 0.0);
        let covered: Vec<f64> = (triangles(room))
            .filter(|(corners, _)| on_floor(*corners) && is_covered(*corners))
            .flat_map(|(_, light)| light)
            .collect();
        let brightest = covered.iter().copied().fold(0.0, f64::max);
        let lit = covered.iter().filter(|&&light| light > 0.0).count();
        println!(
            "{method:?}: {lit} of {} covered corners are lit, up to {brightest:.3e} W/m²",
            covered.len()
        );
        // Sums over hundreds of patches, most of them exactly 0, are rounded.
        assert!(!covered.is_empty() && brightest < 1e-15, "{method:?}");
    }
}

/// At the foot of a wall half of the light is hidden: what lies beyond the wall's plane.
#[test]
fn corners_on_a_contact_have_the_limit_from_their_own_side() {
    let center = DVec3::new(0.3, 0.2, 4.0);
    for method in WITH_LINES {
        let mut scene = floor(0.0);
        scene.blocker("cube", Shape::cuboid(DVec3::Z * 0.5, DVec3::splat(0.5)), 0);
        scene.light(&lamp(center, 0.5), 10.0);
        let bake = scene.bake(&fine(method));
        let (mut worst, mut seen) = (0.0_f64, 0);
        for (corners, values) in triangles(&bake.meshes[0]).filter(|(corners, _)| !is_covered(*corners)) {
            for (p, value) in corners.into_iter().zip(values) {
                if (p.x - 0.5).abs() < ON_THE_LINE && p.y.abs() < 0.499 {
                    // Where the vertex is rounded off the contact, the lamp 4 m up is hidden to four times as far on
                    // the other side by the top of the wall 1 m up.
                    let hidden = p.x + 4.0 * (0.5 - p.x);
                    let visible =
                        rectangle(DVec3::new(hidden, -0.3, 4.0), DVec3::Y, DVec3::X * (0.8 - hidden));
                    let limit = 10.0 * unoccluded_form_factor(&Receiver::new(p, DVec3::Z), &visible);
                    worst = worst.max((value / limit - 1.0).abs());
                    seen += 1;
                }
            }
        }
        println!("{method:?}: {seen} corners at the foot of the wall, off by {worst:.2e} of the limit");
        // Half an f32 epsilon; before that it is 1e-9, which `display/tests.rs` asserts.
        assert!(seen > 4 && worst <= COLOUR, "{method:?}: {worst:e} of the limit");
    }
}

/// Rounding of a colour to f32, relative.
const COLOUR: f64 = 0.5 * f32::EPSILON as f64 + 1e-9;

/// A small box half sunk into the top of a big one.
#[test]
fn boxes_that_intersect_meet_along_mesh_edges() {
    for method in WITH_LINES {
        let mut scene = floor(0.0);
        scene.object("big", Shape::cuboid(DVec3::Z, DVec3::ONE), 0);
        scene.object("small", Shape::cuboid(DVec3::new(0.1, 0.2, 2.0), DVec3::splat(0.3)), 0);
        scene.light(&lamp(DVec3::new(0.3, 0.2, 5.0), 0.5), 10.0);
        let bake = scene.bake(&fine(method));
        assert_sound(&scene.input, &bake);
        let what = format!("{method:?}");
        // On the big box's top, and on the small one's sides
        let lines = outline([[-0.2, -0.1], [0.4, 0.5]], 2.0);
        assert_covered(&bake.meshes[1], &lines, &what);
        assert_covered(&bake.meshes[2], &lines, &what);
        let (mut hidden, mut lit) = (0, 0);
        for (corners, light) in
            triangles(&bake.meshes[1]).filter(|(corners, _)| corners.iter().all(|p| p.z == 2.0))
        {
            let p = centroid(corners);
            if p.x > -0.2 && p.x < 0.4 && p.y > -0.1 && p.y < 0.5 {
                assert_eq!(light, [0.0; 3], "{what}: inside the small box, around {p}");
                hidden += 1;
            } else {
                lit += usize::from(light.iter().any(|&l| l > 0.1));
            }
        }
        for (corners, light) in
            triangles(&bake.meshes[2]).filter(|(corners, _)| corners.iter().all(|p| p.z < 2.0 + 1e-5))
        {
            assert_eq!(light, [0.0; 3], "{what}: inside the big box, around {}", centroid(corners));
        }
        assert!(hidden > 0 && lit > 0, "{what}: {hidden} hidden, {lit} lit");
    }
}

/// A board that sticks through a wall: each has the other's cross-section in its mesh.
#[test]
fn a_board_through_a_wall_meets_it_along_mesh_edges() {
    for method in WITH_LINES {
        let mut scene = Scene::default();
        let black = scene.material(0.0, 0.0);
        let wall = Shape::quad(DVec3::new(0.0, -2.0, 0.0), DVec3::Y * 4.0, DVec3::Z * 3.0);
        scene.object("wall", wall, black);
        scene.object("board", Shape::cuboid(DVec3::new(0.0, 0.2, 1.0), DVec3::new(0.8, 0.5, 0.05)), black);
        scene.light(&lamp(DVec3::new(1.5, 0.0, 3.0), 0.4), 10.0);
        let bake = scene.bake(&fine(method));
        assert_sound(&scene.input, &bake);
        let what = format!("{method:?}");
        let corners =
            [[-0.3, 0.95], [0.7, 0.95], [0.7, 1.05], [-0.3, 1.05]].map(|[y, z]| DVec3::new(0.0, y, z));
        let section: [[DVec3; 2]; 4] = std::array::from_fn(|k| [corners[k], corners[(k + 1) % 4]]);
        assert_covered(&bake.meshes[0], &section, &what);
        assert_covered(&bake.meshes[1], &section, &what);
        // Behind the wall the board is dark to the contact; before it, its top is lit from there on.
        let (mut dark, mut lit) = (0, 0);
        for (corners, light) in triangles(&bake.meshes[1]) {
            let p = centroid(corners);
            if p.x < 0.0 {
                assert_eq!(light, [0.0; 3], "{what}: behind the wall, around {p}");
                dark += 1;
            } else if corners.iter().all(|c| (c.z - 1.05).abs() < 1e-12) {
                assert!(
                    light.iter().all(|&l| l > 0.01),
                    "{what}: in front of the wall, around {p}: {light:?}"
                );
                lit += 1;
            }
        }
        assert!(dark > 0 && lit > 0, "{what}: {dark} dark, {lit} lit");
    }
}

/// Refinement may cut pieces beside a contact as it likes: no light passes under the wall.
#[test]
fn refinement_lets_no_light_under_a_box() {
    for method in WITH_LINES {
        let mut scene = floor(0.0);
        scene.blocker("cube", Shape::cuboid(DVec3::Z * 0.5, DVec3::splat(0.5)), 0);
        scene.light(&lamp(DVec3::new(0.3, 0.2, 4.0), 0.5), 10.0);
        scene.light(&lamp(DVec3::new(-2.0, 1.2, 1.0), 0.2), 10.0);
        let bake = scene.bake(&arriving(Settings { tolerance: 3e-3, ..by(method) }));
        assert_sound(&scene.input, &bake);
        for (corners, light) in triangles(&bake.meshes[0]).filter(|(corners, _)| is_covered(*corners)) {
            assert_eq!(light, [0.0; 3], "{method:?}: around {}", centroid(corners));
        }
        assert!(corners(&bake.meshes[0]).any(|(_, light)| light.y > 0.1));
    }
}

#[test]
fn edges_say_which_line_they_lie_on() {
    for method in WITH_LINES {
        let mut scene = floor(0.0);
        scene.object("cube", Shape::cuboid(DVec3::Z * 0.5, DVec3::splat(0.5)), 0);
        scene.light(&lamp(DVec3::new(0.3, 0.2, 4.0), 0.5), 10.0);
        let bake = scene.bake(&fine(method));
        let floor = &bake.meshes[0];
        let on_outline = |p: DVec3| (p.truncate().abs().max_element() - 0.5).abs() < ON_THE_LINE;
        let mut counts = [0; 4];
        for (triangle, kinds) in floor.triangles.iter().zip(&floor.edge_line) {
            for (k, &kind) in kinds.iter().enumerate() {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]].map(|v| floor.positions[v as usize]);
                counts[kind as usize] += 1;
                if kind == 3 {
                    assert!(on_outline(a) && on_outline(b), "{method:?}: a contact from {a} to {b}");
                }
            }
        }
        // Both sides of the contact know of it; the light is not sharp, and its shadow has a penumbra.
        assert!(counts[3] >= 8 && counts[1] >= 8, "{method:?}: {counts:?}");
        assert_eq!(counts[2], 0);
    }
}

/// A rod of 15 mm goes through a wall of 30 mm in the middle of a room: within the wall it is dark, however short the lines are
/// that part this from the rest.
#[test]
fn a_rod_is_dark_within_the_wall_that_it_goes_through() {
    let mut scene = floor(0.0);
    scene.object("rod", Shape::cuboid(DVec3::Z, DVec3::new(0.55, 0.0075, 0.0075)), 0);
    scene.object("wall", Shape::cuboid(DVec3::new(0.1, 0.0, 1.0), DVec3::new(0.015, 0.1, 0.1)), 0);
    scene.light(&lamp(DVec3::new(0.3, 0.2, 3.0), 0.5), 10.0);
    let bake = scene.bake(&arriving(Settings { tolerance: 0.04, ..by(Method::Adm) }));
    let rod = &bake.meshes[1];
    let top = |x: f64| common::baked::light_at(rod, DVec3::new(x, 0.001, 1.0075)).expect("there is a rod").y;
    let beside = top(0.0);
    for x in [0.087, 0.1, 0.113] {
        assert!(top(x) < 1e-3 * beside, "{} at {x}, {beside} beside", top(x));
    }
}
