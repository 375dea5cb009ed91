//! Conversion of keyword arguments to options, and of reports to dictionaries.

use cagework_cage::CageOptions;
use cagework_core::BindOptions;
use cagework_io::{json_fault, value_fault};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::error;

/// 2^53: all smaller whole numbers have an exact f64.
const MAX_WHOLE: f64 = 9_007_199_254_740_992.0;

/// Reads options from keyword arguments. Missing arguments and `None` mean the default.
///
/// # Errors
/// `TypeError` for an unknown name, `OptionError` for a value of the wrong type. Ranges are checked by the core.
pub(crate) fn options<T: Default + Serialize + DeserializeOwned>(
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<T> {
    let wrong =
        |name: &str, e: serde_json::Error| error::option(format!("{name}: {}", value_fault(&e.to_string())));
    let mut all = serde_json::to_value(T::default()).map_err(|e| wrong("defaults", e))?;
    for (name, value) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        let names: Vec<String> = all.as_object().into_iter().flat_map(|all| all.keys().cloned()).collect();
        let Some(option) = all.get_mut(&name) else {
            return Err(PyTypeError::new_err(format!("no option {name:?}; there are {}", names.join(", "))));
        };
        if !value.is_none() {
            *option = json(&name, &value)?;
            // Convert after each option, so that the error names the option at fault.
            serde_json::from_value::<T>(all.clone()).map_err(|e| wrong(&name, e))?;
        }
    }
    serde_json::from_value(all).map_err(|e| wrong("options", e))
}

fn json(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    // Also a bool of NumPy.
    if let Ok(flag) = value.extract::<bool>() {
        return Ok(Value::from(flag));
    }
    // The float 24.0 counts as the whole number 24.
    let whole = |x: f64| x.fract() == 0.0 && x.abs() < MAX_WHOLE;
    if let Some(x) = value.extract::<f64>().ok().filter(|&x| whole(x)) {
        return Ok(Value::from(x as i64));
    }
    let number = value.extract::<u64>().map(Value::from).or_else(|_| value.extract::<i64>().map(Value::from));
    let number = number.or_else(|_| value.extract::<f64>().map(Value::from));
    number.or_else(|_| value.extract::<String>().map(Value::from)).map_err(|_| {
        error::option(format!(
            "{name} is of type {}; expected a number, a string or a bool",
            value.get_type()
        ))
    })
}

/// Returns the default options of `bind` and of `generate_cage`: a list of two dicts. The tests compare them with the signatures.
///
/// Raises nothing.
#[pyfunction]
pub(crate) fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    dictionary(py, &(BindOptions::default(), CageOptions::default()))
}

/// Converts a dictionary to a struct; the inverse of [`dictionary`].
///
/// # Errors
/// `ArrayError` if the value does not have the expected structure.
pub(crate) fn from_dictionary<T: DeserializeOwned>(value: &Bound<'_, PyAny>) -> PyResult<T> {
    let text: String = value.py().import("json")?.call_method1("dumps", (value,))?.extract()?;
    serde_json::from_str(&text).map_err(|e| error::array(json_fault(text.as_bytes(), &e)))
}

/// Converts a report to a dictionary.
///
/// # Errors
/// Never in practice, because reports contain only text, numbers and lists.
pub(crate) fn dictionary<'py>(py: Python<'py>, report: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(report).map_err(error::option)?;
    py.import("json")?.call_method1("loads", (text,))
}
