//! The baked mesh: every triangle a part of its source, nothing torn, nothing doubled, nothing lost.

mod common;

use std::collections::HashMap;

use antumbra::settings::{Method, Settings};
use antumbra::weld::{Bake, BakedMesh};
use common::Random;
use common::baked::{area, assert_sound, corners, is_watertight};
use common::scene::{Scene, adaptive, by, lamp, uniform};
use common::shape::Shape;
use glam::{DMat4, DVec3};

/// An object over a floor, lit from above and from the side, with a thin bar that throws a shadow on both.
fn shadowed(shape: Shape) -> Scene {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    scene.object("shape", shape, grey);
    scene.object("floor", Shape::square(DVec3::NEG_Z * 1.5, 4.0), grey);
    scene.blocker("bar", Shape::cuboid(DVec3::new(0.3, 0.2, 1.8), DVec3::new(1.0, 0.05, 0.02)), grey);
    scene.light(&lamp(DVec3::Z * 3.0, 0.2), 20.0);
    let side = [[2.5, -0.2, 1.0], [2.5, 0.2, 1.0], [2.5, 0.2, 1.4], [2.5, -0.2, 1.4]];
    scene.light(&side.map(DVec3::from).map(|p| p + DVec3::X).into_iter().rev().collect::<Vec<_>>(), 20.0);
    scene
}

fn coarse() -> Settings {
    Settings { tolerance: 0.03, ..adaptive() }
}

/// All methods that refine, coarse.
fn coarse_by_all() -> [Settings; 3] {
    [Method::Adm, Method::Dm, Method::As].map(|method| Settings { tolerance: 0.03, ..by(method) })
}

/// Bakes the scene, checks it, and returns the bake after making sure that its first object was refined.
fn refined(scene: &Scene, settings: &Settings) -> Bake {
    let bake = scene.bake(settings);
    assert_sound(&scene.input, &bake);
    let before = scene.input.objects[0].triangles.len();
    assert!(bake.meshes[0].triangles.len() > before, "nothing was refined");
    bake
}

#[test]
fn a_watertight_cube_stays_watertight() {
    let scene = shadowed(Shape::cuboid(DVec3::ZERO, DVec3::ONE));
    for settings in coarse_by_all().into_iter().chain([adaptive(), uniform(0.3)]) {
        let bake = refined(&scene, &settings);
        assert!(is_watertight(&bake.meshes[0].triangles), "{:?}", settings.method);
        bake.meshes.iter().for_each(assert_no_t_vertices);
    }
}

#[test]
fn a_watertight_smooth_sphere_stays_watertight() {
    let scene = shadowed(Shape::sphere(1.0, 2));
    for settings in coarse_by_all() {
        assert!(is_watertight(&refined(&scene, &settings).meshes[0].triangles), "{:?}", settings.method);
    }
}

/// Slivers beside wide faces: the coarse levels of neighbours are far apart, and must be brought together.
#[test]
fn a_watertight_l_with_faces_of_all_sizes_stays_watertight() {
    let scene = shadowed(Shape::thin_l().map(|p| p - DVec3::new(1.0, 1.0, 0.5)));
    for settings in coarse_by_all().into_iter().chain([uniform(0.2)]) {
        assert!(is_watertight(&refined(&scene, &settings).meshes[0].triangles), "{:?}", settings.method);
    }
}

#[test]
fn a_transformed_object_keeps_its_own_coordinates() {
    let mut scene = shadowed(Shape::cuboid(DVec3::ZERO, DVec3::ONE));
    scene.input.objects[0].world_from_object = DMat4::from_translation(DVec3::new(0.1, 0.2, 0.3))
        * DMat4::from_rotation_y(0.3)
        * DMat4::from_scale(DVec3::new(0.5, 1.0, 0.7));
    for settings in coarse_by_all() {
        let bake = refined(&scene, &settings);
        let mesh = &bake.meshes[0];
        for corner in &scene.input.objects[0].positions {
            assert_eq!(mesh.positions.iter().filter(|p| *p == corner).count(), 1);
        }
    }
}

/// Adaptive subdivision: within one source triangle, neighbours differ by one level at most: a part is a whole, a half or a quarter of its
/// element, so areas differ by 8 at most, and edges of one triangle never carry a vertex of another.
#[test]
fn neighbours_differ_by_one_level() {
    let scene = shadowed(Shape::cuboid(DVec3::ZERO, DVec3::ONE));
    let bake = refined(&scene, &by(Method::As));
    for mesh in &bake.meshes {
        let area_of = |t: usize| area(mesh.triangles[t].map(|v| mesh.positions[v as usize]));
        let mut on_edge: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
        for (t, [a, b, c]) in mesh.triangles.iter().copied().enumerate() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                on_edge.entry((from.min(to), from.max(to))).or_default().push(t);
            }
        }
        for sharing in on_edge.values().filter(|sharing| sharing.len() == 2) {
            let (s, t) = (sharing[0], sharing[1]);
            if mesh.source_triangle[s] == mesh.source_triangle[t] {
                let ratio = area_of(s) / area_of(t);
                assert!((0.124..8.1).contains(&ratio), "neighbours of areas 1 : {ratio}");
            }
        }
        assert_no_t_vertices(mesh);
    }
}

/// No vertex lies inside an edge: looked for the slow way, on every seventh triangle.
fn assert_no_t_vertices(mesh: &BakedMesh) {
    let size = mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    for (t, triangle) in mesh.triangles.iter().enumerate().step_by(7) {
        for k in 0..3 {
            let [a, b] = [k, (k + 1) % 3].map(|k| mesh.positions[triangle[k] as usize]);
            let along = (b - a).normalize();
            let inside = mesh.positions.iter().any(|&p| {
                let s = along.dot(p - a);
                s > 1e-9 * size && s < a.distance(b) - 1e-9 * size && p.distance(a + s * along) < 1e-12 * size
            });
            assert!(!inside, "a vertex inside edge {k} of triangle {t}");
        }
    }
}

#[test]
fn a_uniform_mesh_has_equal_triangles() {
    let mut scene = Scene::default();
    let grey = scene.material(0.5, 0.0);
    let grid = Shape::grid(DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 2.0, [3, 2]);
    scene.object("floor", grid, grey);
    scene.light(&lamp(DVec3::new(0.2, 0.3, 0.5), 0.1), 10.0);
    for (element_size, level) in [(1.5, 0), (1.4, 1), (0.7, 2), (0.2, 3)] {
        let bake = scene.bake(&uniform(element_size));
        let mesh = &bake.meshes[0];
        assert_eq!(mesh.triangles.len(), 12 << (2 * level), "at {element_size} m");
        for triangle in &mesh.triangles {
            let area = area(triangle.map(|v| mesh.positions[v as usize]));
            assert!((area / 0.5_f64.powi(2 * level + 1) - 1.0).abs() < 1e-9);
        }
    }
}

fn assert_element_size(settings: &Settings) {
    let scene = shadowed(Shape::thin_l());
    for mesh in &scene.bake(settings).meshes {
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            assert!(longest <= settings.element_size * (1.0 + 1e-9), "an edge of {longest} m");
        }
    }
}

#[test]
fn an_element_size_is_an_upper_bound() {
    assert_element_size(&uniform(0.3));
    assert_element_size(&Settings { element_size: 0.3, tolerance: 0.03, ..by(Method::As) });
}

#[test]
fn an_element_size_is_an_upper_bound_with_shadow_lines_too() {
    for method in [Method::Adm, Method::Dm] {
        assert_element_size(&Settings { element_size: 0.3, tolerance: 0.03, ..by(method) });
    }
}

#[test]
fn a_triangle_budget_is_kept() {
    let scene = shadowed(Shape::cuboid(DVec3::ZERO, DVec3::ONE));
    for method in [Method::Adm, Method::Dm, Method::As] {
        let fine = Settings { tolerance: 0.003, ..by(method) };
        let free = scene.bake(&fine).report.result.triangles;
        let budget = free / 2;
        let bake = scene.bake(&Settings { triangle_budget: budget as u64, ..fine.clone() });
        assert_sound(&scene.input, &bake);
        let triangles = bake.report.result.triangles;
        println!("{method:?}: {free} triangles without a budget, {triangles} of {budget} with it");
        assert!(triangles <= budget, "{method:?}: {triangles} triangles of {budget}");
        assert!(triangles > budget / 2, "{method:?}: only {triangles} triangles of {budget}");
        assert_eq!(bake.report.result.ended_by, "triangle_budget");
        let enough = Settings { triangle_budget: 4 * free as u64, ..fine };
        assert_eq!(scene.bake(&enough).report.result.triangles, free);
    }
}

#[test]
fn no_level_leaves_the_coarse_mesh() {
    let scene = shadowed(Shape::cuboid(DVec3::ZERO, DVec3::ONE));
    for method in [Method::Adm, Method::Dm, Method::As] {
        let settings = |max_level| Settings { max_level, ..by(method) };
        let count = |max_level| scene.bake(&settings(max_level)).report.result.triangles;
        let counts: Vec<usize> = (0..4).map(count).collect();
        // Where bisection ends too early it makes up for it elsewhere, so that more levels may need fewer triangles.
        let is_fair = counts.is_sorted() || method != Method::As;
        assert!(is_fair && counts[1..].iter().all(|count| counts[0] < *count), "{method:?}: {counts:?}");
    }
}

#[test]
fn what_does_not_receive_has_no_mesh() {
    let mut scene = shadowed(Shape::cuboid(DVec3::ZERO, DVec3::ONE));
    let objects = |bake: &Bake| bake.meshes.iter().map(|mesh| mesh.object).collect::<Vec<_>>();
    assert_eq!(objects(&scene.bake(&coarse())), [0, 1]);
    scene.input.objects[0].receives = false;
    assert_eq!(objects(&scene.bake(&coarse())), [1]);
}

/// How many different colours meet at each corner of the source cube.
fn colours_at_corners(scene: &Scene) -> Vec<usize> {
    let bake = scene.bake(&coarse());
    assert_sound(&scene.input, &bake);
    (scene.input.objects[0].positions.iter())
        .map(|corner| {
            let mut colours: Vec<DVec3> = Vec::new();
            for (_, light) in corners(&bake.meshes[0]).filter(|(p, _)| p == corner) {
                if !colours.contains(&light) {
                    colours.push(light);
                }
            }
            colours.len()
        })
        .collect()
}

#[test]
fn smooth_corners_share_one_colour_and_creases_do_not() {
    let cube = Shape::cuboid(DVec3::ZERO, DVec3::ONE);
    let flat = colours_at_corners(&shadowed(cube.clone()));
    assert!(flat.contains(&3), "{flat:?}");
    let smooth = colours_at_corners(&shadowed(cube.clone().smooth_about(DVec3::ZERO)));
    assert!(smooth.iter().all(|&colours| colours == 1), "{smooth:?}");
    // Corner normals that are the faces' own make flat faces.
    let mut given = cube;
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| given.positions[v as usize]);
        [(b - a).cross(c - a).normalize(); 3]
    };
    given.corner_normals = Some(given.triangles.iter().map(normal).collect());
    assert_eq!(colours_at_corners(&shadowed(given)), flat);
}

/// Twenty wild meshes: soups of triangles that share vertices, slivers among them.
#[test]
fn random_soups_stay_sound() {
    let mut random = Random(7);
    for _ in 0..20 {
        let positions: Vec<DVec3> = (0..12).map(|_| random.in_cube()).collect();
        let triangle = |random: &mut Random| loop {
            let corners: [u32; 3] = std::array::from_fn(|_| random.below(12) as u32);
            if corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0] {
                return corners;
            }
        };
        let mut triangles: Vec<[u32; 3]> = (0..10).map(|_| triangle(&mut random)).collect();
        // Of two triangles with the same corners, every edge would count twice.
        triangles.sort_by_key(|t| sorted(*t));
        triangles.dedup_by_key(|t| sorted(*t));
        let scene = shadowed(Shape { positions, triangles, corner_normals: None });
        for method in [Method::Adm, Method::Dm, Method::As] {
            assert_sound(&scene.input, &scene.bake(&Settings { tolerance: 0.1, ..by(method) }));
        }
    }
}

fn sorted(mut corners: [u32; 3]) -> [u32; 3] {
    corners.sort_unstable();
    corners
}
