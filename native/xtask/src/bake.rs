//! `cargo xtask bake`: one .blend in, the baked .blend with its export, picture and report out.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::failure::{Failure, Outcome, run_quietly};
use crate::host::{Host, HostOptions};
use crate::{extension, files, progress, summary, tree};

/// Options of the task.
#[derive(Args)]
pub(crate) struct Options {
    /// The .blend to bake; without it the paper's scene is made and baked.
    scene: Option<PathBuf>,
    /// The baked .blend; its .glb and .png are put beside it.
    #[arg(long, value_name = "OUT.blend")]
    output: Option<PathBuf>,
    /// What the bake took and what came out.
    #[arg(long, value_name = "REPORT.json")]
    report: Option<PathBuf>,
    /// A setting of the bake, for example tolerance=0.005; may be given again.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    #[command(flatten)]
    host: HostOptions,
}

/// Sets everything up, bakes, and shows what came out.
pub(crate) fn run(options: &Options) -> Outcome {
    // Refuse what cannot work before anything is downloaded or built.
    if let Some(scene) = options.scene.as_ref().filter(|scene| !scene.is_file()) {
        return Err(Failure::Input(format!("there is no file {}", scene.display())));
    }
    refuse_what_is_no_setting(&options.settings)?;
    let output = match &options.output {
        Some(output) if output.extension().is_none_or(|extension| extension != "blend") => {
            return Err(Failure::Input(format!("{} does not end with .blend", output.display())));
        }
        Some(output) => absolute(output)?,
        None => tree::target("bake/OUT.blend"),
    };
    let report = options.report.as_deref().map_or_else(|| Ok(tree::target("bake/REPORT.json")), absolute)?;
    let host = options.host.choose()?;
    extension::set_up(&host)?;
    let scene = match &options.scene {
        Some(scene) => absolute(scene)?,
        None => make_paper_scene(&host)?,
    };

    // A file of an earlier bake must not pass for this one's.
    let (glb, picture) = (output.with_extension("glb"), output.with_extension("png"));
    let page = report.with_extension("html");
    let written = [output, glb, picture, report, page];
    for file in &written {
        if *file == scene {
            return Err(Failure::Input(format!("{} would be written over", scene.display())));
        }
        files::make_parent(file)?;
        if file.exists() {
            fs::remove_file(file).map_err(Failure::file(file))?;
        }
    }
    let [output, glb, picture, report, page] = &written;

    println!("Baking {}", scene.display());
    let mut bake = host.antumbra(&scene);
    bake.arg("--output").arg(output).arg("--report").arg(report).arg("--report-page").arg(page);
    for setting in &options.settings {
        bake.arg("--set").arg(setting);
    }
    progress::watch(&mut bake)?;
    println!("Exporting and rendering");
    for (script, file) in [("export_glb.py", glb), ("render_picture.py", picture)] {
        let mut finish = host.script(&tree::path("native/xtask/blender").join(script));
        run_quietly(finish.arg(output).arg(file))?;
    }
    if let Some(missing) = written.iter().find(|file| !file.is_file()) {
        return Err(Failure::Task(format!("{} was not written", missing.display())));
    }
    summary::print(report, &host.name(), &written)
}

fn make_paper_scene(host: &Host) -> Outcome<PathBuf> {
    let scene = tree::target("scenes/paper.blend");
    files::make_parent(&scene)?;
    run_quietly(host.script(&tree::path("tests/scenes/paper.py")).arg(&scene))?;
    Ok(scene)
}

/// Settings are NAME=VALUE.
pub(crate) fn refuse_what_is_no_setting(settings: &[String]) -> Outcome {
    match settings.iter().find(|text| !text.contains('=')) {
        Some(text) => Err(Failure::Input(format!("“{text}” is not of the form NAME=VALUE"))),
        None => Ok(()),
    }
}

fn absolute(path: &Path) -> Outcome<PathBuf> {
    std::path::absolute(path).map_err(Failure::file(path))
}
