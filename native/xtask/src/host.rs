//! The Blender that a task runs in: a real one by `--background`, or the bpy module.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;

use crate::bpy::BpyVersion;
use crate::failure::{Failure, Outcome, run, run_quietly};
use crate::venv::Venv;
use crate::{bpy, files, tree};

/// The oldest Blender that has extensions.
const OLDEST: (u32, u32) = (4, 2);

/// Where this repository's own CI puts a real Blender, below the user's cache folder.
const CACHED: &str = "antumbra/blender-5.2/blender";

/// A Blender of either kind.
pub(crate) enum Host {
    /// A Blender program.
    Blender { program: PathBuf, version: String },
    /// The bpy module in its environment.
    Bpy { version: BpyVersion, venv: Venv },
}

/// Which Blender a task bakes in.
#[derive(Args)]
pub(crate) struct HostOptions {
    /// The Blender to bake in; otherwise $BLENDER, a blender on PATH, or bpy.
    #[arg(long, value_name = "PATH")]
    blender: Option<PathBuf>,
    /// Bake in this version of the bpy module.
    #[arg(long, value_name = "VERSION", conflicts_with = "blender")]
    bpy: Option<BpyVersion>,
}

impl HostOptions {
    /// See [`Host::choose`].
    pub(crate) fn choose(&self) -> Outcome<Host> {
        Host::choose(self.blender.as_deref(), self.bpy)
    }
}

impl Host {
    /// The Blender for a bake: the one asked for, `$BLENDER`, one on `PATH`, else bpy.
    pub(crate) fn choose(program: Option<&Path>, bpy: Option<BpyVersion>) -> Outcome<Self> {
        if let Some(version) = bpy {
            return Self::bpy(version);
        }
        if let Some(program) = program {
            return Self::blender(program);
        }
        match Self::installed()? {
            Some(host) => Ok(host),
            None => Self::bpy(BpyVersion::V5_0),
        }
    }

    /// The bpy module of a version, installed when it is not yet.
    pub(crate) fn bpy(version: BpyVersion) -> Outcome<Self> {
        Ok(Self::Bpy { version, venv: version.venv()? })
    }

    /// `$BLENDER`, which must be fit, or a fit `blender` on `PATH`.
    pub(crate) fn installed() -> Outcome<Option<Self>> {
        if let Some(program) = std::env::var_os("BLENDER").filter(|program| !program.is_empty()) {
            return Self::blender(Path::new(&program)).map(Some);
        }
        match Self::blender(Path::new("blender")) {
            Ok(host) => Ok(Some(host)),
            Err(Failure::Input(reason)) => {
                if on_path("blender") {
                    println!("note: the Blender on PATH is left out: {reason}");
                }
                Ok(None)
            }
            Err(failure) => Err(failure),
        }
    }

    /// An installed Blender, or the one that `.ci/get-blender` put into the user's cache folder.
    pub(crate) fn installed_or_cached() -> Outcome<Option<Self>> {
        if let Some(host) = Self::installed()? {
            return Ok(Some(host));
        }
        let cache = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from);
        let cache = cache.or_else(|| std::env::home_dir().map(|home| home.join(".cache")));
        match cache.map(|cache| cache.join(CACHED)).filter(|program| program.exists()) {
            Some(program) => Self::blender(&program).map(Some),
            None => Ok(None),
        }
    }

    fn blender(program: &Path) -> Outcome<Self> {
        let shown = program.display();
        let output = Command::new(program)
            .arg("--version")
            .output()
            .map_err(|error| Failure::Input(format!("{shown} is no Blender that can be run: {error}")))?;
        let said = String::from_utf8_lossy(&output.stdout);
        let version = said.lines().find_map(|line| line.strip_prefix("Blender "));
        let version =
            version.ok_or_else(|| Failure::Input(format!("{shown} --version does not name a Blender")))?;
        let mut numbers = version.split('.').map(|number| number.parse::<u32>().unwrap_or(0));
        if (numbers.next().unwrap_or(0), numbers.next().unwrap_or(0)) < OLDEST {
            let (major, minor) = OLDEST;
            return Err(Failure::Input(format!(
                "{shown} is Blender {version}; {major}.{minor} is the oldest one that works"
            )));
        }
        // Commands run in the repository's folder: a relative path would be looked up there.
        let program = if program.components().count() > 1 {
            std::path::absolute(program).map_err(Failure::file(program))?
        } else {
            program.to_owned()
        };
        Ok(Self::Blender { program, version: version.to_owned() })
    }

    /// For people.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Blender { program, version } => format!("Blender {version} ({})", program.display()),
            Self::Bpy { version, .. } => format!("bpy {}", version.name()),
        }
    }

    /// Its user folder, which nothing but this repository uses.
    fn user_folder(&self) -> PathBuf {
        let name = match self {
            Self::Blender { version, .. } => format!("blender-{}", version.replace(' ', "-")),
            Self::Bpy { version, .. } => format!("bpy-{}", version.name()),
        };
        tree::target("blender-user").join(name)
    }

    /// A command that runs a Python script inside it; the script finds its own arguments after `--`.
    pub(crate) fn script(&self, script: &Path) -> Command {
        let mut command = match self {
            Self::Blender { .. } => {
                let mut command = self.blender_command();
                command.args(["--python-exit-code", "1", "--python"]).arg(script);
                command
            }
            Self::Bpy { venv, .. } => {
                let mut command = tree::command(venv.python());
                command.arg(script);
                command
            }
        };
        command.env("BLENDER_USER_RESOURCES", self.user_folder()).arg("--");
        command
    }

    /// Tells a test that opens a window which program to start and where its user folder is; nothing for bpy, which
    /// has no window.
    pub(crate) fn in_window(&self, command: &mut Command) {
        if let Self::Blender { program, .. } = self {
            command.env("ANTUMBRA_BLENDER", program).env("ANTUMBRA_BLENDER_USER", self.user_folder());
        }
    }

    /// `blender --background`, for the Blender kind only.
    fn blender_command(&self) -> Command {
        let program = match self {
            Self::Blender { program, .. } => program.as_os_str(),
            Self::Bpy { .. } => OsStr::new("blender"),
        };
        let mut command = tree::command(program);
        command.arg("--background").env("BLENDER_USER_RESOURCES", self.user_folder());
        command
    }

    /// A command that runs the extension's command line on a .blend.
    pub(crate) fn antumbra(&self, scene: &Path) -> Command {
        match self {
            Self::Blender { .. } => {
                let mut command = self.blender_command();
                command.arg(scene).args(["--command", "antumbra"]);
                command
            }
            Self::Bpy { .. } => {
                let mut command = self.script(&tree::path("native/xtask/blender/antumbra_command.py"));
                command.arg(scene);
                command
            }
        }
    }

    /// A command that runs a sub-command of Blender's own `extension` tool.
    pub(crate) fn extension_tool(&self) -> Outcome<Command> {
        match self {
            Self::Blender { .. } => {
                let mut command = self.blender_command();
                command.args(["--command", "extension"]);
                Ok(command)
            }
            Self::Bpy { venv, .. } => {
                let mut command = tree::command(venv.python());
                command.arg(bpy::extension_script(venv)?);
                Ok(command)
            }
        }
    }

    /// Installs and enables the extension from its zip, in a user folder that holds nothing else.
    pub(crate) fn install(&self, zip: &Path) -> Outcome {
        let user = self.user_folder();
        let state = files::digest(&[zip.to_owned()])?;
        files::unless_stamped(&user.join("installed.txt"), &state, || {
            files::remove_folder(&user)?;
            std::fs::create_dir_all(&user).map_err(Failure::file(&user))?;
            match self {
                Self::Blender { .. } => {
                    let mut install = self.extension_tool()?;
                    install.args(["install-file", "--repo", "user_default", "--enable"]).arg(zip);
                    run_quietly(&mut install)?;
                }
                Self::Bpy { .. } => {
                    let mut install = self.script(&tree::path("native/xtask/blender/install_extension.py"));
                    run_quietly(install.arg(zip))?;
                }
            }
            Ok(())
        })
    }

    /// pytest inside it, ready for its arguments; the extension is enabled there.
    pub(crate) fn pytest(&self) -> Outcome<Command> {
        let mut pytest = self.script(&tree::path("native/xtask/blender/run_pytest.py"));
        if let Self::Blender { .. } = self {
            pytest.arg("--site").arg(pytest_folder()?);
        }
        Ok(pytest)
    }
}

/// pytest in a folder of its own, for a Blender whose Python has none. It is pure Python: any version reads it.
fn pytest_folder() -> Outcome<PathBuf> {
    let folder = tree::target("blender-site");
    let requirements = tree::path("tests/requirements-blender.txt");
    let wanted = files::read(&requirements)?;
    files::unless_stamped(&folder.join("requirements.txt"), &wanted, || {
        files::remove_folder(&folder)?;
        let tools = Venv::ready("tools")?;
        run(tools
            .pip()
            .args(["--no-compile", "--target"])
            .arg(&folder)
            .arg("--requirement")
            .arg(&requirements))
    })?;
    Ok(folder)
}

fn on_path(program: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(program).is_file())
}
