//! Why a command was refused. The document is unchanged then.

use cagework_core::{CageError, ControlError};
use cagework_io::{SelectError, WriteError};
use thiserror::Error;

use crate::edit::PoseError;
use crate::rest_edit::RestEditError;

/// Why a command was refused.
#[derive(Debug, Error)]
pub enum EditError {
    /// No model is open, or none has this number.
    #[error("there is no such model yet: open one first")]
    NoModel,
    /// The only model cannot be removed.
    #[error("this is the only model in the cage: open another one")]
    OnlyModel,
    /// There is no cage, or only a draft of one.
    #[error("there is no cage yet: make or open one first")]
    NoCage,
    /// The command works on a selection.
    #[error("select {what} first")]
    NothingSelected {
        /// What the command needs.
        what: &'static str,
    },
    /// A saved pose that does not exist.
    #[error("there is no pose number {number}: {count} are saved")]
    NoSuchPose {
        /// Counted from 1.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// Painted amounts for another number of vertices.
    #[error("{given} amounts for {expected} vertices")]
    Amounts {
        /// Amounts given.
        given: usize,
        /// Vertices of the model.
        expected: usize,
    },
    /// A number that is not finite.
    #[error("{what} must be finite numbers")]
    NotFinite {
        /// What the numbers are.
        what: &'static str,
    },
    /// Positions that are no cage.
    #[error(transparent)]
    Cage(#[from] CageError),
    /// Controls that do not fit into the cage.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// An edit of the rest cage.
    #[error(transparent)]
    Rest(#[from] RestEditError),
    /// A pose of another cage.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// A name that is that of no part of the model.
    #[error(transparent)]
    Part(#[from] SelectError),
    /// A rig that cannot be read.
    #[error(transparent)]
    Rig(#[from] WriteError),
}
