//! `start`: checks the settings and moves the scene into a solving thread.

use antumbra::settings::{Anyway, Effort, Method, Quantity, Settings, Transport};
use pyo3::prelude::*;

use crate::errors::{invalid_setting, to_python};
use crate::job::Job;
use crate::scene::Scene;

/// Starts a bake in a thread of its own and returns at once. The scene's data is moved into the bake.
///
/// Settings are checked before that: a refused one leaves the scene as it was.
#[expect(
    clippy::too_many_arguments,
    reason = "one keyword per setting, as in the add-on and its command line"
)]
#[pyfunction]
#[pyo3(signature = (
    scene, *, method = "ADM", tolerance = 0.01, element_size = 0.0, max_level = 8, max_blockers = 4,
    time_limit = 0.0, triangle_budget = 0, quantity = "RADIOSITY", transport = "AUTO", layers = "TOTAL",
    verify_points = 1000, threads = 0
))]
pub(crate) fn start(
    py: Python<'_>,
    scene: &Scene,
    method: &str,
    tolerance: f64,
    element_size: f64,
    max_level: i64,
    max_blockers: i64,
    time_limit: f64,
    triangle_budget: i64,
    quantity: &str,
    transport: &str,
    layers: &str,
    verify_points: i64,
    threads: i64,
) -> PyResult<Job> {
    let settings = Settings {
        method: choice(
            py,
            "method",
            method,
            &[("ADM", Method::Adm), ("DM", Method::Dm), ("AS", Method::As), ("UNIFORM", Method::Uniform)],
        )?,
        tolerance,
        element_size,
        max_level: count(py, "max_level", max_level)?,
        max_blockers: count(py, "max_blockers", max_blockers)?,
        time_limit,
        triangle_budget: count(py, "triangle_budget", triangle_budget)?,
        quantity: choice(
            py,
            "quantity",
            quantity,
            &[("RADIOSITY", Quantity::Radiosity), ("IRRADIANCE", Quantity::Irradiance)],
        )?,
        transport: choice(
            py,
            "transport",
            transport,
            &[
                ("AUTO", Transport::Auto),
                ("SHOOTING", Transport::Shooting),
                ("HIERARCHICAL", Transport::Hierarchical),
                ("RAYS", Transport::Rays),
            ],
        )?,
        separate_layers: choice(py, "layers", layers, &[("TOTAL", false), ("SEPARATE", true)])?,
        verify_points: count(py, "verify_points", verify_points)?,
        anyway: Anyway::default(),
        effort: Effort::default(),
        threads: count(py, "threads", threads)?,
    };
    settings.validate().map_err(|error| to_python(py, &error))?;
    Job::spawn(scene.take()?, settings)
}

fn choice<T: Copy>(py: Python<'_>, setting: &str, got: &str, choices: &[(&str, T)]) -> PyResult<T> {
    choices.iter().find(|(name, _)| *name == got).map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
        let message = format!("setting {setting} = {got}: must be one of {}", names.join(", "));
        invalid_setting(py, message, setting)
    })
}

fn count<T: TryFrom<i64>>(py: Python<'_>, setting: &str, got: i64) -> PyResult<T> {
    T::try_from(got).map_err(|_| {
        let reason = if got < 0 { "must not be negative" } else { "is too large" };
        invalid_setting(py, format!("setting {setting} = {got}: {reason}"), setting)
    })
}
