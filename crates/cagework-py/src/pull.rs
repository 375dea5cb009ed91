//! `pull` and the classes `Puller` and `Drag`: solve for the pose of the cage.

use cagework_core::bind as bind_points;
use cagework_core::options::OutsidePolicy;
use cagework_core::{BindOptions, Frames, Progress, TriMesh, Weights};
use cagework_pose::pull::{DRAG_FRAMES, Drag as PoseDrag, DragOptions, Grip, Handle, Probes, Pull, Reach};
use glam::{DVec3, Vec3};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::bind::bind_options;
use crate::cage::Cage;
use crate::{arrays, error, files, work};

/// Solves for the pose of the cage that moves vertices of the model to targets with little bending:
/// pull(vertices, triangles, cage, weights, grabs, to, *, pins=(), report=None, start=None, reach=None, relax=0.5,
/// progress=None, grid="auto", ...)
/// -> [n_cage, 3] float64, object units
///
/// vertices: [n, 3]; triangles: [m, 3], or None with a model, as read_model takes it, in place of the vertices; weights:
/// [n, n_cage], from bind; grabs: [k] vertex indices; to: [k, 3] their targets; pins: [l] vertices that stay in place;
/// report: of bind, for points with offsets; start: [n_cage, 3] initial pose, by default the cage at rest; reach: how far
/// along the surface the model follows, as a fraction of its size; None for automatic, math.inf for the whole model;
/// relax: 0 keeps the details of the initial pose, 1 restores the rest shape; options: those of bind, for the points on
/// and near the model at which the solver samples the weights.
///
/// Binds those points in each call; Puller binds them once for many pulls.
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
    triangles: Option<&Bound<'py, PyAny>>,
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
    let start = DragStart::new(cage.get(), grabs, pins, start, reach, relax)?;
    let to = start.targets(cage.get(), to)?;
    Puller::new(py, vertices, triangles, cage, weights, report, progress, options)?.run(py, &start, &to)
}

/// A model and its cage, prepared for pulls: the points at which the solver samples the weights are bound once.
///
/// Puller(vertices, triangles, cage, weights, *, report=None, progress=None, grid="auto", ...)
///
/// The arguments are those of pull. Raises PullError, BindError, OptionError, ArrayError. Ctrl-C cancels the bind.
///
/// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
/// >>> weights, report = cw.bind(mesh.vertices, cage, grid=24)
/// >>> puller = cw.Puller(mesh.vertices, mesh.faces, cage, weights, report=report, grid=24)
/// >>> puller.pull([0], mesh.vertices[:1]).shape == cage.vertices.shape
/// True
#[pyclass(frozen, module = "cagework")]
pub(crate) struct Puller {
    pull: Pull,
    triangles: Vec<[u32; 3]>,
    weights: Weights,
    frames: Frames,
    cage: Py<Cage>,
}

#[pymethods]
impl Puller {
    #[new]
    #[pyo3(
        signature = (vertices, triangles, cage, weights, *, report = None, progress = None, **options),
        text_signature = "(vertices, triangles, cage, weights, *, report=None, progress=None, grid='auto', method='embedded', solver=None, threads=0, tau=1e-05, max_iterations=20000, sparsify=0.0, memory_limit=4294967296, outside='extend')"
    )]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        triangles: Option<&Bound<'_, PyAny>>,
        cage: &Bound<'_, Cage>,
        weights: &Bound<'_, PyAny>,
        report: Option<&Bound<'_, PyAny>>,
        progress: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        // Allow probes outside the cage: they are off the surface by up to 1/64 of the cage's longest side, so a tight
        // cage may not enclose them.
        let options = BindOptions { outside: OutsidePolicy::Extend, ..bind_options(options)? };
        let (controls, origin) = (cage.get().controls(), cage.get().origin());
        let (vertices, triangles) = match triangles {
            Some(triangles) => (vertices.clone(), arrays::triangles(triangles)?),
            None => files::surface_of("vertices", vertices)?,
        };
        let positions = arrays::finite_points("vertices", &vertices, None, origin)?.as_slice().to_vec();
        let mesh = TriMesh { positions, triangles };
        let (weights, frames) = arrays::join_offsets(report, arrays::weights(weights)?)?;
        let prepare = |progress: &dyn Progress| -> PyResult<Pull> {
            let probes = Probes::new(&mesh, controls).map_err(error::pull)?;
            let bound = bind_points(probes.points(), controls, &options, progress).map_err(error::bind)?;
            Pull::new(&mesh, controls, probes, &bound.frames.folded(&bound.weights)).map_err(error::pull)
        };
        let pull = work::run_with(py, progress, prepare)??;
        Ok(Self { pull, triangles: mesh.triangles, weights, frames, cage: cage.clone().unbind() })
    }

    /// Solves for a pose of the cage: pull(grabs, to, *, pins=(), start=None, reach=None, relax=0.5)
    /// -> [n_cage, 3] float64, object units
    ///
    /// The arguments are those of the function pull. Raises PullError, ArrayError.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> weights, report = cw.bind(mesh.vertices, cage, grid=24)
    /// >>> puller = cw.Puller(mesh.vertices, mesh.faces, cage, weights, report=report, grid=24)
    /// >>> to = mesh.vertices[:1] + [0.1, 0.0, 0.0]
    /// >>> bool(np.allclose((weights @ puller.pull([0], to))[0], to, atol=0.01))
    /// True
    #[pyo3(
        signature = (grabs, to, *, pins = None, start = None, reach = None, relax = 0.5),
        text_signature = "($self, grabs, to, *, pins=None, start=None, reach=None, relax=0.5)"
    )]
    #[pyo3(name = "pull")]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn solve<'py>(
        &self,
        py: Python<'py>,
        grabs: &Bound<'py, PyAny>,
        to: &Bound<'py, PyAny>,
        pins: Option<&Bound<'py, PyAny>>,
        start: Option<&Bound<'py, PyAny>>,
        reach: Option<f64>,
        relax: f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let start = DragStart::new(self.cage.get(), grabs, pins, start, reach, relax)?;
        let to = start.targets(self.cage.get(), to)?;
        self.run(py, &start, &to)
    }

    /// Starts a drag: drag(grabs, *, pins=(), start=None, reach=None, relax=0.5) -> Drag
    ///
    /// The arguments are those of the function pull. Raises PullError, ArrayError.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> weights, report = cw.bind(mesh.vertices, cage, grid=24)
    /// >>> puller = cw.Puller(mesh.vertices, mesh.faces, cage, weights, report=report, grid=24)
    /// >>> puller.drag([0]).to(mesh.vertices[:1]).shape == cage.vertices.shape
    /// True
    #[pyo3(
        signature = (grabs, *, pins = None, start = None, reach = None, relax = 0.5),
        text_signature = "($self, grabs, *, pins=None, start=None, reach=None, relax=0.5)"
    )]
    fn drag(
        &self,
        py: Python<'_>,
        grabs: &Bound<'_, PyAny>,
        pins: Option<&Bound<'_, PyAny>>,
        start: Option<&Bound<'_, PyAny>>,
        reach: Option<f64>,
        relax: f64,
    ) -> PyResult<Drag> {
        let start = DragStart::new(self.cage.get(), grabs, pins, start, reach, relax)?;
        let drag = work::run(py, |_| self.begin(&start))??;
        Ok(Drag { drag, start, cage: self.cage.clone_ref(py) })
    }
}

/// A drag of a model with targets that change, such as the mouse. Made by Puller.drag.
///
/// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
/// >>> weights, report = cw.bind(mesh.vertices, cage, grid=24)
/// >>> cw.Puller(mesh.vertices, mesh.faces, cage, weights, report=report, grid=24).drag([0])
/// <cagework.Drag object at ...>
#[pyclass(module = "cagework")]
pub(crate) struct Drag {
    drag: PoseDrag,
    start: DragStart,
    cage: Py<Cage>,
}

#[pymethods]
impl Drag {
    /// Solves for the pose of the cage with the grabs at new targets: to(targets) -> [n_cage, 3] float64, object units
    ///
    /// targets: [k, 3]. The solve starts at the previous pose, so that it takes less time than Puller.pull. Where several
    /// poses fit equally well, the result depends on the targets before.
    ///
    /// Raises PullError, ArrayError.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> weights, report = cw.bind(mesh.vertices, cage, grid=24)
    /// >>> drag = cw.Puller(mesh.vertices, mesh.faces, cage, weights, report=report, grid=24).drag([0])
    /// >>> to = [mesh.vertices[:1] + [x, 0.0, 0.0] for x in (0.1, 0.2)]
    /// >>> [bool(np.allclose((weights @ drag.to(each))[0], each, atol=0.01)) for each in to]
    /// [True, True]
    fn to<'py>(
        &mut self,
        py: Python<'py>,
        targets: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let cage = self.cage.get();
        let to = self.start.targets(cage, targets)?;
        let drag = &mut self.drag;
        let posed = work::run(py, |_| {
            drag.converge(&to);
            drag.cage()
        })?;
        arrays::wide_array_of(py, posed.into_iter().map(|p| cage.origin() + p))
    }
}

impl Puller {
    fn begin(&self, start: &DragStart) -> PyResult<PoseDrag> {
        let grips = |handles: &[Handle]| -> PyResult<Vec<Grip>> {
            let grips = handles.iter().map(|&h| Grip::new(h, &self.pull, &self.triangles, &self.weights));
            grips.collect::<Result<_, _>>().map_err(error::pull)
        };
        let (grabs, pins) = (grips(&start.grabs)?, grips(&start.pins)?);
        PoseDrag::new(&self.pull, &start.posed, &grabs, &pins, &self.frames, start.options)
            .map_err(error::pull)
    }

    fn run<'py>(
        &self,
        py: Python<'py>,
        start: &DragStart,
        to: &[DVec3],
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let posed = work::run(py, |_| {
            let mut drag = self.begin(start)?;
            drag.go(to, DRAG_FRAMES);
            drag.converge(to);
            Ok::<_, PyErr>(drag.cage())
        })??;
        let origin = self.cage.get().origin();
        arrays::wide_array_of(py, posed.into_iter().map(|p| origin + p))
    }
}

/// Handles and initial pose of a drag, relative to the cage's origin.
struct DragStart {
    grabs: Vec<Handle>,
    pins: Vec<Handle>,
    posed: Vec<DVec3>,
    options: DragOptions,
}

fn wide(points: &[Vec3]) -> Vec<DVec3> {
    points.iter().map(|p| p.as_dvec3()).collect()
}

impl DragStart {
    /// Reads the arguments of `pull`.
    ///
    /// # Errors
    /// `ArrayError`.
    fn new(
        cage: &Cage,
        grabs: &Bound<'_, PyAny>,
        pins: Option<&Bound<'_, PyAny>>,
        start: Option<&Bound<'_, PyAny>>,
        reach: Option<f64>,
        relax: f64,
    ) -> PyResult<Self> {
        let (controls, origin) = (cage.controls(), cage.origin());
        let handles = |name, value| -> PyResult<Vec<Handle>> {
            Ok(arrays::list(name, value)?.into_iter().map(Handle::Vertex).collect())
        };
        let grabs = handles("grabs", grabs)?;
        let pins = pins.map(|pins| handles("pins", pins)).transpose()?.unwrap_or_default();
        let n = controls.n_controls();
        let posed = match start {
            None => wide(controls.rest()),
            Some(start) => wide(arrays::finite_points("start", start, Some(n), origin)?.as_slice()),
        };
        let reach = match reach {
            None => Reach::Automatic,
            Some(f64::INFINITY) => Reach::Whole,
            Some(share) => Reach::Of(share),
        };
        Ok(Self { grabs, pins, posed, options: DragOptions { reach, relax, ..DragOptions::default() } })
    }

    /// Reads the targets of the grabs.
    ///
    /// # Errors
    /// `ArrayError`, and `PullError` if a target is not finite.
    fn targets(&self, cage: &Cage, to: &Bound<'_, PyAny>) -> PyResult<Vec<DVec3>> {
        let to = wide(arrays::points("to", to, Some(self.grabs.len()), cage.origin())?.as_slice());
        match to.iter().find(|at| !at.is_finite()) {
            Some(at) => {
                Err(error::pull(format!("a target is {at}; its coordinates must be finite in float32")))
            }
            None => Ok(to),
        }
    }
}
