//! `cargo xtask extension`: the zip that a Blender user installs.

use std::path::{Path, PathBuf};

use clap::Args;
use toml_edit::{Array, DocumentMut, value};

use crate::bpy::BpyVersion;
use crate::failure::{Failure, Outcome, run_quietly};
use crate::host::Host;
use crate::wheel::{self, PLATFORMS, Platform};
use crate::{files, tree};

/// Options of the task.
#[derive(Args)]
pub(crate) struct Options {
    /// Build for Linux, macOS and Windows instead of for this machine alone.
    #[arg(long)]
    all_platforms: bool,
    /// The Blender that builds and validates the zip files; otherwise $BLENDER, one on PATH, or bpy.
    #[arg(long, value_name = "PATH")]
    blender: Option<PathBuf>,
}

/// Builds `dist/*.zip`.
pub(crate) fn run(options: &Options) -> Outcome {
    let host = match &options.blender {
        Some(program) => Host::choose(Some(program), None)?,
        None => match Host::installed_or_cached()? {
            Some(host) => host,
            None => Host::bpy(BpyVersion::V5_0)?,
        },
    };
    let platforms = if options.all_platforms { PLATFORMS.to_vec() } else { vec![Platform::host()?] };

    // Build every wheel that can be built, so that one message names all that is missing.
    let (mut wheels, mut missing) = (Vec::new(), Vec::new());
    for platform in platforms {
        println!("Building the solver for {}", platform.blender);
        match wheel::build_portable(platform) {
            Ok(wheel) => wheels.push((platform, wheel)),
            Err(failure) => missing.push(failure.to_string()),
        }
    }
    if !missing.is_empty() {
        return Err(Failure::Task(format!("no zip was built:\n  {}", missing.join("\n  "))));
    }

    let dist = tree::path("dist");
    files::remove_folder(&dist)?;
    for zip in build(&host, &wheels, "release", &dist)? {
        run_quietly(host.extension_tool()?.arg("validate").arg(&zip))?;
        let size = std::fs::metadata(&zip).map_err(Failure::file(&zip))?.len();
        println!("{} ({} KB), valid for {}", zip.display(), size / 1024, host.name());
    }
    Ok(())
}

/// Builds the extension and installs it in a Blender.
pub(crate) fn set_up(host: &Host) -> Outcome {
    println!("Setting up {}", host.name());
    host.install(&build_native(host, &wheel::build_native()?)?)
}

/// The zip for this machine, for a bake or a test.
pub(crate) fn build_native(host: &Host, wheel: &Path) -> Outcome<PathBuf> {
    let folder = tree::target("extension/zip");
    let staged = [(Platform::host()?, wheel.to_owned())];
    let mut zips = build(host, &staged, "native", &folder)?;
    zips.pop().ok_or_else(|| Failure::Task("Blender built no zip".to_owned()))
}

/// Stages the add-on with its wheels under `target/`, has Blender check and zip it, and returns the zips.
///
/// The source tree's own manifest names no wheel: what it would name exists only here.
fn build(host: &Host, wheels: &[(Platform, PathBuf)], stage: &str, into: &Path) -> Outcome<Vec<PathBuf>> {
    let source = tree::target(&format!("extension/{stage}"));
    files::mirror(&tree::path("addon/antumbra"), &source)?;
    files::copy(&tree::path("LICENSE"), &source.join("LICENSE"))?;
    for (_, wheel) in wheels {
        files::copy(wheel, &source.join("wheels").join(file_name(wheel)))?;
    }
    let manifest = source.join("blender_manifest.toml");
    files::write(&manifest, &with_wheels(&files::read(&manifest)?, wheels)?)?;

    run_quietly(host.extension_tool()?.arg("validate").arg(&source))?;
    files::remove_folder(into)?;
    std::fs::create_dir_all(into).map_err(Failure::file(into))?;
    let mut build = host.extension_tool()?;
    build.args(["build", "--split-platforms", "--source-dir"]).arg(&source).arg("--output-dir").arg(into);
    run_quietly(&mut build)?;
    files::below(into)
}

/// The manifest with the platforms and wheels that are in this build.
fn with_wheels(manifest: &str, wheels: &[(Platform, PathBuf)]) -> Outcome<String> {
    let mut manifest: DocumentMut = manifest
        .parse()
        .map_err(|error| Failure::Task(format!("addon/antumbra/blender_manifest.toml: {error}")))?;
    let platforms: Array = wheels.iter().map(|(platform, _)| platform.blender).collect();
    let paths: Array = wheels.iter().map(|(_, wheel)| format!("./wheels/{}", file_name(wheel))).collect();
    manifest["platforms"] = value(platforms);
    manifest["wheels"] = value(paths);
    Ok(manifest.to_string())
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheels_stay_above_the_manifests_tables() {
        let manifest = "id = \"antumbra\" # kept\n\n[permissions]\nfiles = \"Bakes\"\n";
        let wheels = [(PLATFORMS[0], PathBuf::from("target/a.whl")), (PLATFORMS[4], PathBuf::from("b.whl"))];
        let staged = with_wheels(manifest, &wheels).unwrap();
        let read: DocumentMut = staged.parse().unwrap();
        assert_eq!(read["platforms"].to_string().trim(), r#"["linux-x64", "windows-x64"]"#);
        assert_eq!(read["wheels"].to_string().trim(), r#"["./wheels/a.whl", "./wheels/b.whl"]"#);
        assert_eq!(read["permissions"]["files"].as_str(), Some("Bakes"));
        assert!(staged.contains("# kept"));
    }
}
