//! Conversion between NumPy arrays and the core's arrays.

use cagework_core::{Binding, Frames, Weights};
use cagework_io::origin_near;
use glam::{DVec3, Vec3};
use numpy::{
    PyArray1, PyArray2, PyArrayDescrMethods as _, PyArrayDyn, PyArrayMethods as _, PyReadonlyArray2,
    PyUntypedArray, PyUntypedArrayMethods as _,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::{Deserialize, Serialize};

use crate::error;
use crate::options::{dictionary, from_dictionary};

/// Points from an array: borrowed if it is C-contiguous float32, otherwise converted.
pub(crate) enum Points<'py> {
    Borrowed(PyReadonlyArray2<'py, f32>),
    Converted(Vec<Vec3>),
}

impl Points<'_> {
    /// The points `[n]`. Converted points are relative to the origin that was subtracted from them.
    pub(crate) fn as_slice(&self) -> &[Vec3] {
        match self {
            Self::Borrowed(array) => {
                bytemuck::cast_slice(array.as_slice().expect("the array is C-contiguous"))
            }
            Self::Converted(points) => points,
        }
    }
}

/// Converts a value to a C-contiguous array in the byte order of the machine. Such an array is returned unchanged.
///
/// # Errors
/// `ArrayError` if entries are masked, because the conversion would use the numbers behind the mask.
fn c_contiguous<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    let (none, numpy) = (value.py().None(), value.py().import("numpy")?);
    if value.hasattr("mask")? && numpy.getattr("ma")?.call_method1("is_masked", (value,))?.is_truthy()? {
        return Err(error::array(format!("{name}: entries are masked; fill them or remove their rows")));
    }
    let array = numpy.call_method1("require", (value, none, "CA"))?;
    let array: Bound<'py, PyUntypedArray> = array.cast_into()?;
    if array.dtype().is_native_byteorder() != Some(false) {
        return Ok(array);
    }
    let native = array.dtype().call_method1("newbyteorder", ("=",))?;
    Ok(array.call_method1("astype", (native,))?.cast_into()?)
}

/// Creates an `ArrayError` with the actual and the expected type and shape.
fn mismatch(name: &str, array: &Bound<'_, PyUntypedArray>, expected: &str) -> PyErr {
    let (dtype, shape) = (array.dtype(), array.shape());
    error::array(format!("{name}: expected {expected}, got {dtype} of shape {shape:?}"))
}

/// Reads points `[n, 3]` relative to an origin. Whole numbers are converted. If `n` is given, the number of points must
/// match.
///
/// # Errors
/// `ArrayError`, with the actual and the expected type and shape.
pub(crate) fn points<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    n: Option<usize>,
    origin: DVec3,
) -> PyResult<Points<'py>> {
    let mut array = c_contiguous(name, value)?;
    if matches!(array.dtype().kind(), b'i' | b'u') {
        array = array.call_method1("astype", ("float64",))?.cast_into()?;
    }
    let fits = matches!(*array.shape(), [rows, 3] if n.is_none_or(|n| n == rows));
    match (fits, array.cast::<PyArray2<f32>>(), array.cast::<PyArray2<f64>>()) {
        (true, Ok(array), _) if origin == DVec3::ZERO => Ok(Points::Borrowed(array.try_readonly()?)),
        (true, Ok(array), _) => {
            let array = array.try_readonly()?;
            let rows = array.as_slice().expect("the array is C-contiguous").as_chunks::<3>().0;
            let from = |&p: &[f32; 3]| (Vec3::from_array(p).as_dvec3() - origin).as_vec3();
            Ok(Points::Converted(rows.iter().map(from).collect()))
        }
        (true, _, Ok(array)) => {
            let array = array.try_readonly()?;
            let rows = array.as_slice().expect("the array is C-contiguous").as_chunks::<3>().0;
            Ok(Points::Converted(rows.iter().map(|&p| (DVec3::from_array(p) - origin).as_vec3()).collect()))
        }
        _ => {
            let n = n.map_or("n".to_owned(), |n| n.to_string());
            Err(mismatch(name, &array, &format!("float32 or float64 of shape [{n}, 3]")))
        }
    }
}

/// Like [`points`], for points that must have finite coordinates.
///
/// # Errors
/// `ArrayError`, with the actual and the expected type and shape, or with the first row that is not finite.
pub(crate) fn finite_points<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    n: Option<usize>,
    origin: DVec3,
) -> PyResult<Points<'py>> {
    let points = points(name, value, n, origin)?;
    match points.as_slice().iter().position(|p| !p.is_finite()) {
        Some(row) => Err(error::array(format!(
            "{name}: row {row} is {:?}; coordinates must be finite in float32",
            points.as_slice()[row].to_array()
        ))),
        None => Ok(points),
    }
}

/// Reads points `[n, 3]` relative to an origin near them. Also returns this origin, which is zero unless the points are
/// far away.
///
/// # Errors
/// The errors of [`points`].
pub(crate) fn points_and_origin<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    n: Option<usize>,
) -> PyResult<(Points<'py>, DVec3)> {
    let world = points(name, value, n, DVec3::ZERO)?;
    let origin = origin_near(world.as_slice());
    if origin == DVec3::ZERO { Ok((world, origin)) } else { Ok((points(name, value, n, origin)?, origin)) }
}

/// Reads indices from an array of integers.
fn indices(name: &str, array: &Bound<'_, PyUntypedArray>, expected: &str) -> PyResult<Vec<u32>> {
    if !matches!(array.dtype().kind(), b'i' | b'u') {
        return Err(mismatch(name, array, expected));
    }
    let array = array.call_method1("astype", ("int64",))?.cast_into::<PyArrayDyn<i64>>()?.try_readonly()?;
    let index = |&i: &i64| {
        let largest = u32::MAX;
        u32::try_from(i)
            .map_err(|_| error::array(format!("{name}: index {i} is not between 0 and {largest}")))
    };
    array.as_slice().expect("astype keeps the memory order").iter().map(index).collect()
}

/// Reads indices `[n]`.
///
/// # Errors
/// `ArrayError` if the array has another type or shape, or an index is negative or too large.
pub(crate) fn list(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    let (array, expected) = (c_contiguous(name, value)?, "integers of shape [n]");
    match *array.shape() {
        [0] => Ok(Vec::new()),
        [_] => indices(name, &array, expected),
        _ => Err(mismatch(name, &array, expected)),
    }
}

/// Reads triangles `[n, 3]`.
///
/// # Errors
/// `ArrayError` if the array has another type or shape, or an index is negative or too large.
pub(crate) fn triangles(value: &Bound<'_, PyAny>) -> PyResult<Vec<[u32; 3]>> {
    let name = "triangles";
    let (array, expected) = (c_contiguous(name, value)?, "integers of shape [n, 3]");
    match *array.shape() {
        [_, 3] => Ok(indices(name, &array, expected)?.as_chunks().0.to_vec()),
        _ => Err(mismatch(name, &array, expected)),
    }
}

/// Reads faces: an array `[n, k]`, or a list of arrays of any lengths.
///
/// # Errors
/// `ArrayError` if the array has another type or shape, or an index is negative or too large.
pub(crate) fn faces(value: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<u32>>> {
    let Ok(array) = value.cast::<PyUntypedArray>() else {
        return value.try_iter()?.map(|face| list("a face", &face?)).collect();
    };
    let (array, expected) =
        (c_contiguous("faces", array)?, "integers of shape [n, 3] or [n, 4], or a list of such arrays");
    match *array.shape() {
        [_, k] if k > 0 => Ok(indices("faces", &array, expected)?.chunks(k).map(<[u32]>::to_vec).collect()),
        _ => Err(mismatch("faces", &array, expected)),
    }
}

/// Converts points relative to an origin to an array `[n, 3]`: float32, or float64 if the origin is not zero.
///
/// # Errors
/// Never in practice, because every point has three numbers.
pub(crate) fn array_of(py: Python<'_>, points: Vec<Vec3>, origin: DVec3) -> PyResult<Bound<'_, PyAny>> {
    if origin != DVec3::ZERO {
        return Ok(wide_array_of(py, points.iter().map(|p| origin + p.as_dvec3()))?.into_any());
    }
    let n = points.len();
    let flat = points.into_iter().map(|p| p.to_array()).collect::<Vec<_>>().into_flattened();
    Ok(PyArray1::from_vec(py, flat).reshape([n, 3])?.into_any())
}

/// Converts points to a float64 array `[n, 3]`.
///
/// # Errors
/// Never in practice, because every point has three numbers.
pub(crate) fn wide_array_of<'py>(
    py: Python<'py>,
    points: impl Iterator<Item = DVec3>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat = points.map(|p| p.to_array()).collect::<Vec<_>>().into_flattened();
    let n = flat.len() / 3;
    PyArray1::from_vec(py, flat).reshape([n, 3])
}

/// Converts triples of indices to an int32 array `[n, 3]`.
///
/// # Errors
/// Never in practice, because every triple has three indices.
pub(crate) fn triples<'py>(py: Python<'py>, all: &[[u32; 3]]) -> PyResult<Bound<'py, PyArray2<i32>>> {
    PyArray1::from_iter(py, all.as_flattened().iter().map(|&i| i as i32)).reshape([all.len(), 3])
}

/// Converts weights to a `scipy.sparse.csr_array` without copying, or to `cagework._sparse.csr_array` if SciPy is not
/// installed.
///
/// # Errors
/// Never in practice, because `cagework._sparse` is part of this package.
pub(crate) fn matrix_of(py: Python<'_>, weights: Weights) -> PyResult<Bound<'_, PyAny>> {
    let shape = (weights.n_rows(), weights.n_columns());
    let (indptr, indices, data) = weights.into_parts();
    // SciPy needs signed indices. Viewing u32 as int32 is valid as long as all values fit.
    let small = i32::try_from(data.len()).is_ok();
    let signed = |unsigned: Vec<u32>| {
        let array = PyArray1::from_vec(py, unsigned);
        if small { array.call_method1("view", ("int32",)) } else { array.call_method1("astype", ("int64",)) }
    };
    let parts = (PyArray1::from_vec(py, data), signed(indices)?, signed(indptr)?);
    let module = py.import("scipy.sparse").or_else(|_| py.import("cagework._sparse"))?;
    module.getattr("csr_array")?.call1((parts, shape))
}

/// Reads weights from a sparse SciPy matrix.
///
/// # Errors
/// `ArrayError` if it is not a sparse matrix, or its rows are not valid weights.
pub(crate) fn weights(value: &Bound<'_, PyAny>) -> PyResult<Weights> {
    let Ok(rows) = value.call_method0("tocsr") else {
        let actual = value.get_type().name()?;
        return Err(error::array(format!(
            "weights: expected a sparse matrix or array of SciPy, got {actual}"
        )));
    };
    let part = |name: &str| c_contiguous("weights", &rows.getattr(name)?);
    let data = part("data")?;
    if data.dtype().kind() != b'f' {
        return Err(mismatch("weights", &data, "float32 or float64"));
    }
    let data = data.call_method1("astype", ("float32",))?.cast_into::<PyArray1<f32>>()?;
    let (_, n_columns): (u32, u32) = rows.getattr("shape")?.extract()?;
    let [indptr, indices] = [part("indptr")?, part("indices")?].map(|a| indices("weights", &a, "integers"));
    Weights::new(n_columns, indptr?, indices?, data.to_vec()?)
        .map_err(|e| error::array(format!("weights: {e}")))
}

/// The entries of a sparse matrix, row by row. Most rows are empty.
#[derive(Default, Serialize, Deserialize)]
struct Offsets {
    /// Number of columns of the matrix.
    columns: u32,
    vertex: Vec<u32>,
    column: Vec<u32>,
    value: Vec<f32>,
}

impl Offsets {
    fn of(matrix: &Weights) -> Self {
        let mut all = Self { columns: matrix.n_columns() as u32, ..Self::default() };
        for (row, (columns, values)) in matrix.rows().enumerate() {
            all.vertex.extend(columns.iter().map(|_| row as u32));
            all.column.extend(columns);
            all.value.extend(values);
        }
        all
    }

    /// The matrix, with `n_rows` rows.
    ///
    /// # Errors
    /// `ArrayError` if the entries are not those of such a matrix in the order of its rows.
    fn matrix(self, n_rows: usize) -> PyResult<Weights> {
        let n = self.vertex.len();
        let fits = self.vertex.is_sorted() && self.vertex.last().is_none_or(|&row| (row as usize) < n_rows);
        if !fits || self.column.len() != n || self.value.len() != n {
            let fault =
                "the offsets of the report do not match the weights: pass the report of the same bind";
            return Err(error::array(fault));
        }
        let end_of = |row: usize| self.vertex.partition_point(|&vertex| (vertex as usize) < row) as u32;
        let indptr = (0..=n_rows).map(end_of).collect();
        Weights::new(self.columns, indptr, self.column, self.value)
            .map_err(|e| error::array(format!("offsets: {e}")))
    }
}

/// Adds `outside`, `frames` and `offsets` to a report. Splits the offset columns off the weights, and returns the
/// weights of the controls.
///
/// # Errors
/// Never in practice, because reports contain only text, numbers and lists.
pub(crate) fn split_offsets<'py>(report: &Bound<'py, PyAny>, binding: Binding) -> PyResult<Weights> {
    let (py, Binding { weights, frames, outside, .. }) = (report.py(), binding);
    let points = PyDict::new(py);
    points.set_item("vertex", outside.iter().map(|o| o.vertex).collect::<Vec<_>>())?;
    points.set_item("distance", outside.iter().map(|o| o.distance).collect::<Vec<_>>())?;
    points.set_item("share", outside.iter().map(|o| o.share).collect::<Vec<_>>())?;
    report.set_item("outside", points)?;
    report.set_item("frames", dictionary(py, &frames)?)?;
    if !frames.is_used() {
        return Ok(weights);
    }
    let n = weights.n_columns() as u32;
    let n_controls = n - frames.n_columns() as u32;
    report.set_item("offsets", dictionary(py, &Offsets::of(&weights.columns(n_controls..n)))?)?;
    Ok(weights.columns(0..n_controls))
}

/// Inverse of [`split_offsets`]: appends the offset columns in a report to `own`, the weights of the controls.
///
/// # Errors
/// `ArrayError`; `KeyError` if the report is not one of `bind`.
pub(crate) fn join_offsets(report: Option<&Bound<'_, PyAny>>, own: Weights) -> PyResult<(Weights, Frames)> {
    let Some(report) = report else { return Ok((own, Frames::default())) };
    let frames: Frames = from_dictionary(&report.get_item("frames")?)?;
    if !frames.is_used() {
        return Ok((own, frames));
    }
    let [rows, columns] = [own.n_rows(), own.n_columns()];
    let offsets = from_dictionary::<Offsets>(&report.get_item("offsets")?)?.matrix(rows)?;
    if offsets.n_columns() != frames.n_columns() || !frames.fits(columns) {
        return Err(error::array(format!(
            "the report does not match the weights, which have shape [{rows}, {columns}]"
        )));
    }
    Ok((own.beside(&offsets), frames))
}
