//! What models take, counted before it is allocated: a few bytes of a file may ask for anything.

use thiserror::Error;

/// More memory would be needed than is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "it needs about {} MiB of memory, more than the limit of {} MiB: use a smaller model or raise the limit",
    needed.div_ceil(MIB),
    limit.div_ceil(MIB)
)]
pub struct MemoryError {
    /// Bytes needed.
    pub needed: u64,
    /// Bytes allowed.
    pub limit: u64,
}

const MIB: u64 = 1 << 20;

impl MemoryError {
    /// # Errors
    /// [`MemoryError`] if `needed` is more than `limit`.
    pub fn check(needed: u64, limit: u64) -> Result<(), Self> {
        if needed > limit { Err(Self { needed, limit }) } else { Ok(()) }
    }
}
