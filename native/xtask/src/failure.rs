//! Why a task ended without its result, and running other programs with that in mind.

use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};

use thiserror::Error;

/// A failed task, in one line.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    /// The arguments or the input are at fault.
    #[error("{0}")]
    Input(String),
    /// Anything else.
    #[error("{0}")]
    Task(String),
}

impl Failure {
    /// 2 for bad arguments or input, 1 for the rest.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Task(_) => 1,
        }
    }

    /// Names the file that an operation failed on.
    pub(crate) fn file(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |error| Self::Task(format!("{}: {error}", path.display()))
    }
}

/// What every task returns.
pub(crate) type Outcome<T = ()> = Result<T, Failure>;

/// Runs a command to its end with the terminal as its own.
pub(crate) fn run(command: &mut Command) -> Outcome {
    let status = command.status().map_err(|error| cannot_start(command, &error))?;
    succeeded(command, status)
}

/// Runs a command to its end without a word; what it said is shown only when it fails.
pub(crate) fn run_quietly(command: &mut Command) -> Outcome<String> {
    let output = command.stdin(Stdio::null()).output().map_err(|error| cannot_start(command, &error))?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    if !output.status.success() {
        eprint!("{said}{}", String::from_utf8_lossy(&output.stderr));
    }
    succeeded(command, output.status).map(|()| said)
}

/// The failure to start a program at all.
pub(crate) fn cannot_start(command: &Command, error: &std::io::Error) -> Failure {
    Failure::Task(format!("cannot run {}: {error}", command.get_program().display()))
}

fn succeeded(command: &Command, status: ExitStatus) -> Outcome {
    if status.success() {
        return Ok(());
    }
    let arguments: Vec<_> = command.get_args().map(|argument| argument.to_string_lossy()).collect();
    let program = command.get_program().display();
    Err(Failure::Task(format!("{program} {} ended with {status}", arguments.join(" "))))
}
