//! Limits of a conversion, and its errors.

use cagework_core::words::size_rounded_down;
use thiserror::Error;
use ufbx::{AllocatorOpts, ErrorType};

/// Limit on the depth of the tree of nodes. Rigs have less than 100 levels.
pub(crate) const MAX_DEPTH: u32 = 1000;
/// Largest memory limit that is passed to `ufbx`, bytes. Rust's allocator accepts sizes up to half the address space.
const MAX_MEMORY: u64 = isize::MAX as u64 / 2;

/// Error of converting an FBX file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FbxError {
    /// The file is damaged or too old.
    #[error("not readable as FBX: {0}. Export it again, as FBX 7.4 or newer")]
    Damaged(String),
    /// The contents exceed the memory limit.
    #[error(
        "its contents need more than the limit of {} of memory: use a smaller model or raise the limit",
        size_rounded_down(*.limit)
    )]
    Memory {
        /// Limit in bytes.
        limit: u64,
    },
    /// The tree of nodes is too deep.
    #[error("its nodes are nested more than {MAX_DEPTH} levels deep, the limit: flatten its hierarchy")]
    Depth,
    /// There are too many items of one kind.
    #[error("it has more than {limit} {what}, the limit: use a smaller model")]
    TooMany {
        /// Kind of the items.
        what: &'static str,
        /// Limit on their number.
        limit: usize,
    },
    /// A control point is NaN or infinite.
    #[error("control point {point} of mesh '{mesh}' is not finite: repair the mesh and export it again")]
    NotFinite {
        /// Name of the mesh.
        mesh: String,
        /// Index of the control point, from 0.
        point: usize,
    },
}

/// Parts of the memory limit, bytes. `ufbx` limits its temporary and its resulting memory separately.
#[derive(Clone, Copy)]
pub(crate) struct Shares {
    pub(crate) parser: usize,
    pub(crate) glb: u64,
    pub(crate) limit: u64,
}

impl Shares {
    /// A quarter each for temporary memory, for the parsed file and for the clip that is being baked, and for the GLB. The
    /// GLB exists twice when it is written, and then temporary memory is free.
    pub(crate) fn of(limit: u64) -> Self {
        let quarter = limit.min(MAX_MEMORY) / 4;
        Self { parser: quarter as usize, glb: quarter, limit }
    }

    pub(crate) fn allocator(self) -> AllocatorOpts {
        AllocatorOpts { memory_limit: self.parser, ..AllocatorOpts::default() }
    }

    pub(crate) fn fault(self, error: &ufbx::Error) -> FbxError {
        match error.type_ {
            ErrorType::MemoryLimit | ErrorType::AllocationLimit | ErrorType::OutOfMemory => {
                FbxError::Memory { limit: self.limit }
            }
            ErrorType::NodeDepthLimit => FbxError::Depth,
            _ => FbxError::Damaged(error.description.to_lowercase()),
        }
    }
}
