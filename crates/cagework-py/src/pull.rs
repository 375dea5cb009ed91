//! `pull`: solves for the pose of the cage.

use cagework_core::bind as bind_points;
use cagework_core::options::OutsidePolicy;
use cagework_core::{BindOptions, TriMesh};
use cagework_pose::pull::{DRAG_FRAMES, Drag, DragOptions, Grip, Handle, Probes, Pull, Reach};
use glam::{DVec3, Vec3};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::bind::bind_options;
use crate::cage::Cage;
use crate::{arrays, error, work};

/// Solves for the pose of the cage that moves vertices of the model to targets with little bending:
/// pull(vertices, triangles, cage, weights, grabs, to, *, pins=(), report=None, start=None, reach=None, relax=0.5,
/// progress=None, grid="auto", ...)
/// -> [n_cage, 3] float64, object units
///
/// vertices: [n, 3]; triangles: [m, 3]; weights: [n, n_cage], from bind; grabs: [k] vertex indices; to: [k, 3] their
/// targets; pins: [l] vertices that stay in place; report: of bind, for points with offsets; start: [n_cage, 3] initial
/// pose, by default the cage at rest; reach: how far along the surface the model follows, as a fraction of its size;
/// None for automatic, math.inf for the whole model; relax: 0 keeps the details of the initial pose, 1 restores the
/// rest shape; options: those of bind, for the points on and near the model at which the solver samples the weights.
///
/// Raises PullError, BindError, OptionError, ArrayError. Ctrl-C cancels the bind.
///
/// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
/// >>> weights, report = cw.bind(mesh.vertices, cage, grid=24)
/// >>> top = int(mesh.vertices[:, 2].argmax())
/// >>> to = mesh.vertices[top] + [0.2, 0.0, 0.0]
/// >>> posed = cw.pull(mesh.vertices, mesh.faces, cage, weights, [top], [to], report=report, grid=24)
/// >>> bool(np.allclose((weights @ posed)[top], to, atol=0.01))
/// True
#[pyfunction]
#[pyo3(
    signature = (vertices, triangles, cage, weights, grabs, to, *, pins = None, report = None, start = None, reach = None, relax = 0.5, progress = None, **options),
    text_signature = "(vertices, triangles, cage, weights, grabs, to, *, pins=None, report=None, start=None, reach=None, relax=0.5, progress=None, grid='auto', method='embedded', solver=None, threads=0, tau=1e-05, max_iterations=20000, sparsify=0.0, memory_limit=4294967296, outside='extend')"
)]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub(crate) fn pull<'py>(
    py: Python<'py>,
    vertices: &Bound<'py, PyAny>,
    triangles: &Bound<'py, PyAny>,
    cage: &Bound<'py, Cage>,
    weights: &Bound<'py, PyAny>,
    grabs: &Bound<'py, PyAny>,
    to: &Bound<'py, PyAny>,
    pins: Option<&Bound<'py, PyAny>>,
    report: Option<&Bound<'py, PyAny>>,
    start: Option<&Bound<'py, PyAny>>,
    reach: Option<f64>,
    relax: f64,
    progress: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    // Allow probes outside the cage: they are off the surface by up to 1/64 of the cage's longest side, so a tight cage
    // may not enclose them.
    let options = BindOptions { outside: OutsidePolicy::Extend, ..bind_options(options)? };
    let (controls, origin) = (cage.get().controls(), cage.get().origin());
    let positions = arrays::finite_points("vertices", vertices, None, origin)?.as_slice().to_vec();
    let mesh = TriMesh { positions, triangles: arrays::triangles(triangles)? };
    let weights = arrays::weights(weights)?;
    let (weights, frames) = arrays::join_offsets(report, weights)?;
    let handles = |name, value| -> PyResult<Vec<Handle>> {
        Ok(arrays::list(name, value)?.into_iter().map(Handle::Vertex).collect())
    };
    let grabs = handles("grabs", grabs)?;
    let pins = pins.map(|pins| handles("pins", pins)).transpose()?.unwrap_or_default();
    let to = arrays::points("to", to, Some(grabs.len()), origin)?.as_slice().to_vec();
    if let Some(at) = to.iter().find(|at| !at.is_finite()) {
        return Err(error::pull(format!("a target is {at}; its coordinates must be finite in float32")));
    }
    let n = controls.n_controls();
    let start = start.map(|start| arrays::finite_points("start", start, Some(n), origin)).transpose()?;
    let start: Vec<Vec3> = start.map_or_else(|| controls.rest().to_vec(), |start| start.as_slice().to_vec());
    let reach = match reach {
        None => Reach::Automatic,
        Some(f64::INFINITY) => Reach::Whole,
        Some(share) => Reach::Of(share),
    };
    let posed = work::run_with(py, progress, |progress| -> PyResult<Vec<DVec3>> {
        let probes = Probes::new(&mesh, controls).map_err(error::pull)?;
        let of_probes = bind_points(probes.points(), controls, &options, progress).map_err(error::bind)?;
        let pull = Pull::new(&mesh, controls, probes, &of_probes.frames.folded(&of_probes.weights))
            .map_err(error::pull)?;
        let grips = |handles: &[Handle]| -> PyResult<Vec<Grip>> {
            let grips = handles.iter().map(|&h| Grip::new(h, &pull, &mesh.triangles, &weights));
            grips.collect::<Result<_, _>>().map_err(error::pull)
        };
        let from: Vec<DVec3> = start.iter().map(|p| p.as_dvec3()).collect();
        let drag_options = DragOptions { reach, relax, ..DragOptions::default() };
        let drag = Drag::new(&pull, &from, &grips(&grabs)?, &grips(&pins)?, &frames, drag_options);
        let mut drag = drag.map_err(error::pull)?;
        let to: Vec<DVec3> = to.iter().map(|p| p.as_dvec3()).collect();
        drag.go(&to, DRAG_FRAMES);
        drag.converge(&to);
        Ok(drag.cage())
    })??;
    arrays::wide_array_of(py, posed.into_iter().map(|p| origin + p))
}
