//! `antumbra_native`: the solver for Python.
//!
//! A thin layer that does one thing per file: [`scene`] owns the caller's arrays, [`start`] moves them into a thread,
//! [`job`] watches that thread, [`bake`] hands the result over without copying it. Python's lock is left through
//! one door, [`detach`]; every error becomes an exception in one place, [`errors`]. `antumbra_native.pyi` is the
//! interface as Python sees it.

mod arrays;
mod bake;
mod detach;
mod errors;
mod job;
mod scene;
mod start;

use peak_alloc::PeakAlloc;
use pyo3::prelude::*;

/// Counts what the solver allocates, for its report. What Python and Blender take is not in it.
#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

#[pymodule]
fn antumbra_native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::register(module)?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<job::Job>()?;
    module.add_class::<job::Progress>()?;
    module.add_class::<bake::Bake>()?;
    module.add_class::<bake::BakedMesh>()?;
    module.add_function(wrap_pyfunction!(job::start_failing, module)?)?;
    module.add_function(wrap_pyfunction!(start::start, module)?)
}
