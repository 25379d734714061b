//! A progress bar over a program that prints its percentage.

use std::io::{BufReader, Read};
use std::process::{Command, Stdio};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::failure::{Failure, Outcome, cannot_start};

/// Runs a command, turns its lines like `antumbra: 42 % shooting light` into a bar, passes every other line on, and
/// returns its exit code.
pub(crate) fn watch(command: &mut Command) -> Outcome<i32> {
    let mut child =
        command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().map_err(|e| cannot_start(command, &e))?;
    let output = child.stdout.take().expect("it was asked for as a pipe; this is a bug in xtask");
    let bar = ProgressBar::new(100).with_style(
        ProgressStyle::with_template("{bar:40} {percent:>3} % {elapsed} {wide_msg}")
            .expect("the template is a constant; this is a bug in xtask"),
    );
    bar.enable_steady_tick(Duration::from_millis(250));
    for_each_line(output, |line| match percent(line) {
        Some((percent, message)) => {
            bar.set_position(percent);
            bar.set_message(message.to_owned());
        }
        None if line.trim().is_empty() => {}
        None => bar.suspend(|| println!("{line}")),
    })?;
    let status = child.wait().map_err(|error| Failure::Task(format!("lost the running bake: {error}")))?;
    if status.success() {
        bar.finish();
    } else {
        bar.finish_and_clear();
    }
    // No code at all: a signal ended it.
    Ok(status.code().unwrap_or(1))
}

/// A line may also end with a carriage return, as progress in a terminal does.
fn for_each_line(output: impl Read, mut act: impl FnMut(&str)) -> Outcome {
    let mut line = Vec::new();
    for byte in BufReader::new(output).bytes() {
        match byte.map_err(|error| Failure::Task(format!("lost the bake's output: {error}")))? {
            b'\n' | b'\r' => {
                act(&String::from_utf8_lossy(&line));
                line.clear();
            }
            byte => line.push(byte),
        }
    }
    act(&String::from_utf8_lossy(&line));
    Ok(())
}

fn percent(line: &str) -> Option<(u64, &str)> {
    let (number, message) = line.trim().strip_prefix("antumbra:")?.split_once('%')?;
    let number = number.trim().parse().ok().filter(|number| *number <= 100)?;
    Some((number, message.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_percentages_are_progress() {
        assert_eq!(percent("antumbra:  42 % shooting light"), Some((42, "shooting light")));
        assert_eq!(percent("antumbra: 142 % of something"), None);
        assert_eq!(percent("antumbra: the mean is off by 3 %"), None);
        assert_eq!(percent("Saved 100%"), None);
    }

    #[test]
    fn carriage_returns_end_lines() {
        let mut lines = Vec::new();
        for_each_line(&b"a\rb\nc"[..], |line| lines.push(line.to_owned())).unwrap();
        assert_eq!(lines, ["a", "b", "c"]);
    }
}
