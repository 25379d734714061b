//! Meshes as they come out of scanners, converters and hasty hands: what is baked of them is sound all the same.

mod common;

use std::f64::consts::TAU;

use antumbra::settings::{Method, Settings};
use antumbra::weld::Bake;
use common::Random;
use common::baked::{all_light, assert_sound, corners};
use common::scene::{Scene, arriving, by, lamp};
use common::shape::Shape;
use glam::DVec3;

/// A shape over a grey floor below a lamp, by both methods that search for lines and by subdivision.
fn bakes(shape: &Shape) -> [Bake; 3] {
    baked(shape).map(|(scene, bake)| {
        assert_sound(&scene.input, &bake);
        bake
    })
}

fn baked(shape: &Shape) -> [(Scene, Bake); 3] {
    [Method::Adm, Method::Dm, Method::As].map(|method| {
        let mut scene = Scene::default();
        let grey = scene.material(0.5, 0.0);
        scene.object("floor", Shape::square(DVec3::ZERO, 2.0), grey);
        scene.object("shape", shape.clone(), grey);
        scene.light(&lamp(DVec3::new(0.3, 0.1, 3.0), 0.3), 20.0);
        let settings = Settings { tolerance: 0.05, triangle_budget: 4000, verify_points: 0, ..by(method) };
        let bake = scene.bake(&settings);
        assert!(all_light(&bake).all(|light| light.is_finite() && light.min_element() >= 0.0));
        assert!(all_light(&bake).any(|light| light.y > 0.1), "{method:?}: it is dark");
        (scene, bake)
    })
}

/// A disc of triangles that all meet in one point, a hundred times as long as wide, and one in a needle's shape.
#[test]
fn fans_of_thin_triangles() {
    let fan = |count: u32, squash: f64| {
        let rim = (0..count).map(|i| TAU * f64::from(i) / f64::from(count));
        let mut positions = vec![DVec3::Z];
        positions.extend(rim.map(|angle| DVec3::new(0.5 * angle.cos(), squash * 0.5 * angle.sin(), 1.0)));
        let triangles = (0..count).map(|i| [0, 1 + i, 1 + (i + 1) % count]).collect();
        Shape { positions, triangles, corner_normals: None }
    };
    for shape in [fan(300, 1.0), fan(100, 1e-4)] {
        let [adm, ..] = bakes(&shape);
        assert!(corners(&adm.meshes[1]).all(|(_, light)| light.y > 0.1), "a part of it is dark");
    }
}

/// Two floors side by side, one cut where the other is not: a T-junction at every other vertex.
#[test]
fn t_junctions_leak_no_light() {
    let coarse = Shape::grid(DVec3::new(-0.5, -0.5, 1.0), DVec3::X * 0.5, DVec3::Y, [1, 4]);
    let fine = Shape::grid(DVec3::new(0.0, -0.5, 1.0), DVec3::X * 0.5, DVec3::Y, [1, 8]);
    let whole = Shape::grid(DVec3::new(-0.5, -0.5, 1.0), DVec3::X, DVec3::Y, [1, 1]);
    let below = |shape: &Shape| -> f64 {
        let mut scene = Scene::default();
        let black = scene.material(0.0, 0.0);
        // In full shadow, whatever side of the seam
        scene.object("floor", Shape::square(DVec3::Z * 0.9, 0.3), black);
        scene.blocker("sheet", shape.clone(), black);
        scene.light(&lamp(DVec3::Z * 3.0, 0.3), 20.0);
        let bake = scene.bake(&arriving(by(Method::Adm)));
        assert_sound(&scene.input, &bake);
        all_light(&bake).map(|light| light.y).fold(0.0, f64::max)
    };
    assert_eq!(below(&whole), 0.0);
    assert_eq!(below(&coarse.clone().and(&fine)), 0.0);
    bakes(&coarse.and(&fine));
}

/// One mesh that runs through itself, a self-crossing band.
#[test]
fn meshes_that_intersect_themselves() {
    let mut random = Random(3);
    let mut crumpled = Shape::grid(DVec3::new(-0.5, -0.5, 1.0), DVec3::X, DVec3::Y, [3, 3]);
    crumpled.positions.iter_mut().for_each(|p| *p += 0.3 * random.in_cube());
    bakes(&crumpled);
    let two = Shape::cuboid(DVec3::Z, DVec3::new(0.5, 0.2, 0.2));
    bakes(&two.and(&Shape::cuboid(DVec3::new(0.1, 0.0, 1.1), DVec3::new(0.1, 0.5, 0.1))));
}

/// Faces of no area between good ones: points and needles.
#[test]
fn faces_without_area_between_good_ones() {
    let mut shape = Shape::cuboid(DVec3::Z, DVec3::splat(0.3));
    let first = shape.positions.len() as u32;
    let (a, b) = (shape.positions[0], shape.positions[1]);
    shape.positions.extend([a.lerp(b, 0.3), a.lerp(b, 0.7), a, a]);
    shape.triangles.extend([[0, first, 1], [first, first + 1, 1], [0, first + 2, first + 3]]);
    // An edge along which such a face lies has more faces than its source says
    let [(_, adm), ..] = baked(&shape);
    assert_eq!(adm.meshes[1].source_triangle.iter().filter(|&&t| t >= 12).count(), 3, "they were lost");
}

/// Walls of two sheets, one face inwards and one outwards, from a micrometre apart to none at all.
#[test]
fn doubled_walls() {
    for gap in [1e-3, 1e-6, 1e-9, 0.0] {
        let outside = Shape::cuboid(DVec3::Z, DVec3::splat(0.4));
        let inside = Shape::cuboid(DVec3::Z, DVec3::splat(0.4 - gap)).inside_out();
        let [adm, ..] = bakes(&outside.and(&inside));
        // The inside gets nothing
        let brightest = |inner: bool| -> f32 {
            let mesh = &adm.meshes[1];
            let of = mesh.source_triangle.iter().map(|&t| (t >= 12) == inner);
            let colours =
                of.zip(&mesh.corner_radiance).filter(|(of, _)| *of).flat_map(|(_, colours)| *colours);
            colours.map(|colour| colour[1]).fold(0.0, f32::max)
        };
        assert!(brightest(false) > 0.1, "{gap}");
        println!("a gap of {gap:e}: inside {:e}", brightest(true));
        assert!(brightest(true) <= 1e-12, "{gap}: light leaks in");
    }
}

/// Half a box, a bottomless one and a Möbius strip, which has one side only.
#[test]
fn open_shells_and_a_strip_of_one_side() {
    let mut open = Shape::cuboid(DVec3::Z, DVec3::splat(0.4));
    open.triangles.drain(2..4);
    bakes(&open);
    open.triangles.truncate(5);
    bakes(&open);
    let count = 24;
    let mut strip = Shape::default();
    for i in 0..count {
        let angle = TAU * f64::from(i) / f64::from(count);
        let (out, up) = (DVec3::new(angle.cos(), angle.sin(), 0.0), (0.5 * angle).sin_cos());
        let across = 0.2 * (up.1 * out + up.0 * DVec3::Z);
        strip.positions.extend([-1.0, 1.0].map(|side| DVec3::Z + 0.5 * out + side * across));
    }
    for i in 0..count as u32 {
        let (a, b) = (2 * i, 2 * i + 1);
        // The last meets the first the other way around
        let [c, d] = if i + 1 < count as u32 { [a + 2, b + 2] } else { [1, 0] };
        strip.triangles.extend([[a, b, d], [a, d, c]]);
    }
    bakes(&strip);
}

/// Three and more faces on an edge: a cross of sheets, a book of twenty pages.
#[test]
fn edges_of_many_faces() {
    for pages in [3_u32, 4, 20] {
        let mut book = Shape { positions: vec![DVec3::Z, DVec3::Z * 1.5], ..Shape::default() };
        for i in 0..pages {
            let angle = TAU * f64::from(i) / f64::from(pages) + 0.1;
            let out = 0.4 * DVec3::new(angle.cos(), angle.sin(), 0.0);
            book.positions.extend([DVec3::Z + out, DVec3::Z * 1.5 + out]);
            let first = 2 + 2 * i;
            book.triangles.extend([[0, first, first + 1], [0, first + 1, 1]]);
        }
        let [adm, ..] = bakes(&book);
        // Closed-solid shortcuts would call its inside dark: every page has light on it.
        let lit: std::collections::BTreeSet<u32> =
            (adm.meshes[1].source_triangle.iter().zip(&adm.meshes[1].corner_radiance))
                .filter(|(_, colours)| colours.iter().any(|c| c[1] > 0.0))
                .map(|(&t, _)| t / 2)
                .collect();
        assert_eq!(lit.len() as u32, pages, "{lit:?}");
    }
}

/// A grown thing of 131,072 triangles, dented and rough, as a blocker over a floor.
#[test]
#[ignore = "long: a blocker of 131,072 triangles"]
fn an_organic_blocker_of_a_hundred_thousand_triangles() {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), grey);
    let mut random = Random(4);
    let waves: Vec<(DVec3, f64)> = (0..40).map(|_| (20.0 * random.in_cube(), random.unit() * TAU)).collect();
    let grown = |p: DVec3| {
        let dent: f64 = waves.iter().map(|&(wave, phase)| (wave.dot(p) * 3.0 + phase).sin()).sum();
        DVec3::Z + p * (1.0 + 0.02 * dent)
    };
    let mut shape = Shape::sphere(0.5, 7).map(grown);
    shape.corner_normals = None;
    scene.blocker("growth", shape, grey);
    scene.light(&lamp(DVec3::new(0.3, 0.1, 3.0), 0.3), 20.0);
    let settings = Settings { tolerance: 0.05, triangle_budget: 20_000, ..by(Method::Adm) };
    let bake = scene.bake(&settings);
    assert_sound(&scene.input, &bake);
    let verification = bake.report.result.verification.as_ref().expect("it was asked for");
    println!("{:?} {verification:?}", bake.report.result.visibility);
    // Bright in the open, dark below its middle, and as good as it says
    let at = |x: f64, y: f64| common::baked::light_over(&bake.meshes[0], x, y);
    assert!(at(-0.08, -0.04) < 0.05 * at(1.2, 1.2), "{} beside {}", at(-0.08, -0.04), at(1.2, 1.2));
    assert!(verification.error[1] < 0.1, "{:?}", verification.error);
}
