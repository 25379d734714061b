//! Whole bakes of tiny scenes.

use antumbra::Error;
use antumbra::monitor::Monitor;
use antumbra::scene::{
    AreaLightInput, LampInput, LampShape, MaterialInput, ObjectInput, SceneInput, SkyInput,
};
use antumbra::settings::{Effort, Method, Quantity, Settings, Transport};
use antumbra::solve::bake;
use glam::{DMat4, DVec3};

use crate::bytes::Bytes;

/// Whatever stands where, the bake ends, and its light is finite and not negative.
pub fn solver(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let settings = Settings {
        method: bytes.of(&[Method::Adm, Method::Dm, Method::As, Method::Uniform]),
        // Rays take the longest.
        transport: bytes.of(&[
            Transport::Hierarchical,
            Transport::Shooting,
            Transport::Hierarchical,
            Transport::Shooting,
            Transport::Hierarchical,
            Transport::Shooting,
            Transport::Hierarchical,
            Transport::Rays,
        ]),
        quantity: bytes.of(&[Quantity::Radiosity, Quantity::Irradiance]),
        separate_layers: bytes.coin(),
        tolerance: 1.0,
        element_size: bytes.of(&[0.0, 1.0]),
        max_level: 1,
        triangle_budget: 40,
        verify_points: bytes.of(&[0, 0, 0, 0, 0, 0, 0, 4]),
        threads: 1,
        effort: Effort { patches: 30.0, rays: 1e3, links: 100 },
        ..Settings::default()
    };
    let input = scene(&mut bytes);
    let baked = match bake(&input, &settings, &Monitor::new()) {
        Ok(baked) => baked,
        Err(Error::NoLight | Error::NoReceiver | Error::EndlessLight { .. }) => return,
        Err(error) => panic!("{error}"),
    };
    for mesh in &baked.meshes {
        assert_eq!(mesh.corner_radiance.len(), mesh.triangles.len());
        for &colour in mesh.corner_radiance.as_flattened().as_flattened() {
            assert!(colour.is_finite() && colour >= 0.0, "{colour}");
        }
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
    }
}

fn scene(bytes: &mut Bytes) -> SceneInput {
    let mut input = SceneInput::default();
    for index in 0..2 {
        let reflectance = bytes.of(&[0.5, 0.0, 0.9, 1.0]);
        let exitance = bytes.of(&[0.0, 0.0, 0.0, 1.0]);
        let transmittance = bytes.of(&[0.0, 0.0, 0.0, 0.5]);
        input.materials.push(MaterialInput {
            name: format!("material {index}"),
            reflectance_rgb: [reflectance; 3],
            exitance_rgb: [exitance; 3],
            transmittance_rgb: [transmittance; 3],
        });
    }
    for index in 0..1 + bytes.up_to(2) {
        input.objects.push(object(index, bytes));
    }
    for _ in 0..bytes.up_to(2) {
        let [corner, u, v] = [bytes.point(), bytes.point(), bytes.point()];
        input.lights.push(AreaLightInput {
            name: "light".to_owned(),
            outline: vec![corner, corner + u, corner + u + v, corner + v],
            exitance_rgb: [1.0, bytes.share(), 0.0],
        });
    }
    match bytes.byte() % 6 {
        0 => input.lamps.push(LampInput::new(
            "sun",
            LampShape::Sun {
                direction: bytes.direction(),
                angle: bytes.of(&[0.0, 0.1]),
                irradiance_rgb: [1.0; 3],
            },
        )),
        1 => input.lamps.push(LampInput::new(
            "bulb",
            LampShape::Point {
                position: bytes.point(),
                radius: bytes.of(&[0.0, 0.1]),
                faces_receiver: bytes.coin(),
                intensity_rgb: [1.0; 3],
                cone: None,
            },
        )),
        2 => input.sky = Some(SkyInput::even("sky", [1.0; 3])),
        _ => {}
    }
    input
}

/// A box, seen from either side, or some triangles.
fn object(index: usize, bytes: &mut Bytes) -> ObjectInput {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    if bytes.coin() {
        let [a, b] = [bytes.point(), bytes.point()];
        positions.extend((0..8).map(|corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { a[axis] } else { b[axis] };
            DVec3::new(pick(0), pick(1), pick(2))
        }));
        for [a, b, c, d] in
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        {
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    } else {
        let count = 3 + bytes.up_to(4);
        positions.extend((0..count).map(|_| bytes.point()));
        let faces = 1 + bytes.up_to(3);
        triangles.extend((0..faces).map(|_| [0; 3].map(|_| u32::from(bytes.byte()) % count as u32)));
    }
    ObjectInput {
        name: format!("object {index}"),
        positions,
        triangle_materials: triangles.iter().map(|_| u32::from(bytes.byte() & 1)).collect(),
        triangles,
        world_from_object: DMat4::IDENTITY,
        corner_normals: None,
        receives: bytes.byte() % 4 != 0,
        blocks: true,
        sends: true,
    }
}
