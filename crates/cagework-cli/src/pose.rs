//! Reads and writes the files of the commands that solve for a pose of the cage: `pull` and `fit`.

use std::path::{Path, PathBuf};

use cagework_core::Frames;
use cagework_core::deform::OutsideVertex;
use cagework_core::enclosure::Enclosure;
use cagework_core::progress::NoProgress;
use cagework_core::words::counted;
use cagework_core::{BindOptions, Binding, Controls, InnerControls, TriMesh, Weights, bind};
use cagework_io::{Model, SavedWeights, write_inner_controls};
use cagework_pose::pull::{Grip, Handle, Probes, Pull, PullError};
use glam::Vec3;

use crate::args::{CageSource, PoseArgs};
use crate::error::CliError;
use crate::files::{check_outputs, shown_path, write};
use crate::load::{LoadedCage, load_any, load_cage, load_weights};

/// A model with its cage and weights.
pub(crate) struct BoundModel {
    pub(crate) model: Model,
    /// Mesh that is pulled: that of the model, or the surface of splats or points ([`Splats::stand_in`]).
    ///
    /// [`Splats::stand_in`]: cagework_core::splats::Splats::stand_in
    pub(crate) mesh: TriMesh,
    /// Positions of the splats or points that were loaded as `handles`; empty for a model with faces. Their weights
    /// follow those of the mesh. Object units
    handles: Vec<Vec3>,
    pub(crate) cage: LoadedCage,
    /// Weights of the mesh's vertices, then of the handles. `[n_vertices + n_handles, n_columns]`
    pub(crate) weights: Weights,
    pub(crate) frames: Frames,
    pub(crate) outside: Vec<OutsideVertex>,
}

impl BoundModel {
    /// Reads model, cage and weights. Fails if an output would overwrite one of these files or of `other_inputs`.
    /// `handles`: indices of the splats or points that a pull moves or pins; `None` if the model must have faces.
    ///
    /// # Errors
    /// If a file cannot be read, or the files do not match.
    pub(crate) fn load<'a>(
        args: &'a PoseArgs,
        other_inputs: impl Iterator<Item = &'a Path>,
        handles: Option<&[u32]>,
    ) -> Result<Self, CliError> {
        let mut inputs = vec![args.mesh.as_path()];
        inputs.extend(args.weights.as_deref());
        inputs.extend(other_inputs);
        if let CageSource::File(path) = &args.cage {
            inputs.push(path);
        }
        inputs.extend(args.controls.controls.as_deref());
        let outputs: Vec<&Path> =
            std::iter::once(&args.output.path).chain(&args.save_controls).map(PathBuf::as_path).collect();
        check_outputs(&outputs, &inputs)?;
        let model = load_any(&args.mesh, args.read.axis(), args.read.memory)?;
        let cloud = handles.filter(|_| model.n_faces() == 0);
        if cloud.is_none() {
            model.require_faces()?;
        }
        let cage = load_cage(&args.cage, &model, args.read.memory, &args.controls)?;
        cage.require_order_in(&args.output)?;
        let path = match (cloud, &args.weights) {
            (None, Some(path)) => path,
            (Some(handles), None) => return Self::bind_cloud(model, cage, handles, args),
            (None, None) => {
                return Err(CliError::Mismatch {
                    message: "the mesh can only be posed with its weights".into(),
                    hint: "give --weights, which `cagework bind` writes",
                });
            }
            (Some(_), Some(_)) => {
                return Err(CliError::Mismatch {
                    message: "the file has no faces, so it is pulled without weights".into(),
                    hint: "leave out --weights",
                });
            }
        };
        let SavedWeights { weights, frames, outside, inner_controls, .. } =
            load_weights(path, &model, &cage.cage, args.read.memory)?.of_vertices();
        let inner = &cage.controls().rest()[cage.cage.n_vertices()..];
        if inner_controls != inner {
            return Err(CliError::Mismatch {
                message: format!(
                    "{}: was bound with {}, but {} given, or at other positions",
                    shown_path(path),
                    counted(inner_controls.len(), "control inside", "controls inside"),
                    counted(inner.len(), "was", "were")
                ),
                hint: "give the same --controls and --smooth as for `cagework bind`",
            });
        }
        Ok(Self { mesh: model.tri_mesh(), handles: Vec::new(), model, cage, weights, frames, outside })
    }

    /// Binds the surface of splats or points, and the `handles` among them.
    fn bind_cloud(
        model: Model,
        cage: LoadedCage,
        handles: &[u32],
        args: &PoseArgs,
    ) -> Result<Self, CliError> {
        let mesh = model.drawn_splats().map(|splats| splats.stand_in()).unwrap_or_default();
        let (what, last) = ("splat or point", model.positions.len().saturating_sub(1));
        let position = |&index: &u32| {
            let missing = || CliError::file(&args.mesh, PullError::Missing { what, index, last });
            model.positions.get(index as usize).copied().ok_or_else(missing)
        };
        let positions = handles.iter().map(position).collect::<Result<Vec<_>, _>>()?;
        if let Some(&k) = Enclosure::new(cage.controls().surface(), &positions).outside().first() {
            return Err(CliError::Mismatch {
                message: format!("{what} {} is outside the cage", handles[k as usize]),
                hint: "grab and pin what is inside the cage",
            });
        }
        let points = [mesh.positions.as_slice(), &positions].concat();
        let memory_limit = args.read.memory.bytes();
        let options =
            BindOptions { grid: args.grid, memory_limit, held: model.bytes(), ..BindOptions::default() };
        let Binding { weights, frames, outside, .. } = bind(&points, cage.controls(), &options, &NoProgress)?;
        Ok(Self { model, mesh, handles: positions, cage, weights, frames, outside })
    }

    /// Handles of a pull, which names splats or points by their indices: replaces these indices by the rows of
    /// [`Self::weights`]. `handles`: grabs, then pins.
    pub(crate) fn number_handles<'a>(&self, handles: impl Iterator<Item = &'a mut Handle>) {
        let rows = self.mesh.positions.len() as u32..;
        if self.model.n_faces() == 0 {
            let vertices = handles.filter_map(|handle| match handle {
                Handle::Vertex(v) => Some(v),
                Handle::Triangle(..) | Handle::Cage(_) => None,
            });
            vertices.zip(rows).for_each(|(v, row)| *v = row);
        }
    }

    /// Creates the grip of a handle in the file `job`.
    ///
    /// # Errors
    /// If the handle does not exist.
    pub(crate) fn grip(&self, handle: Handle, pull: &Pull, job: &Path) -> Result<Grip, CliError> {
        let rows = &self.weights;
        let wrong = |e| CliError::file(job, e);
        if self.model.n_faces() > 0 {
            return Grip::new(handle, pull, &self.mesh.triangles, rows).map_err(wrong);
        }
        let row = match handle {
            Handle::Vertex(row) => row as usize,
            Handle::Triangle(..) => {
                return Err(CliError::Mismatch {
                    message: "splats and points have no triangles".into(),
                    hint: "give the number of a splat or point, from 0, as \"vertex\"",
                });
            }
            Handle::Cage(i) => return pull.on_cage(i).map_err(wrong),
        };
        let at = self.handles[row - self.mesh.positions.len()];
        let squared = |v: &usize| self.mesh.positions[*v].distance_squared(at);
        let nearest = (0..self.mesh.positions.len()).min_by(|a, b| squared(a).total_cmp(&squared(b)));
        let mut dense = vec![0.0; rows.n_columns()];
        let (columns, values) = rows.row(row);
        columns.iter().zip(values).for_each(|(&c, &w)| dense[c as usize] = f64::from(w));
        Ok(Grip::of_row(dense, nearest.unwrap_or_default() as u32))
    }
}

/// Precomputes what pulls and fits of this mesh and cage share: binds the [`Probes`], at which the gradients of the
/// weights are sampled, and builds a [`Pull`] from them.
///
/// # Errors
/// If the cage is too large, or the probes cannot be bound.
pub(crate) fn pull(mesh: &TriMesh, controls: Controls<'_>, args: &PoseArgs) -> Result<Pull, CliError> {
    let wrong = |e| CliError::file(&args.mesh, e);
    let probes = Probes::new(mesh, controls).map_err(wrong)?;
    let options =
        BindOptions { grid: args.grid, memory_limit: args.read.memory.bytes(), ..BindOptions::default() };
    let bound = bind(probes.points(), controls, &options, &NoProgress)?;
    Pull::new(mesh, controls, probes, &bound.frames.folded(&bound.weights)).map_err(wrong)
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
