//! The one door out of Python's interpreter lock.

use pyo3::prelude::*;

/// Runs `work` without the interpreter lock, so that Blender's window and other Python threads go on meanwhile.
///
/// Everything that can take longer than a copy passes through here; `work` cannot touch Python objects, which its
/// `Send` bound checks.
pub(crate) fn leave_python<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> T {
    py.detach(work)
}
