//! A progress bar over the extension's command line.

use std::io::{BufReader, Read};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::failure::{Failure, Outcome, cannot_start};

/// What the extension's command line puts before its own words; the rest is Blender's.
const OWN: &str = "antumbra:";

/// Runs the extension's command line with its lines like `antumbra: 42 % shooting light` as a bar.
///
/// Bad input (exit code 2) ends with the one line that the extension wrote about it. What Blender and its exporters
/// say is shown only when something else went wrong.
pub(crate) fn watch(command: &mut Command) -> Outcome {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| cannot_start(command, &error))?;
    let output = child.stdout.take().expect("it was asked for as a pipe; this is a bug in xtask");
    let errors = child.stderr.take().expect("it was asked for as a pipe; this is a bug in xtask");
    // Both pipes are read at once: a program waits while one of them is full.
    let errors = thread::spawn(move || {
        let mut lines = Vec::new();
        for_each_line(errors, |line| lines.push(line.to_owned())).map(|()| lines)
    });

    let bar = ProgressBar::new(100).with_style(
        ProgressStyle::with_template("{bar:40} {percent:>3} % {elapsed} {wide_msg}")
            .expect("the template is a constant; this is a bug in xtask"),
    );
    bar.enable_steady_tick(Duration::from_millis(250));
    let mut said = Vec::new();
    for_each_line(output, |line| match percent(line) {
        Some((percent, message)) => {
            bar.set_position(percent);
            bar.set_message(message.to_owned());
        }
        None => said.push(line.to_owned()),
    })?;
    let status = child.wait().map_err(|error| Failure::Task(format!("lost the running bake: {error}")))?;
    let errors = errors.join().expect("reading lines does not panic; this is a bug in xtask")?;
    if status.success() {
        bar.set_message("");
        bar.finish();
        return Ok(());
    }
    bar.finish_and_clear();
    let reason = errors.iter().rev().find_map(|line| line.strip_prefix(OWN));
    match (status.code(), reason) {
        (Some(2), Some(reason)) => Err(Failure::Input(reason.trim().to_owned())),
        (code, _) => {
            for line in said.iter().chain(&errors) {
                eprintln!("{line}");
            }
            let code = if code == Some(2) { Failure::Input } else { Failure::Task };
            Err(code(format!("the bake ended with {status}")))
        }
    }
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
    let (number, message) = line.trim().strip_prefix(OWN)?.split_once('%')?;
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
