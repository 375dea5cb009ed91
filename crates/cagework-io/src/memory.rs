//! Memory limits, checked before allocation: a small file can declare huge arrays.

use thiserror::Error;

/// A file needs more memory than the limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "it needs about {} MiB of memory, more than the limit of {} MiB: use a smaller model or raise the limit",
    needed.div_ceil(MIB),
    limit.div_ceil(MIB)
)]
pub struct MemoryError {
    /// Bytes needed.
    pub needed: u64,
    /// Limit in bytes.
    pub limit: u64,
}

const MIB: u64 = 1 << 20;

impl MemoryError {
    /// Checks that memory suffices. `needed`, `limit`: bytes.
    ///
    /// # Errors
    /// [`MemoryError`] if `needed` is more than `limit`.
    pub fn check(needed: u64, limit: u64) -> Result<(), Self> {
        if needed > limit { Err(Self { needed, limit }) } else { Ok(()) }
    }
}
