//! Weights, and models posed by them.

use cagework_core::bind::{BindError, Binding, SolvedCage};
use cagework_core::deform::deform_bound;
use cagework_core::{BindOptions, bind as bind_points};
use glam::Vec3;
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
/// writes it, and outside: vertex [k], distance [k] (object units), share [k] of points outside the cage; where points need offsets beside their
/// weights (outside, near controls inside), offsets, a csr_array, and its frames, which deform needs.
///
/// Options, as of `cagework bind`: grid=64 (cells along the longest side, 8 to 512), method="embedded" or "classic",
/// solver="multigrid", "jacobi" or "cg", preconditioner="none" or "v_cycle", cell_shape="box" or "cubic",
/// delta_norm="euclidean" or "literal", threads=0 (all), tau=1e-5, max_iterations=20000, sparsify=0.0, memory_limit=4 << 30
/// (bytes), outside="extend", "stay" or "refuse".
///
/// Raises BindError (no point inside, memory), OptionError, ArrayError; Ctrl-C ends it.
#[pyfunction]
#[pyo3(signature = (points, cage, **options))]
pub(crate) fn bind<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    cage: &Bound<'py, Cage>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Returned<'py>> {
    let (options, controls) = (bind_options(options)?, cage.get().controls());
    let points = arrays::points("points", points, None, cage.get().origin())?;
    let positions = points.as_slice();
    let options = BindOptions { held: size_of_val(positions) as u64, ..options };
    let binding = work::run(py, |progress| bind_points(positions, controls, &options, progress))?;
    returned(py, binding.map_err(error::bind)?)
}

/// Binds several models to one cage with one solve: bind_many(models, cage, **options) -> list of (weights, report)
///
/// models: a list of points [n_points, 3]: clothes, levels of detail, variants. What is returned for each is what bind returns, to
/// the bit, at the cost of sampling alone; times in a report are of the model alone. The fields of all columns are kept meanwhile,
/// for which half of memory_limit is there. Options and errors are those of bind.
///
/// Raises BindError, OptionError, ArrayError; Ctrl-C ends it.
#[pyfunction]
#[pyo3(signature = (models, cage, **options))]
#[expect(clippy::needless_pass_by_value, reason = "a list of Python becomes a vector")]
pub(crate) fn bind_many<'py>(
    py: Python<'py>,
    models: Vec<Bound<'py, PyAny>>,
    cage: &Bound<'py, Cage>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Vec<Returned<'py>>> {
    let (options, controls) = (bind_options(options)?, cage.get().controls());
    let of = |points| arrays::points("points", points, None, cage.get().origin());
    let points: Vec<_> = models.iter().map(of).collect::<PyResult<_>>()?;
    let positions: Vec<_> = points.iter().map(arrays::Points::as_slice).collect();
    let all = work::run(py, |progress| {
        let solved = SolvedCage::new(controls, &options, progress)?;
        let held = |of: &[Vec3]| size_of_val(of) as u64;
        positions
            .iter()
            .map(|of| solved.bind(of, (held(of), 0), progress))
            .collect::<Result<Vec<_>, BindError>>()
    })?;
    all.map_err(error::bind)?.into_iter().map(|binding| returned(py, binding)).collect()
}

/// Weights and report for Python.
type Returned<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>);

fn returned(py: Python<'_>, binding: Binding) -> PyResult<Returned<'_>> {
    let report = dictionary(py, &binding.report)?;
    let weights = arrays::put_beside(&report, binding)?;
    Ok((arrays::matrix_of(py, weights)?, report))
}

/// Points of a posed cage: deform(weights, posed, report=None) -> [n_points, 3] float32, object units;
/// float64 where posed is so far from the origin that 32 bits would round it
///
/// weights: a sparse matrix [n_points, n_cage]; posed: [n_cage, 3] float32 or float64, object units; report: what bind
/// returned, for points that need offsets. Without it this is weights @ posed, summed in 64 bits.
///
/// Raises ArrayError.
#[pyfunction]
#[pyo3(signature = (weights, posed, report = None))]
pub(crate) fn deform<'py>(
    py: Python<'py>,
    weights: &Bound<'py, PyAny>,
    posed: &Bound<'py, PyAny>,
    report: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let weights = arrays::weights(weights)?;
    let (posed, origin) = arrays::placed("posed", posed, Some(weights.n_columns()))?;
    let (weights, frames) = arrays::with_beside(report, weights)?;
    let posed = posed.as_slice();
    arrays::array_of(py, work::run(py, |_| deform_bound(&weights, &frames, posed))?, origin)
}
