//! What a bake says about its own error.

use antumbra::report::Verification;
use antumbra::weld::Bake;

pub(crate) fn verified(bake: &Bake) -> &Verification {
    bake.report.result.verification.as_ref().expect("there is light")
}

/// What a bake says about its own error, on a line of its own.
pub(crate) fn print(what: &str, bake: &Bake) {
    let v = verified(bake);
    let percent = |values: [f64; 3]| values.map(|value| (1e4 * value).round() / 100.0);
    println!(
        "{what} ({}): error {:?} %, bias {:?} %, p99 {:.2} %, energy {:+.2} %, noise {:.2} %, {} points of 2 x {} paths, \
         {} rays in {:.0} ms of {:.0} ms",
        bake.report.result.ended_by,
        percent(v.error),
        percent(v.bias),
        100.0 * v.p99,
        100.0 * v.energy_defect,
        100.0 * v.noise,
        v.points,
        v.paths,
        v.rays,
        1e3 * v.time_s,
        1e3 * bake.report.timings.solve_s,
    );
}
