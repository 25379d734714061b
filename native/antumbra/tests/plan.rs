//! What a bake leaves out changes nothing, or no more than it says; and only where the scene does not need it.

mod common;

use antumbra::report::LeftOut;
use antumbra::scene::{LampInput, LampShape};
use antumbra::settings::{Anyway, Effort, Method, Settings, Transport};
use antumbra::weld::{Bake, BakedMesh};
use common::Random;
use common::planned::{all_scenes, floor_alone, floor_and_box, in_a_room};
use common::scene::{Scene, adaptive, arriving};
use common::shape::Shape;
use glam::DVec3;

/// Whether a bake left something out.
fn leaves_out(bake: &Bake, name: &str) -> bool {
    bake.report.result.plan.iter().any(|left_out| left_out.name == name)
}

/// Bit for bit.
fn assert_same(a: &Bake, b: &Bake, what: &str) {
    assert_eq!(a.meshes.len(), b.meshes.len(), "{what}");
    for (a, b) in a.meshes.iter().zip(&b.meshes) {
        assert_eq!(a.triangles, b.triangles, "{what}");
        assert_eq!(a.source_triangle, b.source_triangle, "{what}");
        assert!(a.positions == b.positions, "{what}: positions");
        let bits = |colours: &[[[f32; 3]; 3]]| -> Vec<u32> {
            colours.as_flattened().as_flattened().iter().map(|v| v.to_bits()).collect()
        };
        assert!(bits(&a.corner_radiance) == bits(&b.corner_radiance), "{what}: colours");
    }
}

fn percent_of_time(without: &Bake, with: &Bake) -> f64 {
    100.0 * without.report.timings.solve_s / with.report.timings.solve_s
}

#[test]
fn without_reflection_nothing_is_exchanged_and_nothing_changes() {
    let settings = Settings { verify_points: 0, tolerance: 0.05, ..adaptive() };
    for transport in [Transport::Hierarchical, Transport::Shooting, Transport::Rays] {
        for (name, scene) in all_scenes() {
            let not_needed =
                ["black floor and box", "floor alone", "black boxes in a round sun", "floor in the sun"];
            let needed = !not_needed.contains(&name);
            if transport == Transport::Rays && (needed || name.contains("sun")) {
                // It takes a minute, and is told by the same look.
                continue;
            }
            for settings in [settings.clone(), arriving(settings.clone())] {
                let settings = Settings { transport, ..settings };
                let anyway = Anyway { reflection: true, ..Anyway::default() };
                let without = scene.bake(&settings);
                let with = scene.bake(&Settings { anyway, ..settings });
                assert_eq!(leaves_out(&without, "reflection"), !needed, "{transport:?}, {name}");
                assert!(!leaves_out(&with, "reflection"));
                assert_same(&without, &with, &format!("{transport:?}, {name}"));
                if !needed {
                    println!("{transport:?}, {name}: {:.0} % of the time", percent_of_time(&without, &with));
                }
            }
        }
    }
}

/// Where all light stays, too.
#[test]
fn in_a_closed_black_room_nothing_changes_either() {
    let mut scene = in_a_room();
    scene.input.materials.iter_mut().for_each(|material| material.reflectance_rgb = [0.0; 3]);
    let settings = arriving(Settings { verify_points: 0, tolerance: 0.05, ..adaptive() });
    let anyway = Anyway { reflection: true, ..Anyway::default() };
    let without = scene.bake(&settings);
    let with = scene.bake(&Settings { anyway, ..settings });
    assert!(leaves_out(&without, "reflection"));
    assert_same(&without, &with, "black room");
}

/// A plate a hair above the floor sees it.
#[test]
fn surfaces_that_nearly_lie_in_one_plane_exchange_light() {
    let mut scene = floor_alone(0.5);
    let grey = scene.material(0.5, 0.0);
    scene.object("plate", Shape::square(DVec3::new(0.5, 0.5, 0.001), 0.5), grey);
    assert!(!leaves_out(&scene.bake(&adaptive()), "reflection"));
}

/// With everything for a candidate, the kernel finds that most of it hides nothing.
#[test]
fn what_stands_elsewhere_hides_nothing() {
    for method in [Method::Adm, Method::As] {
        let settings = Settings { verify_points: 0, tolerance: 0.05, method, ..adaptive() };
        for (name, scene) in all_scenes() {
            let anyway = Anyway { open_visibility: true, ..Anyway::default() };
            let without = scene.bake(&settings);
            let with = scene.bake(&Settings { anyway, ..settings.clone() });
            // A sun that is a point is no form factor, and the black boxes send each other none.
            let of_points = name.contains("in the sun");
            assert!(leaves_out(&without, "open_visibility") || of_points, "{name}");
            assert!(!leaves_out(&with, "open_visibility"), "{name}: {:?}", with.report.result.plan);
            let counts = [&without, &with].map(|bake| bake.report.result.visibility.sampled);
            println!(
                "{method:?}, {name}: {:.0} % of the time; {}; {counts:?} by rays",
                percent_of_time(&without, &with),
                without.report.result.plan.iter().map(|l| l.saved.as_str()).collect::<Vec<_>>().join(", ")
            );
            if counts == [0, 0] {
                assert_same(&without, &with, name);
            }
        }
    }
}

/// With everything for a candidate, every patch sends rays to find out that nothing covers half of it.
#[test]
fn what_stands_elsewhere_covers_no_patches() {
    let mut shelf = in_a_room();
    let grey = shelf.material(0.3, 0.0);
    let plate = Shape::cuboid(DVec3::new(-1.0, 1.93, 1.0), DVec3::new(0.3, 0.05, 0.2));
    shelf.object("picture", plate, grey);
    let effort = Effort { patches: 2_000.0, rays: 1e5, ..Effort::default() };
    let settings =
        Settings { verify_points: 0, tolerance: 0.1, transport: Transport::Rays, effort, ..adaptive() };
    for (name, scene) in [("picture", shelf), ("floor and box", floor_and_box(0.5, 0.3))] {
        let anyway = Anyway { open_visibility: true, ..Anyway::default() };
        let bakes = [scene.bake(&settings), scene.bake(&Settings { anyway, ..settings.clone() })];
        // The same patches, and what they meet.
        let cut = bakes.each_ref().map(|bake| {
            let transport = &bake.report.result.transport;
            [transport.elements, transport.links]
        });
        assert_eq!(cut[0], cut[1], "{name}");
    }
}

/// Walls, floors and what else has everything on one side.
#[test]
fn outer_faces_hide_nothing() {
    for method in [Method::Adm, Method::As] {
        for (name, scene) in all_scenes() {
            let settings = Settings { verify_points: 0, tolerance: 0.05, method, ..adaptive() };
            let anyway = Anyway { outer_faces: true, ..Anyway::default() };
            let without = scene.bake(&settings);
            let with = scene.bake(&Settings { anyway, ..settings });
            assert!(leaves_out(&without, "outer_faces"), "{name}");
            assert!(!leaves_out(&with, "outer_faces"), "{name}");
            println!("{method:?}, {name}: {:.0} % of the time", percent_of_time(&without, &with));
            // Where dozens of faces were to be looked at, rays were taken instead.
            if [&without, &with].map(|bake| bake.report.result.visibility.sampled) == [0, 0] {
                assert_same(&without, &with, name);
            }
        }
    }
}

/// Of two plates a metre apart, the lower one hides a sun below from the upper one's underside, and is at the outside of all
/// for one above.
#[test]
fn what_stands_before_a_sun_is_no_outer_face() {
    let settings = arriving(Settings { verify_points: 0, ..adaptive() });
    let outer = |bake: &Bake| {
        let of = |left_out: &&LeftOut| left_out.name == "outer_faces";
        bake.report.result.plan.iter().find(of).map(|left_out| left_out.saved.clone())
    };
    let under = |direction: DVec3, angle: f64| {
        let mut scene = Scene::default();
        let black = scene.material(0.0, 0.0);
        scene.blocker("lower", Shape::square(DVec3::ZERO, 4.0), black);
        let upper = Shape::square(DVec3::ZERO, 1.0).map(|p| DVec3::new(p.x, -p.y, 1.0 - p.z));
        scene.object("upper", upper, black);
        let shape = LampShape::Sun { direction, angle, irradiance_rgb: [1.0; 3] };
        scene.input.lamps.push(LampInput::new("sun", shape));
        scene.bake(&settings)
    };
    // The upper one is at the outside for the sun below, the lower one for that above.
    let one_of_them = Some("1 of 2 faces and quadrilaterals".to_owned());
    for angle in [0.0, 0.5] {
        let below = under(-DVec3::Z, angle);
        assert!(below.meshes[0].corner_radiance.as_flattened().iter().all(|&light| light == [0.0; 3]));
        assert_eq!(outer(&below), one_of_them);
        assert_eq!(outer(&under(DVec3::new(0.2, 0.0, 1.0), angle)), one_of_them);
    }
    // Half of a wide sun is below the horizon.
    assert_eq!(outer(&under(DVec3::new(1.0, 0.0, 0.1), 0.5)), None);
}

/// What a switch is called, how it is forced off, and the scenes in which it leaves something out.
type Switch = (&'static str, fn(&mut Anyway), &'static [&'static str]);

/// Where a box hides a little from little, as the elements happen to lie.
const MAY_SCREEN: [&str; 7] = [
    "boxes in the sun",
    "black boxes in a round sun",
    "dark floor and box",
    "black floor and box",
    "floor and box",
    "box in a room",
    "balls",
];

const EXACT: [Switch; 4] = [
    (
        "occlusion",
        |anyway| anyway.occlusion = true,
        &["floor alone", "empty room", "rotunda", "floor in the sun"],
    ),
    (
        "shadow_lines",
        |anyway| anyway.shadow_lines = true,
        &["floor alone", "empty room", "rotunda", "floor in the sun"],
    ),
    (
        "facing_away",
        |anyway| anyway.facing_away = true,
        &[
            "rooms in a row",
            "floor and box",
            "box in a room",
            "empty room",
            "balls",
            "rotunda",
            "boxes in the sun",
        ],
    ),
    ("screens", |anyway| anyway.screens = true, &["rooms in a row"]),
];

#[test]
fn exact_switches_change_nothing_wherever_they_leave_something_out() {
    for method in [Method::Adm, Method::As] {
        let settings = Settings { verify_points: 0, tolerance: 0.05, method, ..adaptive() };
        for (scene_name, scene) in all_scenes() {
            let without = scene.bake(&settings);
            for (name, force, scenes) in EXACT {
                let mut anyway = Anyway::default();
                force(&mut anyway);
                let with = scene.bake(&Settings { anyway, ..settings.clone() });
                let what = format!("{name}, {scene_name}, {method:?}");
                println!("{what}: {:.0} % of the time", percent_of_time(&without, &with));
                if name != "screens" || !MAY_SCREEN.contains(&scene_name) {
                    assert_eq!(leaves_out(&without, name), scenes.contains(&scene_name), "{what}");
                }
                assert!(!leaves_out(&with, name), "{what}");
                // Where a crowd hides a source, rays tell of it only nearly what a single polygon tells for sure.
                let sampled = [&without, &with].map(|bake| bake.report.result.visibility.sampled);
                if name != "screens" || sampled[0] == sampled[1] {
                    assert_same(&without, &with, &what);
                }
            }
        }
    }
}

/// The light that a mesh shows at a place of a source triangle, over the channels.
fn light_at(mesh: &BakedMesh, source: u32, place: DVec3) -> DVec3 {
    let first = mesh.source_triangle.partition_point(|&other| other < source);
    let all = (first..mesh.triangles.len()).take_while(|&k| mesh.source_triangle[k] == source);
    let weights = |k: usize| {
        let [a, b, c] = mesh.corner_barycentric[k].map(DVec3::from_array);
        let whole = a.dot(b.cross(c));
        DVec3::new(place.dot(b.cross(c)), place.dot(c.cross(a)), place.dot(a.cross(b))) / whole
    };
    let deepest = all.map(|k| (k, weights(k))).max_by(|a, b| a.1.min_element().total_cmp(&b.1.min_element()));
    let (k, weights) = deepest.expect("a source triangle is covered by baked ones");
    let [a, b, c] = mesh.corner_radiance[k].map(|rgb| DVec3::from_array(rgb.map(f64::from)));
    weights.x * a + weights.y * b + weights.z * c
}

/// Rms difference of two bakes over their surfaces, relative to the mean of the second.
fn difference(one: &Bake, other: &Bake, scene: &Scene) -> f64 {
    let mut random = Random(5);
    let (mut squares, mut sum, mut area) = (0.0, 0.0, 0.0);
    for (one, other) in one.meshes.iter().zip(&other.meshes) {
        let object = &scene.input.objects[one.object];
        for (source, triangle) in object.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|v| object.positions[v as usize]);
            let weight = 0.5 * (b - a).cross(c - a).length() / 200.0;
            for _ in 0..200 {
                let (root, v) = (random.unit().sqrt(), random.unit());
                let place = DVec3::new(1.0 - root, root * (1.0 - v), root * v);
                let [one, other] = [one, other].map(|mesh| light_at(mesh, source as u32, place));
                squares += weight * (one - other).length_squared() / 3.0;
                sum += weight * other.element_sum() / 3.0;
                area += weight;
            }
        }
    }
    (squares / area).sqrt() / (sum / area)
}

const BOUNDED: [Switch; 1] =
    [("second_bounce", |anyway| anyway.second_bounce = true, &["dark floor and box"])];

#[test]
fn bounded_switches_stay_within_their_bounds() {
    let settings = Settings { verify_points: 0, tolerance: 0.05, ..adaptive() };
    for (scene_name, scene) in all_scenes() {
        let without = scene.bake(&settings);
        for (name, force, scenes) in BOUNDED {
            let what = format!("{name}, {scene_name}");
            let left_out = without.report.result.plan.iter().find(|left_out| left_out.name == name);
            let mut anyway = Anyway::default();
            force(&mut anyway);
            let with = scene.bake(&Settings { anyway, ..settings.clone() });
            assert!(!leaves_out(&with, name), "{what}");
            println!(
                "{what}: {left_out:?}, {:.0} % of the time, {:.4} wanted errors",
                percent_of_time(&without, &with),
                difference(&without, &with, &scene) / settings.tolerance
            );
            assert_eq!(left_out.is_some(), scenes.contains(&scene_name), "{what}");
            match left_out {
                Some(left_out) => {
                    let difference = difference(&without, &with, &scene) / settings.tolerance;
                    assert!(difference <= left_out.bound, "{what}: {difference} of {}", left_out.bound);
                }
                None => assert_same(&without, &with, &what),
            }
        }
    }
}
