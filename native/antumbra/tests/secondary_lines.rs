//! Shadows in the light of a surface that is lit itself: lines where that light is strong, none where it is weak.
//!
//! A lamp shines up at a white card and sends nothing to the floor; a board between card and floor throws a penumbra
//! whose borders are known by similar triangles.

mod common;

use antumbra::settings::{Method, Settings};
use common::baked::assert_sound;
use common::lines::uncovered;
use common::scene::{Scene, arriving, by, lamp};
use common::shape::Shape;
use glam::DVec3;

/// Mesh edges lie this near to the lines, metres: a millionth of the floor.
const ON_THE_LINE: f64 = 6e-6;

/// A floor, 6 m wide; a board at z = 1 that ends at x = 0 and whose other borders throw no shadow on the floor; a card at
/// z = 4 from x = -0.2 to 0.8, and a lamp below it that shines up.
///
/// `pieces`: rows and columns of quadrilaterals that the card is made of.
fn card_over_a_half_plane(reflectance: f64, pieces: u32) -> Scene {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    let card = scene.material(reflectance, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 3.0), black);
    let board = Shape::quad(DVec3::new(-9.0, -9.0, 1.0), DVec3::X * 9.0, DVec3::Y * 18.0);
    scene.blocker("board", board, black);
    let corner = DVec3::new(-0.2, -0.5, 4.0);
    scene.blocker("card", Shape::grid(corner, DVec3::Y, DVec3::X, [pieces; 2]), card);
    let mut up = lamp(DVec3::new(0.3, 0.0, 3.5), 0.4);
    up.reverse();
    scene.light(&up, 10.0);
    scene
}

/// A lamp that the floor sees past the board: 1 m wide, beside and a little above the card.
fn with_a_lamp_for_the_floor(mut scene: Scene, exitance: f64) -> Scene {
    scene.light(&lamp(DVec3::new(1.3, 0.2, 4.2), 0.5), exitance);
    scene
}

/// Where the card's edges at x = 0.8 and -0.2 throw the board's edge, three times as far above it as it is above the
/// floor.
fn borders_of_the_penumbra() -> [[DVec3; 2]; 2] {
    [-0.8 / 3.0, 0.2 / 3.0].map(|x| [DVec3::new(x, -3.0, 0.0), DVec3::new(x, 3.0, 0.0)])
}

/// The lines of faces and nothing else.
fn lines_only(method: Method) -> Settings {
    arriving(Settings { tolerance: 1e-3, element_size: 1e4, max_level: 0, ..by(method) })
}

/// Shares of the two borders without mesh edges.
fn open(scene: &Scene, settings: &Settings) -> [f64; 2] {
    let bake = scene.bake(settings);
    assert_sound(&scene.input, &bake);
    println!("{:?}: {:?}", settings.method, bake.report.result.lines);
    borders_of_the_penumbra().map(|line| uncovered(&bake.meshes[0], line, ON_THE_LINE))
}

#[test]
fn a_lit_card_draws_the_borders_of_its_penumbra() {
    for method in [Method::Adm, Method::Dm] {
        assert_eq!(open(&card_over_a_half_plane(0.8, 1), &lines_only(method)), [0.0; 2], "{method:?}");
    }
}

/// What the card is made of does not matter: inner borders of a flat surface throw no lines.
#[test]
fn a_card_of_many_pieces_draws_the_same_lines() {
    let count = |pieces| {
        let scene = card_over_a_half_plane(0.8, pieces);
        assert_eq!(open(&scene, &lines_only(Method::Dm)), [0.0; 2], "{pieces} pieces");
        scene.bake(&lines_only(Method::Dm)).report.result.lines.drawn
    };
    assert_eq!(count(1), count(4));
}

/// Beside a lamp a dark card, or a white one in weak light, is not worth a line; a bright one is.
#[test]
fn weak_secondary_light_draws_nothing() {
    let settings = arriving(Settings { tolerance: 0.01, element_size: 1e4, max_level: 0, ..by(Method::Adm) });
    let strong = with_a_lamp_for_the_floor(card_over_a_half_plane(0.8, 1), 1.0);
    assert_eq!(open(&strong, &settings), [0.0; 2]);
    let dark = with_a_lamp_for_the_floor(card_over_a_half_plane(0.0005, 1), 1.0);
    assert_eq!(open(&dark, &settings), [1.0; 2]);
    let outshone = with_a_lamp_for_the_floor(card_over_a_half_plane(0.8, 1), 3000.0);
    assert_eq!(open(&outshone, &settings), [1.0; 2]);
    // All of them are lines all the same.
    assert_eq!(open(&dark, &lines_only(Method::Dm)), [0.0; 2]);
}

/// Many faces that all light each other: full discontinuity meshing keeps to its triangles and to its time.
#[test]
fn full_discontinuity_meshing_of_many_reflectors_is_bounded() {
    let mut scene = Scene::default();
    let grey = scene.material(0.6, 0.0);
    scene.object("room", Shape::room(DVec3::splat(4.0)), grey);
    for x in 0..4 {
        for y in 0..4 {
            let place = DVec3::new(0.5 + f64::from(x), 0.5 + f64::from(y), 1.0);
            scene.object("block", Shape::cuboid(place, DVec3::splat(0.2)), grey);
        }
    }
    scene.light(&lamp(DVec3::new(2.0, 2.0, 3.9), 0.5), 10.0);
    let settings =
        Settings { triangle_budget: 3000, time_limit: 2.0, tolerance: 0.1, ..arriving(by(Method::Dm)) };
    let start = std::time::Instant::now();
    let bake = scene.bake(&settings);
    assert_sound(&scene.input, &bake);
    assert!(bake.report.result.triangles <= 3100, "{} triangles", bake.report.result.triangles);
    // What has begun is finished, on a machine that may be busy; without an end this takes minutes.
    assert!(start.elapsed().as_secs_f64() < 30.0, "{:?}", start.elapsed());
}
