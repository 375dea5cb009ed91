//! `bind`, `bind_many` and `deform`.

use cagework_core::bind::{BindError, Binding, SolvedCage};
use cagework_core::deform::deform_finite;
use cagework_core::{BindOptions, bind as bind_points};
use glam::Vec3;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::cage::Cage;
use crate::options::{dictionary, options};
use crate::{arrays, error, files, work};

/// Reads the options of a bind and checks their ranges.
///
/// # Errors
/// `OptionError`; `TypeError` for an unknown name.
pub(crate) fn bind_options(given: Option<&Bound<'_, PyDict>>) -> PyResult<BindOptions> {
    let mut all: BindOptions = options(given)?;
    let solver = given.map(|given| given.get_item("solver")).transpose()?.flatten();
    if solver.is_none_or(|solver| solver.is_none()) {
        all.solver = all.method.usual_solver();
    }
    all.check().map_err(error::option)?;
    Ok(all)
}

/// Binds points to a cage by harmonic coordinates: bind(points, cage, *, progress=None, grid="auto", ...) -> (weights, report)
///
/// points: [n_points, 3] float32 or float64, object units; or a model, as read_model takes it, whose vertices are bound. A C-contiguous float32 array is not copied, so do not write to it while
/// bind runs.
///
/// Returns (weights, report). weights: scipy.sparse.csr_array [n_points, n_cage] of float32; the rows of points inside sum to 1. report: dict with
/// iterations, converged, timings_ms, memory_bytes, rest_error (object units), notices and the other entries that
/// `cagework bind --report` writes; outside: lists vertex [k], distance [k] (object units) and share [k] of the points outside the
/// cage. If points are outside, or near controls inside the cage, it also has offsets (the entries of a sparse
/// matrix) and frames, which deform uses. json.dumps takes the report, and deform takes what json.loads returns.
///
/// Options, as for `cagework bind`: grid="auto" (cells along the longest side: 64, 96, 128 or 192, so that the narrowest part
/// and gap of the cage are four cells wide if possible, or up to 320 if fewer do not resolve the cage; or a number from 8
/// to 512), method="embedded" or "classic",
/// solver="multigrid", "jacobi" or "cg", threads=0 (all), tau=1e-5, max_iterations=20000, sparsify=0.0, memory_limit=4 << 30
/// (bytes), outside="extend", "stay" or "refuse".
///
/// progress: function that is called with the completed fraction, 0 to 1, every 50 ms and at the end; raise in it to cancel. Or a
/// bar of tqdm: progress=tqdm(total=100).
///
/// Raises BindError (for example if no point is inside, or the memory limit is exceeded), OptionError, ArrayError. Ctrl-C cancels.
///
/// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
/// >>> weights, report = cw.bind(mesh.vertices, cage, grid=24)
/// >>> bool(np.allclose(weights @ cage.vertices, mesh.vertices, atol=1e-3))
/// True
#[pyfunction]
#[pyo3(
    signature = (points, cage, *, progress = None, **options),
    text_signature = "(points, cage, *, progress=None, grid='auto', method='embedded', solver=None, threads=0, tau=1e-05, max_iterations=20000, sparsify=0.0, memory_limit=4294967296, outside='extend')"
)]
pub(crate) fn bind<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    cage: &Bound<'py, Cage>,
    progress: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<WeightsAndReport<'py>> {
    let (options, controls) = (bind_options(options)?, cage.get().controls());
    let points = files::vertices_of("points", points)?;
    let points = arrays::points("points", &points, None, cage.get().origin())?;
    let positions = points.as_slice();
    let options = BindOptions { held: size_of_val(positions) as u64, ..options };
    let binding =
        work::run_with(py, progress, |progress| bind_points(positions, controls, &options, progress))?;
    weights_and_report(py, binding.map_err(error::bind)?)
}

/// Binds several models to one cage with one solve: bind_many(models, cage, *, progress=None, grid="auto", ...) -> list of (weights, report)
///
/// models: list of points [n_points, 3] or of models, such as clothes, levels of detail or variants. The fields are solved once for all models, and
/// then sampled for each model; the times in a report do not include this solve. Each result is identical to that of bind. The fields
/// of all columns are kept in memory and may take half of memory_limit. progress and options are those of bind.
///
/// Raises BindError, OptionError, ArrayError. Ctrl-C cancels.
///
/// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
/// >>> body, vest = mesh.vertices, mesh.vertices[:50]
/// >>> [weights.shape[0] for weights, _ in cw.bind_many([body, vest], cage, grid=24)] == [len(body), 50]
/// True
#[pyfunction]
#[pyo3(
    signature = (models, cage, *, progress = None, **options),
    text_signature = "(models, cage, *, progress=None, grid='auto', method='embedded', solver=None, threads=0, tau=1e-05, max_iterations=20000, sparsify=0.0, memory_limit=4294967296, outside='extend')"
)]
#[expect(clippy::needless_pass_by_value, reason = "pyo3 converts a Python list to an owned vector")]
pub(crate) fn bind_many<'py>(
    py: Python<'py>,
    models: Vec<Bound<'py, PyAny>>,
    cage: &Bound<'py, Cage>,
    progress: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Vec<WeightsAndReport<'py>>> {
    let (options, controls) = (bind_options(options)?, cage.get().controls());
    let of = |points| {
        let points = files::vertices_of("points", points)?;
        arrays::points("points", &points, None, cage.get().origin())
    };
    let points: Vec<_> = models.iter().map(of).collect::<PyResult<_>>()?;
    let positions: Vec<_> = points.iter().map(arrays::Points::as_slice).collect();
    let all = work::run_with(py, progress, |progress| {
        let solved = SolvedCage::new(controls, &options, progress)?;
        let held = |of: &[Vec3]| size_of_val(of) as u64;
        positions
            .iter()
            .map(|of| solved.bind(of, held(of), 0, progress))
            .collect::<Result<Vec<_>, BindError>>()
    })?;
    all.map_err(error::bind)?.into_iter().map(|binding| weights_and_report(py, binding)).collect()
}

type WeightsAndReport<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>);

fn weights_and_report(py: Python<'_>, binding: Binding) -> PyResult<WeightsAndReport<'_>> {
    let report = dictionary(py, &binding.report)?;
    let weights = arrays::split_offsets(&report, binding)?;
    Ok((arrays::matrix_of(py, weights)?, report))
}

/// Deforms the bound points: deform(weights, posed, report=None) -> [n_points, 3], object units
///
/// weights: sparse matrix [n_points, n_cage]; posed: [n_cage, 3] float32 or float64, object units; report: the report of bind,
/// needed for points with offsets, such as points outside. Without it the result is weights @ posed, summed in float64. Returns
/// float32, or float64 if posed is so far from the origin that float32 would lose digits; posed is then taken relative to a point
/// near it, so rows that do not sum to 1 need the report.
///
/// Raises ArrayError.
///
/// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
/// >>> weights, report = cw.bind(mesh.vertices, cage, grid=24)
/// >>> bool(np.allclose(cw.deform(weights, cage.vertices * [2, 1, 1], report), mesh.vertices * [2, 1, 1], atol=1e-3))
/// True
#[pyfunction]
#[pyo3(signature = (weights, posed, report = None))]
pub(crate) fn deform<'py>(
    py: Python<'py>,
    weights: &Bound<'py, PyAny>,
    posed: &Bound<'py, PyAny>,
    report: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let weights = arrays::weights(weights)?;
    let (posed, origin) = arrays::points_and_origin("posed", posed, Some(weights.n_columns()))?;
    let (weights, frames) = arrays::join_offsets(report, weights)?;
    let posed = posed.as_slice();
    let points = work::run(py, |_| deform_finite(&weights, &frames, posed))?;
    arrays::array_of(py, points.map_err(|e| error::array(e.to_string()))?, origin)
}
