//! Light between surfaces: what links and conjugate gradients must give for every reflectance, and that the paper's way,
//! shooting, agrees.

mod common;

use antumbra::Error;
use antumbra::report::TransportSummary;
use antumbra::settings::{Settings, Transport};
use antumbra::weld::BakedMesh;
use common::baked::{all_light, assert_sound};
use common::scene::{Scene, adaptive, arriving, by_shooting, lamp, uniform};
use common::shape::Shape;
use glam::{DMat4, DQuat, DVec3};

fn by_links() -> Settings {
    Settings { transport: Transport::Hierarchical, ..adaptive() }
}

fn by_rays() -> Settings {
    Settings { transport: Transport::Rays, ..adaptive() }
}

/// A cube of 1 m whose walls reflect and emit alike.
fn furnace(reflectance: f64) -> Scene {
    let mut scene = Scene::default();
    let wall = scene.material(reflectance, 1.0);
    scene.object("furnace", Shape::room(DVec3::ONE), wall);
    scene
}

/// A closed room of walls from black to nearly white with a box in it, lit from below its ceiling.
fn room() -> Scene {
    let mut scene = Scene::default();
    let walls: Vec<u32> =
        [0.0, 0.3, 0.6, 0.8, 0.9, 0.99].into_iter().map(|rho| scene.material(rho, 0.0)).collect();
    let shell = scene.object("walls", Shape::room(DVec3::new(3.0, 4.0, 2.5)), walls[0]);
    for (index, material) in shell.triangle_materials.iter_mut().enumerate() {
        *material = walls[index / 2];
    }
    scene.input.materials[2].reflectance_rgb = [0.9, 0.5, 0.1];
    let place = DMat4::from_rotation_translation(DQuat::from_rotation_z(0.5), DVec3::new(1.8, 2.5, 0.5));
    scene.object("box", Shape::cuboid(DVec3::ZERO, DVec3::new(0.5, 0.3, 0.3)), walls[3]).world_from_object =
        place;
    scene.light(&lamp(DVec3::new(1.2, 2.0, 2.3), 0.3), 10.0);
    scene
}

/// Mean light over meshes.
fn mean<'a>(meshes: impl IntoIterator<Item = &'a BakedMesh>) -> DVec3 {
    let (mut sum, mut area) = (DVec3::ZERO, 0.0);
    for mesh in meshes {
        for (triangle, colours) in mesh.triangles.iter().zip(&mesh.corner_radiance) {
            let size = common::baked::area(triangle.map(|v| mesh.positions[v as usize]));
            sum += size * colours.map(common::baked::light).into_iter().sum::<DVec3>() / 3.0;
            area += size;
        }
    }
    sum / area
}

/// B = E/(1 - rho) for every reflectance, after few iterations.
#[test]
fn a_furnace_is_right_however_much_it_reflects() {
    for reflectance in [0.0, 0.5, 0.9, 0.99, 0.999, 0.999_999] {
        let scene = furnace(reflectance);
        let bake = scene.bake(&by_links());
        let expected = 1.0 / (1.0 - reflectance);
        let error = |light: DVec3| (light / expected - 1.0).abs().max_element();
        let worst = all_light(&bake).map(error).fold(0.0, f64::max);
        let transport = &bake.report.result.transport;
        println!("rho {reflectance}: off by {worst:.1e}, {} iterations", transport.iterations);
        assert!(worst <= 1e-6, "rho {reflectance}: off by {worst:e}");
        assert!(transport.iterations <= 20, "rho {reflectance}: {} iterations", transport.iterations);
    }
}

#[test]
fn a_closed_room_absorbs_exactly_what_is_emitted() {
    let scene = room();
    let bake = scene.bake(&arriving(by_links()));
    assert_sound(&scene.input, &bake);
    let imbalance = bake.report.result.transport.imbalance.expect("the room is closed");
    println!("|absorbed - emitted| / emitted = {imbalance:.1e}");
    assert!(imbalance <= 1e-9, "{imbalance:e} of the light is lost");
}

#[test]
fn an_open_room_is_not_said_to_keep_its_light() {
    let mut scene = room();
    scene.input.objects[0].triangles.truncate(10);
    scene.input.objects[0].triangle_materials.truncate(10);
    assert_eq!(scene.bake(&by_links()).report.result.transport.imbalance, None);
}

#[test]
fn a_closed_room_that_reflects_everything_is_refused_by_name() {
    for settings in [by_links(), by_shooting()] {
        let Err(Error::EndlessLight { surfaces }) = furnace(1.0).try_bake(&settings) else {
            panic!("it has no solution")
        };
        assert_eq!(surfaces, "“furnace”");
        // One channel is enough
        let mut scene = furnace(0.5);
        scene.input.materials[0].reflectance_rgb = [0.5, 1.0, 0.5];
        assert!(matches!(scene.try_bake(&settings), Err(Error::EndlessLight { .. })));
        // Not where nothing is emitted in it
        scene.input.materials[0].exitance_rgb = [1.0, 0.0, 1.0];
        let lights: Vec<DVec3> = all_light(&scene.bake(&settings)).collect();
        for light in lights {
            assert!(light.y == 0.0 && (light.x - 2.0).abs() < 2e-6, "{light}");
        }
    }
}

/// A white box around a lamp, closed: what is outside is not asked.
fn lit_safe(walls: [f64; 3]) -> Scene {
    let mut scene = room();
    let white = scene.material(1.0, 0.0);
    scene.input.materials[white as usize].reflectance_rgb = walls;
    scene.blocker("safe", Shape::room(DVec3::splat(0.4)).map(|p| p + DVec3::splat(0.3)), white);
    scene.light(&lamp(DVec3::splat(0.5), 0.1), 10.0);
    scene
}

/// A closed slit of white that glows, one of whose ends lets half of the light through: it gets out after about as many
/// reflections as the square of the length by the width.
fn glowing_slit(width: f64) -> Scene {
    let mut scene = Scene::default();
    let [filter, white, grey] =
        [scene.material(1.0, 1.0), scene.material(1.0, 1.0), scene.material(0.5, 0.0)];
    scene.input.materials[filter as usize].transmittance_rgb = [0.5; 3];
    let slit = scene.object("slit", Shape::room(DVec3::new(width, 1.0, 1.0)), white);
    let is_below = |triangle: &[u32; 3]| triangle.iter().all(|&v| slit.positions[v as usize].z == 0.0);
    for (material, triangle) in slit.triangle_materials.iter_mut().zip(&slit.triangles) {
        if is_below(triangle) {
            *material = filter;
        }
    }
    scene.object("below", Shape::cuboid(DVec3::new(0.0, 0.5, -1.0), DVec3::splat(0.5)), grey);
    scene
}

/// Light so enclosed that no ray of hundreds finds out: links a little too strong would make any amount of it.
#[test]
fn light_that_leaves_a_white_slit_after_millions_of_reflections_is_refused_by_name() {
    for settings in [by_links(), by_shooting()] {
        for width in [1e-5, 6e-7] {
            let Err(Error::EndlessLight { surfaces }) = glowing_slit(width).try_bake(&settings) else {
                panic!("{width} wide, by {:?}", settings.transport)
            };
            assert_eq!(surfaces, "“slit”");
        }
        let scene = glowing_slit(0.3);
        assert_sound(&scene.input, &scene.bake(&settings));
    }
}

/// Not even where nobody would see it: shots would go on for ever, and others never come to shoot.
#[test]
fn shooting_refuses_light_in_a_white_box_that_is_not_baked() {
    let Err(Error::EndlessLight { surfaces }) = lit_safe([0.5, 0.5, 1.0]).try_bake(&by_shooting()) else {
        panic!("it has no solution")
    };
    assert_eq!(surfaces, "“safe”");
    // What one wall absorbs of a channel is no help for another, and enough for its own
    let mut scene = lit_safe([1.0; 3]);
    let (red, cyan) = (scene.material(0.0, 0.0), scene.material(0.0, 0.0));
    scene.input.materials[red as usize].reflectance_rgb = [1.0, 0.9, 0.9];
    scene.input.materials[cyan as usize].reflectance_rgb = [0.9, 1.0, 1.0];
    let safe = scene.input.objects.last_mut().expect("it is there");
    for (index, material) in safe.triangle_materials.iter_mut().enumerate() {
        *material = if index < 6 { red } else { cyan };
    }
    assert_sound(&scene.input, &scene.bake(&Settings { tolerance: 0.1, ..by_shooting() }));
}

/// Shot by shot this would take about 1/(1 - rho) shots of every patch.
#[test]
fn a_furnace_is_right_by_shooting() {
    for reflectance in [0.5, 0.99, 0.999_999] {
        let bake = furnace(reflectance).bake(&Settings { tolerance: 0.1, ..by_shooting() });
        let result = &bake.report.result;
        let expected = 1.0 / (1.0 - reflectance);
        let error = |light: DVec3| (light / expected - 1.0).abs().max_element();
        let worst = all_light(&bake).map(error).fold(0.0, f64::max);
        let TransportSummary { elements, iterations, .. } = result.transport;
        println!(
            "rho {reflectance}: off by {worst:.1e}, {iterations} shots and iterations of {elements} sources"
        );
        assert!(worst <= 1e-6, "rho {reflectance}: off by {worst:e}");
        // A shot of each side that is lit computes its column, and one more finds that all are there.
        assert!(iterations <= 3 * elements + 20, "rho {reflectance}: {iterations}");
    }
}

#[test]
fn what_reflects_everything_in_the_open_is_fine() {
    let mut scene = Scene::default();
    let mirror_white = scene.material(1.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 1.0), mirror_white);
    scene.object("cube", Shape::cuboid(DVec3::Z * 0.3, DVec3::splat(0.3)), mirror_white);
    scene.light(&lamp(DVec3::Z * 2.0, 0.3), 10.0);
    let bake = scene.bake(&by_links());
    assert_sound(&scene.input, &bake);
    let brightest = all_light(&bake).map(DVec3::max_element).fold(0.0, f64::max);
    assert!(brightest > 0.1 && brightest < 10.0, "{brightest}");
}

/// Rows of rays sum to exactly 1, however few they are.
#[test]
fn a_furnace_is_right_by_rays() {
    for reflectance in [0.0, 0.5, 0.99, 0.999_999] {
        let bake = furnace(reflectance).bake(&by_rays());
        let expected = 1.0 / (1.0 - reflectance);
        let worst =
            all_light(&bake).map(|light| (light / expected - 1.0).abs().max_element()).fold(0.0, f64::max);
        let transport = &bake.report.result.transport;
        println!("rho {reflectance}: off by {worst:.1e}, {} iterations", transport.iterations);
        assert!(worst <= 1e-6, "rho {reflectance}: off by {worst:e}");
    }
}

/// A picture a millimetre before a lit wall: what is behind it is dark to within the gap, although it lies between lit rims
/// and faces a wall that is lit all around.
#[test]
fn rays_find_the_darkness_behind_a_picture() {
    let mut scene = Scene::default();
    let white = scene.material(0.7, 0.0);
    scene.object("room", Shape::room(DVec3::splat(3.0)), white);
    let picture = Shape::cuboid(DVec3::new(1.5, 0.006, 1.5), DVec3::new(0.5, 0.005, 0.4));
    scene.object("picture", picture, white);
    scene.light(&lamp(DVec3::new(1.5, 1.5, 2.9), 0.5), 10.0);
    let bake = scene.bake(&arriving(by_rays()));
    let light = |object: usize, at: DVec3| {
        let mesh = bake.meshes.iter().find(|mesh| mesh.object == object).expect("it is baked");
        common::baked::light_at(mesh, at).expect("there is a surface")
    };
    let [behind, wall] = [light(1, DVec3::new(1.45, 0.001, 1.4)), light(0, DVec3::new(1.45, 0.0, 1.4))];
    let beside = light(0, DVec3::new(0.6, 0.0, 1.4));
    println!("behind it {behind}, on the wall {wall}, beside it {beside}");
    assert!(behind.max_element() < 0.01 * beside.max_element());
    assert!(wall.max_element() < 0.01 * beside.max_element());
}

/// Plates the width of a hand before the walls of a hall: no element of so large a wall has a corner or the middle of an edge
/// behind one, but the patches that look around are there.
#[test]
fn rays_find_the_darkness_that_no_corner_sees() {
    let mut scene = Scene::default();
    let white = scene.material(0.7, 0.0);
    scene.object("hall", Shape::room(DVec3::splat(6.0)), white);
    let places = [(1.13, 0.91), (2.3, 4.47), (3.77, 2.21), (4.9, 5.3), (0.52, 3.6), (5.33, 1.37)];
    for (x, z) in places {
        let plate = Shape::cuboid(DVec3::new(x, 0.006, z), DVec3::new(0.12, 0.003, 0.09));
        scene.object("plate", plate, white);
    }
    scene.light(&lamp(DVec3::new(3.0, 3.0, 5.9), 0.5), 10.0);
    let bake = scene.bake(&Settings { tolerance: 0.01, ..arriving(by_rays()) });
    let wall = bake.meshes.iter().find(|mesh| mesh.object == 0).expect("it is baked");
    let light =
        |x: f64, z: f64| common::baked::light_at(wall, DVec3::new(x, 0.0, z)).expect("there is a wall");
    let mut darkness = 0.0;
    for (x, z) in places {
        let [behind, beside] = [light(x, z), light(x + 0.3, z)].map(DVec3::max_element);
        println!("behind {behind:.4}, beside {beside:.4}");
        darkness += (1.0 - behind / beside) / places.len() as f64;
    }
    assert!(darkness > 0.9, "only {darkness} of the light is missing");
}

/// A sheet over a lamp in a floor, of which the middle is in the shadow: all light on the floor is what the sheet reflects, and it
/// does so with either side.
#[test]
fn rays_find_the_light_on_either_side_of_a_sheet() {
    let on_floor = |turned: bool| {
        let mut scene = Scene::default();
        let [black, white] = [scene.material(0.0, 0.0), scene.material(0.9, 0.0)];
        scene.object("floor", Shape::square(DVec3::ZERO, 3.0), black);
        let sheet = Shape::square(DVec3::Z, 0.02);
        scene.object("sheet", if turned { sheet.inside_out() } else { sheet }, white);
        scene.blocker("screen", Shape::square(0.9 * DVec3::Z, 0.008), black);
        let mut upwards = lamp(0.01 * DVec3::Z, 0.01);
        upwards.reverse();
        scene.light(&upwards, 1e4);
        let bake = scene.bake(&Settings { transport: Transport::Rays, ..arriving(uniform(0.5)) });
        mean(bake.meshes.iter().filter(|mesh| mesh.object == 0)).y
    };
    let [back, front] = [on_floor(false), on_floor(true)];
    println!("by its back {back:e}, by its front {front:e}");
    // What is shown of the front knows its corners only, which are lit most.
    assert!(back > 0.5 * front && back < front, "{back} and {front}");
}

/// What reflects nothing sends no rays, and gets light all the same.
#[test]
fn black_surfaces_are_refined_where_rays_carry_the_light() {
    let mut scene = Scene::default();
    let black = scene.material(0.0, 0.0);
    scene.object("floor", Shape::square(DVec3::ZERO, 2.0), black);
    scene.object("box", Shape::cuboid(DVec3::Z, DVec3::splat(0.3)), black);
    scene.light(&lamp(DVec3::new(0.3, 0.2, 3.0), 0.2), 100.0);
    let floor = |settings: Settings| {
        let bake = scene.bake(&arriving(settings));
        common::baked::corners(&bake.meshes[0]).collect::<Vec<_>>()
    };
    let (links, rays) = (floor(by_links()), floor(by_rays()));
    assert!(rays.len() > 1000, "{} corners", rays.len());
    let most = |corners: &[(DVec3, DVec3)]| corners.iter().map(|(_, light)| light.y).fold(0.0, f64::max);
    let dark = |corners: &[(DVec3, DVec3)]| corners.iter().filter(|(_, light)| light.y == 0.0).count();
    assert!((most(&rays) / most(&links) - 1.0).abs() < 0.01);
    assert!(dark(&links) > 0 && dark(&rays) > 0);
}

#[test]
fn rays_leave_the_inside_of_a_closed_box_dark_and_refuse_endless_light() {
    let mut scene = room();
    let white = scene.material(1.0, 0.0);
    scene.object("safe", Shape::room(DVec3::splat(0.4)).map(|p| p + DVec3::splat(0.3)), white);
    let bake = scene.bake(&by_rays());
    let safe = bake.meshes.iter().find(|mesh| mesh.object == 2).expect("it is baked");
    let colours = safe.corner_radiance.as_flattened().as_flattened();
    assert!(colours.iter().all(|&colour| colour == 0.0));

    let Err(Error::EndlessLight { surfaces }) = furnace(1.0).try_bake(&by_rays()) else {
        panic!("it has no solution")
    };
    assert_eq!(surfaces, "“furnace”");
}

/// What keeps red for ever has a solution in light that has none.
#[test]
fn walls_that_absorb_no_red_are_refused_in_red_light_only() {
    let lit = |exitance_rgb: [f64; 3]| {
        let mut scene = furnace(0.5);
        scene.input.materials[0].reflectance_rgb = [1.0, 0.5, 0.5];
        scene.input.materials[0].exitance_rgb = exitance_rgb;
        scene
    };
    for settings in [by_links(), by_shooting(), by_rays()] {
        let light = mean(&lit([0.0, 1.0, 1.0]).bake(&settings).meshes);
        assert!(light.distance(DVec3::new(0.0, 2.0, 2.0)) < 0.02, "{light} by {:?}", settings.transport);
        let Err(Error::EndlessLight { surfaces }) = lit([1.0, 1.0, 1.0]).try_bake(&settings) else {
            panic!("it has no solution by {:?}", settings.transport)
        };
        assert_eq!(surfaces, "“furnace”");
    }
}

/// Means over the baked surfaces of a room by all ways.
#[test]
fn shooting_links_and_rays_agree() {
    let scene = room();
    let mean = |settings: &Settings| mean(&scene.bake(settings).meshes);
    let (links, shots) = (mean(&arriving(by_links())), mean(&arriving(by_shooting())));
    let rays = mean(&arriving(by_rays()));
    println!("by links {links}, by shooting {shots}, by rays {rays}");
    assert!((rays / links - 1.0).abs().max_element() < 0.01, "{rays} and {links}");
    assert!((links / shots - 1.0).abs().max_element() < 0.015, "{links} and {shots}");
}

/// Left to itself, the solver links scenes of few faces, and where shots would not end.
#[test]
fn the_report_says_which_way_was_taken() {
    let mode = |reflectance, transport| {
        let settings = Settings { transport, ..adaptive() };
        furnace(reflectance).bake(&settings).report.result.transport.mode
    };
    assert_eq!(mode(0.5, Transport::Auto), "HIERARCHICAL");
    assert_eq!(mode(0.95, Transport::Auto), "HIERARCHICAL");
    assert_eq!(mode(0.5, Transport::Hierarchical), "HIERARCHICAL");
    assert_eq!(mode(0.95, Transport::Shooting), "SHOOTING");
    assert_eq!(mode(0.5, Transport::Rays), "RAYS");
}
