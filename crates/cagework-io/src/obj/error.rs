//! Errors of reading OBJ files.

use thiserror::Error;

use crate::memory::MemoryError;

/// Error of reading an OBJ file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ObjError {
    /// A coordinate is missing or not a finite number.
    #[error("line {line}: {axis} coordinate is {found}; it must be a finite number such as 1.25")]
    Coordinate {
        /// Line number, from 1.
        line: usize,
        /// Axis: x, y or z.
        axis: char,
        /// Text of the coordinate.
        found: String,
    },
    /// A corner of a face, line or point is not an index.
    #[error("line {line}: corner '{found}' is not an index such as 7, 7/2, 7//3 or -1")]
    Corner {
        /// Line number, from 1.
        line: usize,
        /// Text of the corner.
        found: String,
    },
    /// A face, line or point has a vertex index out of range.
    #[error("line {line}: refers to vertex {index}, but there are {vertices}")]
    Vertex {
        /// Line number, from 1.
        line: usize,
        /// Index as written.
        index: i64,
        /// Number of vertices; for a relative index, only the vertices before the line.
        vertices: usize,
    },
    /// The file has no `v` lines.
    #[error("no vertices: an OBJ file has lines such as 'v 0 1 0'")]
    Empty,
    /// The memory limit is exceeded.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// Too many materials. Each becomes a draw call and a GLB primitive.
    #[error("line {line}: more than {limit} materials: merge some")]
    Materials {
        /// Line number, from 1.
        line: usize,
        /// Maximum number of materials.
        limit: usize,
    },
    /// A face has too many corners.
    #[error("line {line}: the face has more than {limit} corners: split it")]
    FaceCorners {
        /// Line number, from 1.
        line: usize,
        /// Maximum number of corners.
        limit: usize,
    },
    /// The file has more vertices or corners than 32-bit indices can number.
    #[error("line {line}: more than {limit} vertices or corners: simplify the model")]
    TooLarge {
        /// Line number, from 1.
        line: usize,
        /// Maximum number of vertices or corners.
        limit: u32,
    },
}
