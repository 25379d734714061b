//! `Job`: a bake that runs in its own thread, and the window through which Python watches it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use antumbra::monitor::Monitor;
use antumbra::scene::SceneInput;
use antumbra::settings::Settings;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::MEMORY;
use crate::bake::{Bake, list_of_meshes};
use crate::detach::leave_python;
use crate::errors::{SolverPanicError, to_python};
use crate::scene::Scene;

/// How often a waiting `result()` looks for Ctrl+C: as often as the solver looks for a cancel.
const SIGNAL_CHECK: Duration = Duration::from_millis(50);

/// What the thread ends with.
enum Outcome {
    Baked(Box<antumbra::weld::Bake>),
    Refused(antumbra::Error),
    Panicked(String),
}

/// What bakes.
type Solver = fn(&SceneInput, &Settings, &Monitor) -> Result<antumbra::weld::Bake, antumbra::Error>;

/// The running side of a job.
struct Worker {
    thread: JoinHandle<()>,
    outcome: Receiver<Outcome>,
}

/// A running bake. Dropping it cancels the bake and waits for its thread.
#[pyclass(frozen, module = "antumbra_native")]
pub(crate) struct Job {
    monitor: Arc<Monitor>,
    /// `None` once `result()` has taken it.
    worker: Mutex<Option<Worker>>,
}

impl Job {
    /// Starts the solving thread.
    pub(crate) fn spawn(scene: SceneInput, settings: Settings) -> PyResult<Self> {
        Self::spawn_with(scene, settings, antumbra::solve::bake)
    }

    /// The same with any solver.
    fn spawn_with(scene: SceneInput, settings: Settings, solver: Solver) -> PyResult<Self> {
        let monitor = Arc::new(Monitor::new());
        let (sender, outcome) = channel();
        let watched = Arc::clone(&monitor);
        let solve = move || {
            let outcome = solve_caught(solver, &scene, &settings, &watched);
            // The input may be large: free it before the caller makes meshes of the output.
            drop(scene);
            // Nobody listens any more when the job was dropped.
            let _ = sender.send(outcome);
        };
        let thread = Builder::new().name("antumbra".to_owned()).spawn(solve)?;
        Ok(Self { monitor, worker: Mutex::new(Some(Worker { thread, outcome })) })
    }

    fn worker(&self) -> MutexGuard<'_, Option<Worker>> {
        self.worker.lock().expect("nothing panics under this lock; this is a bug in antumbra")
    }
}

/// Panics end here: unwinding into the interpreter would take Blender down with the user's unsaved work.
fn solve_caught(solver: Solver, scene: &SceneInput, settings: &Settings, monitor: &Monitor) -> Outcome {
    // Nothing of the scene is read again after a panic, so no half-changed state can be seen.
    // A cancelled bake that has not noticed yet counts too.
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    match catch_unwind(AssertUnwindSafe(|| solver(scene, settings, monitor))) {
        Ok(Ok(mut bake)) => {
            bake.report.memory.peak_bytes = Some(MEMORY.peak_usage().saturating_sub(before) as u64);
            Outcome::Baked(Box::new(bake))
        }
        Ok(Err(error)) => Outcome::Refused(error),
        Err(payload) => Outcome::Panicked(panic_message(payload.as_ref())),
    }
}

/// A job whose solver meets a bug. No bug is at hand to test with what becomes of one; nothing else calls this.
#[pyfunction]
#[pyo3(name = "_start_failing")]
pub(crate) fn start_failing(scene: &Scene) -> PyResult<Job> {
    Job::spawn_with(scene.take()?, Settings::default(), |_, _, _| panic!("failing as asked for"))
}

fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("the solver panicked without a message")
        .to_owned()
}

#[pymethods]
impl Job {
    /// The latest snapshot of how far the bake has come; never waits for the solver.
    fn progress(&self) -> Progress {
        let progress = self.monitor.progress();
        Progress {
            stage: progress.stage.name(),
            fraction: progress.fraction,
            shots: progress.shots,
            elements: progress.elements,
            unshot: progress.unshot,
        }
    }

    /// Asks the bake to give up; `result()` then raises `BakeCancelled`.
    fn cancel(&self) {
        self.monitor.cancel();
    }

    /// Asks the bake to finish with what it has.
    fn stop(&self) {
        self.monitor.stop();
    }

    /// The mesh and its light as they were at a stage of the bake, or `None` when there is nothing new.
    ///
    /// Asking is what makes the solver keep the next one: a bake that nobody watches costs nothing.
    fn preview(&self, py: Python<'_>) -> PyResult<Option<Py<PyList>>> {
        self.monitor.preview().map(|meshes| list_of_meshes(py, meshes)).transpose()
    }

    /// Whether `result()` would return or raise at once.
    fn done(&self) -> bool {
        self.worker().as_ref().is_none_or(|worker| worker.thread.is_finished())
    }

    /// Waits for the bake and hands it over, or raises why there is none. Can be called once.
    ///
    /// Ctrl+C while waiting cancels the bake.
    fn result(&self, py: Python<'_>) -> PyResult<Bake> {
        let worker = self.worker().take();
        let worker =
            worker.ok_or_else(|| PyRuntimeError::new_err("the result of this bake was taken before"))?;
        let outcome = leave_python(py, || wait(worker, &self.monitor))?;
        match outcome {
            Outcome::Baked(bake) => Bake::new(py, *bake),
            Outcome::Refused(error) => Err(to_python(py, &error)),
            Outcome::Panicked(message) => Err(SolverPanicError::new_err(format!(
                "the solver failed: {message}. This is a bug in Antumbra, please report it"
            ))),
        }
    }
}

/// Waits for the thread's last word, with Python left alone but for its signals.
fn wait(worker: Worker, monitor: &Monitor) -> PyResult<Outcome> {
    let Worker { thread, outcome } = worker;
    let outcome = loop {
        match outcome.recv_timeout(SIGNAL_CHECK) {
            Ok(outcome) => break Ok(outcome),
            Err(RecvTimeoutError::Timeout) => {
                #[expect(
                    clippy::redundant_closure_for_method_calls,
                    reason = "the method itself is not general over the lock's lifetime"
                )]
                if let Err(interrupt) = Python::attach(|py| py.check_signals()) {
                    monitor.cancel();
                    break Err(interrupt);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                unreachable!("the thread sends an outcome even when it panics; this is a bug in antumbra")
            }
        }
    };
    thread.join().expect("the thread catches its panics; this is a bug in antumbra");
    outcome
}

impl Drop for Job {
    fn drop(&mut self) {
        self.monitor.cancel();
        let Some(worker) = self.worker().take() else { return };
        // A solver that fails while it is being cancelled has nobody left to tell.
        let join = move || drop(worker.thread.join());
        // While the interpreter shuts down there is no lock to leave any more.
        let mut join = Some(join);
        Python::try_attach(|py| join.take().map(|join| leave_python(py, join)));
        if let Some(join) = join {
            join();
        }
    }
}

/// A snapshot of how far a bake has come.
#[pyclass(frozen, get_all, module = "antumbra_native")]
pub(crate) struct Progress {
    /// What the solver is doing, in lower-case English.
    stage: &'static str,
    /// Share of the expected work that is done, 0 to 1.
    fraction: f64,
    /// Shots so far.
    shots: usize,
    /// Leaf elements of the mesh.
    elements: usize,
    /// Share of the emitted light that has not been distributed yet.
    unshot: f64,
}

#[pymethods]
impl Progress {
    fn __repr__(&self) -> String {
        format!(
            "Progress(stage={:?}, fraction={}, shots={}, elements={}, unshot={})",
            self.stage, self.fraction, self.shots, self.elements, self.unshot
        )
    }
}
