//! `cargo xtask robustness`: how the solver bears what is stiff, huge, tiny or far away, as curves.
//!
//! ```text
//! tests/study/robustness.py ──► target/robustness/robustness.csv, robustness.md, robustness.png
//! ```
//!
//! By the binding alone: no Blender is needed.

use clap::Args;

use crate::failure::{Outcome, run as run_command};
use crate::venv::Venv;
use crate::{files, tree, wheel};

/// Options of the task.
#[derive(Args)]
pub(crate) struct Options {
    /// Also keep the picture beside the manual.
    #[arg(long)]
    keep: bool,
}

/// Measures and draws.
pub(crate) fn run(options: &Options) -> Outcome {
    let study = Venv::ready("study")?;
    study.install_wheel(&wheel::build_native()?)?;
    let folder = tree::target("robustness");
    let picture = folder.join("robustness.png");
    files::make_parent(&picture)?;
    let mut measure = tree::command(study.python());
    run_command(measure.arg(tree::path("tests/study/robustness.py")).arg(&folder))?;
    if options.keep {
        files::copy(&picture, &tree::path("addon/manual/pictures/robustness.png"))?;
    }
    println!("\nrobustness.csv, robustness.md and robustness.png are in {}", folder.display());
    Ok(())
}
