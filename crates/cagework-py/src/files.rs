//! Reads models from files or bytes, and writes files.

use std::io;
use std::path::{Path, PathBuf};

use cagework_core::BindOptions;
use cagework_core::rig::Rig;
use cagework_io::{Clip, Model, ModelFormat, Resolve, shown};
use glam::DVec3;
use numpy::PyArray2;
use pyo3::exceptions::{PyOSError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes, PyList, PyMemoryView};

use crate::{arrays, error, work};

/// A model to read.
pub(crate) enum Source {
    File(PathBuf),
    Bytes(Vec<u8>),
}

impl Source {
    /// Interprets an argument: bytes, a bytearray or a memoryview, or a path.
    ///
    /// # Errors
    /// `TypeError` with the name of the argument.
    pub(crate) fn of(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(bytes) = argument.cast::<PyBytes>() {
            return Ok(Self::Bytes(bytes.as_bytes().to_vec()));
        }
        if argument.is_instance_of::<PyByteArray>() || argument.is_instance_of::<PyMemoryView>() {
            let bytes = argument.py().get_type::<PyBytes>().call1((argument,))?;
            return Ok(Self::Bytes(bytes.extract()?));
        }
        argument.extract().map(Self::File).or_else(|_| {
            let kind = argument.get_type().name()?;
            Err(PyTypeError::new_err(format!("{name}: expected a path or bytes, got {kind}")))
        })
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
            Self::Bytes(bytes) => read("model", bytes, &mut |_| None),
            Self::File(path) => {
                let bytes = cagework_files::read(path).map_err(|e| named(path, &e))?;
                read(&path.to_string_lossy(), &bytes, &mut |name| beside(path, name))
            }
        };
        model.map_err(error::model)
    }
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

/// Writes a file.
///
/// # Errors
/// `OSError`.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> PyResult<()> {
    std::fs::write(path, bytes).map_err(|e| named(path, &e))
}

/// Interprets an argument that is a model or a list of models.
fn sources(name: &str, models: &Bound<'_, PyAny>) -> PyResult<Vec<Source>> {
    match models.cast::<PyList>() {
        Ok(models) => models.iter().map(|model| Source::of(name, &model)).collect(),
        Err(_) => Ok(vec![Source::of(name, models)?]),
    }
}

/// Reads the joints of the models from which `n` vertices were read, at rest or with the ends of their morph targets.
/// `origin`: point to which the vertices are relative.
///
/// # Errors
/// `OSError`, `ModelError` if a model cannot be read or the models have another number of vertices.
pub(crate) fn rig(py: Python<'_>, models: &Bound<'_, PyAny>, n: usize, origin: DVec3) -> PyResult<Rig> {
    let sources = sources("rig", models)?;
    work::run(py, move |_| -> PyResult<_> {
        let mut all = Vec::new();
        for source in &sources {
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
/// model: path of a file in any format of docs/formats.md, or its bytes. A file without faces can be read as well, such
/// as the pose of a cage. A list of models gives the vertices of all of them, for one cage around a body and its clothes.
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
    let (positions, triangles, origin) = work::run(py, move |_| -> PyResult<_> {
        let (mut positions, mut triangles, mut origin) = (Vec::new(), Vec::new(), None);
        let is_alone = sources.len() == 1;
        for source in &sources {
            let mut model = source.read()?;
            model.set_origin(*origin.get_or_insert(model.origin()));
            // In a list, a model that lacks the clip contributes no frames.
            let clip = clip.as_deref().filter(|clip| is_alone || Clip::named(&model.clips(), clip).is_ok());
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
    })??;
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
