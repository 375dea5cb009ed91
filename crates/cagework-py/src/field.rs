//! The class `Field`: the deformation of the space in and around a cage.

use std::sync::Arc;

use cagework_core::BindOptions;
use cagework_core::bind::BindError;
use cagework_core::field::{CELLS, CELLS_RANGE, Field as CoreField, FieldWeights, InverseField};
use cagework_io::{UpAxis, write_field_npz};
use glam::{DVec3, Vec3};
use numpy::{PyArray1, PyArray3, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::bind::bind_options;
use crate::cage::Cage;
use crate::options::dictionary;
use crate::{arrays, error, files, work};

/// The deformation of a posed cage as a field, for points that are not bound.
///
/// Field(cage, posed, *, cells=64, progress=None, grid="auto", ...)
///
/// Binds the nodes of a lattice in and around the cage once, with `cells` cells along its longest side (8 to 256), and
/// interpolates between them. Outside the cage the deformation fades to nothing within a quarter of the longest side.
///
/// posed: [n_cage, 3] float32 or float64, object units; progress and options: those of bind; `outside` has no effect. A
/// pickled field is small; loading it binds again, which gives the same numbers.
///
/// Raises BindError, OptionError, ArrayError. Ctrl-C cancels.
///
/// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
/// >>> field = cw.Field(cage, cage.vertices * [2, 1, 1], cells=16)
/// >>> bool(np.allclose(field.map([[0.1, 0.0, 0.0]]), [[0.2, 0.0, 0.0]], atol=1e-3))
/// True
#[pyclass(frozen, module = "cagework")]
pub(crate) struct Field {
    weights: Arc<FieldWeights>,
    field: CoreField,
    cage: Py<Cage>,
    /// Pose of the cage. `[n_controls]`, relative to the cage's origin
    posed: Vec<Vec3>,
    cells: u32,
    options: BindOptions,
}

#[pymethods]
impl Field {
    #[new]
    #[pyo3(
        signature = (cage, posed, *, cells = f64::from(CELLS), progress = None, **options),
        text_signature = "(cage, posed, *, cells=64, progress=None, grid='auto', method='embedded', solver=None, threads=0, tau=1e-05, max_iterations=20000, sparsify=0.0, memory_limit=4294967296, outside='extend')"
    )]
    fn new(
        py: Python<'_>,
        cage: &Bound<'_, Cage>,
        posed: &Bound<'_, PyAny>,
        cells: f64,
        progress: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        CELLS_RANGE.check(cells).map_err(error::option)?;
        let (options, controls) = (bind_options(options)?, cage.get().controls());
        let posed = arrays::finite_points("posed", posed, Some(controls.n_controls()), cage.get().origin())?;
        let (posed, cells) = (posed.as_slice().to_vec(), cells as u32);
        let made = work::run_with(py, progress, |progress| -> Result<_, BindError> {
            let weights = FieldWeights::bind(controls, cells, &options, progress)?;
            let field = weights.pose(controls.rest(), &posed);
            Ok((Arc::new(weights), field))
        })?;
        let (weights, field) = made.map_err(error::bind)?;
        Ok(Self { weights, field, cage: cage.clone().unbind(), posed, cells, options })
    }

    /// Returns the field of another pose of the same cage without binding again.
    ///
    /// Raises ArrayError.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> field = cw.Field(cage, cage.vertices * [2, 1, 1], cells=16)
    /// >>> bool(np.allclose(field.pose(cage.vertices).map([[0.1, 0.0, 0.0]]), [[0.1, 0.0, 0.0]], atol=1e-3))
    /// True
    fn pose(&self, py: Python<'_>, posed: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (cage, weights) = (self.cage.get(), self.weights.clone());
        let controls = cage.controls();
        let posed = arrays::finite_points("posed", posed, Some(controls.n_controls()), cage.origin())?;
        let posed = posed.as_slice().to_vec();
        let field = work::run(py, |_| weights.pose(controls.rest(), &posed))?;
        let Self { cells, options, .. } = *self;
        Ok(Self { weights, field, cage: self.cage.clone_ref(py), posed, cells, options })
    }

    /// Positions of points after the deformation: [n, 3] -> [n, 3], object units.
    ///
    /// Raises ArrayError.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> field = cw.Field(cage, cage.vertices * [2, 1, 1], cells=16)
    /// >>> bool(np.allclose(field.map(mesh.vertices), mesh.vertices * [2, 1, 1], atol=1e-3))
    /// True
    fn map<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.each(py, points, |p| self.field.map(p))
    }

    /// The points that `map` moves to the given ones: [n, 3] -> [n, 3], object units. NaN where none is found, for
    /// example where the deformation folds.
    ///
    /// Raises ArrayError.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> field = cw.Field(cage, cage.vertices * [2, 1, 1], cells=16)
    /// >>> bool(np.allclose(field.inverse(mesh.vertices * [2, 1, 1]), mesh.vertices, atol=1e-3))
    /// True
    fn inverse<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let inverse = InverseField::new(&self.field);
        self.each(py, points, |p| inverse.find(p).unwrap_or(Vec3::NAN))
    }

    /// Deformation gradients at points: [n, 3] -> [n, 3, 3] float32. F[k] @ d is the image of a small vector d at point
    /// k.
    ///
    /// Raises ArrayError.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> field = cw.Field(cage, cage.vertices * [2, 1, 1], cells=16)
    /// >>> bool(np.allclose(field.gradient([[0.1, 0.0, 0.0]]), [np.diag([2, 1, 1])], atol=1e-3))
    /// True
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let points = arrays::points("points", points, None, self.cage.get().origin())?;
        let (n, points) = (points.as_slice().len(), points.as_slice());
        let of_point = |&p: &Vec3| self.field.gradient(p).transpose().to_cols_array();
        let flat = work::run(py, |_| points.iter().flat_map(of_point).collect::<Vec<f32>>())?;
        PyArray1::from_vec(py, flat).reshape([n, 3, 3])
    }

    /// Writes the lattice as an .npz file, as `cagework deform --lattice` does, to a path or a file object.
    ///
    /// Raises OSError, TypeError.
    ///
    /// >>> cage = cw.generate_cage(mesh.vertices, mesh.faces, target=40)
    /// >>> field = cw.Field(cage, cage.vertices * [2, 1, 1], cells=16)
    /// >>> field.save("field.npz")
    /// >>> sorted(np.load("field.npz"))  # doctest: +ELLIPSIS
    /// [...]
    fn save(&self, path: &Bound<'_, PyAny>) -> PyResult<()> {
        files::write(path, &write_field_npz(&self.field, self.cage.get().origin(), UpAxis::Y))
    }

    fn __repr__(&self) -> String {
        let [x, y, z] = self.field.lattice.dims.to_array().map(|n| n - 1);
        format!("Field({x} x {y} x {z} cells)")
    }

    /// Whether the fields have the same cage, pose, cells and options.
    fn __eq__(&self, other: &Self) -> bool {
        (self.cells, self.options) == (other.cells, other.options)
            && self.posed == other.posed
            && *self.cage.get() == *other.cage.get()
    }

    fn __hash__(&self) -> u64 {
        u64::from(self.cells) ^ self.cage.get().__hash__()
    }

    /// Arguments that pickle passes to the constructor, which binds again: the same numbers, in less than a thousandth
    /// of the space.
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let origin = self.origin();
        let posed = arrays::wide_array_of(py, self.posed.iter().map(|p| origin + p.as_dvec3()))?;
        let options = dictionary(py, &self.options)?;
        options.set_item("cells", self.cells)?;
        ((self.cage.clone_ref(py), posed), options).into_pyobject(py)
    }
}

impl Field {
    pub(crate) fn core(&self) -> &CoreField {
        &self.field
    }

    /// Point that was subtracted from the positions of the field.
    pub(crate) fn origin(&self) -> DVec3 {
        self.cage.get().origin()
    }

    /// Maps each of the points, `[n, 3]`.
    fn each<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        map: impl Fn(Vec3) -> Vec3 + Send + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let origin = self.cage.get().origin();
        let points = arrays::points("points", points, None, origin)?;
        let points = points.as_slice();
        let mapped = work::run(py, |_| points.iter().map(|&p| map(p)).collect())?;
        arrays::array_of(py, mapped, origin)
    }
}
