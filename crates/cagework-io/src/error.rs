//! Errors of writing models and of reading poses.

use cagework_core::words::{counted, size_rounded_down, size_rounded_up};
use thiserror::Error;

use crate::shown::shown;

/// Error of writing a model.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The number of positions differs from the model's number of vertices.
    #[error("{} for a model of {}: give one position per vertex", counted(*given, "position", "positions"), counted(*expected, "vertex", "vertices"))]
    Count {
        /// Number of positions given.
        given: usize,
        /// Number of vertices of the model.
        expected: usize,
    },
    /// The rig is not that of a humanoid.
    #[error(transparent)]
    Humanoid(#[from] cagework_pose::humanoid::HumanoidError),
    /// A position is not a finite number.
    #[error("the new position of vertex {vertex} is not a finite number")]
    NotFinite {
        /// Vertex index.
        vertex: usize,
    },
    /// The model has no triangles, which the format needs.
    #[error("the model has no faces, but {format} needs triangles: export PLY instead, which keeps points")]
    NoFaces {
        /// Name of the requested format, such as "GLB".
        format: &'static str,
    },
    /// A number of a splat exceeds the largest value that the format can store.
    #[error(
        "splat {splat} has {what} {value}, more than the limit of {limit}: scale the capture, or write another format"
    )]
    Splat {
        /// Index of the splat, from 0.
        splat: usize,
        /// Name of the number, with its article: "the position".
        what: &'static str,
        /// The number that does not fit.
        value: String,
        /// Largest value that the format can store.
        limit: &'static str,
    },
    /// The format is read, but not written.
    #[error("a {} is read, but not written: export {others}", format.to_uppercase())]
    ReadOnly {
        /// Extension of the requested format, lower case, without the dot.
        format: &'static str,
        /// Formats that can be exported instead, as text: "GLB, PLY, SPLAT or SPZ".
        others: String,
    },
    /// The format stores splats, but the model has none.
    #[error("the model has no splats, but a {} stores nothing else: export {}", format.to_uppercase(), others)]
    NoSplats {
        /// Extension of the requested format, lower case, without the dot.
        format: &'static str,
        /// Formats that can be exported instead, as text: "OBJ, PLY, OFF or 3MF".
        others: String,
    },
    /// The number of poses given differs from the number of poses in the timeline.
    #[error("the timeline has {expected} poses, but {given} were given: make a timeline for these poses")]
    Poses {
        /// Number of poses given.
        given: usize,
        /// Number of poses of the timeline.
        expected: usize,
    },
    /// The operation needs a rig, but the model is not a glTF.
    #[error("the model is not a glTF, so it has no rig: export it without the rig options")]
    NoRig,
    /// No clip has this index.
    #[error("the model has no clip {0}: clips are counted from 0")]
    NoClip(usize),
    /// The export exceeds the GLB limit of 4 GiB.
    #[error("the model needs {bytes} bytes, more than the 4 GiB that a GLB can hold: export an OBJ instead")]
    TooLarge {
        /// Size that the export would have.
        bytes: u64,
    },
    /// A project would be larger than the caller allows.
    #[error(
        "the project takes {}, more than the limit of {}",
        size_rounded_up(*bytes),
        size_rounded_down(*limit)
    )]
    Limit {
        /// Size that the file would have, or a lower limit of it, bytes.
        bytes: u64,
        /// Largest size that the caller allows, bytes.
        limit: u64,
    },
    /// A GLB of this many corners could not be read again.
    #[error(
        "a material has {corners} corners of triangles, more than the limit of {limit} for a GLB: export another format"
    )]
    Corners {
        /// Number of corners.
        corners: u64,
        /// Largest number that is accepted.
        limit: u64,
    },
    /// The original document cannot be changed, for the reason given.
    #[error("the original document cannot be changed: {0}")]
    Document(String),
}

/// Error of reading a model as a pose of a cage.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PoseError {
    /// The pose and the cage have different numbers of vertices.
    #[error(
        "pose {} has {given} vertices, but cage {} has {expected}: a pose keeps the cage's vertices and their order",
        shown(pose),
        shown(cage)
    )]
    Count {
        /// Name of the pose's file.
        pose: String,
        /// Number of vertices in the pose.
        given: usize,
        /// Name of the cage.
        cage: String,
        /// Number of vertices of the cage.
        expected: usize,
    },
    /// The clip or morph targets of the pose cannot be read.
    #[error("pose {}: {source}", shown(pose))]
    States {
        /// Name of the pose's file.
        pose: String,
        /// Reason why the clip or the morph targets cannot be read.
        source: WriteError,
    },
    /// An edge of the pose joins vertices that share no face in the cage, so the vertices are in another order.
    #[error(
        "pose {} has an edge from vertex {} to {}, which share no face in cage {}: its vertices are in another order; {hint}",
        shown(pose),
        edge[0],
        edge[1],
        shown(cage)
    )]
    Order {
        /// Name of the pose's file.
        pose: String,
        /// Vertex indices of the edge, from 0.
        edge: [u32; 2],
        /// Name of the cage.
        cage: String,
        /// How to export a pose that keeps the order.
        hint: String,
    },
}
