//! Weights, and models posed by them.

use cagework_core::BindOptions;
use cagework_core::bind as bind_points;
use cagework_core::deform::deform_bound;
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::cage::Cage;
use crate::options::{dictionary, options};
use crate::{arrays, error, work};

/// Options of a bind, in range.
///
/// # Errors
/// `OptionError`; `TypeError` for a name that there is not.
pub(crate) fn bind_options(given: Option<&Bound<'_, PyDict>>) -> PyResult<BindOptions> {
    let mut all: BindOptions = options(given)?;
    let solver = given.map(|given| given.get_item("solver")).transpose()?.flatten();
    if solver.is_none_or(|solver| solver.is_none()) {
        all.solver = all.method.usual_solver();
    }
    all.check().map_err(error::option)?;
    Ok(all)
}

/// Binds points to a cage by harmonic coordinates: bind(points, cage, **options) -> (weights, report)
///
/// points: [n_points, 3] float32 or float64, object units; float32 in rows is read where it is: do not write to it meanwhile.
///
/// Returns weights, a scipy.sparse.csr_array [n_points, n_cage] of float32, dimensionless, each row summing to 1, and a dict:
/// iterations, converged, timings_ms, memory_bytes, rest_error (object units), notices and so on, as `cagework bind --report`
/// writes it, and outside: vertex [k], corners [k, 3], offset [k, 3] of points outside the cage, which deform needs.
///
/// Options, as of `cagework bind`: grid=64 (cells along the longest side, 8 to 512), method="embedded" or "classic",
/// solver="multigrid", "jacobi" or "cg", preconditioner="none" or "v_cycle", cell_shape="box" or "cubic",
/// delta_norm="euclidean" or "literal", threads=0 (all), tau=1e-5, max_iterations=20000, sparsify=0.0, memory_limit=4 << 30
/// (bytes), outside="closest_point" or "refuse".
///
/// Raises BindError (no point inside, memory), OptionError, ArrayError; Ctrl-C ends it.
#[pyfunction]
#[pyo3(signature = (points, cage, **options))]
pub(crate) fn bind<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    cage: &Bound<'py, Cage>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let (options, controls) = (bind_options(options)?, cage.get().controls());
    let points = arrays::points("points", points, None)?;
    let positions = points.as_slice();
    let options = BindOptions { held: size_of_val(positions) as u64, ..options };
    let binding = work::run(py, |progress| bind_points(positions, controls, &options, progress))?;
    let binding = binding.map_err(error::bind)?;
    let report = dictionary(py, &binding.report)?;
    report.set_item("outside", arrays::outside_of(py, &binding.outside)?)?;
    Ok((arrays::matrix_of(py, binding.weights)?, report))
}

/// Points of a posed cage: deform(weights, posed, report=None) -> [n_points, 3] float32, object units
///
/// weights: a sparse matrix [n_points, n_cage]; posed: [n_cage, 3] float32 or float64, object units; report: what bind
/// returned: points outside the cage keep their offset from it. Without it this is weights @ posed, summed in 64 bits.
///
/// Raises ArrayError.
#[pyfunction]
#[pyo3(signature = (weights, posed, report = None))]
pub(crate) fn deform<'py>(
    py: Python<'py>,
    weights: &Bound<'py, PyAny>,
    posed: &Bound<'py, PyAny>,
    report: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let weights = arrays::weights(weights)?;
    let posed = arrays::points("posed", posed, Some(weights.n_columns()))?;
    let outside = report.map(|report| arrays::outside(report, &weights)).transpose()?.unwrap_or_default();
    let posed = posed.as_slice();
    arrays::array_of(py, work::run(py, |_| deform_bound(&weights, &outside, posed))?)
}
