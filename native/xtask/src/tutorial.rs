//! `cargo xtask tutorial`: the pictures of addon/manual/tutorial.md, taken in Blender's window by doing what it says.

use std::path::PathBuf;

use clap::Args;

use crate::failure::{Failure, Outcome, run as run_command, run_quietly};
use crate::host::Host;
use crate::venv::Venv;
use crate::{extension, files, tree};

/// What the tutorial shows.
const PICTURES: [&str; 6] =
    ["check.png", "running.png", "baked.png", "lines.png", "false-colours.png", "error-curve.png"];

/// Options of the task.
#[derive(Args)]
pub(crate) struct Options {
    /// The real Blender whose window is shown; otherwise $BLENDER, one on PATH, or the one that .ci/get-blender fetched.
    #[arg(long, value_name = "PATH")]
    blender: Option<PathBuf>,
}

/// Writes the pictures to addon/manual/pictures.
pub(crate) fn run(options: &Options) -> Outcome {
    let host = match &options.blender {
        Some(program) => Some(Host::choose(Some(program), None)?),
        None => Host::installed_or_cached()?,
    };
    let host = host.ok_or_else(|| {
        Failure::Input(
            "there is no real Blender, and bpy has no window: .ci/get-blender fetches one".to_owned(),
        )
    })?;
    extension::set_up(&host)?;
    let scene = tree::target("tutorial/paper.blend");
    files::make_parent(&scene)?;
    run_quietly(host.script(&tree::path("tests/scenes/paper.py")).arg(&scene))?;

    println!("Taking pictures");
    let taken = tree::target("tutorial");
    let mut pictures = tree::command(Venv::ready("tools")?.python());
    pictures.arg(tree::path("tests/window/make_pictures.py")).arg(&scene).arg(&taken);
    host.in_window(&mut pictures);
    run_command(&mut pictures)?;
    for picture in PICTURES {
        files::copy(&taken.join(picture), &tree::path("addon/manual/pictures").join(picture))?;
    }
    println!("{}", tree::path("addon/manual/pictures").display());
    Ok(())
}
