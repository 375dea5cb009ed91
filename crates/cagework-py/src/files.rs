//! Reads models from files or bytes, and writes files.

use std::io;
use std::path::{Path, PathBuf};

use cagework_core::BindOptions;
use cagework_io::Model;
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::{arrays, error, work};

/// A model to read.
pub(crate) enum Source {
    File(PathBuf),
    Bytes(Vec<u8>),
}

impl Source {
    /// Interprets an argument: bytes, or a path.
    pub(crate) fn of(argument: &Bound<'_, PyAny>) -> PyResult<Self> {
        match argument.cast::<PyBytes>() {
            Ok(bytes) => Ok(Self::Bytes(bytes.as_bytes().to_vec())),
            Err(_) => Ok(Self::File(argument.extract()?)),
        }
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

/// Reads a file that a model refers to. `None` if it does not exist.
fn beside(folder: &Path, name: &str) -> Option<Result<Vec<u8>, String>> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    // Canonical paths also detect symbolic links that lead out of the folder.
    let (folder, path) = (folder.canonicalize().ok()?, folder.join(name).canonicalize().ok()?);
    if !path.starts_with(folder) {
        return Some(Err("leads out of the model's folder".into()));
    }
    Some(std::fs::read(path).map_err(|e| format!("cannot be read ({e})")))
}

/// The Python exception for an I/O error, such as `FileNotFoundError`; its message contains the file's name.
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

/// Reads a model: read_model(model, states=False, clip=None) -> (vertices [n, 3], triangles [m, 3] int32)
///
/// model: path of a file in any format of docs/formats.md, or its bytes. A file without faces can be read as well, such
/// as the pose of a cage.
///
/// Vertices are in world space, object units, in the file's order, which reshape uses too. They are split at seams as
/// in the file. They are float32, or float64 if float32 would lose digits, as for map coordinates.
///
/// states: append the vertices in each morph target; clip: with states, also append the vertices in the frames of this
/// clip. A cage around all of them is generate_cage(*read_model(model, states=True)).
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
