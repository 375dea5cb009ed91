//! Errors of commands. The document is unchanged after an error.

use cagework_core::options::UnknownWord;
use cagework_core::{CageError, ControlError};
use cagework_io::{SelectError, WriteError};
use cagework_job::JobError;
use cagework_pose::blend::VertexCountError;
use cagework_pose::humanoid::HumanoidError;
use cagework_pose::proportions::ProportionError;
use thiserror::Error;

use crate::rest_edit::RestEditError;

/// Reason why a command cannot be applied.
#[derive(Debug, Error)]
pub enum EditError {
    /// No model is open, or none has this id.
    #[error("there is no such model yet: open one first")]
    NoModel,
    /// The only model cannot be removed.
    #[error("this is the only model in the cage: open another one")]
    OnlyModel,
    /// There is no cage, or only a draft of one.
    #[error("there is no cage yet: make or open one first")]
    NoCage,
    /// The command needs a selection, but nothing suitable is selected.
    #[error("select {what} first")]
    NothingSelected {
        /// What must be selected, such as "a vertex".
        what: &'static str,
    },
    /// There is no saved pose with this number.
    #[error("pose {number} does not exist; saved poses: {count}")]
    NoSuchPose {
        /// Number of the pose, from 1.
        number: usize,
        /// Number of saved poses.
        count: usize,
    },
    /// [`Command::SetPainted`](crate::Command::SetPainted) does not have one amount per vertex of the model.
    #[error("{given} amounts for {expected} vertices")]
    Amounts {
        /// Number of amounts that were given.
        given: usize,
        /// Number of vertices of the model.
        expected: usize,
    },
    /// A number is not finite.
    #[error("{what} must be finite numbers")]
    NotFinite {
        /// The numbers that are not finite, such as "positions of a cage".
        what: &'static str,
    },
    /// The mesh is not a valid cage.
    #[error(transparent)]
    Cage(#[from] CageError),
    /// The controls do not fit into the cage.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// An edit of the rest cage is not possible.
    #[error(transparent)]
    Rest(#[from] RestEditError),
    /// The saved pose with this number belongs to another cage.
    #[error("pose {number} belongs to another cage")]
    OtherCage {
        /// Number of the pose, from 1.
        number: usize,
    },
    /// The positions belong to another cage.
    #[error(transparent)]
    Pose(#[from] VertexCountError),
    /// The animation cannot show a pose at this time.
    #[error("{name} cannot be at {seconds} s: {limit}")]
    PoseTime {
        /// Name of the pose.
        name: String,
        /// Time given for the pose, seconds.
        seconds: f32,
        /// The limit that the time exceeds, or the pose that it would meet.
        limit: String,
    },
    /// A name selects no part of the model.
    #[error(transparent)]
    Part(#[from] SelectError),
    /// There is no such bone.
    #[error(transparent)]
    Bone(#[from] UnknownWord),
    /// The models are not a humanoid.
    #[error(transparent)]
    Humanoid(#[from] HumanoidError),
    /// A proportion cannot be set.
    #[error(transparent)]
    Proportion(#[from] ProportionError),
    /// A rig cannot move the cage.
    #[error(transparent)]
    Job(#[from] JobError),
    /// The rig cannot be read.
    #[error(transparent)]
    Rig(#[from] WriteError),
}
