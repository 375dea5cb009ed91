//! Reads and writes the files of the commands that solve for a pose of the cage: `pull` and `fit`.

use std::path::{Path, PathBuf};

use cagework_core::Frames;
use cagework_core::deform::OutsideVertex;
use cagework_core::progress::NoProgress;
use cagework_core::words::counted;
use cagework_core::{BindOptions, Controls, InnerControls, Weights, bind};
use cagework_io::{Model, SavedWeights, write_inner_controls};
use cagework_pose::pull::{Probes, Pull};
use glam::Vec3;

use crate::args::{CageSource, PoseArgs};
use crate::deform::load_weights;
use crate::error::CliError;
use crate::files::{check_outputs, shown_path, write};
use crate::load::{LoadedCage, load_cage, load_model};

/// A model with its cage and weights.
pub(crate) struct BoundModel {
    pub(crate) model: Model,
    pub(crate) cage: LoadedCage,
    pub(crate) weights: Weights,
    pub(crate) frames: Frames,
    pub(crate) outside: Vec<OutsideVertex>,
}

impl BoundModel {
    /// Returns the weights with the [`Frames`] folded in, so that deformed positions are linear in the positions of the
    /// controls. `[n_vertices, n_controls]`
    pub(crate) fn rows(&self) -> Weights {
        self.frames.folded(&self.weights)
    }

    /// Reads model, cage and weights. Fails if an output would overwrite one of these files or of `other_inputs`.
    ///
    /// # Errors
    /// If a file cannot be read, or the files do not match.
    pub(crate) fn load<'a>(
        args: &'a PoseArgs,
        other_inputs: impl Iterator<Item = &'a Path>,
    ) -> Result<Self, CliError> {
        let mut inputs = vec![args.mesh.as_path(), args.weights.as_path()];
        inputs.extend(other_inputs);
        if let CageSource::File(path) = &args.cage {
            inputs.push(path);
        }
        inputs.extend(args.controls.controls.as_deref());
        let outputs: Vec<&Path> =
            std::iter::once(&args.output.path).chain(&args.save_controls).map(PathBuf::as_path).collect();
        check_outputs(&outputs, &inputs)?;
        let model = load_model(&args.mesh, args.read.axis(), args.read.memory)?;
        let cage = load_cage(&args.cage, &model, args.read.memory, &args.controls)?;
        cage.require_order_in(&args.output)?;
        let SavedWeights { weights, frames, outside, inner_controls, .. } =
            load_weights(&args.weights, &model, &cage.cage, args.read.memory)?.of_vertices();
        let inner = &cage.controls().rest()[cage.cage.n_vertices()..];
        if inner_controls != inner {
            return Err(CliError::Mismatch {
                message: format!(
                    "{}: was bound with {}, but {} given, or at other positions",
                    shown_path(&args.weights),
                    counted(inner_controls.len(), "inner control", "inner controls"),
                    counted(inner.len(), "was", "were")
                ),
                hint: "give the same --controls and --smooth as for `cagework bind`",
            });
        }
        Ok(Self { model, cage, weights, frames, outside })
    }
}

/// Precomputes what pulls and fits of this model and cage share: binds the [`Probes`], at which the gradients of the
/// weights are sampled, and builds a [`Pull`] from them.
///
/// # Errors
/// If the cage is too large, or the probes cannot be bound.
pub(crate) fn pull(model: &Model, controls: Controls<'_>, args: &PoseArgs) -> Result<Pull, CliError> {
    let mesh = model.tri_mesh();
    let wrong = |e| CliError::file(&args.mesh, e);
    let probes = Probes::new(&mesh, controls).map_err(wrong)?;
    let options =
        BindOptions { grid: args.grid, memory_limit: args.read.memory.bytes(), ..BindOptions::default() };
    let bound = bind(probes.points(), controls, &options, &NoProgress)?;
    Pull::new(&mesh, controls, probes, &bound.frames.folded(&bound.weights)).map_err(wrong)
}

/// Writes a pose of the cage and, with `--save-controls`, the pose of the inner controls. `pose`: `[n_controls]`,
/// object units.
///
/// # Errors
/// If a file cannot be written.
pub(crate) fn write_pose(
    model: &Model,
    cage: &LoadedCage,
    pose: &[Vec3],
    args: &PoseArgs,
) -> Result<(), CliError> {
    let (of_cage, of_inner) = pose.split_at(cage.cage.n_vertices());
    write(&args.output.path, &cage.write_pose(of_cage, &args.output)?)?;
    if let (Some(path), Some(inner)) = (&args.save_controls, cage.inner()) {
        let positions = model.up().turned_back(of_inner).into_owned();
        let posed = InnerControls { positions, ..inner.clone() };
        write(path, &write_inner_controls(&posed, model.origin()))?;
    }
    Ok(())
}
