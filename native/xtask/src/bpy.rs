//! The bpy modules: Blender as a Python package.

use std::path::PathBuf;

use clap::ValueEnum;

use crate::failure::{Failure, Outcome};
use crate::files;
use crate::venv::Venv;

/// The releases that the extension is tested in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum BpyVersion {
    /// The oldest Blender that is supported.
    #[value(name = "4.2")]
    V4_2,
    /// The long-term release after it.
    #[value(name = "4.5")]
    V4_5,
    /// The newest bpy for Python 3.11.
    #[value(name = "5.0")]
    V5_0,
}

impl BpyVersion {
    /// Every version, oldest first.
    pub(crate) const ALL: [Self; 3] = [Self::V4_2, Self::V4_5, Self::V5_0];

    /// As Blender writes it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::V4_2 => "4.2",
            Self::V4_5 => "4.5",
            Self::V5_0 => "5.0",
        }
    }

    /// Its environment.
    pub(crate) fn venv(self) -> Outcome<Venv> {
        Venv::ready(&format!("bpy-{}", self.name()))
    }
}

/// The script behind `blender --command extension`, which runs without Blender too.
pub(crate) fn extension_script(venv: &Venv) -> Outcome<PathBuf> {
    let package = venv.site_packages().join("bpy");
    let ending = "scripts/addons_core/bl_pkg/cli/blender_ext.py";
    files::below(&package)?
        .into_iter()
        .find(|file| file.ends_with(ending))
        .ok_or_else(|| Failure::Task(format!("{} has no {ending}", package.display())))
}
