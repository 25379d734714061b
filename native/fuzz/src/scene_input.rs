//! Whatever a caller may hand in.

use antumbra::Error;
use antumbra::monitor::Monitor;
use antumbra::scene::{
    AreaLightInput, ConeInput, LampInput, LampShape, MaterialInput, ObjectInput, SceneInput, SkyInput,
};
use antumbra::settings::Settings;
use antumbra::solve::bake;
use glam::{DMat3, DMat4, DVec3};

use crate::bytes::Bytes;

/// Refused in one line, or accepted: a bake that was cancelled before it began ends there.
pub fn scene_input(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let settings = Settings {
        tolerance: bytes.number(),
        element_size: bytes.number(),
        time_limit: bytes.number(),
        verify_points: 0,
        threads: 1,
        ..Settings::default()
    };
    // Mostly sound, or nothing else would be looked at.
    let settings = if bytes.byte() == 0 { settings } else { Settings { threads: 1, ..Settings::default() } };
    let input = input(&mut bytes);
    let monitor = Monitor::new();
    monitor.cancel();
    let error = bake(&input, &settings, &monitor).expect_err("it was cancelled");
    assert!(!error.to_string().contains('\n'));
    assert!(!matches!(error, Error::Threads { .. }));
}

fn input(bytes: &mut Bytes) -> SceneInput {
    let mut input = SceneInput::default();
    for index in 0..1 + bytes.up_to(2) {
        input.materials.push(MaterialInput {
            name: format!("material {index}"),
            reflectance_rgb: [0; 3].map(|_| bytes.number().abs()),
            exitance_rgb: [0; 3].map(|_| bytes.number().abs()),
            transmittance_rgb: [0; 3].map(|_| bytes.number().abs()),
        });
    }
    for index in 0..bytes.up_to(3) {
        input.objects.push(object(index, input.materials.len(), bytes));
    }
    for index in 0..bytes.up_to(2) {
        let corners = bytes.up_to(5);
        input.lights.push(AreaLightInput {
            name: format!("light {index}"),
            outline: (0..corners).map(|_| vector(bytes)).collect(),
            exitance_rgb: [0; 3].map(|_| bytes.number()),
        });
    }
    for _ in 0..bytes.up_to(2) {
        let mut lamp = LampInput::new("lamp", lamp_shape(bytes));
        lamp.casts_shadows = bytes.coin();
        lamp.lit_objects = bytes.coin().then(|| vec![u32::from(bytes.byte() % 4)]);
        lamp.blocking_objects = bytes.coin().then(|| vec![u32::from(bytes.byte() % 4)]);
        input.lamps.push(lamp);
    }
    if bytes.coin() {
        let cells_per_side = bytes.of(&[1, 2, 4, 3, 0]);
        let cells = if bytes.byte() == 0 { 5 } else { 6 * cells_per_side * cells_per_side };
        let exitance_rgb = (0..cells).map(|_| [bytes.number(), 0.5, 0.5]).collect();
        input.sky = Some(SkyInput { name: "sky".to_owned(), cells_per_side, exitance_rgb });
    }
    input
}

fn object(index: usize, materials: usize, bytes: &mut Bytes) -> ObjectInput {
    let vertices = 3 + bytes.up_to(5);
    let count = bytes.up_to(6);
    // Now and then one that is not there
    let within = |bytes: &mut Bytes, count: usize| {
        let byte = bytes.byte();
        if byte == 255 { u32::from(byte) } else { u32::from(byte) % count as u32 }
    };
    let mut matrix = DMat4::IDENTITY;
    if bytes.coin() {
        let axes = [0; 4].map(|_| vector(bytes));
        matrix = DMat4::from_cols(
            axes[0].extend(0.0),
            axes[1].extend(0.0),
            axes[2].extend(0.0),
            axes[3].extend(1.0),
        );
    }
    let normals = if bytes.byte() == 0 { count + 1 } else { count };
    ObjectInput {
        name: format!("object {index}"),
        positions: (0..vertices).map(|_| vector(bytes)).collect(),
        triangles: (0..count).map(|_| [0; 3].map(|_| within(bytes, vertices))).collect(),
        triangle_materials: (0..count).map(|_| within(bytes, materials)).collect(),
        world_from_object: matrix,
        corner_normals: bytes.coin().then(|| (0..normals).map(|_| [0; 3].map(|_| vector(bytes))).collect()),
        receives: bytes.coin(),
        blocks: bytes.coin(),
        sends: bytes.coin(),
    }
}

fn lamp_shape(bytes: &mut Bytes) -> LampShape {
    match bytes.byte() % 3 {
        0 => LampShape::Sun {
            direction: vector(bytes),
            angle: bytes.number().abs(),
            irradiance_rgb: [bytes.number(), 1.0, 1.0],
        },
        1 => LampShape::Point {
            position: vector(bytes),
            radius: bytes.number(),
            faces_receiver: bytes.coin(),
            intensity_rgb: [bytes.number(), 1.0, 1.0],
            cone: bytes.coin().then(|| ConeInput {
                cone_from_world: DMat3::from_cols(vector(bytes), vector(bytes), vector(bytes)),
                angle: bytes.number(),
                blend: bytes.number(),
            }),
        },
        _ => {
            let corners = bytes.up_to(5);
            LampShape::Panel {
                outline: (0..corners).map(|_| vector(bytes)).collect(),
                exitance_rgb: [bytes.number(), 1.0, 1.0],
                spread: bytes.number(),
            }
        }
    }
}

/// Mostly of ordinary numbers.
fn vector(bytes: &mut Bytes) -> DVec3 {
    if bytes.byte() < 16 { DVec3::new(bytes.number(), bytes.number(), bytes.number()) } else { bytes.point() }
}
