//! Errors of core and io as Python's exceptions, with their sentences. The classes are in `python/cagework/_errors.py`.

use std::ffi::CString;
use std::fmt::Display;

use pyo3::exceptions::PyUserWarning;
use pyo3::{PyErr, PyResult, PyTypeInfo as _, Python};

/// A class of Python and the function that makes one of an error.
macro_rules! exceptions {
    ($($(#[$about:meta])* $name:ident: $class:ident,)+) => {
        mod classes {
            $(pyo3::import_exception!(cagework._errors, $class);)+
        }
        $($(#[$about])* pub(crate) fn $name(error: impl Display) -> PyErr {
            classes::$class::new_err(error.to_string())
        })+
    };
}

exceptions! {
    /// An array of another shape or type than is needed.
    array: ArrayError,
    /// A bind that failed.
    bind: BindError,
    /// No cage, or none could be made.
    cage: CageError,
    /// A model that cannot be read or written.
    model: ModelError,
    /// An option out of range.
    option: OptionError,
    /// Nothing that can be pulled.
    pull: PullError,
}

/// A warning, which Python may be told to raise.
///
/// # Errors
/// The warning.
pub(crate) fn warn(py: Python<'_>, sentence: &str) -> PyResult<()> {
    let sentence = CString::new(sentence.replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &PyUserWarning::type_object(py), &sentence, 1)
}
