//! The exact visible form factor against closed forms and limits.

mod common;

use antumbra::visibility::unoccluded_form_factor;
use common::{receiver, rectangle};
use glam::DVec3;

#[test]
fn rectangle_parallel_to_the_receiver() {
    for (a, b, c, expected) in [
        (1.0, 1.0, 1.0, 0.138_531_605_994_893),
        (2.0, 1.0, 1.0, 0.167_375_009_914_384),
        (10.0, 10.0, 1.0, 0.247_971_408_295_310),
    ] {
        let source = rectangle(DVec3::Z * c, DVec3::X * a, DVec3::Y * b);
        let form_factor = unoccluded_form_factor(&receiver([0.0; 3], [0.0, 0.0, 1.0]), &source);
        assert!((form_factor - expected).abs() < 1e-15, "{a}×{b} at {c}: {form_factor}");
    }
}
