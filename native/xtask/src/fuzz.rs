//! `cargo xtask fuzz`: random bytes as polygons, lines, input and whole scenes, as long as one likes.
//!
//! ```text
//! native/fuzz/targets/*.rs ──► cargo-fuzz (nightly) ──► native/fuzz/corpus/     what reached new code, kept for the next run
//!                                                  └──► native/fuzz/artifacts/  what broke
//! ```

use std::process::Stdio;

use clap::Args;

use crate::failure::{Failure, Outcome, run as run_command};
use crate::tree;

/// The targets, and the bytes that one execution reads at most.
const TARGETS: [(&str, u32); 5] =
    [("form_factor", 700), ("closure", 300), ("arrangement", 500), ("scene_input", 900), ("solver", 200)];

/// Options of the task.
#[derive(Args)]
pub(crate) struct Options {
    /// The targets: `form_factor`, `closure`, `arrangement`, `scene_input`, `solver`; otherwise all.
    targets: Vec<String>,
    /// Executions of each target.
    #[arg(long, value_name = "COUNT", default_value_t = 1_000_000)]
    runs: u64,
    /// Seconds for each target, if it has not done its executions by then.
    #[arg(long, value_name = "SECONDS", default_value_t = 3600)]
    seconds: u64,
    /// With the address sanitizer: several times slower, and of use in what is unsafe, which only libraries are here.
    #[arg(long)]
    sanitize: bool,
}

/// Runs the targets one after the other; the first that breaks ends it.
pub(crate) fn run(options: &Options) -> Outcome {
    let chosen = options.targets.iter().map(|name| {
        let known = TARGETS.into_iter().find(|(target, _)| target == name);
        known.ok_or_else(|| Failure::Input(format!("there is no fuzz target “{name}”; `--help` names them")))
    });
    let chosen = chosen.collect::<Outcome<Vec<_>>>()?;
    let chosen = if chosen.is_empty() { TARGETS.to_vec() } else { chosen };

    // rustup's cargo, not the one of this toolchain, knows of others.
    let mut version = tree::command("cargo");
    version.args(["+nightly", "fuzz", "--version"]).stdout(Stdio::null()).stderr(Stdio::null());
    if !version.status().is_ok_and(|status| status.success()) {
        return Err(Failure::Input(
            "cargo-fuzz or the nightly compiler is missing: `rustup toolchain install nightly --profile minimal` \
             and `cargo install cargo-fuzz --locked`"
                .to_owned(),
        ));
    }
    for (target, bytes) in chosen {
        println!("\n=== {target} ===");
        let mut fuzz = tree::command("cargo");
        fuzz.args(["+nightly", "fuzz", "run", "--fuzz-dir", "native/fuzz"]);
        // With `cfg(fuzzing)`, the triangulation checks all of itself at each of its points, nine tenths of all time; and to
        // log what every comparison compared would take half of the rest.
        fuzz.args(["--no-cfg-fuzzing", "--no-trace-compares"]);
        fuzz.args(["--sanitizer", if options.sanitize { "address" } else { "none" }, target, "--"]);
        fuzz.arg(format!("-runs={}", options.runs)).arg(format!("-max_total_time={}", options.seconds));
        fuzz.arg(format!("-max_len={bytes}")).args(["-timeout=60", "-print_final_stats=1"]);
        run_command(&mut fuzz)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_has_its_file() {
        for (target, _) in TARGETS {
            assert!(tree::path(&format!("native/fuzz/targets/{target}.rs")).is_file(), "{target}");
        }
    }

    #[test]
    fn an_unknown_target_is_bad_input() {
        let options = Options { targets: vec!["walls".to_owned()], runs: 1, seconds: 1, sanitize: false };
        assert_eq!(run(&options).unwrap_err().exit_code(), 2);
    }
}
