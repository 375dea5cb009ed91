//! Why files of any format could not be written, or do not belong together.

use thiserror::Error;

use crate::shown::shown;

/// Why a model could not be written.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WriteError {
    /// Not one position per vertex.
    #[error("{given} positions for a model of {expected} vertices")]
    Count {
        /// Positions given.
        given: usize,
        /// Vertices of the model.
        expected: usize,
    },
    /// A position is not a finite number.
    #[error("the new position of vertex {vertex} is not a finite number")]
    NotFinite {
        /// The vertex.
        vertex: usize,
    },
    /// A GLB needs triangles.
    #[error("the model has no faces, and a GLB needs some: write an OBJ instead")]
    NoFaces,
    /// Only glTF has rigs.
    #[error("the model is no glTF: it has no rig to keep")]
    NoRig,
    /// There is no clip of this number.
    #[error("the model has no clip {0}")]
    NoClip(usize),
    /// A GLB holds at most 4 GiB.
    #[error("the model needs {bytes} bytes, more than the 4 GiB that a GLB can hold: write an OBJ instead")]
    TooLarge {
        /// Bytes needed.
        bytes: u64,
    },
    /// The original document cannot be patched.
    #[error("the original document cannot be patched: {0}")]
    Document(String),
}

/// Why a file is not a pose of a cage.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "pose {} has {given} vertices, but cage {} has {expected}: a pose keeps the cage's vertices and their order",
    shown(pose),
    shown(cage)
)]
pub struct PoseError {
    /// Name of the pose.
    pub pose: String,
    /// Vertices of the pose.
    pub given: usize,
    /// Name of the cage.
    pub cage: String,
    /// Vertices of the cage.
    pub expected: usize,
}
