//! Errors of core and io as Python's exceptions, with their sentences. The classes are in `python/cagework/_errors.py`.

use std::fmt::Display;

use pyo3::PyErr;

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
