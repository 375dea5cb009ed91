//! Rigged models: lists the points to bind, and writes the deformed model.

use std::path::Path;

use cagework_io::{Model, ReshapeOptions, ReshapeReport, WriteError};
use glam::{DVec3, Vec3};

use crate::error::CliError;

/// Encodes a rigged model: deformed by one pose, or at rest with the poses as morph targets if there are several or if
/// they become expressions. `by`: displacements of all bound points, `[n_poses][n_points]`, object units; `outside`:
/// indices of the points outside the cage.
///
/// # Errors
/// If the weights lack the rig's points, or the model cannot be written.
pub(crate) fn write(
    model: &Model,
    outside: &[u32],
    names: &[String],
    mut by: Vec<Vec<DVec3>>,
    (output, options): (&Path, &ReshapeOptions),
) -> Result<(Vec<u8>, ReshapeReport), CliError> {
    let n = model.positions.len();
    let wrong = |e| match e {
        WriteError::Count { given, expected } => CliError::Mismatch {
            message: format!(
                "the weights have {} points of the model's rig, but it has {}",
                given.saturating_sub(n),
                expected - n
            ),
            hint: "bind the model again, or write it without its rig (--static)",
        },
        e => CliError::file(output, e),
    };
    if by.len() == 1 && !options.expressions {
        return model.write_reshaped(&by.remove(0), outside, &[], options).map_err(wrong);
    }
    let rest = vec![DVec3::ZERO; by.first().map_or(0, Vec::len)];
    let poses: Vec<_> = names.iter().cloned().zip(by).collect();
    model.write_reshaped(&rest, outside, &poses, options).map_err(wrong)
}

/// Lists the points to bind: the vertices, then the points of the rig. Also returns the number of points of the rig.
///
/// # Errors
/// If the rig cannot be read.
pub(crate) fn points(model: &Model, name: &Path) -> Result<(Vec<Vec3>, usize), CliError> {
    let extra = model.extra_points().map_err(|e| CliError::file(name, e))?;
    let n = extra.len();
    let mut all = model.positions.clone();
    all.extend(extra);
    Ok((all, n))
}
