//! Reads models from files or bytes, and writes files.

use std::io;
use std::path::{Path, PathBuf};

use cagework_core::rig::Rig;
use cagework_core::{BindOptions, PolygonMesh};
use cagework_io::{Clip, Model, ModelFormat, Resolve, shown};
use glam::{DVec3, Vec3};
use numpy::{PyArray2, PyUntypedArray};
use pyo3::exceptions::{PyOSError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes, PyList, PyMemoryView};

use crate::{arrays, error, work};

/// A model to read: what all functions accept as a model.
pub(crate) enum Source {
    File(PathBuf),
    /// Name that may tell the format, and the bytes of a file.
    Bytes(String, Vec<u8>),
    /// Mesh relative to an origin near it.
    Mesh(PolygonMesh, DVec3),
}

impl Source {
    /// Interprets an argument: a path; the bytes of a file, also as a bytearray, memoryview or file object; a mesh
    /// object; or a tuple of vertices and faces.
    ///
    /// # Errors
    /// `TypeError` with the name of the argument; the errors of reading a file object; `ArrayError`.
    pub(crate) fn of(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Self> {
        if argument.is_instance_of::<PyMemoryView>() {
            let bytes = argument.py().get_type::<PyBytes>().call1((argument,))?;
            return Ok(Self::Bytes("model".to_owned(), bytes.extract()?));
        }
        if let Some(file) = Self::file(name, argument)? {
            return Ok(file);
        }
        let Some((vertices, faces)) = mesh_of(argument)? else {
            let kind = argument.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "{name}: expected a path, bytes, a file opened with mode 'rb', a mesh with vertices and faces, or \
                 (vertices, faces), got {kind}"
            )));
        };
        let (positions, origin) = arrays::points_and_origin("vertices", &vertices, None)?;
        let positions = positions.as_slice().to_vec();
        Ok(Self::Mesh(PolygonMesh { positions, faces: arrays::faces(&faces)? }, origin))
    }

    /// Interprets a path, bytes, a bytearray or a file object; `None` for anything else.
    fn file(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Option<Self>> {
        if argument.is_instance_of::<PyBytes>() || argument.is_instance_of::<PyByteArray>() {
            return Ok(Some(Self::Bytes("model".to_owned(), argument.extract()?)));
        }
        if let Ok(path) = argument.extract() {
            return Ok(Some(Self::File(path)));
        }
        if !argument.hasattr("read")? {
            return Ok(None);
        }
        let content = models(argument.py())?.call_method1("content_of", (name, argument))?.extract()?;
        let (name, bytes): (String, Vec<u8>) = content;
        Ok(Some(Self::Bytes(name, bytes)))
    }

    /// Reads the model and the files in its folder that it refers to, with the default memory limit.
    ///
    /// # Errors
    /// `OSError`, `ModelError`.
    pub(crate) fn read(&self) -> PyResult<Model> {
        self.read_within(BindOptions::default().memory_limit)
    }

    /// Reads the model and the files in its folder that it refers to. `memory_limit`: bytes.
    ///
    /// # Errors
    /// `OSError`, `ModelError`.
    pub(crate) fn read_within(&self, memory_limit: u64) -> PyResult<Model> {
        self.read_for(false, memory_limit)
    }

    /// Like [`Self::read_within`]; with `clips`, also accepts a glTF of clips without triangles.
    ///
    /// # Errors
    /// `OSError`, `ModelError`.
    pub(crate) fn read_for(&self, clips: bool, memory_limit: u64) -> PyResult<Model> {
        let read = |name: &str, bytes: &[u8], resolve: &mut Resolve<'_>| {
            if clips {
                Model::read_with_clips(name, bytes, resolve, memory_limit)
            } else {
                Model::read_within(name, bytes, resolve, memory_limit)
            }
        };
        let model = match self {
            Self::Mesh(mesh, origin) => Model::of_mesh("mesh.obj", mesh, *origin),
            Self::Bytes(name, bytes) => read(name, bytes, &mut |_| None),
            Self::File(path) => {
                let bytes = cagework_files::read(path).map_err(|e| named(path, &e))?;
                read(&path.to_string_lossy(), &bytes, &mut |name| beside(path, name))
            }
        };
        model.map_err(error::model)
    }
}

/// The module `cagework._models`.
fn models(py: Python<'_>) -> PyResult<Bound<'_, PyModule>> {
    py.import("cagework._models")
}

/// Returns the vertices and faces of a mesh object or of a tuple; `None` for anything else.
fn mesh_of<'py>(value: &Bound<'py, PyAny>) -> PyResult<Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
    models(value.py())?.call_method1("mesh_of", (value,))?.extract()
}

/// Returns the vertices of a model, or an array unchanged.
///
/// # Errors
/// `OSError`, `ModelError`.
pub(crate) fn vertices_of<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    if value.is_instance_of::<PyUntypedArray>() || value.is_instance_of::<PyList>() {
        return Ok(value.clone());
    }
    if let Some(file) = Source::file(name, value)? {
        let model = work::run(value.py(), move |_| file.read())??;
        let origin = model.origin();
        return arrays::array_of(value.py(), model.positions, origin);
    }
    Ok(mesh_of(value)?.map_or_else(|| value.clone(), |(vertices, _)| vertices))
}

/// Returns the vertices and triangles of a model.
///
/// # Errors
/// Those of [`Source::of`] and [`Source::read`]; `ModelError` for a model without faces.
pub(crate) fn surface_of<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<(Bound<'py, PyAny>, Vec<[u32; 3]>)> {
    let source = Source::of(name, value)?;
    let model = work::run(value.py(), move |_| source.read())??;
    model.require_faces().map_err(error::model)?;
    let origin = model.origin();
    Ok((arrays::array_of(value.py(), model.positions, origin)?, model.triangles))
}

/// Reads a file that the model `main` refers to. `None` if it does not exist.
fn beside(main: &Path, name: &str) -> Option<Result<Vec<u8>, String>> {
    let read = cagework_files::read_beside(main, name)?;
    Some(read.map_err(|e| match e.raw_os_error() {
        None => e.to_string(),
        Some(_) => format!("cannot be read ({e})"),
    }))
}

/// Creates the Python exception for an I/O error, such as `FileNotFoundError`, with `errno` and `filename` for an error of
/// the operating system. Its message contains the file's name.
fn named(path: &Path, error: &io::Error) -> PyErr {
    if let Some(number) = error.raw_os_error() {
        let text = error.to_string();
        let text = text.split(" (os error").next().unwrap_or_default().to_owned();
        return PyOSError::new_err((number, text, path.to_string_lossy().into_owned()));
    }
    io::Error::new(error.kind(), format!("{}: {error}", shown(&path.to_string_lossy()))).into()
}

/// Writes to a path or to a file object.
///
/// # Errors
/// `OSError`; `TypeError` for anything else; the errors of a file object.
pub(crate) fn write(to: &Bound<'_, PyAny>, bytes: &[u8]) -> PyResult<()> {
    if let Ok(path) = to.extract::<PathBuf>() {
        return std::fs::write(&path, bytes).map_err(|e| named(&path, &e));
    }
    if !to.hasattr("write")? {
        let kind = to.get_type().name()?;
        let message = format!("path: expected a path or a file opened with mode 'wb', got {kind}");
        return Err(PyTypeError::new_err(message));
    }
    to.call_method1("write", (PyBytes::new(to.py(), bytes),)).map(drop)
}

/// Name of the file at a path or of a file object; empty if it has none.
pub(crate) fn name_of(to: &Bound<'_, PyAny>) -> String {
    let path = to.extract::<PathBuf>().or_else(|_| to.getattr("name")?.extract());
    path.map_or_else(|_: PyErr| String::new(), |path| path.to_string_lossy().into_owned())
}

/// Interprets an argument that is a model or a list of models.
pub(crate) fn sources(name: &str, models: &Bound<'_, PyAny>) -> PyResult<Vec<Source>> {
    match models.cast::<PyList>() {
        Ok(models) => models.iter().map(|model| Source::of(name, &model)).collect(),
        Err(_) => Ok(vec![Source::of(name, models)?]),
    }
}

/// Positions, triangles and the origin of the positions.
type Joined = (Vec<Vec3>, Vec<[u32; 3]>, DVec3);

/// Reads the meshes of several models as one.
///
/// # Errors
/// `OSError`, `ModelError`.
pub(crate) fn read_all(sources: &[Source], states: bool, clip: Option<&str>) -> PyResult<Joined> {
    let (mut positions, mut triangles, mut origin) = (Vec::new(), Vec::new(), None);
    let is_alone = sources.len() == 1;
    for source in sources {
        let mut model = source.read()?;
        model.set_origin(*origin.get_or_insert(model.origin()));
        // In a list, a model that lacks the clip contributes no frames.
        let clip = clip.filter(|clip| is_alone || Clip::named(&model.clips(), clip).is_ok());
        let (own, corners) = if states {
            model.states(clip).map_err(error::model)?
        } else {
            (model.positions, model.triangles)
        };
        let first = positions.len() as u32;
        positions.extend(own);
        triangles.extend(corners.into_iter().map(|t| t.map(|v| first + v)));
    }
    Ok((positions, triangles, origin.ok_or_else(|| error::model("the list of models is empty"))?))
}

/// Reads the joints of the models from which `n` vertices were read, at rest or with the ends of their morph targets.
/// `origin`: point to which the vertices are relative.
///
/// # Errors
/// `OSError`, `ModelError` if a model cannot be read or the models have another number of vertices.
pub(crate) fn rig(py: Python<'_>, sources: &[Source], n: usize, origin: DVec3) -> PyResult<Rig> {
    work::run(py, move |_| -> PyResult<_> {
        let mut all = Vec::new();
        for source in sources {
            let mut model = source.read()?;
            model.set_origin(origin);
            let rig = model.rest_rig().map_err(error::model)?;
            let states = model.states(None).map_err(error::model)?.0.len();
            all.push((rig, [model.positions.len(), states]));
        }
        let totals = [0, 1].map(|k| all.iter().map(|(_, n)| n[k]).sum::<usize>());
        let Some(k) = totals.iter().position(|&total| total == n) else {
            let [rest, states] = totals;
            return Err(error::model(format!(
                "rig has {rest} vertices, or {states} with its morph targets; vertices has {n}: give the model from which they were read"
            )));
        };
        let mut joined = Rig::default();
        for (rig, n) in &all {
            joined.append(rig.as_ref(), n[k]);
        }
        Ok(joined)
    })?
}

/// Reads a model: read_model(model, states=False, clip=None) -> (vertices [n, 3], triangles [m, 3] int32)
///
/// model: what each function accepts as a model: the path of a file in any format of docs/formats.md; its bytes, or a file object
/// opened with mode "rb"; a mesh object of trimesh, Open3D, PyVista or meshio, or any other one with vertices and faces; or
/// (vertices, faces). Bytes and file objects cannot refer to other files. A mesh counts as an OBJ file. A file without faces
/// can be read as well, such as the pose of a cage. A list of models gives the vertices of all of them, for one cage
/// around a body and its clothes.
///
/// Vertices are in world space, object units, in the file's order, which reshape uses too. They are split at seams as
/// in the file. They are float32, or float64 if float32 would lose digits, as for map coordinates.
///
/// states: append the vertices in each morph target; clip: with states, also append the vertices at up to 32 equally
/// spaced times of this clip. A cage around all of them is generate_cage(*read_model(model, states=True)).
///
/// Raises OSError, ModelError.
///
/// >>> vertices, triangles = cw.read_model("fox.glb")
/// >>> vertices.shape[1], triangles.shape[1]
/// (3, 3)
#[pyfunction]
#[pyo3(signature = (model, states = false, clip = None))]
pub(crate) fn read_model<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    states: bool,
    clip: Option<String>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArray2<i32>>)> {
    let sources = sources("model", model)?;
    let (positions, triangles, origin) =
        work::run(py, move |_| read_all(&sources, states, clip.as_deref()))??;
    Ok((arrays::array_of(py, positions, origin)?, arrays::triples(py, &triangles)?))
}

/// Returns the mesh of a glTF or FBX file, with its materials, as a GLB that needs no other files. `None` for other
/// formats. The vertices are those of `read_model`.
///
/// For `cagework_notebook`, which sends a single file to the notebook.
///
/// Raises `OSError`, `ModelError`.
#[pyfunction]
pub(crate) fn to_glb<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
) -> PyResult<Option<Bound<'py, PyBytes>>> {
    let source = Source::of("model", model)?;
    let glb = work::run(py, move |_| -> PyResult<_> {
        let model = source.read()?;
        if model.format() != ModelFormat::Gltf || model.triangles.is_empty() {
            return Ok(None);
        }
        model.write_glb(&model.positions).map(Some).map_err(error::model)
    })??;
    Ok(glb.map(|glb| PyBytes::new(py, &glb)))
}
