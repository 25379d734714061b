//! One exception class per kind of error, mapped in one place.

use antumbra::Error;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::types::PyType;

create_exception!(antumbra_native, AntumbraError, PyException, "Base of every error the solver raises.");
create_exception!(
    antumbra_native,
    InvalidSceneError,
    AntumbraError,
    "The scene holds something that cannot be computed. `object` and `index` name it where they are known."
);
create_exception!(
    antumbra_native,
    InvalidSettingError,
    AntumbraError,
    "A setting is out of its range. `setting` is its name."
);
create_exception!(antumbra_native, NoLightError, AntumbraError, "Nothing in the scene sends light.");
create_exception!(antumbra_native, NoReceiverError, AntumbraError, "No surface is there to be baked.");
create_exception!(antumbra_native, BakeCancelled, AntumbraError, "The bake was cancelled.");
create_exception!(
    antumbra_native,
    SolverPanicError,
    AntumbraError,
    "The solver met a state it holds to be impossible: a bug in Antumbra."
);

/// Adds every exception class to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    fn add(module: &Bound<'_, PyModule>, class: &Bound<'_, PyType>, attributes: &[&str]) -> PyResult<()> {
        // The stable ABI of Python 3.11 cannot derive a Rust struct from Exception, so the attributes live in the
        // instance, and the class holds what an instance without them answers.
        for name in attributes {
            class.setattr(*name, module.py().None())?;
        }
        module.add(class.name()?, class)
    }
    let py = module.py();
    add(module, &py.get_type::<AntumbraError>(), &[])?;
    add(module, &py.get_type::<InvalidSceneError>(), &["object", "index"])?;
    add(module, &py.get_type::<InvalidSettingError>(), &["setting"])?;
    add(module, &py.get_type::<NoLightError>(), &[])?;
    add(module, &py.get_type::<NoReceiverError>(), &[])?;
    add(module, &py.get_type::<BakeCancelled>(), &[])?;
    add(module, &py.get_type::<SolverPanicError>(), &[])
}

/// The exception for an error of the solver.
pub(crate) fn to_python(py: Python<'_>, error: &Error) -> PyErr {
    let message = error.to_string();
    match error {
        Error::VertexNotFinite { object, vertex: index }
        | Error::VertexTooFar { object, vertex: index, .. }
        | Error::NormalNotFinite { object, corner: index }
        | Error::VertexOutOfRange { object, triangle: index, .. }
        | Error::MaterialOutOfRange { object, triangle: index, .. } => {
            invalid_scene(py, message, Some(object), Some(*index))
        }
        Error::TransformNotFinite { object } | Error::LengthMismatch { object, .. } => {
            invalid_scene(py, message, Some(object), None)
        }
        Error::ReflectanceOutOfRange { .. }
        | Error::TransmittanceOutOfRange { .. }
        | Error::ExitanceInvalid { .. }
        | Error::LightNotFinite { .. }
        | Error::LightOutOfRange { .. }
        | Error::LightOutline { .. }
        | Error::LinkOutOfRange { .. }
        | Error::SkyCells { .. }
        | Error::EndlessLight { .. } => invalid_scene(py, message, None, None),
        Error::NoLight => NoLightError::new_err(message),
        Error::NoReceiver => NoReceiverError::new_err(message),
        Error::InvalidSetting { name, .. } => invalid_setting(py, message, name),
        Error::Cancelled => BakeCancelled::new_err(message),
        // The enum may grow in the solver first: a new kind is still an AntumbraError with its message.
        _ => AntumbraError::new_err(message),
    }
}

/// An [`InvalidSceneError`] with its attributes.
pub(crate) fn invalid_scene(
    py: Python<'_>,
    message: String,
    object: Option<&str>,
    index: Option<usize>,
) -> PyErr {
    with_attributes(py, InvalidSceneError::new_err(message), |value| {
        value.setattr("object", object)?;
        value.setattr("index", index)
    })
}

/// An [`InvalidSettingError`] with its attribute.
pub(crate) fn invalid_setting(py: Python<'_>, message: String, setting: &str) -> PyErr {
    with_attributes(py, InvalidSettingError::new_err(message), |value| value.setattr("setting", setting))
}

fn with_attributes(
    py: Python<'_>,
    error: PyErr,
    set: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<()>,
) -> PyErr {
    // An exception that cannot take its attributes is still the right exception.
    match set(error.value(py).as_any()) {
        Ok(()) => error,
        Err(failure) => failure,
    }
}
