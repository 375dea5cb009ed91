//! The class `Cage`, `generate_cage` and `check_cage`.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use cagework_cage::check::check_smooth;
use cagework_cage::generate::{CageReport, Rings};
use cagework_cage::{CageOptions, generate_of_kind};
use cagework_core::crossing::notices;
use cagework_core::options::{GRID, SMOOTH_STEPS, parse_grid};
use cagework_core::{Cage as CoreCage, ControlSet, Controls, InnerControls, PolygonMesh};
use cagework_io::write_cage_obj;
use glam::DVec3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::options::{dictionary, options};
use crate::{arrays, error, files, work};

/// A closed polygon mesh around a model, with outward faces. Checked on construction, and immutable.
///
/// Cage(vertices, faces, smooth=0)
///
/// vertices: [n_cage, 3] float32 or float64, object units; faces: integers of shape [n, 3] or [n, 4], or a list of
/// arrays of any lengths, counter-clockwise seen from outside (an inside-out mesh is flipped, with a notice); smooth: 0
/// to 3 steps of Catmull-Clark subdivision of the surface. Positions are stored as float32 relative to an origin near
/// the cage, which is zero unless the cage is far away.
///
/// Raises CageError, which names the invalid face, edge or vertex, and ArrayError.
///
/// >>> vertices = [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
/// >>> faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
/// >>> cw.Cage(vertices, faces)
/// Cage(8 vertices, 6 faces)
#[pyclass(frozen, module = "cagework")]
pub(crate) struct Cage {
    set: ControlSet,
    /// Subtracted from all stored positions, object units.
    origin: DVec3,
    /// Rest positions `[n_cage, 3]`; read-only.
    vertices: Py<PyArray2<f64>>,
    report: Option<CageReport>,
    rings: Option<Rings>,
}

impl Cage {
    /// Builds a cage from a mesh and the origin to which its positions are relative.
    fn of(
        py: Python<'_>,
        (mesh, origin): (&PolygonMesh, DVec3),
        smooth: u32,
        report: Option<CageReport>,
    ) -> PyResult<Self> {
        let cage = CoreCage::new(mesh).map_err(error::cage)?;
        let set = ControlSet::new(&cage, smooth, InnerControls::default()).map_err(error::cage)?;
        let vertices = arrays::wide_array_of(py, cage.positions().iter().map(|p| origin + p.as_dvec3()))?;
        vertices.call_method1("setflags", (false,))?;
        Ok(Self { set, origin, vertices: vertices.unbind(), report, rings: None })
    }

    /// Origin to which the positions are relative: zero unless the cage is far away from the world's origin.
    pub(crate) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The controls that points are bound to.
    pub(crate) fn controls(&self) -> Controls<'_> {
        Controls::from(&self.set)
    }

    /// Loops of vertices around limbs; none without rings.
    pub(crate) fn loops(&self) -> Vec<Vec<u32>> {
        self.rings.iter().flat_map(|rings| rings.loops().into_values()).collect()
    }

    fn mesh(&self) -> PolygonMesh {
        self.set.cage().to_polygon_mesh()
    }
}

/// Converts a number of subdivision steps. `smooth` is a float, so that any number gets the error message of the core.
fn steps(smooth: f64) -> PyResult<u32> {
    SMOOTH_STEPS.check(smooth).map_err(error::option)?;
    Ok(smooth as u32)
}

#[pymethods]
impl Cage {
    #[new]
    #[pyo3(signature = (vertices, faces, smooth = 0.0))]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        smooth: f64,
    ) -> PyResult<Self> {
        let smooth = steps(smooth)?;
        let (positions, origin) = arrays::points_and_origin("vertices", vertices, None)?;
        let positions = positions.as_slice().to_vec();
        Self::of(py, (&PolygonMesh { positions, faces: arrays::faces(faces)? }, origin), smooth, None)
    }

    /// Reads a cage from a file in any format of docs/formats.md. Vertices of an STL or a glTF are merged if their
    /// positions are equal.
    ///
    /// Raises OSError, ModelError if the file cannot be read as a model, CageError if it is not a valid cage.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> cage.save("cage.obj")
    /// >>> bool(np.allclose(cw.Cage.load("cage.obj").vertices, cage.vertices, atol=1e-3))
    /// True
    #[staticmethod]
    #[pyo3(signature = (path, smooth = 0.0))]
    fn load(py: Python<'_>, path: &Bound<'_, PyAny>, smooth: f64) -> PyResult<Self> {
        let smooth = steps(smooth)?;
        let model = files::Source::of("path", path)?.read()?;
        model.require_faces().map_err(error::model)?;
        Self::of(py, (&model.cage_mesh(), model.origin()), smooth, None)
    }

    /// Writes the cage as an OBJ file, to a path or a file object: at rest, or with the posed vertices [n_cage, 3],
    /// float32 or float64, object units.
    ///
    /// Raises OSError, TypeError, ArrayError.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> cage.save("wide.obj", cage.vertices * [2, 1, 1])
    #[pyo3(signature = (path, vertices = None))]
    fn save(&self, path: &Bound<'_, PyAny>, vertices: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let mut mesh = self.mesh();
        if let Some(vertices) = vertices {
            let n = mesh.positions.len();
            let posed = arrays::finite_points("vertices", vertices, Some(n), self.origin)?;
            mesh.positions = posed.as_slice().to_vec();
        }
        files::write(path, &write_cage_obj(&mesh, self.origin))
    }

    /// Rest positions, [n_cage, 3] float64, object units. Read-only: use cage.vertices.copy() for a pose.
    #[getter]
    fn vertices(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        self.vertices.clone_ref(py)
    }

    /// Vertex indices of each face, counter-clockwise seen from outside: list of int32 arrays.
    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let face = |face: &Vec<u32>| PyArray1::from_iter(py, face.iter().map(|&i| i as i32));
        PyList::new(py, self.set.cage().faces().iter().map(face))
    }

    /// The faces split into triangles, [n_triangles, 3] int32.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        arrays::triples(py, self.set.cage().triangles())
    }

    /// Number of Catmull-Clark subdivision steps.
    #[getter]
    fn smooth(&self) -> u32 {
        self.set.smooth()
    }

    /// Notices about the cage: repairs and possible problems, one sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        notices(self.set.cage())
    }

    /// Result of a check of the cage: dict with valid, vertices, faces, components, thickness (object units), problems.
    #[getter]
    fn checked<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (mesh, smooth) = (self.mesh(), self.smooth());
        dictionary(py, &work::run(py, move |_| check_smooth(&mesh, None, None, smooth))?)
    }

    /// Rings of a generated cage of the kind "skeleton": dict with chains, the names of the limbs, and places, for each
    /// vertex a dict with chain (index), ring and place in the ring; None for other cages.
    #[getter]
    fn rings<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.rings.as_ref().map(|rings| dictionary(py, rings)).transpose()
    }

    /// Report of generate_cage: dict with kind, refusal, voxels, clearance, mirror and other entries; None for other
    /// cages.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.report.as_ref().map(|report| dictionary(py, report)).transpose()
    }

    fn __repr__(&self) -> String {
        let cage = self.set.cage();
        format!("Cage({} vertices, {} faces)", cage.n_vertices(), cage.faces().len())
    }

    /// Whether the cages have the same vertices, faces and steps of subdivision.
    fn __eq__(&self, other: &Self) -> bool {
        self == other
    }

    pub(crate) fn __hash__(&self) -> u64 {
        let cage = self.set.cage();
        let mut hasher = DefaultHasher::new();
        cage.faces().hash(&mut hasher);
        bytemuck::cast_slice::<_, u8>(cage.positions()).hash(&mut hasher);
        hasher.finish()
    }

    /// The function that makes a pickled cage, and its arguments.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let made = serde_json::to_string(&(&self.report, &self.rings)).map_err(error::cage)?;
        let arguments = (self.vertices(py), self.faces(py)?, self.smooth(), made).into_pyobject(py)?;
        Ok((py.import("cagework._native")?.getattr("restored_cage")?, arguments))
    }
}

impl PartialEq for Cage {
    fn eq(&self, other: &Self) -> bool {
        let [a, b] = [self, other].map(|cage| cage.set.cage());
        (self.origin, self.smooth()) == (other.origin, other.smooth())
            && a.positions() == b.positions()
            && a.faces() == b.faces()
    }
}

/// Makes a cage that was pickled. `made`: JSON of its report and rings.
///
/// Raises `CageError`, `ArrayError`.
#[pyfunction]
pub(crate) fn restored_cage(
    py: Python<'_>,
    vertices: &Bound<'_, PyAny>,
    faces: &Bound<'_, PyAny>,
    smooth: f64,
    made: &str,
) -> PyResult<Cage> {
    let (report, rings) = serde_json::from_str(made).map_err(error::cage)?;
    Ok(Cage { report, rings, ..Cage::new(py, vertices, faces, smooth)? })
}

/// Generates a cage that strictly encloses a model: generate_cage(vertices, triangles=None, *, rig=None, progress=None, target=80, ...) -> Cage
///
/// vertices: [n, 3] float32 or float64, object units; triangles: [m, 3] integers. The mesh may be open or overlap
/// itself. Without triangles, vertices is a model, or a list of models, as read_model takes it: the cage encloses its
/// morph targets too and follows its joints, as with `cagework cage`. rig: the model, or list of models, from which read_model read them, for the joints: path or bytes.
///
/// Options, as for `cagework cage`: target=80 (number of vertices, 8 to 400; simple shapes get fewer, and holes and gaps
/// may need more), detail=0.028 (fraction of the longest side), quads=True, kind="auto", "skeleton" (rings of quads along
/// the limbs), "shell" (follows the surface) or "hull"; auto is skeleton if it fits well, otherwise shell, and
/// cage.report["refusal"] says why; symmetry="auto", "none", "x", "y" or "z", per_component=False, clearance=0.0 (fraction of the diagonal), voxels=0 (along the longest
/// side; 0: derived from target), smooth=0 (steps of subdivision; the smooth surface encloses the model). progress: as
/// for bind.
///
/// Raises CageError if no cage can be generated, OptionError, ArrayError. Ctrl-C cancels.
///
/// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
/// >>> cage.vertices.shape[1]
/// 3
#[pyfunction]
#[pyo3(
    signature = (vertices, triangles = None, *, rig = None, progress = None, **options),
    text_signature = "(vertices, triangles=None, *, rig=None, progress=None, target=80, detail=0.028, quads=True, kind='auto', symmetry='auto', per_component=False, clearance=0.0, voxels=0, smooth=0)"
)]
pub(crate) fn generate_cage(
    py: Python<'_>,
    vertices: &Bound<'_, PyAny>,
    triangles: Option<&Bound<'_, PyAny>>,
    rig: Option<&Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Cage> {
    let options: CageOptions = self::options(options)?;
    options.check().map_err(error::option)?;
    let mut rig = rig.map(|rig| files::sources("rig", rig)).transpose()?;
    let (positions, triangles, origin) = if let Some(triangles) = triangles {
        let (points, origin) = arrays::points_and_origin("vertices", vertices, None)?;
        (points.as_slice().to_vec(), arrays::triangles(triangles)?, origin)
    } else {
        let models = files::sources("vertices", vertices)?;
        let joined = work::run(py, |_| files::read_all(&models, true, None))??;
        rig.get_or_insert(models);
        joined
    };
    let rig = rig.map(|rig| files::rig(py, &rig, positions.len(), origin)).transpose()?;
    let generated = work::run_with(py, progress, |progress| {
        generate_of_kind(&positions, &triangles, rig.as_ref(), &options, progress)
    })?;
    let generated = generated.map_err(error::cage)?;
    let report = Some(generated.report);
    let cage = Cage::of(py, (&generated.cage.to_polygon_mesh(), origin), options.smooth, report)?;
    Ok(Cage { rings: generated.rings, ..cage })
}

/// Number of cells, or "auto".
#[derive(FromPyObject)]
pub(crate) enum GridArgument {
    Cells(f64),
    Word(String),
}

/// Lists the faults of a cage: check_cage(cage, points=None, grid="auto", smooth=None) -> list of dict
///
/// cage: a Cage, or an object with vertices and faces such as trimesh.Trimesh, which need not be closed; points: [n, 3]
/// that should be inside; grid: grid of the bind, whose unresolved places are reported; smooth: steps of subdivision, by
/// default those of the Cage.
///
/// Each problem has code, severity ("error", "warning" or "note"), count, places (vertices, edges, faces, points),
/// message and fixes. A cage without errors can be bound.
///
/// Raises ArrayError, OptionError.
///
/// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
/// >>> [problem["message"] for problem in cw.check_cage(cage, mesh.vertices) if problem["severity"] == "error"]
/// []
#[pyfunction]
#[pyo3(signature = (cage, points = None, grid = GridArgument::Cells(0.0), smooth = None))]
pub(crate) fn check_cage<'py>(
    py: Python<'py>,
    cage: &Bound<'py, PyAny>,
    points: Option<&Bound<'py, PyAny>>,
    grid: GridArgument,
    smooth: Option<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let grid = match grid {
        GridArgument::Cells(cells) => GRID.check(cells).map(|()| cells as u32),
        GridArgument::Word(word) => parse_grid(&word),
    };
    let grid = grid.map_err(error::option)?;
    let own = cage.cast::<Cage>().map_or(0, |cage| cage.get().smooth());
    let smooth = smooth.map_or(Ok(own), steps)?;
    let vertices = cage.getattr("vertices")?;
    let (positions, origin) = arrays::points_and_origin("vertices", &vertices, None)?;
    let positions = positions.as_slice().to_vec();
    let mesh = PolygonMesh { positions, faces: arrays::faces(&cage.getattr("faces")?)? };
    let points = points.map(|points| files::vertices_of("points", points)).transpose()?;
    let points = points.as_ref().map(|points| arrays::points("points", points, None, origin)).transpose()?;
    let inside = points.as_ref().map(arrays::Points::as_slice);
    let check = work::run(py, |_| check_smooth(&mesh, inside, Some(grid), smooth))?;
    dictionary(py, &check.problems)
}
