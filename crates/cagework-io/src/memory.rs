//! Memory limits of a file, checked before allocation: a small file can declare huge arrays.

use cagework_core::words::{size_rounded_down, size_rounded_up};
use thiserror::Error;

/// A file needs more memory than the limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "it needs about {} of memory, more than the limit of {}: use a smaller model or raise the limit",
    size_rounded_up(*needed),
    size_rounded_down(*limit)
)]
pub struct MemoryError {
    /// Estimate of the memory that is needed, bytes.
    pub needed: u64,
    /// Limit in bytes.
    pub limit: u64,
}

/// Memory of the table for welding coincident vertices, bytes per vertex.
pub(crate) const WELD_BYTES: u64 = 36;

impl MemoryError {
    /// Checks that memory suffices. `needed`, `limit`: bytes.
    ///
    /// # Errors
    /// [`MemoryError`] if `needed` is more than `limit`.
    pub fn check(needed: u64, limit: u64) -> Result<(), Self> {
        if needed > limit { Err(Self { needed, limit }) } else { Ok(()) }
    }
}
