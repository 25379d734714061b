//! numpy arrays to owned Rust data, with shape and dtype checked, and back without a copy.

use bytemuck::{Pod, allocation::cast_vec};
use numpy::ndarray::IntoDimension;
use numpy::{
    Element, PyArray, PyArray1, PyArrayDescrMethods, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// What an argument must look like, for the check and for its message.
pub(crate) struct Expected<'a> {
    object: &'a str,
    name: &'static str,
    shape: &'a [Option<usize>],
}

impl<'a> Expected<'a> {
    /// The array `name` of `object`, one length per axis, `None` where any length will do.
    pub(crate) fn of(object: &'a str, name: &'static str, shape: &'a [Option<usize>]) -> Self {
        Self { object, name, shape }
    }
}

/// Owns a float32 or float64 array as rows of `N`.
pub(crate) fn floats<const N: usize>(
    value: &Bound<'_, PyAny>,
    expected: &Expected<'_>,
) -> PyResult<Vec<[f64; N]>> {
    let array = checked(value, expected, "float32 or float64", |kind, size| {
        kind == b'f' && (size == 4 || size == 8)
    })?;
    rows(&contiguous::<f64>(array)?)
}

/// Owns an array of any integer type as rows of `N`.
pub(crate) fn integers<const N: usize>(
    value: &Bound<'_, PyAny>,
    expected: &Expected<'_>,
) -> PyResult<Vec<[i64; N]>> {
    let array = checked(value, expected, "integer", |kind, _| kind == b'i' || kind == b'u')?;
    rows(&contiguous::<i64>(array)?)
}

/// Hands a vector of rows to numpy as an array of the given shape. No copy: numpy keeps the allocation alive.
pub(crate) fn into_numpy<'py, Row: Pod, T: Element + Pod, Shape: IntoDimension>(
    py: Python<'py>,
    rows: Vec<Row>,
    shape: Shape,
) -> PyResult<Py<PyArray<T, Shape::Dim>>>
where
    Shape::Dim: 'py,
{
    let flat = cast_vec::<Row, T>(rows);
    Ok(PyArray1::from_vec(py, flat).reshape(shape)?.unbind())
}

fn checked<'a, 'py>(
    value: &'a Bound<'py, PyAny>,
    expected: &Expected<'_>,
    kinds: &str,
    accepts: impl FnOnce(u8, usize) -> bool,
) -> PyResult<&'a Bound<'py, PyUntypedArray>> {
    let Expected { name, object, shape } = expected;
    let Ok(array) = value.cast::<PyUntypedArray>() else {
        let got = value.get_type().name()?;
        let message = format!("object “{object}”: {name} is a {got}, expected a numpy array");
        return Err(PyTypeError::new_err(message));
    };
    let dtype = array.dtype();
    if !accepts(dtype.kind(), dtype.itemsize()) {
        let message = format!("object “{object}”: {name} has dtype {dtype}, expected {kinds}");
        return Err(PyTypeError::new_err(message));
    }
    let got = array.shape();
    let fits = got.len() == shape.len()
        && got.iter().zip(*shape).all(|(length, wanted)| wanted.is_none_or(|wanted| wanted == *length));
    if !fits {
        let axis = |length: Option<usize>| length.map_or("N".to_owned(), |length| length.to_string());
        let got = tuple(got.iter().map(|length| axis(Some(*length))));
        let wanted = tuple(shape.iter().map(|length| axis(*length)));
        let message = format!("object “{object}”: {name} has shape {got}, expected {wanted}");
        return Err(PyValueError::new_err(message));
    }
    Ok(array)
}

/// The array as aligned, native-endian, C-contiguous `T`; numpy copies only when it is anything else.
fn contiguous<'py, T: Element>(array: &Bound<'py, PyUntypedArray>) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let py = array.py();
    let require = py.import("numpy")?.getattr("require")?;
    let array = require.call1((array, numpy::dtype::<T>(py), ["C", "A"]))?;
    array.extract()
}

fn rows<T: Element + Pod, const N: usize>(array: &PyReadonlyArrayDyn<'_, T>) -> PyResult<Vec<[T; N]>> {
    let (rows, _) = array.as_slice()?.as_chunks::<N>();
    Ok(rows.to_vec())
}

fn tuple(lengths: impl Iterator<Item = String>) -> String {
    let lengths: Vec<_> = lengths.collect();
    match lengths.as_slice() {
        [one] => format!("({one},)"),
        _ => format!("({})", lengths.join(", ")),
    }
}
