//! A bound model whose cage is posed by the program: what `pull` and `fit` share.

use std::path::{Path, PathBuf};

use cagework_core::Frames;
use cagework_core::deform::OutsideVertex;
use cagework_core::progress::Silent;
use cagework_core::{BindOptions, Controls, InnerControls, Weights, bind};
use cagework_io::{Model, SavedWeights, write_inner_controls};
use cagework_pose::pull::{Probes, Pull};
use glam::Vec3;

use crate::args::{CageSource, PoseArgs};
use crate::deform::load_weights;
use crate::error::CliError;
use crate::files::{check_outputs, shown_path, write};
use crate::load::{LoadedCage, load_cage, load_model};

/// A model, its cage and its weights.
pub(crate) struct Bound {
    pub(crate) model: Model,
    pub(crate) cage: LoadedCage,
    pub(crate) weights: Weights,
    pub(crate) frames: Frames,
    pub(crate) outside: Vec<OutsideVertex>,
}

impl Bound {
    /// Rows that are linear in the controls: what is solved with.
    pub(crate) fn rows(&self) -> Weights {
        self.frames.folded(&self.weights)
    }

    /// Reads all three; `others` are read besides, and must not be written over either.
    ///
    /// # Errors
    /// When a file cannot be read, or they do not belong together.
    pub(crate) fn load<'a>(
        args: &'a PoseArgs,
        others: impl Iterator<Item = &'a Path>,
    ) -> Result<Self, CliError> {
        let mut inputs = vec![args.mesh.as_path(), args.weights.as_path()];
        inputs.extend(others);
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
                    "{}: was bound with {} controls inside the cage, but {} are given, or they are elsewhere",
                    shown_path(&args.weights),
                    inner_controls.len(),
                    inner.len()
                ),
                hint: "give the --controls and --smooth of `cagework bind`",
            });
        }
        Ok(Self { model, cage, weights, frames, outside })
    }
}

/// What a pull needs once per binding.
///
/// # Errors
/// When the cage is too large, or the probes cannot be bound.
pub(crate) fn pull(model: &Model, controls: Controls<'_>, args: &PoseArgs) -> Result<Pull, CliError> {
    let mesh = model.tri_mesh();
    let wrong = |e| CliError::file(&args.mesh, e);
    let probes = Probes::new(&mesh, controls).map_err(wrong)?;
    let options =
        BindOptions { grid: args.grid, memory_limit: args.read.memory.bytes(), ..BindOptions::default() };
    let bound = bind(probes.points(), controls, &options, &Silent)?;
    Pull::new(&mesh, controls, probes, &bound.frames.folded(&bound.weights)).map_err(wrong)
}

/// Writes a pose of the cage, and of the controls inside if they are asked for. `pose`: `[n_controls]`.
///
/// # Errors
/// When they cannot be written.
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
