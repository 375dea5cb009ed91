//! The points that are bound, and how they follow the controls of a cage.

use cagework_core::deform::{OutsideVertex, deform_bound, displacements};
use cagework_core::field::{Field, FieldWeights, Lattice};
use cagework_core::{BindOptions, Binding, Controls, Frames, Weights};
use cagework_io::{Model, SavedWeights};
use cagework_pose::parts::Parts;
use glam::{DVec3, Vec3};

use crate::error::JobError;

/// How the points of a model follow the controls of a cage. Each kind of model needs some of these functions.
pub trait Follow {
    /// Why the points cannot follow.
    type Error: From<JobError>;

    /// Computes the displacements of the model's vertices and of the points of its rig
    /// ([`Model::extra_points`]) in a pose. `[n_points]`, object units
    ///
    /// # Errors
    /// If the pose belongs to another cage.
    fn displacements(&self, model: &Model, pose: &[Vec3]) -> Result<Vec<DVec3>, Self::Error>;

    /// Computes the model's vertices in a pose, with parts that stay in place or keep their shape. At rest, returns
    /// [`Model::positions`] without rounding. `[n_vertices]`, object units
    ///
    /// # Errors
    /// If the pose belongs to another cage.
    fn vertices(&self, model: &Model, pose: &[Vec3], parts: &Parts) -> Result<Vec<Vec3>, Self::Error>;

    /// Computes the deformation of space in a pose; `None` at rest.
    ///
    /// # Errors
    /// If the pose belongs to another cage.
    fn field(&self, pose: &[Vec3]) -> Result<Option<Field>, Self::Error>;

    /// Indices of the points outside the cage.
    ///
    /// # Errors
    /// If the points are not known.
    fn outside(&self) -> Result<Vec<u32>, Self::Error>;
}

/// Points to bind to a cage.
#[derive(Clone, Debug)]
pub struct JobPoints {
    /// Positions. `[n_points]`, object units
    pub positions: Vec<Vec3>,
    /// Options for binding these points, with the memory that is in use.
    pub options: BindOptions,
    /// Lattice whose nodes are bound instead of points of the model.
    pub(crate) lattice: Option<Lattice>,
}

/// Bound points of a job, and the controls at rest.
#[derive(Clone, Debug)]
pub struct BoundPoints {
    rest: Vec<Vec3>,
    by: BoundBy,
}

/// What was bound.
#[derive(Clone, Debug)]
enum BoundBy {
    /// Rows of the vertices, then of the points of the rig.
    Points { weights: Weights, frames: Frames, outside: Vec<OutsideVertex> },
    /// Weights of a lattice.
    Lattice(FieldWeights),
    /// Nothing: all points stay.
    Nothing,
}

impl JobPoints {
    /// Combines the points with the result of binding [`Self::positions`] to `controls`.
    ///
    /// # Panics
    /// If the number of bound nodes of a lattice differs.
    #[must_use]
    pub fn bound<'a>(self, binding: Binding, controls: impl Into<Controls<'a>>) -> BoundPoints {
        let rest = controls.into().rest().to_vec();
        let Binding { weights, frames, outside, .. } = binding;
        let by = match self.lattice {
            Some(lattice) => BoundBy::Lattice(FieldWeights::new(lattice, weights, frames)),
            None => BoundBy::Points { weights, frames, outside },
        };
        BoundPoints { rest, by }
    }
}

impl BoundPoints {
    /// Weights that were read from a file. `rest`: positions of the controls at rest. `[n_controls]`, object units
    #[must_use]
    pub fn from_saved(saved: SavedWeights, rest: Vec<Vec3>) -> Self {
        let SavedWeights { weights, frames, outside, .. } = saved;
        Self { rest, by: BoundBy::Points { weights, frames, outside } }
    }

    /// Nothing is bound, for a file of clips without a mesh. `rest`: positions of the controls at rest.
    #[must_use]
    pub fn nothing(rest: Vec<Vec3>) -> Self {
        Self { rest, by: BoundBy::Nothing }
    }

    fn check(&self, pose: &[Vec3]) -> Result<(), JobError> {
        let (given, expected) = (pose.len(), self.rest.len());
        if given == expected { Ok(()) } else { Err(JobError::OtherCage { given, expected }) }
    }
}

impl Follow for BoundPoints {
    type Error = JobError;

    fn displacements(&self, model: &Model, pose: &[Vec3]) -> Result<Vec<DVec3>, JobError> {
        self.check(pose)?;
        match &self.by {
            BoundBy::Points { weights, frames, .. } => Ok(displacements(weights, frames, &self.rest, pose)),
            BoundBy::Nothing => Ok(vec![DVec3::ZERO; model.positions.len() + model.extra_points()?.len()]),
            BoundBy::Lattice(_) => Err(JobError::Unbound),
        }
    }

    fn vertices(&self, model: &Model, pose: &[Vec3], parts: &Parts) -> Result<Vec<Vec3>, JobError> {
        self.check(pose)?;
        if pose == self.rest {
            return Ok(model.positions.clone());
        }
        let BoundBy::Points { weights, frames, .. } = &self.by else { return Err(JobError::Unbound) };
        let mut deformed = deform_bound(weights, frames, pose);
        // Points of the rig may have been bound, too.
        deformed.truncate(model.positions.len());
        Ok(if parts.is_empty() { deformed } else { parts.hold(&model.positions, &deformed) })
    }

    fn field(&self, pose: &[Vec3]) -> Result<Option<Field>, JobError> {
        self.check(pose)?;
        match &self.by {
            _ if pose == self.rest => Ok(None),
            BoundBy::Lattice(weights) => Ok(Some(weights.pose(&self.rest, pose))),
            BoundBy::Points { .. } | BoundBy::Nothing => Err(JobError::Unbound),
        }
    }

    fn outside(&self) -> Result<Vec<u32>, JobError> {
        match &self.by {
            BoundBy::Points { outside, .. } => Ok(outside.iter().map(|o| o.vertex).collect()),
            BoundBy::Lattice(_) | BoundBy::Nothing => Ok(Vec::new()),
        }
    }
}
