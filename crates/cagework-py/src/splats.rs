//! The class `Splats`: a capture of Gaussian splats.

use std::sync::Arc;

use cagework_core::splats::{Splats as CoreSplats, n_harmonics};
use cagework_io::{Model, ModelFormat, RestoreError, Store, StoredArrays};
use glam::{Mat3, Quat, Vec3};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};

use crate::field::Field;
use crate::{arrays, error, files, work};

/// Gaussian splats of a file (3DGS or compressed .ply, .splat, .spz, .sog, .glb).
///
/// Splats(path)
///
/// Raises OSError, ModelError.
///
/// >>> splats = cw.Splats("plant.splat")
/// >>> len(splats) == len(splats.positions)
/// True
#[pyclass(frozen, module = "cagework")]
pub(crate) struct Splats {
    /// The model that was read. `save` writes a copy of its file with the changed splats.
    model: Arc<Model>,
    splats: CoreSplats,
}

#[pymethods]
impl Splats {
    #[new]
    fn new(py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<Self> {
        let source = files::Source::of("path", path)?;
        let model = work::run(py, move |_| source.read())??;
        let splats = model.splats().cloned().ok_or_else(|| error::model("it has no Gaussian splats"))?;
        Ok(Self { model: Arc::new(model), splats })
    }

    fn __len__(&self) -> usize {
        self.splats.len()
    }

    fn __repr__(&self) -> String {
        format!("Splats({} splats, spherical harmonics of degree {})", self.splats.len(), self.splats.degree)
    }

    /// Whether the splats have the same numbers.
    fn __eq__(&self, other: &Self) -> bool {
        self.model.origin() == other.model.origin() && self.splats == other.splats
    }

    fn __hash__(&self) -> u64 {
        self.splats.len() as u64
    }

    /// The function that makes pickled splats, and its arguments.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let arrays = work::run(py, |_| {
            let (mut store, splats) = (Store::default(), &self.splats);
            let is_changed = self.model.splats() != Some(splats);
            store.push(&[u8::from(is_changed), splats.degree]);
            if is_changed {
                for vectors in [&splats.positions, &splats.scales, &splats.colors, &splats.harmonics] {
                    store.push(vectors);
                }
                store.push(&splats.rotations);
                store.push(&splats.opacities);
            }
            Model::clone(&self.model).store(&mut store);
            store.into_arrays()
        })?;
        let arrays: Vec<_> = arrays.iter().map(|bytes| PyBytes::new(py, bytes)).collect();
        Ok((py.import("cagework._native")?.getattr("restored_splats")?, (arrays,).into_pyobject(py)?))
    }

    /// Centres, [n, 3], object units.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::array_of(py, self.splats.positions.clone(), self.model.origin())
    }

    /// Standard deviations along the axes, [n, 3] float32, object units.
    #[getter]
    fn scales<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        vectors(py, &self.splats.scales)
    }

    /// Rotations of the axes, unit quaternions x, y, z, w, [n, 4] float32.
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let flat = self.splats.rotations.iter().flat_map(Quat::to_array).collect();
        PyArray1::from_vec(py, flat).reshape([self.splats.len(), 4])
    }

    /// Opacities, [n] float32, 0 to 1.
    #[getter]
    fn opacities<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.splats.opacities)
    }

    /// Colours without spherical harmonics, [n, 3] float32, sRGB.
    #[getter]
    fn colors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        vectors(py, &self.splats.colors)
    }

    /// Coefficients of spherical harmonics of bands 1 to 3, [n, 0 | 3 | 8 | 15, 3] float32.
    #[getter]
    fn harmonics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let shape = [self.splats.len(), n_harmonics(self.splats.degree), 3];
        vectors(py, &self.splats.harmonics)?.reshape(shape)
    }

    /// Covariance matrices, [n, 3, 3] float32, square object units.
    #[getter]
    fn covariances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let of_splat = |s: usize| {
            let axes: Mat3 = self.splats.axes(s);
            (axes * axes.transpose()).to_cols_array()
        };
        let flat = (0..self.splats.len()).flat_map(of_splat).collect();
        PyArray1::from_vec(py, flat).reshape([self.splats.len(), 3, 3])
    }

    /// Returns the splats deformed by a field. Splats that the field does not move keep all digits.
    ///
    /// >>> splats = cw.Splats("plant.splat")
    /// >>> cage = cw.generate_cage(*splats.shells(), target=40)
    /// >>> field = cw.Field(cage, cage.vertices * [2, 1, 1], cells=16)
    /// >>> bool(np.allclose(splats.deformed(field).positions, splats.positions * [2, 1, 1], atol=1e-3))
    /// True
    fn deformed(&self, py: Python<'_>, field: &Bound<'_, Field>) -> PyResult<Self> {
        let (field, mut model) = (field.get(), (*self.model).clone());
        model.set_origin(field.origin());
        let rest = self.seen_from(field);
        let splats = work::run(py, |_| rest.deformed(field.core()))?;
        Ok(Self { model: Arc::new(model), splats })
    }

    /// How much the field bends each splat, which an ellipsoid cannot show: [n] float32. At each end of its longest
    /// axis, a linear deformation misses the place to which the field moves this end. The result is the larger of the
    /// two distances, as a fraction of the undeformed half axis, which is sqrt(3) standard deviations long.
    ///
    /// >>> splats = cw.Splats("plant.splat")
    /// >>> cage = cw.generate_cage(*splats.shells(), target=40)
    /// >>> field = cw.Field(cage, cage.vertices * [2, 1, 1], cells=16)
    /// >>> bool((splats.first_order_errors(field) < 1).all())
    /// True
    fn first_order_errors<'py>(
        &self,
        py: Python<'py>,
        field: &Bound<'py, Field>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let (field, rest) = (field.get(), self.seen_from(field.get()));
        let errors = work::run(py, |_| rest.first_order_errors(field.core()))?;
        Ok(PyArray1::from_vec(py, errors))
    }

    /// Vertices and triangles of octahedra around the splats, for `generate_cage`. Transparent splats (haze) and the
    /// largest splats (background) are omitted.
    ///
    /// >>> splats = cw.Splats("plant.splat")
    /// >>> cage = cw.generate_cage(*splats.shells(), target=40)
    fn shells<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArray2<i32>>)> {
        let (vertices, triangles) = work::run(py, |_| self.splats.shells())?;
        Ok((arrays::array_of(py, vertices, self.model.origin())?, arrays::triples(py, &triangles)?))
    }

    /// Writes the splats to a path or a file object. The format is `format` ("ply", "splat", "spz" or "glb"), or that of the
    /// name's extension. If it is the format from which the splats were read,
    /// unchanged splats are copied from that file, except in a .glb and in an .spz of another version than 3, whose
    /// splats are encoded again.
    ///
    /// Raises OSError, TypeError, ModelError.
    ///
    /// >>> splats = cw.Splats("plant.splat")
    /// >>> splats.save("plant.ply")
    #[pyo3(signature = (path, format = None))]
    fn save(&self, py: Python<'_>, path: &Bound<'_, PyAny>, format: Option<&str>) -> PyResult<()> {
        let name = format.map_or_else(|| files::name_of(path), |format| format!(".{format}"));
        let wanted = "give a name that ends in .ply, .splat, .spz or .glb, or the format";
        let format = ModelFormat::of_export(&name).ok_or_else(|| error::model(wanted))?;
        let bytes =
            work::run(py, |_| self.model.write_splats(format, &self.splats))?.map_err(error::model)?;
        files::write(path, &bytes)
    }
}

/// Makes splats that were pickled.
///
/// Raises `ModelError`.
#[pyfunction]
pub(crate) fn restored_splats(py: Python<'_>, arrays: Vec<Vec<u8>>) -> PyResult<Splats> {
    work::run(py, move |_| {
        let mut arrays = arrays.into_iter();
        let mut next = || arrays.next();
        let mut from = StoredArrays(&mut next);
        let &[is_changed, degree] = from.numbers::<u8>()?.as_slice() else {
            return Err(RestoreError::Damaged);
        };
        let changed = if is_changed == 0 {
            None
        } else {
            let [positions, scales] = [from.numbers()?, from.numbers()?];
            let [colors, harmonics] = [from.numbers()?, from.numbers()?];
            let (rotations, opacities) = (from.numbers()?, from.numbers()?);
            Some(CoreSplats { positions, scales, rotations, opacities, colors, degree, harmonics })
        };
        let model = Model::restore(&mut from)?;
        let splats = changed.or_else(|| model.splats().cloned()).ok_or(RestoreError::Damaged)?;
        Ok(Splats { model: Arc::new(model), splats })
    })?
    .map_err(error::model)
}

impl Splats {
    /// The splats with positions relative to the origin of a field.
    fn seen_from(&self, field: &Field) -> CoreSplats {
        let by = (self.model.origin() - field.origin()).as_vec3();
        let mut splats = self.splats.clone();
        if by != Vec3::ZERO {
            splats.positions.iter_mut().for_each(|p| *p += by);
        }
        splats
    }
}

fn vectors<'py>(py: Python<'py>, all: &[Vec3]) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let flat = all.iter().flat_map(Vec3::to_array).collect();
    PyArray1::from_vec(py, flat).reshape([all.len(), 3])
}
