//! Memory limits, checked before allocation: a small file can declare huge arrays.

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

const MIB: u64 = 1 << 20;

/// Memory of the table for welding coincident vertices, bytes per vertex.
pub(crate) const WELD_BYTES: u64 = 36;

/// Limits on the size of the contents of a compressed file, so that a small file does not take much memory.
#[derive(Clone, Copy)]
pub(crate) struct Expansion {
    /// Size up to which every file may be unpacked, bytes.
    least: u64,
    /// Larger contents may have at most this many times the size of the compressed file.
    ratio: u64,
}

impl Expansion {
    /// Text and arrays. Compression typically shrinks the XML of models to 1/10 of its size.
    pub(crate) const TEXT: Self = Self { least: 64 * MIB, ratio: 100 };
    /// Splats. Compression typically shrinks them to 1/2 of their size, and a byte takes up to 22 bytes of memory while a
    /// cage is generated.
    pub(crate) const SPLATS: Self = Self { least: 32 * MIB, ratio: 16 };

    /// Checks the size of the contents before they are unpacked.
    ///
    /// # Errors
    /// A message for the user, if the contents exceed both limits.
    pub(crate) fn check(self, unpacked: u64, file: u64) -> Result<(), String> {
        if unpacked <= self.least.max(file.saturating_mul(self.ratio)) {
            return Ok(());
        }
        Err(format!(
            "its {file} bytes unpack to {unpacked}, more than the limit of {} MiB or {} times its size: save it again",
            self.least / MIB,
            self.ratio
        ))
    }
}

impl MemoryError {
    /// Checks that memory suffices. `needed`, `limit`: bytes.
    ///
    /// # Errors
    /// [`MemoryError`] if `needed` is more than `limit`.
    pub fn check(needed: u64, limit: u64) -> Result<(), Self> {
        if needed > limit { Err(Self { needed, limit }) } else { Ok(()) }
    }
}
