//! Conversion of the libraries' errors to the exceptions in `python/cagework/_errors.py`.

use std::fmt::Display;

use cagework_job::JobError;
use pyo3::PyErr;

/// Imports exception classes, and defines for each a function that creates the exception from an error.
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
    /// An array with an unexpected shape or type.
    array: ArrayError,
    /// A failed bind.
    bind: BindError,
    /// An invalid cage, or a failed generation.
    cage: CageError,
    /// A model that cannot be read or written.
    model: ModelError,
    /// An option with an invalid value.
    option: OptionError,
    /// Invalid grabs, pins or targets.
    pull: PullError,
}

/// Creates the exception for an error of deforming a file.
pub(crate) fn job(error: JobError) -> PyErr {
    match error {
        JobError::Bind(error) => bind(error),
        JobError::NoPoses => array(error),
        JobError::NeedsMesh { .. }
        | JobError::NeedsSplats
        | JobError::NoFeet
        | JobError::NoVrm { .. }
        | JobError::ClipFormat { .. }
        | JobError::FormatPoses { .. }
        | JobError::OnePose { .. }
        | JobError::NoAnimation { .. }
        | JobError::Times { .. }
        | JobError::Timeline(_) => option(error),
        _ => model(error),
    }
}
