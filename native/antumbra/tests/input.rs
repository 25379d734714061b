//! What is wrong with a scene is said by name and number; what is merely odd is baked all the same.

mod common;

use antumbra::Error;
use antumbra::scene::{AreaLightInput, LampInput, LampShape};
use antumbra::settings::Settings;
use antumbra::weld::Bake;
use common::baked::{all_light, assert_sound, corners};
use common::scene::{Scene, adaptive, arriving, lamp, uniform};
use common::shape::Shape;
use glam::{DMat4, DVec3};

/// A valid scene: a lamp over a table on a floor.
fn valid() -> Scene {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), grey);
    scene.object("table", Shape::cuboid(DVec3::Z * 0.5, DVec3::new(0.4, 0.3, 0.02)), grey);
    scene.light(&lamp(DVec3::Z * 2.0, 0.3), 10.0);
    scene
}

/// The error after one change to the valid scene, whose message must contain `words`.
fn refused(change: impl FnOnce(&mut Scene), words: &[&str]) -> Error {
    let mut scene = valid();
    change(&mut scene);
    let error = scene.try_bake(&adaptive()).expect_err("this scene is not valid");
    let message = error.to_string();
    for word in words {
        assert!(message.contains(word), "“{message}” does not say “{word}”");
    }
    assert!(!message.contains('\n'), "one line only: {message}");
    error
}

#[test]
fn the_valid_scene_is_valid() {
    let scene = valid();
    let bake = scene.bake(&adaptive());
    assert_sound(&scene.input, &bake);
    assert!(bake.report.warnings.is_empty(), "{:?}", bake.report.warnings);
    let summary = &bake.report.scene;
    assert_eq!((summary.objects, summary.triangles, summary.lights), (2, 14, 1));
}

#[test]
fn a_vertex_that_is_not_finite() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let error = refused(|s| s.input.objects[1].positions[5].y = value, &["“table”", "vertex 5"]);
        assert_eq!(error, Error::VertexNotFinite { object: "table".into(), vertex: 5 });
    }
}

/// Single precision ends at 3e38, and areas are squares.
#[test]
fn a_vertex_beyond_all_reach() {
    for far in [1.1e15, f64::from(f32::MAX)] {
        let error = refused(|s| s.input.objects[1].positions[2].x = far, &["“table”", "vertex 2", "1e15 m"]);
        assert_eq!(error, Error::VertexTooFar { object: "table".into(), vertex: 2, most: 1e15 });
    }
    let far = Error::LightOutOfRange {
        light: "light 0".into(),
        what: "distance from the origin",
        value: 1e30,
        most: 1e15,
    };
    assert_eq!(refused(|s| s.input.lights[0].outline[0].z = -1e30, &["“light 0”", "distance"]), far);
}

/// Finite in its own space, but not in the world.
#[test]
fn a_vertex_that_overflows_in_the_world() {
    let error = refused(
        |s| {
            s.input.objects[1].positions[3] = DVec3::splat(1e300);
            s.input.objects[1].world_from_object = DMat4::from_scale(DVec3::splat(1e300));
        },
        &["“table”"],
    );
    assert_eq!(error, Error::VertexNotFinite { object: "table".into(), vertex: 3 });
}

#[test]
fn a_corner_normal_that_is_not_finite() {
    let error = refused(
        |s| {
            let mut normals = vec![[DVec3::Z; 3]; 12];
            normals[2][1].x = f64::NAN;
            s.input.objects[1].corner_normals = Some(normals);
        },
        &["“table”", "corner 7"],
    );
    assert_eq!(error, Error::NormalNotFinite { object: "table".into(), corner: 7 });
}

#[test]
fn a_transform_that_is_not_finite() {
    for value in [f64::NAN, f64::INFINITY] {
        let error =
            refused(|s| s.input.objects[0].world_from_object.w_axis.z = value, &["“floor”", "transform"]);
        assert_eq!(error, Error::TransformNotFinite { object: "floor".into() });
    }
}

#[test]
fn a_vertex_that_is_not_there() {
    let error = refused(|s| s.input.objects[1].triangles[4][2] = 8, &["“table”", "triangle 4", "vertex 8"]);
    let expected = Error::VertexOutOfRange { object: "table".into(), triangle: 4, vertex: 8, vertices: 8 };
    assert_eq!(error, expected);
}

#[test]
fn a_material_that_is_not_there() {
    let error =
        refused(|s| s.input.objects[1].triangle_materials[4] = 1, &["“table”", "triangle 4", "material 1"]);
    let expected =
        Error::MaterialOutOfRange { object: "table".into(), triangle: 4, material: 1, materials: 1 };
    assert_eq!(error, expected);
}

#[test]
fn arrays_that_do_not_fit_together() {
    let mismatch =
        |array, got, expected| Error::LengthMismatch { object: "table".into(), array, got, expected };
    let error = refused(
        |s| s.input.objects[1].triangle_materials.truncate(11),
        &["“table”", "triangle_materials", "11", "12"],
    );
    assert_eq!(error, mismatch("triangle_materials", 11, 12));
    let error = refused(
        |s| s.input.objects[1].corner_normals = Some(vec![[DVec3::Z; 3]; 13]),
        &["“table”", "corner_normals", "13", "12"],
    );
    assert_eq!(error, mismatch("corner_normals", 13, 12));
}

#[test]
fn reflectance_outside_0_to_1() {
    for value in [1.000_001, -1e-9, 2.0, f64::INFINITY] {
        let error = refused(
            |s| s.input.materials[0].reflectance_rgb[1] = value,
            &["“material 0”", "green", "0 to 1"],
        );
        let material = "material 0".to_owned();
        assert_eq!(error, Error::ReflectanceOutOfRange { material, channel: "green", value });
    }
    let error = refused(|s| s.input.materials[0].reflectance_rgb[2] = f64::NAN, &["“material 0”", "blue"]);
    assert!(matches!(error, Error::ReflectanceOutOfRange { channel: "blue", .. }));
}

#[test]
fn emission_that_is_negative_or_not_finite() {
    for value in [-0.5, f64::INFINITY] {
        let error =
            refused(|s| s.input.materials[0].exitance_rgb[0] = value, &["“material 0”", "red", "emission"]);
        assert_eq!(error, Error::ExitanceInvalid { material: "material 0".into(), channel: "red", value });
    }
    let error = refused(|s| s.input.materials[0].exitance_rgb[0] = f64::NAN, &["“material 0”"]);
    assert!(matches!(error, Error::ExitanceInvalid { .. }));
}

#[test]
fn a_light_that_is_not_finite() {
    let not_finite = Error::LightNotFinite { light: "light 0".into() };
    assert_eq!(refused(|s| s.input.lights[0].exitance_rgb[2] = f64::NAN, &["“light 0”"]), not_finite);
    assert_eq!(refused(|s| s.input.lights[0].outline[3].x = f64::INFINITY, &["“light 0”"]), not_finite);
}

#[test]
fn a_strength_that_no_colour_can_hold() {
    let strength =
        |value| Error::LightOutOfRange { light: "light 0".into(), what: "strength", value, most: 1e30 };
    assert_eq!(
        refused(|s| s.input.lights[0].exitance_rgb[1] = -1e31, &["“light 0”", "strength"]),
        strength(1e31)
    );
    let error = refused(|s| s.input.materials[0].exitance_rgb[0] = 1e31, &["“material 0”", "red", "1e31"]);
    assert!(matches!(error, Error::ExitanceInvalid { .. }));
}

/// Outlines are clipped as what is convex: what is not is refused rather than lit wrong.
#[test]
fn a_light_with_dents_a_bow_tie_a_star_and_one_that_is_not_flat() {
    let outline =
        |points: &[[f64; 3]]| points.iter().map(|&p| DVec3::from(p) + DVec3::Z * 2.0).collect::<Vec<_>>();
    let dented = outline(&[[-1.0, -1.0, 0.0], [0.0, 0.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]]);
    let bow_tie = outline(&[[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -0.5, 0.0], [-1.0, 1.0, 0.0]]);
    let bent = outline(&[[-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.01], [1.0, -1.0, 0.0]]);
    let star: Vec<DVec3> = (0..5)
        .map(|i| f64::from(2 * i) * std::f64::consts::TAU / 5.0)
        .map(|angle| DVec3::new(angle.cos(), angle.sin(), 2.0))
        .collect();
    for outline in [dented, bow_tie, bent, star] {
        let panel = LampShape::Panel { outline: outline.clone(), exitance_rgb: [1.0; 3], spread: 1.0 };
        let error = refused(|s| s.input.lights[0].outline = outline, &["“light 0”", "not flat and convex"]);
        assert_eq!(error, Error::LightOutline { light: "light 0".into() });
        let error = refused(|s| s.input.lamps.push(LampInput::new("panel", panel)), &["“panel”", "not flat"]);
        assert_eq!(error, Error::LightOutline { light: "panel".into() });
    }
    // Either way around, with corners in line, and off by what single precision makes of it a kilometre away
    let mut scene = valid();
    scene.input.lights[0].outline.reverse();
    scene.light(&[[0.0, 0.0, 3.0], [0.5, 0.0, 3.0], [1.0, 0.0, 3.0], [0.0, 1.0, 3.0]].map(DVec3::from), 1.0);
    let turn = DMat4::from_rotation_x(0.3) * DMat4::from_translation(DVec3::new(1e3, 2e3, -1e3));
    let turned = lamp(DVec3::Z * 2.0, 0.3).map(|p| turn.transform_point3(p).as_vec3().as_dvec3());
    scene.light(&turned, 1.0);
    // And 4e-13 m wide, as random bytes had it: its corners' rounding tilts its normal by 2e-4
    let [from, along, beside] =
        [[-0.75, 1.0, -0.25], [-0.75; 3], [-0.75, -0.75 - 3.7e-13, -0.75 - 3.7e-13]].map(DVec3::from);
    scene.light(&[from, from + along, from + along + beside, from + beside], 1.0);
    assert_sound(&scene.input, &scene.bake(&adaptive()));
}

#[test]
fn a_scene_without_light() {
    assert_eq!(refused(|s| s.input.lights.clear(), &["light"]), Error::NoLight);
    // A light without area is left out, and then there is none.
    let flat = |s: &mut Scene| s.input.lights[0].outline = vec![DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
    assert_eq!(refused(flat, &["light"]), Error::NoLight);
}

#[test]
fn a_scene_without_receivers() {
    let none = |s: &mut Scene| s.input.objects.iter_mut().for_each(|object| object.receives = false);
    assert_eq!(refused(none, &["bake"]), Error::NoReceiver);
    assert_eq!(refused(|s| s.input.objects.clear(), &["bake"]), Error::NoReceiver);
    let empty = |s: &mut Scene| *s = Scene::default();
    assert_eq!(refused(empty, &["bake"]), Error::NoReceiver);
    let flat = |s: &mut Scene| {
        s.input.objects.iter_mut().for_each(|o| o.world_from_object = DMat4::from_scale(DVec3::ZERO));
    };
    assert_eq!(refused(flat, &["bake"]), Error::NoReceiver);
}

#[test]
fn settings_out_of_range() {
    let default = Settings::default;
    for (name, settings) in [
        ("tolerance", Settings { tolerance: 0.0, ..default() }),
        ("tolerance", Settings { tolerance: 2.0, ..default() }),
        ("tolerance", Settings { tolerance: f64::NAN, ..default() }),
        ("element_size", Settings { element_size: -1.0, ..default() }),
        ("element_size", Settings { element_size: f64::INFINITY, ..default() }),
        ("max_level", Settings { max_level: 17, ..default() }),
        ("time_limit", Settings { time_limit: -1.0, ..default() }),
        ("time_limit", Settings { time_limit: f64::NAN, ..default() }),
    ] {
        match valid().try_bake(&settings) {
            Err(Error::InvalidSetting { name: refused, .. }) => assert_eq!(refused, name),
            other => panic!("{name}: {other:?}"),
        }
    }
}

#[test]
fn an_object_without_area_is_left_out_with_a_warning() {
    let mut scene = valid();
    let expected = valid().bake(&adaptive());
    let object = scene.object("flattened", Shape::cuboid(DVec3::Z, DVec3::splat(0.1)), 0);
    object.world_from_object = DMat4::from_scale(DVec3::new(1.0, 0.0, 0.0));
    let bake = scene.bake(&adaptive());
    assert_eq!(bake.meshes.iter().map(|mesh| mesh.object).collect::<Vec<_>>(), [0, 1]);
    assert!(bake.report.warnings.iter().any(|w| w.contains("“flattened”")), "{:?}", bake.report.warnings);
    assert!(all_light(&bake).eq(all_light(&expected)), "it changed the light");
}

#[test]
fn a_light_without_area_is_left_out_with_a_warning() {
    let mut scene = valid();
    let outline = vec![DVec3::Z; 4];
    scene.input.lights.push(AreaLightInput { name: "dot".into(), outline, exitance_rgb: [1.0; 3] });
    let bake = scene.bake(&adaptive());
    assert!(bake.report.warnings.iter().any(|w| w.contains("“dot”")), "{:?}", bake.report.warnings);
    assert_eq!(bake.report.scene.lights, 1);
}

#[test]
fn an_object_without_triangles_is_no_trouble() {
    let mut scene = valid();
    scene.object("nothing", Shape::default(), 0);
    let points = Shape { positions: vec![DVec3::ZERO; 3], ..Shape::default() };
    scene.object("points", points, 0);
    let bake = scene.bake(&adaptive());
    assert_eq!(bake.meshes.len(), 2);
    assert!(all_light(&bake).eq(all_light(&valid().bake(&adaptive()))), "it changed the light");
}

/// Faces without area stay in the mesh, so that it keeps its shape, and are lit like their neighbours.
#[test]
fn a_face_without_area_keeps_its_place() {
    let mut scene = valid();
    let floor = &mut scene.input.objects[0];
    floor.positions.push(floor.positions[0].lerp(floor.positions[1], 0.5));
    floor.triangles.push([0, 4, 1]);
    floor.triangle_materials.push(0);
    let bake = scene.bake(&adaptive());
    let mesh = &bake.meshes[0];
    assert_eq!(mesh.source_triangle.iter().filter(|&&t| t == 2).count(), 1);
    assert!(all_light(&bake).all(|light| light.is_finite() && light.min_element() >= 0.0));
}

/// A mirrored object is its unmirrored twin: front sides stay in front.
#[test]
fn a_mirrored_object_gets_the_light_of_its_twin() {
    let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let shape = || Shape::cuboid(DVec3::new(0.7, 0.2, 0.5), DVec3::new(0.3, 0.2, 0.4));
    let bake = |mirrored: bool| {
        let mut scene = valid();
        let twin = if mirrored {
            let across = shape().map(|p| mirror.transform_point3(p)).inside_out();
            scene.object("twin", across, 0)
        } else {
            scene.object("twin", shape(), 0)
        };
        if mirrored {
            twin.world_from_object = mirror;
        }
        let bake = scene.bake(&arriving(uniform(0.2)));
        assert_sound(&scene.input, &bake);
        bake
    };
    let (plain, mirrored) = (bake(false), bake(true));
    // Per corner: source triangle, place in the world, and light.
    let lit = |bake: &Bake, flip: DVec3| -> Vec<(u32, DVec3, f64)> {
        let mesh = &bake.meshes[2];
        (corners(mesh).enumerate())
            .map(|(index, (p, light))| (mesh.source_triangle[index / 3], flip * p, light.y))
            .collect()
    };
    let expected = lit(&plain, DVec3::ONE);
    let got = lit(&mirrored, DVec3::new(-1.0, 1.0, 1.0));
    assert_eq!(expected.len(), got.len());
    for (triangle, p, light) in got {
        let twin = expected.iter().find(|(t, q, _)| *t == triangle && p.distance(*q) < 1e-9);
        let twin = twin.expect("the meshes are the same").2;
        assert!((light - twin).abs() <= 0.02 * (twin + 0.1), "{light} instead of {twin} at {p}");
    }
    assert!(expected.iter().any(|corner| corner.2 > 0.3), "the top is lit");
}

/// The caller's scene is only read.
#[test]
fn a_bake_that_fails_leaves_the_next_one_alone() {
    let scene = valid();
    let before = scene.bake(&adaptive());
    assert!(scene.try_bake(&Settings { tolerance: -1.0, ..adaptive() }).is_err());
    assert!(all_light(&scene.bake(&adaptive())).eq(all_light(&before)));
}
