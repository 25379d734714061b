//! `cargo xtask test`: every check there is, then one table of what held.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use clap::Args;

use crate::bpy::BpyVersion;
use crate::failure::{Failure, Outcome, run as run_command};
use crate::host::Host;
use crate::venv::Venv;
use crate::{extension, tree, wheel};

/// Tells tests in Python whether those that take minutes are wanted.
const LONG: &str = "ANTUMBRA_LONG";

/// Options of the task.
#[derive(Args)]
pub(crate) struct Options {
    /// Also the tests that take minutes, those in Blender's window, and every bpy version.
    #[arg(long)]
    long: bool,
    /// Only the steps whose name contains this, with what they need.
    #[arg(long, value_name = "TEXT", default_value = "")]
    filter: String,
    /// Test the extension in this version of the bpy module; may be given again. Otherwise in the newest.
    #[arg(long, value_name = "VERSION")]
    bpy: Vec<BpyVersion>,
    /// The real Blender to test in; otherwise $BLENDER, one on PATH, or the one that .ci/get-blender fetched.
    #[arg(long, value_name = "PATH")]
    blender: Option<PathBuf>,
}

impl Options {
    fn bpy_versions(&self) -> Vec<BpyVersion> {
        match (self.long, self.bpy.as_slice()) {
            (true, []) => BpyVersion::ALL.to_vec(),
            (false, []) => vec![BpyVersion::V5_0],
            (_, versions) => versions.to_vec(),
        }
    }
}

/// Runs the steps and prints how each one went.
pub(crate) fn run(options: &Options) -> Outcome {
    let blender = match &options.blender {
        Some(program) => Some(Host::choose(Some(program), None)?),
        None => Host::installed_or_cached()?,
    };
    let mut steps = Steps { filter: options.filter.clone(), done: Vec::new() };
    check_rust(&mut steps, options.long);
    check_python(&mut steps);
    check_installed(&mut steps, options, blender.as_ref());
    steps.print();
    if blender.is_none() {
        println!(
            "\n*** NOT TESTED IN A REAL BLENDER: there is none in $BLENDER, on PATH or in the cache. ***"
        );
        println!("*** .ci/get-blender fetches one on Debian; elsewhere use --blender PATH.              ***");
    }
    steps.verdict()
}

fn check_rust(steps: &mut Steps, long: bool) {
    steps.step("rust format", || run_command(tree::cargo().args(["fmt", "--all", "--check"])));
    steps.step("rust lint", || {
        let lint = ["clippy", "--workspace", "--all-targets", "--locked", "--", "--deny", "warnings"];
        run_command(tree::cargo().args(lint))
    });
    steps.step("rust tests", || {
        let mut tests = tree::cargo();
        match (has_nextest(), long) {
            (true, false) => tests.args(["nextest", "run", "--no-fail-fast", "--workspace", "--locked"]),
            (true, true) => tests.args([
                "nextest",
                "run",
                "--no-fail-fast",
                "--workspace",
                "--locked",
                "--run-ignored",
                "all",
            ]),
            (false, false) => {
                tests.args(["test", "--no-fail-fast", "--workspace", "--locked", "--all-targets"])
            }
            (false, true) => tests.args([
                "test",
                "--no-fail-fast",
                "--workspace",
                "--locked",
                "--all-targets",
                "--",
                "--include-ignored",
            ]),
        };
        run_command(&mut tests)
    });
    // nextest does not run them.
    steps.step("rust doc tests", || {
        run_command(tree::cargo().args(["test", "--workspace", "--locked", "--doc"]))
    });
}

fn check_python(steps: &mut Steps) {
    steps.step("python lint", || {
        let tools = Venv::ready("tools")?;
        run_command(tools.module("ruff").args(["check", "."]))?;
        run_command(tools.module("ruff").args(["format", "--check", "."]))
    });
    steps.step("python types", || run_command(&mut Venv::ready("tools")?.module("mypy")));
}

/// What is installed is what gets tested: the wheel, then the zip with the wheel in it.
fn check_installed(steps: &mut Steps, options: &Options, blender: Option<&Host>) {
    let versions = options.bpy_versions();
    let in_bpy = |version: BpyVersion| format!("extension in bpy {}", version.name());
    let in_blender = blender.map(|host| format!("extension in {}", host.name()));
    let in_window = blender.filter(|_| options.long).map(|host| format!("window of {}", host.name()));
    let mut with_zip: Vec<String> = versions.iter().copied().map(in_bpy).collect();
    with_zip.extend(in_blender.clone());
    with_zip.extend(in_window.clone());
    let needs_zip = steps.selects("zip") || with_zip.iter().any(|name| steps.selects(name));
    let needs_wheel = ["wheel", "binding stub", "python tests"].iter().any(|name| steps.selects(name));
    if !needs_zip && !needs_wheel {
        return;
    }

    let Some(wheel) = steps.needed("wheel", wheel::build_native) else { return };
    let tools_with_wheel = || {
        let tools = Venv::ready("tools")?;
        tools.install_wheel(&wheel)?;
        Ok::<_, Failure>(tools)
    };
    steps.step("binding stub", || {
        let allowed = tree::path("native/antumbra-py/stubtest-allowlist.txt");
        let mut stubtest = tools_with_wheel()?.module("mypy.stubtest");
        run_command(stubtest.arg("antumbra_native").arg("--allowlist").arg(allowed))
    });
    steps.step("python tests", || {
        let mut pytest = tools_with_wheel()?.module("pytest");
        run_command(with_length(pytest.args(["-q", "tests/python"]), options.long))
    });
    if !needs_zip {
        return;
    }

    let zip = steps.needed("zip", || match blender {
        Some(host) => extension::build_native(host, &wheel),
        None => extension::build_native(&Host::bpy(versions[0])?, &wheel),
    });
    let Some(zip) = zip else { return };
    let test_in = |host: &Host| {
        host.install(&zip)?;
        run_command(with_length(host.pytest()?.args(["-q", "tests/blender"]), options.long))
    };
    for version in versions {
        steps.step(&in_bpy(version), || test_in(&Host::bpy(version)?));
    }
    if let Some((host, name)) = blender.zip(in_blender) {
        steps.step(&name, || test_in(host));
    }
    if let Some((host, name)) = blender.zip(in_window) {
        steps.step(&name, || test_in_window(host, &zip));
    }
}

/// Mouse and keys in a window on a screen that nobody sees. Where the machine has no such screen, the tests say what is
/// missing and are skipped.
fn test_in_window(host: &Host, zip: &Path) -> Outcome {
    host.install(zip)?;
    let mut pytest = Venv::ready("tools")?.module("pytest");
    pytest.args(["-q", "-rs", "tests/window"]).env("ANTUMBRA_WINDOW_FOLDER", tree::target("window"));
    host.in_window(&mut pytest);
    run_command(&mut pytest)
}

fn with_length(tests: &mut Command, long: bool) -> &mut Command {
    if long { tests.env(LONG, "1") } else { tests.env_remove(LONG) }
}

fn has_nextest() -> bool {
    let version =
        tree::cargo().args(["nextest", "--version"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    version.is_ok_and(|status| status.success())
}

/// The steps so far.
struct Steps {
    filter: String,
    done: Vec<Step>,
}

/// How one step went.
struct Step {
    name: String,
    time: Duration,
    failure: Option<Failure>,
}

impl Steps {
    fn selects(&self, name: &str) -> bool {
        name.contains(&self.filter)
    }

    /// Runs a step that was asked for; a failure does not keep the next ones from running.
    fn step(&mut self, name: &str, work: impl FnOnce() -> Outcome) {
        if self.selects(name) {
            self.needed(name, work);
        }
    }

    /// Runs a step that others need, asked for or not.
    fn needed<T>(&mut self, name: &str, work: impl FnOnce() -> Outcome<T>) -> Option<T> {
        println!("\n=== {name} ===");
        let start = Instant::now();
        let (value, failure) = match work() {
            Ok(value) => (Some(value), None),
            Err(failure) => (None, Some(failure)),
        };
        if let Some(failure) = &failure {
            println!("{name}: {failure}");
        }
        self.done.push(Step { name: name.to_owned(), time: start.elapsed(), failure });
        value
    }

    fn print(&self) {
        println!();
        for Step { name, time, failure } in &self.done {
            let verdict = if failure.is_none() { "passed" } else { "FAILED" };
            println!("{verdict}  {:>7.1} s  {name}", time.as_secs_f64());
        }
        let time: Duration = self.done.iter().map(|step| step.time).sum();
        println!("        {:>7.1} s  in all", time.as_secs_f64());
    }

    fn verdict(&self) -> Outcome {
        let failed: Vec<_> =
            self.done.iter().filter(|step| step.failure.is_some()).map(|step| step.name.as_str()).collect();
        match (self.done.is_empty(), failed.is_empty()) {
            (true, _) => Err(Failure::Input(format!("no step has “{}” in its name", self.filter))),
            (false, true) => Ok(()),
            (false, false) => Err(Failure::Task(format!("failed: {}", failed.join(", ")))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_failed_step_fails_the_task_and_the_others_still_run() {
        let mut steps = Steps { filter: String::new(), done: Vec::new() };
        steps.step("first", || Err(Failure::Task("on purpose".to_owned())));
        let mut ran = false;
        steps.step("second", || {
            ran = true;
            Ok(())
        });
        assert!(ran);
        assert_eq!(steps.verdict().unwrap_err().to_string(), "failed: first");
    }

    #[test]
    fn a_filter_that_selects_nothing_is_bad_input() {
        let mut steps = Steps { filter: "nothing".to_owned(), done: Vec::new() };
        steps.step("rust tests", || Ok(()));
        assert_eq!(steps.verdict().unwrap_err().exit_code(), 2);
    }
}
