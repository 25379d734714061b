//! Scenes that need everything, or do not need something that the plan leaves out.

use antumbra::scene::{LampInput, LampShape};
use glam::{DMat3, DVec3};

use super::scene::{Scene, lamp};
use super::shape::Shape;

/// A floor with a box over it, of these reflectances, under a lamp.
pub(crate) fn floor_and_box(floor: f64, on_it: f64) -> Scene {
    let mut scene = Scene::default();
    let materials = [floor, on_it].map(|reflectance| scene.material(reflectance, 0.0));
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), materials[0]);
    let turn = DMat3::from_rotation_z(0.4);
    let cube = Shape::cuboid(DVec3::ZERO, DVec3::splat(0.4)).map(|p| turn * p + DVec3::new(0.3, 0.1, 0.4));
    scene.object("box", cube, materials[1]);
    scene.light(&lamp(DVec3::new(-0.5, 0.3, 2.0), 0.3), 20.0);
    scene
}

pub(crate) fn floor_alone(reflectance: f64) -> Scene {
    let mut scene = floor_and_box(reflectance, 0.0);
    scene.input.objects.pop();
    scene
}

pub(crate) fn in_a_room() -> Scene {
    let mut scene = floor_and_box(0.5, 0.3);
    let white = scene.material(0.7, 0.0);
    scene.input.objects.remove(0);
    scene.object(
        "room",
        Shape::room(DVec3::new(4.0, 4.0, 2.5)).map(|p| p - DVec3::new(2.0, 2.0, 0.0)),
        white,
    );
    scene
}

pub(crate) fn empty_room() -> Scene {
    let mut scene = in_a_room();
    scene.input.objects.remove(0);
    scene
}

/// Smooth balls under lamps of all shapes.
pub(crate) fn balls() -> Scene {
    let mut scene = floor_and_box(0.5, 0.3);
    let red = scene.material(0.6, 0.0);
    for x in [-1.2, -0.4] {
        scene.object("ball", Shape::sphere(0.3, 2).map(|p| p + DVec3::new(x, -0.8, 0.4)), red);
    }
    let mut add = |shape| scene.input.lamps.push(LampInput::new("lamp", shape));
    add(LampShape::Sun {
        direction: DVec3::new(0.5, 0.3, 1.0),
        angle: 0.01,
        irradiance_rgb: [1.0, 2.0, 3.0],
    });
    add(LampShape::Point {
        position: DVec3::new(1.0, -1.0, 1.5),
        radius: 0.1,
        faces_receiver: true,
        intensity_rgb: [3.0, 2.0, 1.0],
        cone: None,
    });
    scene
}

pub(crate) fn all_scenes() -> Vec<(&'static str, Scene)> {
    vec![
        ("rooms in a row", rooms_in_a_row()),
        ("rotunda", rotunda()),
        ("boxes in the sun", boxes_in_the_sun(0.3)),
        ("black boxes in a round sun", in_a_round_sun(boxes_in_the_sun(0.0))),
        ("floor in the sun", floor_in_the_sun()),
        ("dark floor and box", floor_and_box(0.002, 0.002)),
        ("black floor and box", floor_and_box(0.0, 0.0)),
        ("floor and box", floor_and_box(0.5, 0.3)),
        ("floor alone", floor_alone(0.8)),
        ("box in a room", in_a_room()),
        ("empty room", empty_room()),
        ("balls", balls()),
    ]
}

/// Six closed rooms beside each other, with a lamp in each.
pub(crate) fn rooms_in_a_row() -> Scene {
    let mut scene = Scene::default();
    let white = scene.material(0.7, 0.0);
    for k in 0..6 {
        let at = DVec3::new(4.0 * f64::from(k), 0.0, 0.0);
        scene.object("room", Shape::room(DVec3::new(3.8, 3.0, 2.5)).map(|p| p + at), white);
        scene.light(&lamp(at + DVec3::new(1.5, 1.2, 2.4), 0.3), 20.0);
    }
    scene
}

/// The same with a sun as wide as the real one.
pub(crate) fn in_a_round_sun(mut scene: Scene) -> Scene {
    for lamp in &mut scene.input.lamps {
        if let LampShape::Sun { angle, .. } = &mut lamp.shape {
            *angle = 0.009;
        }
    }
    scene
}

/// The ground of the boxes alone.
pub(crate) fn floor_in_the_sun() -> Scene {
    let mut scene = boxes_in_the_sun(0.3);
    scene.input.objects.truncate(1);
    scene
}

/// A closed room of twenty walls, everything in it at its outside: nothing casts a shadow.
pub(crate) fn rotunda() -> Scene {
    const WALLS: u32 = 20;
    let mut scene = Scene::default();
    let white = scene.material(0.7, 0.0);
    let at = |k: u32, z: f64| {
        let angle = std::f64::consts::TAU * f64::from(k % WALLS) / f64::from(WALLS);
        DVec3::new(3.0 * angle.cos(), 3.0 * angle.sin(), z)
    };
    for k in 0..WALLS {
        scene.object("wall", Shape::quad(at(k, 0.0), DVec3::Z * 3.0, at(k + 1, 0.0) - at(k, 0.0)), white);
    }
    for (z, faces_up) in [(0.0, true), (3.0, false)] {
        let positions = (0..WALLS).map(|k| at(k, z)).collect();
        let fan = |k: u32| if faces_up { [0, k, k + 1] } else { [0, k + 1, k] };
        let triangles = (1..WALLS - 1).map(fan).collect();
        scene.object("slab", Shape { positions, triangles, corner_normals: None }, white);
    }
    scene.light(&lamp(DVec3::new(0.5, 0.3, 2.9), 0.5), 20.0);
    scene
}

/// A ground with four boxes that stand on it, of this reflectance, and a sun that is a point.
pub(crate) fn boxes_in_the_sun(reflectance: f64) -> Scene {
    let mut scene = Scene::default();
    let grey = scene.material(reflectance, 0.0);
    scene.object("ground", Shape::square(DVec3::ZERO, 4.0), grey);
    for k in 0..4 {
        let (row, column) = (f64::from(k / 2), f64::from(k % 2));
        let height = 0.3 + 0.1 * f64::from(k % 4);
        let turn = DMat3::from_rotation_z(0.3 * (row + 2.0 * column));
        let at = DVec3::new(2.0 * row - 1.0, 2.0 * column - 1.0, height);
        let shape = Shape::cuboid(DVec3::ZERO, DVec3::new(0.4, 0.4, height)).map(|p| turn * p + at);
        scene.object("box", shape, grey);
    }
    scene.input.lamps.push(LampInput::new(
        "sun",
        LampShape::Sun { direction: DVec3::new(0.5, 0.3, 1.0), angle: 0.0, irradiance_rgb: [3.0, 2.5, 2.0] },
    ));
    scene
}
