//! The wheel of the binding, for this machine or for any platform Blender has.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::failure::{Failure, Outcome, run_quietly};
use crate::venv::Venv;
use crate::{files, tree};

/// The Linux that wheels for others are built against: glibc 2.28 is what Blender itself asks for.
const MANYLINUX: &str = "manylinux_2_28";

/// A platform that the extension is built for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Platform {
    /// Blender's name for it.
    pub(crate) blender: &'static str,
    /// Rust's name for it.
    pub(crate) target: &'static str,
}

/// All platforms of the extension.
pub(crate) const PLATFORMS: [Platform; 5] = [
    Platform { blender: "linux-x64", target: "x86_64-unknown-linux-gnu" },
    Platform { blender: "linux-arm64", target: "aarch64-unknown-linux-gnu" },
    Platform { blender: "macos-x64", target: "x86_64-apple-darwin" },
    Platform { blender: "macos-arm64", target: "aarch64-apple-darwin" },
    Platform { blender: "windows-x64", target: "x86_64-pc-windows-gnu" },
];

impl Platform {
    /// The one this program runs on.
    pub(crate) fn host() -> Outcome<Self> {
        let system = match std::env::consts::OS {
            "macos" => "macos",
            "windows" => "windows",
            _ => "linux",
        };
        let processor = if cfg!(target_arch = "aarch64") { "arm64" } else { "x64" };
        let name = format!("{system}-{processor}");
        PLATFORMS
            .into_iter()
            .find(|platform| platform.blender == name)
            .ok_or_else(|| Failure::Task(format!("no extension is built for {name}")))
    }
}

/// The wheel for this machine alone, built with its own linker.
pub(crate) fn build_native() -> Outcome<PathBuf> {
    let tools = Venv::ready("tools")?;
    println!("Building the solver");
    let folder = tree::target("wheels/native");
    build(&mut maturin(&tools, &folder)?, &folder)
}

/// The wheel for a platform as it is handed out: zig links it against libraries old enough for every user.
pub(crate) fn build_portable(platform: Platform) -> Outcome<PathBuf> {
    // A Windows machine builds for itself with its own linker: zig is for the way there from elsewhere.
    if cfg!(windows) && platform == Platform::host()? {
        return build_native();
    }
    ensure_rust_target(platform)?;
    let release = Venv::ready("release")?;
    let folder = tree::target(&format!("wheels/{}", platform.blender));
    let mut maturin = maturin(&release, &folder)?;
    maturin.args(["--zig", "--target", platform.target]);
    if platform.blender.starts_with("linux") {
        maturin.args(["--compatibility", MANYLINUX]);
    }
    build(&mut maturin, &folder)
}

fn maturin(venv: &Venv, folder: &Path) -> Outcome<Command> {
    // maturin asks `python` for the zig that is installed with it.
    let mut maturin = venv.activated("maturin")?;
    maturin.args(["build", "--release", "--quiet", "--locked", "--manifest-path"]);
    maturin.arg(tree::path("native/antumbra-py/Cargo.toml"));
    maturin.arg("--interpreter").arg(venv.python()).arg("--out").arg(folder);
    Ok(maturin)
}

fn build(maturin: &mut Command, folder: &Path) -> Outcome<PathBuf> {
    // An older wheel may carry another version or platform tag.
    files::remove_folder(folder)?;
    run_quietly(maturin)?;
    let mut wheels = files::below(folder)?;
    wheels.retain(|file| file.extension().is_some_and(|extension| extension == "whl"));
    match <[PathBuf; 1]>::try_from(wheels) {
        Ok([wheel]) => Ok(wheel),
        Err(wheels) => {
            Err(Failure::Task(format!("maturin left {} wheels in {}", wheels.len(), folder.display())))
        }
    }
}

/// Asks rustup for the target when its standard library is not there yet.
fn ensure_rust_target(platform: Platform) -> Outcome {
    let Platform { blender, target } = platform;
    let sysroot = run_quietly(tree::command("rustc").args(["--print", "sysroot"]))?;
    if fs::exists(Path::new(sysroot.trim()).join("lib/rustlib").join(target).join("lib")).unwrap_or(false) {
        return Ok(());
    }
    println!("Adding the Rust target {target}");
    run_quietly(tree::command("rustup").args(["target", "add", target])).map(drop).map_err(|_| {
        Failure::Task(format!(
            "the Rust target {target} is missing, so {blender} cannot be built: run `rustup target add {target}`"
        ))
    })
}
