//! What a bake says about itself at its end.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::failure::{Failure, Outcome};
use crate::files;

/// Prints the table of a REPORT.json and the files that were written.
pub(crate) fn print(report: &Path, host: &str, written: &[PathBuf]) -> Outcome {
    let report: Value = serde_json::from_str(&files::read(report)?)
        .map_err(|error| Failure::Task(format!("{}: {error}", report.display())))?;
    println!();
    for (name, value) in rows(&report) {
        println!("  {name:<12}{value}");
    }
    println!("  {:<12}{host}", "baked in");
    for file in written {
        println!("  {:<12}{}", "wrote", file.display());
    }
    for warning in report["warnings"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        println!("  {:<12}{warning}", "warning");
    }
    Ok(())
}

fn rows(report: &Value) -> Vec<(&'static str, String)> {
    let (scene, result, timings) = (&report["scene"], &report["result"], &report["timings"]);
    let last = report["timeline"].as_array().and_then(|timeline| timeline.last());
    let mut rows = vec![
        (
            "scene",
            format!(
                "{} objects, {} triangles, {} lights",
                count(scene, "objects"),
                count(scene, "triangles"),
                count(scene, "lights")
            ),
        ),
        ("vertices", count(result, "vertices")),
        ("triangles", count(result, "triangles")),
    ];
    if let Some(last) = last {
        let unshot = last["unshot"].as_f64().unwrap_or(0.0) * 100.0;
        rows.push((
            "shots",
            format!("{} ({unshot:.2} % of the light not yet distributed)", count(last, "shots")),
        ));
    }
    if let Some(reason) = result["ended_by"].as_str() {
        rows.push(("ended by", reason.replace('_', " ")));
    }
    let verification = &result["verification"];
    if let Some([error, low, high]) = shares(&verification["error"]) {
        rows.push((
            "error",
            format!(
                "{:.2} % ({:.2} to {:.2}), verified at {} points in {:.2} s",
                100.0 * error,
                100.0 * low,
                100.0 * high,
                count(verification, "points"),
                verification["time_s"].as_f64().unwrap_or(0.0)
            ),
        ));
    }
    if let Some(estimated) = result["estimated_error"].as_f64() {
        rows.push(("estimated", format!("{:.2} % by the solver itself", 100.0 * estimated)));
    }
    let time = |name: &str| timings[name].as_f64().unwrap_or(0.0);
    rows.push((
        "time",
        format!(
            "{:.1} s to read, {:.1} s to solve, {:.1} s to write; {:.1} s of processor time",
            time("read_s"),
            time("solve_s"),
            time("write_s"),
            time("cpu_s")
        ),
    ));
    rows
}

/// A value and its interval.
fn shares(value: &Value) -> Option<[f64; 3]> {
    let values = value.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>()?;
    values.try_into().ok()
}

/// A count with its thousands apart.
fn count(part: &Value, name: &str) -> String {
    let Some(number) = part[name].as_u64() else { return "?".to_owned() };
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn counts_are_readable() {
        let part = json!({ "small": 7, "thousand": 1000, "large": 1_234_567 });
        assert_eq!(
            ["small", "thousand", "large", "none"].map(|name| count(&part, name)),
            ["7", "1,000", "1,234,567", "?"]
        );
    }

    #[test]
    fn the_last_iteration_gives_the_shots() {
        let report = json!({ "timeline": [{ "shots": 1, "unshot": 0.5 }, { "shots": 12, "unshot": 0.001 }] });
        let rows = rows(&report);
        let shots = rows.iter().find(|(name, _)| *name == "shots").map(|(_, value)| value.as_str());
        assert_eq!(shots, Some("12 (0.10 % of the light not yet distributed)"));
    }
}
