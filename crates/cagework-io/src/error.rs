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
pub enum PoseError {
    /// It has another number of vertices.
    #[error(
        "pose {} has {given} vertices, but cage {} has {expected}: a pose keeps the cage's vertices and their order",
        shown(pose),
        shown(cage)
    )]
    Count {
        /// Name of the pose.
        pose: String,
        /// Vertices of the pose.
        given: usize,
        /// Name of the cage.
        cage: String,
        /// Vertices of the cage.
        expected: usize,
    },
    /// Its clip or morph targets cannot be read.
    #[error("pose {}: {source}", shown(pose))]
    States {
        /// Name of the pose.
        pose: String,
        /// Why.
        source: WriteError,
    },
    /// Its faces join vertices that have nothing to do with each other in the cage.
    #[error(
        "pose {} has an edge from vertex {} to {}, which are of no face together in cage {}: its vertices are in another order; {hint}",
        shown(pose),
        edge[0],
        edge[1],
        shown(cage)
    )]
    Order {
        /// Name of the pose.
        pose: String,
        /// Vertices of the edge, from 0.
        edge: [u32; 2],
        /// Name of the cage.
        cage: String,
        /// What to do.
        hint: &'static str,
    },
}
