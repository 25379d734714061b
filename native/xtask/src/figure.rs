//! `cargo xtask figure`: the paper's figure 4, two methods side by side, the meshes above and the shaded scenes below.

use std::path::PathBuf;

use clap::Args;

use crate::failure::{Failure, Outcome, run_quietly};
use crate::host::HostOptions;
use crate::{extension, files, progress, tree};

/// Options of the task.
#[derive(Args)]
pub(crate) struct Options {
    /// The picture.
    #[arg(long, value_name = "OUT.png")]
    output: Option<PathBuf>,
    /// The two methods, the left one first.
    #[arg(long, value_delimiter = ',', value_name = "LEFT,RIGHT", default_value = "AS,ADM")]
    methods: Vec<String>,
    /// Their tolerances, so that both can be made equally good.
    #[arg(long, value_delimiter = ',', value_name = "LEFT,RIGHT", default_value = "0.01,0.01")]
    tolerances: Vec<f64>,
    #[command(flatten)]
    host: HostOptions,
}

/// Bakes the paper's scene twice and renders both.
pub(crate) fn run(options: &Options) -> Outcome {
    // Refuse what cannot work before anything is downloaded or built.
    let two = || Failure::Input("a figure takes two methods and two tolerances".to_owned());
    let [left, right] = options.methods.as_slice() else { return Err(two()) };
    let [left_tolerance, right_tolerance] = options.tolerances.as_slice() else { return Err(two()) };
    let output = match &options.output {
        Some(output) => std::path::absolute(output).map_err(Failure::file(output))?,
        None => tree::path("addon/pictures/figure-4.png"),
    };
    let host = options.host.choose()?;
    extension::set_up(&host)?;

    let scene = tree::target("figure/paper.blend");
    files::make_parent(&scene)?;
    run_quietly(host.script(&tree::path("tests/scenes/paper.py")).arg(&scene))?;
    let mut baked = Vec::new();
    for (side, method, tolerance) in [("left", left, left_tolerance), ("right", right, right_tolerance)] {
        println!("Baking with {method}");
        let blend = tree::target(&format!("figure/{side}.blend"));
        let mut bake = host.antumbra(&scene);
        bake.arg("--output").arg(&blend);
        bake.arg("--set").arg(format!("method={method}")).arg("--set").arg(format!("tolerance={tolerance}"));
        progress::watch(&mut bake)?;
        baked.push(blend);
    }
    println!("Rendering");
    files::make_parent(&output)?;
    run_quietly(host.script(&tree::path("native/xtask/blender/render_figure.py")).args(&baked).arg(&output))?;
    println!("{}", output.display());
    Ok(())
}
