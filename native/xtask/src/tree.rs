//! Where things are in the repository.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The repository's top folder.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("the manifest is native/xtask/Cargo.toml; this is a bug in xtask")
}

/// A path below the top folder.
pub(crate) fn path(relative: &str) -> PathBuf {
    root().join(relative)
}

/// A path below `target/`: whatever is made here can be deleted at any time.
pub(crate) fn target(relative: &str) -> PathBuf {
    root().join("target").join(relative)
}

/// A command that runs in the top folder.
pub(crate) fn command(program: impl AsRef<std::ffi::OsStr>) -> Command {
    let mut command = Command::new(program);
    command.current_dir(root());
    command
}

/// The cargo that runs this task.
pub(crate) fn cargo() -> Command {
    command(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}
