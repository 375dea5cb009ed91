//! Errors that concern a model as a whole; each format has its own.

use thiserror::Error;

use crate::gltf::GltfError;
use crate::obj::ObjError;

/// Why bytes could not be read as a model.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ReadError {
    /// The content is no format that is read here.
    #[error("{name} is {found}: {hint}")]
    Format {
        /// Name the caller gave.
        name: String,
        /// What it seems to be.
        found: &'static str,
        /// What to do.
        hint: &'static str,
    },
    /// Vertices, but no faces, where faces are needed.
    #[error(
        "{name} has {vertices} vertices but no faces: export it with faces (a file of positions only works as a pose)"
    )]
    NoFaces {
        /// Name of the model.
        name: String,
        /// Vertices it has.
        vertices: usize,
    },
    /// A fault in an OBJ file.
    #[error("{name}: {source}")]
    Obj {
        /// Name the caller gave.
        name: String,
        /// The fault.
        source: ObjError,
    },
    /// A fault in a glTF file.
    #[error("{name}: {source}")]
    Gltf {
        /// Name the caller gave.
        name: String,
        /// The fault.
        source: GltfError,
    },
}

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
    "pose {pose} has {given} vertices, but cage {cage} has {expected}: a pose keeps the cage's vertices and their order"
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
