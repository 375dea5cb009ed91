//! Controls inside a cage, from files and back.

use std::path::{Path, PathBuf};

use cagework_core::{Cage, ControlSet, InnerControls};
use cagework_io::{SavedWeights, UpAxis, read_inner_controls};
use glam::{DVec3, Vec3};

use crate::args::{ControlArgs, MemoryArgs};
use crate::error::CliError;
use crate::files::{read, shown_path};

/// The controls of a cage that the arguments ask for; none if that is the plain cage. `axes`: what points up in the
/// files, and what the cage is seen from.
///
/// # Errors
/// When the file cannot be read, or names what cannot be a control.
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
    // What the elements are is asked for even if there is none.
    if args.controls.is_some() && inner.elements.is_empty() {
        return Err(wrong(args, cagework_core::ControlError::Empty));
    }
    ControlSet::new(cage, args.smooth.smooth, inner).map(Some).map_err(|e| wrong(args, e))
}

fn wrong(args: &ControlArgs, error: cagework_core::ControlError) -> CliError {
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

/// Poses of all controls: those of the cage, each followed by the controls inside, at rest where `files` says nothing.
///
/// # Errors
/// When a file cannot be read or has another number of vertices, or there are too few or too many files.
pub(crate) fn with_inner(
    poses: Vec<Vec<Vec3>>,
    files: &[PathBuf],
    rest: &[Vec3],
    axes: (UpAxis, DVec3),
    memory: MemoryArgs,
) -> Result<Vec<Vec<Vec3>>, CliError> {
    if !files.is_empty() && files.len() != poses.len() {
        return Err(CliError::Mismatch {
            message: format!("{} --pose-controls for {} poses", files.len(), poses.len()),
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
                "{}: has {} vertices, but {} controls inside the cage were bound",
                shown_path(path),
                positions.len(),
                rest.len()
            ),
            hint: "a pose of controls is their file with vertices moved: same number, same order",
        })
    };
    let inner: Vec<Vec<Vec3>> = files.iter().map(inner).collect::<Result<_, _>>()?;
    let of = |k: usize| inner.get(k).map_or(rest, Vec::as_slice);
    Ok(poses.into_iter().enumerate().map(|(k, pose)| [pose.as_slice(), of(k)].concat()).collect())
}

/// Where all controls of saved weights rest.
pub(crate) fn rest_of(cage: &Cage, saved: &SavedWeights) -> Vec<Vec3> {
    [cage.positions(), &saved.inner_controls].concat()
}

/// How many controls there are inside, after the number of cage vertices.
pub(crate) fn inner_controls(n: usize) -> String {
    if n == 0 { String::new() } else { format!(" and {n} controls inside") }
}
