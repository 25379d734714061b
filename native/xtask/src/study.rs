//! `cargo xtask study`: how large, how slow and how wrong the bakes of each method are, against an independent reference.
//!
//! ```text
//! tests/scenes/*.py ──► target/study/scenes/SCENE.blend
//! tests/study/reference.py ──► references/SCENE-….npz      light at random points, by Cycles; kept until its script changes
//! tests/study/bake.py ──► bakes/SCENE/METHOD-TOLERANCE.*   through the installed extension, one process per scene
//! tests/study/cycles_bake.py ──► bakes/SCENE/CYCLESsamples-SIZE.*   Cycles' own bake, for comparison; kept where it is not asked for
//! tests/study/evaluate.py ──► results.csv, results.json, tables.md, SCENE.png
//! ```
//!
//! Times are the report's own `solve_s` and `cpu_s`, so start-up is in none of them. Tables compare processor time, which a busy
//! machine changes little.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use serde_json::json;

use crate::failure::{Failure, Outcome, run as run_command, run_quietly};
use crate::host::{Host, HostOptions};
use crate::venv::Venv;
use crate::{extension, files, tree};

/// Options of the task.
#[derive(Args)]
pub(crate) struct Options {
    /// The scenes: paper, cornell, interior, sunlit, the cases of tests/scenes/hard.py (blinds, fence, stairs, tree, cube,
    /// boxes, touching, shelf), and SCENE-directN for a scene's N strongest lights alone, without a second bounce.
    #[arg(long, value_delimiter = ',', value_name = "SCENE,...")]
    scenes: Vec<String>,
    /// The methods; one that this build refuses is named and left out. CYCLES is Cycles' own bake into vertex colours, of
    /// uniform meshes.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "METHOD,...",
        default_value = "UNIFORM,AS,DM,ADM,CYCLES"
    )]
    methods: Vec<String>,
    /// The tolerances; a method stops at the first that it does not reach within the limits.
    #[arg(long, value_delimiter = ',', value_name = "SHARE,...")]
    tolerances: Vec<f64>,
    /// Seconds for one bake.
    #[arg(long, value_name = "SECONDS")]
    time_limit: Option<f64>,
    /// Triangles in one bake.
    #[arg(long, value_name = "TRIANGLES", default_value_t = 400_000)]
    triangle_budget: u32,
    /// Fewer and coarser bakes, rougher references: a few minutes, to see that all of it works.
    #[arg(long)]
    quick: bool,
    /// Only check the reference against light that is known in closed form.
    #[arg(long)]
    check_reference: bool,
    #[command(flatten)]
    host: HostOptions,
}

/// The cases of `tests/scenes/hard.py`.
const HARD: [&str; 9] = ["blinds", "fence", "stairs", "wheel", "tree", "cube", "boxes", "touching", "shelf"];

const SCENES: &str = "paper,cornell,interior,sunlit,shelf,paper-direct1,paper-direct2,interior-direct1";
const QUICK_SCENES: &str = "paper,cornell,paper-direct1,paper-direct2";

/// Coarse ones first: in a furnished room most surfaces are dark, and a share of the mean light is little where it is lit.
const TOLERANCES: [f64; 8] = [0.32, 0.16, 0.08, 0.04, 0.02, 0.01, 0.005, 0.0025];
const QUICK_TOLERANCES: [f64; 4] = [0.08, 0.04, 0.02, 0.01];

/// Cycles' bake, with so many paths at each vertex.
const CYCLES: &str = "CYCLES";
const CYCLES_SAMPLES: &str = "16,64,256,1024";
const QUICK_CYCLES_SAMPLES: &str = "16,256";

/// Reference points of a scene. The interval of a 1 % error is then about a tenth of it in the scenes here.
const POINTS: u32 = 2000;
const QUICK_POINTS: u32 = 500;

/// What a quick study's references have fewer of, in paths per point.
const QUICK_SHARE: u32 = 4;

/// A scene of the study.
#[derive(Debug)]
struct Scene {
    name: String,
    /// Its script in `tests/scenes` with the script's own first arguments.
    script: &'static str,
    case: Option<String>,
    /// Only this many lights, and one bounce.
    direct: Option<u32>,
    /// Paths per reference point.
    samples: u32,
}

impl Scene {
    fn parse(name: &str) -> Outcome<Self> {
        let (base, direct) = match name.split_once("-direct") {
            Some((base, lights)) => (base, lights.parse().ok().filter(|lights| *lights > 0)),
            None => (name, None),
        };
        let unknown = || Failure::Input(format!("there is no scene “{name}”; `--help` names them"));
        if name.contains("-direct") && direct.is_none() {
            return Err(unknown());
        }
        // Chosen so that a point's standard error, relative to the mean, is near 0.3 % in the cube scenes, where errors
        // of 0.2 % are to be measured (the noise's square is subtracted, so its own size is no limit, only its chance),
        // near 1 % in the box, and 2 % in rooms that small bright spots light, whose errors are several per cent.
        let (script, case, samples) = match base {
            "paper" => ("paper.py", None, 6_144),
            "cornell" => ("cornell.py", None, 8_192),
            "interior" => ("interior.py", None, 32_768),
            "sunlit" => ("sunlit.py", None, 8_192),
            "shelf" => ("hard.py", Some(base), 32_768),
            base if HARD.contains(&base) => ("hard.py", Some(base), 6_144),
            _ => return Err(unknown()),
        };
        // Direct light alone is less noisy.
        let samples = if direct.is_some() { samples.min(6_144) } else { samples };
        Ok(Self { name: name.to_owned(), script, case: case.map(str::to_owned), direct, samples })
    }

    /// What is baked and compared: a scene of black surfaces has nothing but irradiance.
    fn quantity(&self) -> &'static str {
        if self.direct.is_some() { "IRRADIANCE" } else { "RADIOSITY" }
    }

    fn make(&self, host: &Host) -> Outcome<PathBuf> {
        let blend = tree::target(&format!("study/scenes/{}.blend", self.name));
        files::make_parent(&blend)?;
        let mut make = host.script(&tree::path("tests/scenes").join(self.script));
        make.args(&self.case).arg(&blend).args(self.direct.map(|lights| format!("direct={lights}")));
        run_quietly(&mut make)?;
        Ok(blend)
    }

    /// Changes when the scene or the way of computing references may have changed.
    fn digest(&self) -> Outcome<String> {
        let scripts = [self.script, "building.py"].map(|script| tree::path("tests/scenes").join(script));
        files::digest(&[&scripts[..], &[tree::path("tests/study/reference.py")]].concat())
    }

    /// The reference's path below `target/study`, computed unless it is there for the same scripts and numbers.
    fn reference(&self, host: &Host, blend: &Path, points: u32, samples: u32) -> Outcome<String> {
        let digest = self.digest()?;
        let relative = format!("references/{}-{points}-{samples}-{digest}.npz", self.name);
        let file = tree::target("study").join(&relative);
        if !file.is_file() {
            files::make_parent(&file)?;
            // Renamed when complete: half a file must not pass for a reference.
            let part = file.with_extension("part.npz");
            let mut compute = host.script(&tree::path("tests/study/reference.py"));
            compute.arg(blend).arg(&part);
            compute.arg(format!("points={points}")).arg(format!("samples={samples}"));
            run_without_stdout(&mut compute)?;
            std::fs::rename(&part, &file).map_err(Failure::file(&file))?;
        }
        Ok(relative)
    }
}

/// Makes the scenes and references, bakes, measures.
pub(crate) fn run(options: &Options) -> Outcome {
    // Refuse what cannot work before anything is downloaded or built.
    let names = match options.scenes.as_slice() {
        [] => (if options.quick { QUICK_SCENES } else { SCENES }).split(',').map(str::to_owned).collect(),
        names => names.to_vec(),
    };
    let scenes = names.iter().map(|name| Scene::parse(name)).collect::<Outcome<Vec<_>>>()?;
    let tolerances = match options.tolerances.as_slice() {
        [] if options.quick => QUICK_TOLERANCES.to_vec(),
        [] => TOLERANCES.to_vec(),
        tolerances => tolerances.to_vec(),
    };
    let host = options.host.choose()?;
    if options.check_reference {
        return run_without_stdout(&mut host.script(&tree::path("tests/study/check_reference.py")));
    }
    let plotting = Venv::ready("study")?;
    extension::set_up(&host)?;

    // Scenes and references first: bakes are timed, and want no work beside them.
    println!("Making scenes and references");
    let points = if options.quick { QUICK_POINTS } else { POINTS };
    let (mut blends, mut described) = (Vec::new(), Vec::new());
    for scene in &scenes {
        let samples = if options.quick { scene.samples / QUICK_SHARE } else { scene.samples };
        let blend = scene.make(&host)?;
        let reference = scene.reference(&host, &blend, points, samples)?;
        described.push(json!({
            "name": scene.name,
            "reference": reference,
            "quantity": scene.quantity(),
            "direct": scene.direct.is_some(),
        }));
        blends.push(blend);
    }
    files::write(&tree::target("study/study.json"), &json!({ "scenes": described }).to_string())?;

    println!("Baking");
    let time_limit = options.time_limit.unwrap_or(if options.quick { 20.0 } else { 120.0 });
    let mut methods: Vec<String> = options.methods.iter().map(|method| method.to_uppercase()).collect();
    let with_cycles = methods.iter().any(|method| method == CYCLES);
    methods.retain(|method| method != CYCLES);
    let texts: Vec<_> = tolerances.iter().map(f64::to_string).collect();
    for (scene, blend) in scenes.iter().zip(&blends) {
        let folder = tree::target("study/bakes").join(&scene.name);
        remove_bakes(&folder, with_cycles)?;
        // What is black has nothing to bake but irradiance, which Cycles' bake does not give by itself.
        if with_cycles && scene.direct.is_none() {
            let mut bake = host.script(&tree::path("tests/study/cycles_bake.py"));
            bake.arg(blend).arg(&folder).arg(time_limit.to_string()).arg(options.triangle_budget.to_string());
            run_without_stdout(bake.arg(if options.quick { QUICK_CYCLES_SAMPLES } else { CYCLES_SAMPLES }))?;
        }
        if methods.is_empty() {
            continue;
        }
        let mut bake = host.script(&tree::path("tests/study/bake.py"));
        bake.arg(blend).arg(&folder).arg(scene.quantity());
        bake.arg(time_limit.to_string()).arg(options.triangle_budget.to_string());
        bake.arg(methods.join(",")).arg(texts.join(","));
        run_without_stdout(&mut bake)?;
    }

    println!("Measuring\n");
    let mut evaluate = tree::command(plotting.python());
    run_command(evaluate.arg(tree::path("tests/study/evaluate.py")).arg(tree::target("study")))?;
    println!(
        "\nThe tables, results.csv, results.json and a plot per scene are in {}",
        tree::target("study").display()
    );
    Ok(())
}

/// Removes the bakes of a scene, those of Cycles only where they are made anew: they do not depend on the solver.
fn remove_bakes(folder: &Path, with_cycles: bool) -> Outcome {
    if with_cycles || !folder.exists() {
        return files::remove_folder(folder);
    }
    for file in files::below(folder)? {
        let of_cycles = file.file_name().is_some_and(|name| name.to_string_lossy().starts_with(CYCLES));
        if !of_cycles {
            std::fs::remove_file(&file).map_err(Failure::file(&file))?;
        }
    }
    Ok(())
}

/// Runs a script of ours that speaks on stderr; stdout has what Blender says to itself.
fn run_without_stdout(command: &mut Command) -> Outcome {
    run_command(command.stdin(Stdio::null()).stdout(Stdio::null()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_of_the_study_is_known() {
        for name in SCENES.split(',').chain(QUICK_SCENES.split(',')).chain(HARD) {
            let scene = Scene::parse(name).unwrap();
            assert!(tree::path("tests/scenes").join(scene.script).is_file(), "{name}");
        }
    }

    #[test]
    fn direct_light_alone_is_baked_as_irradiance() {
        let scene = Scene::parse("cube-direct1").unwrap();
        assert_eq!((scene.direct, scene.quantity()), (Some(1), "IRRADIANCE"));
        assert_eq!(Scene::parse("cube").unwrap().quantity(), "RADIOSITY");
    }

    #[test]
    fn an_unknown_scene_is_bad_input() {
        for name in ["castle", "paper-direct", "paper-direct0", "paper-directly"] {
            assert_eq!(Scene::parse(name).unwrap_err().exit_code(), 2, "{name}");
        }
    }
}
