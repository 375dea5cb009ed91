//! Models from files or bytes.

use std::io;
use std::path::{Path, PathBuf};

use cagework_core::BindOptions;
use cagework_io::Model;
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::{arrays, error, work};

/// Where a model comes from.
pub(crate) enum Source {
    File(PathBuf),
    Bytes(Vec<u8>),
}

impl Source {
    /// Of an argument: bytes, or a path.
    pub(crate) fn of(argument: &Bound<'_, PyAny>) -> PyResult<Self> {
        match argument.cast::<PyBytes>() {
            Ok(bytes) => Ok(Self::Bytes(bytes.as_bytes().to_vec())),
            Err(_) => Ok(Self::File(argument.extract()?)),
        }
    }

    /// Reads the model, and the files beside it that it names.
    ///
    /// # Errors
    /// `OSError`, `ModelError`.
    pub(crate) fn read(&self) -> PyResult<Model> {
        self.read_within(BindOptions::default().memory_limit)
    }

    /// As [`Self::read`], within so many bytes.
    ///
    /// # Errors
    /// `OSError`, `ModelError`.
    pub(crate) fn read_within(&self, memory_limit: u64) -> PyResult<Model> {
        let model = match self {
            Self::Bytes(bytes) => Model::read_within("model", bytes, &mut |_| None, memory_limit),
            Self::File(path) => {
                let bytes = std::fs::read(path).map_err(|e| named(path, &e))?;
                let folder = path.parent().unwrap_or(Path::new(""));
                Model::read_within(
                    &path.to_string_lossy(),
                    &bytes,
                    &mut |name| beside(folder, name),
                    memory_limit,
                )
            }
        };
        model.map_err(error::model)
    }
}

/// A file that a model names, from its folder or below.
fn beside(folder: &Path, name: &str) -> Option<Result<Vec<u8>, String>> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    // Also when a link leads there.
    let (folder, path) = (folder.canonicalize().ok()?, folder.join(name).canonicalize().ok()?);
    if !path.starts_with(folder) {
        return Some(Err("leads out of the model's folder".into()));
    }
    Some(std::fs::read(path).map_err(|e| format!("cannot be read ({e})")))
}

/// The exception of a kind of error, such as `FileNotFoundError`, with the file's name.
fn named(path: &Path, error: &io::Error) -> PyErr {
    io::Error::new(error.kind(), format!("{}: {error}", path.display())).into()
}

/// Writes a file.
///
/// # Errors
/// `OSError`.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> PyResult<()> {
    std::fs::write(path, bytes).map_err(|e| named(path, &e))
}

/// Vertices and triangles of a model: read_model(model, states=False, clip=None) -> (vertices [n, 3] float32, triangles [m, 3]
/// int32); vertices so far from the origin that 32 bits would round them, such as those of a map, are float64
///
/// model: path of a .glb, .gltf, .vrm, .obj, .ply, .stl or .off, or its bytes. Vertices are in world space, object units, in the file's order, split
/// at seams as the file has them: those that reshape moves. A file without faces is read, too: a pose of a cage is one.
///
/// states: after the vertices also where each morph target takes them; clip: the name of a clip, with states, whose frames come
/// after those. That is what a cage should enclose: generate_cage(*read_model(model, states=True)).
///
/// Raises OSError, ModelError.
#[pyfunction]
#[pyo3(signature = (model, states = false, clip = None))]
pub(crate) fn read_model<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    states: bool,
    clip: Option<String>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArray2<i32>>)> {
    let source = Source::of(model)?;
    let ((positions, triangles), origin) = work::run(py, move |_| -> PyResult<_> {
        let model = source.read()?;
        let origin = model.origin();
        if states {
            Ok((model.states(clip.as_deref()).map_err(error::model)?, origin))
        } else {
            Ok(((model.positions, model.triangles), origin))
        }
    })??;
    Ok((arrays::array_of(py, positions, origin)?, arrays::triples(py, &triangles)?))
}
