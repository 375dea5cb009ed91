//! Errors of core and io as Python's exceptions, with their sentences. The classes are in `python/cagework/_errors.py`.

use std::fmt::Display;

use pyo3::PyErr;

mod classes {
    pyo3::import_exception!(cagework._errors, ArrayError);
    pyo3::import_exception!(cagework._errors, BindError);
    pyo3::import_exception!(cagework._errors, CageError);
    pyo3::import_exception!(cagework._errors, ModelError);
    pyo3::import_exception!(cagework._errors, OptionError);
    pyo3::import_exception!(cagework._errors, PullError);
}

/// An array of another shape or type than is needed.
pub(crate) fn array(error: impl Display) -> PyErr {
    classes::ArrayError::new_err(error.to_string())
}

/// A bind that failed.
pub(crate) fn bind(error: impl Display) -> PyErr {
    classes::BindError::new_err(error.to_string())
}

/// No cage, or none could be made.
pub(crate) fn cage(error: impl Display) -> PyErr {
    classes::CageError::new_err(error.to_string())
}

/// A model that cannot be read or written.
pub(crate) fn model(error: impl Display) -> PyErr {
    classes::ModelError::new_err(error.to_string())
}

/// An option out of range.
pub(crate) fn option(error: impl Display) -> PyErr {
    classes::OptionError::new_err(error.to_string())
}

/// Nothing that can be pulled.
pub(crate) fn pull(error: impl Display) -> PyErr {
    classes::PullError::new_err(error.to_string())
}
