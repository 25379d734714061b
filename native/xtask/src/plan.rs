//! `cargo xtask plan`: what each switch of the plan saves, in processor time and memory, as tables.

use crate::failure::{Outcome, run as run_command};
use crate::tree;

/// Bakes small scenes with and without each switch.
pub(crate) fn run() -> Outcome {
    let mut cargo = tree::command("cargo");
    cargo.args(["test", "--quiet", "--package", "antumbra", "--test", "plan_savings"]);
    run_command(cargo.args(["--", "--ignored", "--nocapture", "--test-threads", "1"]))
}
