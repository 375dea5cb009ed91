//! Why an OBJ file could not be read.

use thiserror::Error;

use crate::memory::MemoryError;

/// Why an OBJ file could not be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ObjError {
    /// A coordinate is missing or no number.
    #[error("line {line}: {axis} coordinate is {found}; it must be a finite number such as 1.25")]
    Coordinate {
        /// Line, from 1.
        line: usize,
        /// Which coordinate.
        axis: char,
        /// What stands there.
        found: String,
    },
    /// A corner of a face, line or point is no index.
    #[error("line {line}: corner '{found}' is not an index such as 7, 7/2, 7//3 or -1")]
    Corner {
        /// Line, from 1.
        line: usize,
        /// What stands there.
        found: String,
    },
    /// A face, line or point names a vertex that does not exist.
    #[error("line {line}: names vertex {index}, but there are {vertices}")]
    Vertex {
        /// Line, from 1.
        line: usize,
        /// Index as written.
        index: i64,
        /// Vertices there are (so far, for a relative index).
        vertices: usize,
    },
    /// No `v` line at all.
    #[error("no vertices: an OBJ file has lines such as 'v 0 1 0'")]
    Empty,
    /// More memory than is allowed.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// More materials than can be drawn, and written as primitives.
    #[error("line {line}: more than {limit} different materials: join some")]
    Materials {
        /// Line, from 1.
        line: usize,
        /// The limit.
        limit: usize,
    },
    /// More elements than 32-bit indices can name.
    #[error("line {line}: more than {limit} vertices or corners")]
    TooLarge {
        /// Line, from 1.
        line: usize,
        /// The limit.
        limit: u32,
    },
}
