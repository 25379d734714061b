//! `cargo xtask scale`: how the time and the memory of a bake grow with the scene, and whether it stays as right.
//!
//! ```text
//! tests/scenes/scale.py ──► target/scale/scenes/TRIANGLES.blend   the same kind of flat, larger and finer
//! tests/study/scale_bake.py ──► bakes/TRIANGLES.json   through the installed extension, one process per bake
//! tests/study/scale_tables.py ──► table.md, scale.json, scale.png   with the exponents of growth
//! ```
//!
//! Processor time grows as it does whatever else runs; the time on the clock is told too, and means something on an idle
//! machine only.

use std::process::Stdio;

use clap::Args;

use crate::bake::refuse_what_is_no_setting;
use crate::failure::{Outcome, run as run_command, run_quietly};
use crate::host::HostOptions;
use crate::venv::Venv;
use crate::{extension, files, tree};

/// Options of the task.
#[derive(Args)]
pub(crate) struct Options {
    /// Triangles of the scenes, 800 to 4,000,000.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "TRIANGLES,...",
        default_value = "1000,10000,100000,1000000"
    )]
    sizes: Vec<u32>,
    /// The tolerance of all bakes.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    tolerance: f64,
    /// Another setting of all bakes, for example transport=RAYS; may be given again.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// Only measure again what was baked before.
    #[arg(long)]
    only_tables: bool,
    #[command(flatten)]
    host: HostOptions,
}

/// Makes the scenes, bakes them, and fits.
pub(crate) fn run(options: &Options) -> Outcome {
    // Refuse what cannot work before anything is downloaded or built.
    refuse_what_is_no_setting(&options.settings)?;
    let plotting = Venv::ready("study")?;
    let folder = tree::target("scale/bakes");
    if !options.only_tables {
        let host = options.host.choose()?;
        extension::set_up(&host)?;
        files::remove_folder(&folder)?;
        for size in &options.sizes {
            let blend = tree::target(&format!("scale/scenes/{size}.blend"));
            files::make_parent(&blend)?;
            let mut make = host.script(&tree::path("tests/scenes/scale.py"));
            run_quietly(make.arg(size.to_string()).arg(&blend))?;
            println!("Baking {}", blend.display());
            let report = folder.join(format!("{size}.json"));
            files::make_parent(&report)?;
            let mut bake = host.script(&tree::path("tests/study/scale_bake.py"));
            bake.arg(&blend).arg(&report).arg(format!("tolerance={}", options.tolerance));
            // What Blender says to itself is not for the terminal.
            run_command(bake.args(&options.settings).stdin(Stdio::null()).stdout(Stdio::null()))?;
        }
    }
    let mut tables = tree::command(plotting.python());
    run_command(tables.arg(tree::path("tests/study/scale_tables.py")).arg(tree::target("scale")))
}
