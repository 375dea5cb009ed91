//! Reads inner controls and their poses.

use std::path::{Path, PathBuf};

use cagework_core::words::counted;
use cagework_core::{Cage, ControlSet, InnerControls};
use cagework_io::{SavedWeights, UpAxis, read_inner_controls};
use glam::{DVec3, Vec3};

use crate::args::{ControlArgs, MemoryArgs};
use crate::error::CliError;
use crate::files::{read, shown_path};

/// Builds the controls that the arguments describe. Returns `None` if the cage's vertices are the only controls and the
/// cage is not subdivided. `axes`: up axis of the files, and origin of the cage's positions.
///
/// # Errors
/// If the file cannot be read, or a control is invalid.
pub(crate) fn load_controls(
    cage: &Cage,
    args: &ControlArgs,
    axes: (UpAxis, DVec3),
    memory: MemoryArgs,
) -> Result<Option<ControlSet>, CliError> {
    let inner = match &args.controls {
        None if args.smooth.smooth == 0 => return Ok(None),
        None => InnerControls::default(),
        Some(path) => InnerControls { radius: args.radius, ..load_inner(path, axes, memory)? },
    };
    // `ControlSet::new` accepts a set without controls, which is a mistake if the user gave a file.
    if args.controls.is_some() && inner.elements.is_empty() {
        return Err(control_error(args, cagework_core::ControlError::Empty));
    }
    ControlSet::new(cage, args.smooth.smooth, inner).map(Some).map_err(|e| control_error(args, e))
}

fn control_error(args: &ControlArgs, error: cagework_core::ControlError) -> CliError {
    match &args.controls {
        Some(path) => CliError::file(path, error),
        None => error.into(),
    }
}

fn load_inner(
    path: &Path,
    (up, origin): (UpAxis, DVec3),
    memory: MemoryArgs,
) -> Result<InnerControls, CliError> {
    let inner = read_inner_controls(&read(path)?, origin, memory.bytes());
    let mut inner = inner.map_err(|e| CliError::file(path, e))?;
    inner.positions = up.turned(&inner.positions).into_owned();
    Ok(inner)
}

/// Appends the positions of the inner controls to each pose of the cage: those in `files[k]` to pose k, or `rest` if no
/// files are given.
///
/// # Errors
/// If a file cannot be read or has another number of vertices than `rest`, or the number of files is neither zero nor
/// that of the poses.
pub(crate) fn with_inner(
    poses: Vec<Vec<Vec3>>,
    files: &[PathBuf],
    rest: &[Vec3],
    axes: (UpAxis, DVec3),
    memory: MemoryArgs,
) -> Result<Vec<Vec<Vec3>>, CliError> {
    if !files.is_empty() && files.len() != poses.len() {
        return Err(CliError::Mismatch {
            message: format!(
                "--pose-controls: {} for {}",
                counted(files.len(), "file", "files"),
                counted(poses.len(), "pose", "poses")
            ),
            hint: "give one for each --pose, in the same order, or none",
        });
    }
    let inner = |path: &PathBuf| {
        let positions = load_inner(path, axes, memory)?.positions;
        if positions.len() == rest.len() {
            return Ok(positions);
        }
        Err(CliError::Mismatch {
            message: format!(
                "{}: has {}, but {} bound",
                shown_path(path),
                counted(positions.len(), "vertex", "vertices"),
                counted(rest.len(), "control inside was", "controls inside were")
            ),
            hint: "the pose of controls inside is their file with moved vertices: same number, same order",
        })
    };
    let inner: Vec<Vec<Vec3>> = files.iter().map(inner).collect::<Result<_, _>>()?;
    let of = |k: usize| inner.get(k).map_or(rest, Vec::as_slice);
    Ok(poses.into_iter().enumerate().map(|(k, pose)| [pose.as_slice(), of(k)].concat()).collect())
}

/// Rest positions of the cage's vertices, then of the inner controls. `[n_controls]`, object units.
pub(crate) fn rest_of(cage: &Cage, saved: &SavedWeights) -> Vec<Vec3> {
    [cage.positions(), &saved.inner_controls].concat()
}

/// Returns text such as " and 2 controls inside", which follows the number of cage vertices; empty if `n` is 0.
pub(crate) fn inner_controls_text(n: usize) -> String {
    match n {
        0 => String::new(),
        1 => " and 1 control inside".into(),
        n => format!(" and {n} controls inside"),
    }
}
