//! Developer tasks: `cargo xtask bake | test | extension | study | scale | plan | robustness | fuzz | figure | tutorial`.
//!
//! Needs Rust, Python 3.11 and pip; everything else is set up under `target/` on first use:
//!
//! ```text
//! venv/NAME         one virtual environment per requirements file in tests/
//! wheels/           antumbra_native, built by maturin
//! extension/        the add-on with its wheels, as it is zipped
//! blender-user/     one user folder per Blender, so that the developer's own is never touched
//! bake/             what `cargo xtask bake` writes
//! study/            what `cargo xtask study` writes
//! scale/            what `cargo xtask scale` writes
//! robustness/       what `cargo xtask robustness` writes
//! ```

mod bake;
mod bpy;
mod extension;
mod failure;
mod figure;
mod files;
mod fuzz;
mod host;
mod plan;
mod progress;
mod robustness;
mod scale;
mod study;
mod summary;
mod test;
mod tree;
mod tutorial;
mod venv;
mod wheel;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Developer tasks of Antumbra", disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Bake a .blend, or the paper's scene, from nothing but this repository.
    Bake(bake::Options),
    /// Run every check and test.
    Test(test::Options),
    /// Build the extension's .zip files into dist/.
    Extension(extension::Options),
    /// Measure size, time and error of the methods on several scenes against a path tracer.
    Study(study::Options),
    /// Measure how the time and the memory of a bake grow with the scene.
    Scale(scale::Options),
    /// Measure what the plan's switches save.
    Plan,
    /// Measure how the solver bears stiff and extreme scenes.
    Robustness(robustness::Options),
    /// Try random bytes as scenes, lines and polygons, with cargo-fuzz.
    Fuzz(fuzz::Options),
    /// Take the pictures of addon/manual/tutorial.md in Blender's window.
    Tutorial(tutorial::Options),
    /// Draw two methods side by side, meshes above, light below.
    Figure(figure::Options),
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().task {
        Task::Bake(options) => bake::run(&options),
        Task::Test(options) => test::run(&options),
        Task::Extension(options) => extension::run(&options),
        Task::Study(options) => study::run(&options),
        Task::Scale(options) => scale::run(&options),
        Task::Plan => plan::run(),
        Task::Robustness(options) => robustness::run(&options),
        Task::Fuzz(options) => fuzz::run(&options),
        Task::Figure(options) => figure::run(&options),
        Task::Tutorial(options) => tutorial::run(&options),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.exit_code())
        }
    }
}
