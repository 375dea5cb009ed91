//! NumPy arrays as the core's arrays and back.

use cagework_core::{Binding, Frames, Weights};
use cagework_io::origin_near;
use glam::{DVec3, Vec3};
use numpy::{
    PyArray1, PyArray2, PyArrayDescrMethods as _, PyArrayDyn, PyArrayMethods as _, PyReadonlyArray2,
    PyUntypedArray, PyUntypedArrayMethods as _,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error;
use crate::options::{dictionary, from_dictionary};

/// Points of an array: lent where it holds 32-bit floats in rows, otherwise converted.
pub(crate) enum Points<'py> {
    Lent(PyReadonlyArray2<'py, f32>),
    Converted(Vec<Vec3>),
}

impl Points<'_> {
    /// As seen from an origin. `[n]`
    pub(crate) fn as_slice(&self) -> &[Vec3] {
        match self {
            Self::Lent(array) => bytemuck::cast_slice(array.as_slice().expect("rows were asked for")),
            Self::Converted(points) => points,
        }
    }
}

/// An array, or what can be made one, in rows one after the other: itself where it is.
fn in_rows<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    let none = value.py().None();
    Ok(value.py().import("numpy")?.call_method1("require", (value, none, "CA"))?.cast_into()?)
}

/// That an array is not what is needed.
fn wrong(name: &str, array: &Bound<'_, PyUntypedArray>, needed: &str) -> PyErr {
    let (dtype, shape) = (array.dtype(), array.shape());
    error::array(format!("{name}: {dtype} of shape {shape:?} came; {needed} is needed"))
}

/// Points `[n, 3]` as seen from an origin; as many as `n` says, if it does.
///
/// # Errors
/// `ArrayError` names type and shape that came, and those that are needed.
pub(crate) fn points<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    n: Option<usize>,
    origin: DVec3,
) -> PyResult<Points<'py>> {
    let array = in_rows(value)?;
    let fits = matches!(*array.shape(), [rows, 3] if n.is_none_or(|n| n == rows));
    match (fits, array.cast::<PyArray2<f32>>(), array.cast::<PyArray2<f64>>()) {
        (true, Ok(array), _) if origin == DVec3::ZERO => Ok(Points::Lent(array.try_readonly()?)),
        (true, Ok(array), _) => {
            let array = array.try_readonly()?;
            let rows = array.as_slice().expect("rows were asked for").as_chunks::<3>().0;
            let from = |&p: &[f32; 3]| (Vec3::from_array(p).as_dvec3() - origin).as_vec3();
            Ok(Points::Converted(rows.iter().map(from).collect()))
        }
        (true, _, Ok(array)) => {
            let array = array.try_readonly()?;
            let rows = array.as_slice().expect("rows were asked for").as_chunks::<3>().0;
            Ok(Points::Converted(rows.iter().map(|&p| (DVec3::from_array(p) - origin).as_vec3()).collect()))
        }
        _ => {
            let n = n.map_or("n".to_owned(), |n| n.to_string());
            Err(wrong(name, &array, &format!("float32 or float64 of shape [{n}, 3]")))
        }
    }
}

/// Points `[n, 3]` as seen from an origin near them, and that origin: zero unless they are far away.
///
/// # Errors
/// As [`points`].
pub(crate) fn placed<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    n: Option<usize>,
) -> PyResult<(Points<'py>, DVec3)> {
    let world = points(name, value, n, DVec3::ZERO)?;
    let origin = origin_near(world.as_slice());
    if origin == DVec3::ZERO { Ok((world, origin)) } else { Ok((points(name, value, n, origin)?, origin)) }
}

/// Indices of an array of whole numbers.
fn indices(name: &str, array: &Bound<'_, PyUntypedArray>, needed: &str) -> PyResult<Vec<u32>> {
    if !matches!(array.dtype().kind(), b'i' | b'u') {
        return Err(wrong(name, array, needed));
    }
    let array = array.call_method1("astype", ("int64",))?.cast_into::<PyArrayDyn<i64>>()?.try_readonly()?;
    let index = |&i: &i64| {
        let largest = u32::MAX;
        u32::try_from(i).map_err(|_| error::array(format!("{name}: index {i} is not from 0 to {largest}")))
    };
    array.as_slice().expect("astype keeps the order").iter().map(index).collect()
}

/// Indices `[n]`.
///
/// # Errors
/// `ArrayError`.
pub(crate) fn list(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    let (array, needed) = (in_rows(value)?, "whole numbers of shape [n]");
    match *array.shape() {
        [0] => Ok(Vec::new()),
        [_] => indices(name, &array, needed),
        _ => Err(wrong(name, &array, needed)),
    }
}

/// Triangles `[n, 3]`.
///
/// # Errors
/// `ArrayError`.
pub(crate) fn triangles(value: &Bound<'_, PyAny>) -> PyResult<Vec<[u32; 3]>> {
    let (name, array, needed) = ("triangles", in_rows(value)?, "whole numbers of shape [n, 3]");
    match *array.shape() {
        [_, 3] => Ok(indices(name, &array, needed)?.as_chunks().0.to_vec()),
        _ => Err(wrong(name, &array, needed)),
    }
}

/// Faces: an array `[n, k]`, or a list of arrays of any lengths.
///
/// # Errors
/// `ArrayError`.
pub(crate) fn faces(value: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<u32>>> {
    let Ok(array) = value.cast::<PyUntypedArray>() else {
        return value.try_iter()?.map(|face| list("a face", &face?)).collect();
    };
    let (array, needed) = (in_rows(array)?, "whole numbers of shape [n, 3] or [n, 4], or a list of them,");
    match *array.shape() {
        [_, k] if k > 0 => Ok(indices("faces", &array, needed)?.chunks(k).map(<[u32]>::to_vec).collect()),
        _ => Err(wrong("faces", &array, needed)),
    }
}

/// Points as seen from an origin as an array `[n, 3]` of 32-bit floats, or of 64-bit ones far away.
///
/// # Errors
/// None in practice.
pub(crate) fn array_of(py: Python<'_>, points: Vec<Vec3>, origin: DVec3) -> PyResult<Bound<'_, PyAny>> {
    if origin != DVec3::ZERO {
        return Ok(wide_array_of(py, points.iter().map(|p| origin + p.as_dvec3()))?.into_any());
    }
    let n = points.len();
    let flat = points.into_iter().map(|p| p.to_array()).collect::<Vec<_>>().into_flattened();
    Ok(PyArray1::from_vec(py, flat).reshape([n, 3])?.into_any())
}

/// Points as an array `[n, 3]` of 64-bit floats.
///
/// # Errors
/// None in practice.
pub(crate) fn wide_array_of<'py>(
    py: Python<'py>,
    points: impl Iterator<Item = DVec3>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat = points.map(|p| p.to_array()).collect::<Vec<_>>().into_flattened();
    let n = flat.len() / 3;
    PyArray1::from_vec(py, flat).reshape([n, 3])
}

/// Triples of indices as an array `[n, 3]`.
///
/// # Errors
/// None in practice.
pub(crate) fn triples<'py>(py: Python<'py>, all: &[[u32; 3]]) -> PyResult<Bound<'py, PyArray2<i32>>> {
    PyArray1::from_iter(py, all.as_flattened().iter().map(|&i| i as i32)).reshape([all.len(), 3])
}

/// Weights as a `scipy.sparse.csr_array`, without a copy.
///
/// # Errors
/// When SciPy is not there.
pub(crate) fn matrix_of(py: Python<'_>, weights: Weights) -> PyResult<Bound<'_, PyAny>> {
    let shape = (weights.n_rows(), weights.n_columns());
    let (indptr, indices, data) = weights.into_parts();
    // SciPy counts with signed numbers.
    let small = i32::try_from(data.len()).is_ok();
    let signed = |unsigned: Vec<u32>| {
        let array = PyArray1::from_vec(py, unsigned);
        if small { array.call_method1("view", ("int32",)) } else { array.call_method1("astype", ("int64",)) }
    };
    let parts = (PyArray1::from_vec(py, data), signed(indices)?, signed(indptr)?);
    py.import("scipy.sparse")?.getattr("csr_array")?.call1((parts, shape))
}

/// Weights of a sparse matrix of SciPy.
///
/// # Errors
/// `ArrayError` when it is none, or no matrix of weights.
pub(crate) fn weights(value: &Bound<'_, PyAny>) -> PyResult<Weights> {
    let Ok(rows) = value.call_method0("tocsr") else {
        let came = value.get_type().name()?;
        return Err(error::array(format!(
            "weights: {came} came; a sparse matrix or array of SciPy is needed"
        )));
    };
    let part = |name: &str| in_rows(&rows.getattr(name)?);
    let data = part("data")?;
    if data.dtype().kind() != b'f' {
        return Err(wrong("weights", &data, "float32 or float64"));
    }
    let data = data.call_method1("astype", ("float32",))?.cast_into::<PyArray1<f32>>()?;
    let (_, n_columns): (u32, u32) = rows.getattr("shape")?.extract()?;
    let [indptr, indices] =
        [part("indptr")?, part("indices")?].map(|a| indices("weights", &a, "whole numbers"));
    Weights::new(n_columns, indptr?, indices?, data.to_vec()?)
        .map_err(|e| error::array(format!("weights: {e}")))
}

/// What a report says beside the weights of the controls, which are returned: points outside, and the offsets with their frames.
///
/// # Errors
/// None in practice.
pub(crate) fn put_beside<'py>(report: &Bound<'py, PyAny>, binding: Binding) -> PyResult<Weights> {
    let (py, Binding { weights, frames, outside, .. }) = (report.py(), binding);
    let said = PyDict::new(py);
    said.set_item("vertex", PyArray1::from_iter(py, outside.iter().map(|o| o.vertex as i32)))?;
    said.set_item("distance", PyArray1::from_iter(py, outside.iter().map(|o| o.distance)))?;
    said.set_item("share", PyArray1::from_iter(py, outside.iter().map(|o| o.share)))?;
    report.set_item("outside", said)?;
    report.set_item("frames", dictionary(py, &frames)?)?;
    if !frames.is_used() {
        return Ok(weights);
    }
    let n = weights.n_columns() as u32;
    let n_controls = n - frames.n_columns() as u32;
    report.set_item("offsets", matrix_of(py, weights.columns(n_controls..n))?)?;
    Ok(weights.columns(0..n_controls))
}

/// The way back from [`put_beside`].
///
/// # Errors
/// `ArrayError`; `KeyError` when it is not what a bind reports.
pub(crate) fn with_beside(report: Option<&Bound<'_, PyAny>>, own: Weights) -> PyResult<(Weights, Frames)> {
    let Some(report) = report else { return Ok((own, Frames::default())) };
    let frames: Frames = from_dictionary(&report.get_item("frames")?)?;
    if !frames.is_used() {
        return Ok((own, frames));
    }
    let offsets = weights(&report.get_item("offsets")?)?;
    let [rows, columns] = [own.n_rows(), own.n_columns()];
    if offsets.n_rows() != rows || offsets.n_columns() != frames.n_columns() || !frames.fits(columns) {
        return Err(error::array(format!(
            "the report is not of these weights, which have shape [{rows}, {columns}]"
        )));
    }
    Ok((own.beside(&offsets), frames))
}
