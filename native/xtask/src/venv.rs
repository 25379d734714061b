//! Virtual environments under `target/venv`, one per requirements file.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::failure::{Failure, Outcome, run, run_quietly};
use crate::{files, tree};

/// A virtual environment that holds its requirements.
pub(crate) struct Venv {
    folder: PathBuf,
}

impl Venv {
    /// The environment `name` with all of `tests/requirements-NAME.txt`; made when missing, completed when that file
    /// changed since.
    pub(crate) fn ready(name: &str) -> Outcome<Self> {
        let requirements = tree::path(&format!("tests/requirements-{name}.txt"));
        let venv = Self { folder: tree::target(&format!("venv/{name}")) };
        let wanted = files::read(&requirements)?;
        files::unless_stamped(&venv.folder.join("requirements.txt"), &wanted, || {
            if !venv.python().exists() {
                println!("Making the Python environment {name} (target/venv/{name})");
                run_quietly(tree::command(find_python()?).args(["-m", "venv"]).arg(&venv.folder))?;
            }
            println!(
                "Installing {}",
                requirements.strip_prefix(tree::root()).unwrap_or(&requirements).display()
            );
            run(venv.pip().arg("--requirement").arg(&requirements))
        })?;
        Ok(venv)
    }

    /// Its interpreter.
    pub(crate) fn python(&self) -> PathBuf {
        self.program("python")
    }

    /// A command that runs a module of it.
    pub(crate) fn module(&self, name: &str) -> Command {
        let mut command = tree::command(self.python());
        command.args(["-m", name]);
        command
    }

    /// A program that one of its packages installed.
    pub(crate) fn program(&self, name: &str) -> PathBuf {
        if cfg!(windows) {
            self.folder.join("Scripts").join(format!("{name}.exe"))
        } else {
            self.folder.join("bin").join(name)
        }
    }

    /// A command that runs such a program, with this environment as the one that `python` means.
    pub(crate) fn activated(&self, name: &str) -> Outcome<Command> {
        let program = self.program(name);
        let own = program.parent().map(Path::to_owned);
        let others = std::env::var_os("PATH").unwrap_or_default();
        let path = std::env::join_paths(own.into_iter().chain(std::env::split_paths(&others)))
            .map_err(|error| Failure::Task(format!("PATH cannot be extended: {error}")))?;
        let mut command = tree::command(program);
        command.env("PATH", path).env("VIRTUAL_ENV", &self.folder);
        Ok(command)
    }

    /// Where its packages are.
    pub(crate) fn site_packages(&self) -> PathBuf {
        if cfg!(windows) {
            self.folder.join("Lib/site-packages")
        } else {
            self.folder.join("lib/python3.11/site-packages")
        }
    }

    /// `pip install`, ready for what to install.
    pub(crate) fn pip(&self) -> Command {
        let mut pip = self.module("pip");
        pip.args(["install", "--quiet", "--disable-pip-version-check"]);
        pip
    }

    /// Puts a wheel in, in place of an older build of the same version.
    pub(crate) fn install_wheel(&self, wheel: &Path) -> Outcome {
        let state = files::digest(&[wheel.to_owned()])?;
        files::unless_stamped(&self.folder.join("wheel.txt"), &state, || {
            run(self.pip().args(["--force-reinstall", "--no-deps"]).arg(wheel))
        })
    }
}

/// Python 3.11: the only one that every supported bpy runs in.
fn find_python() -> Outcome<String> {
    let asked = std::env::var("ANTUMBRA_PYTHON").ok();
    let usual = ["python3.11", "python3", "python"].map(str::to_owned);
    asked.into_iter().chain(usual).find(|python| is_3_11(python)).ok_or_else(|| {
        Failure::Task(
            "Python 3.11 is needed and none was found: install it, or name it in ANTUMBRA_PYTHON".to_owned(),
        )
    })
}

fn is_3_11(python: &str) -> bool {
    let check = "import sys; sys.exit(sys.version_info[:2] != (3, 11))";
    let status =
        Command::new(python).args(["-c", check]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}
