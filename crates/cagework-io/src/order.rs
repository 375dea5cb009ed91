//! Orders and permits: nothing is decoded before its price is known.
//!
//! A reader parses headers into an [`Order`], the description of what a decoder would produce. [`Budget::permit`]
//! compares the order's price with the limits and turns it into a [`Permit`]. Decoders take permits, and only a budget
//! creates them, so a decoder that runs unpriced does not compile.

use std::fmt;
use std::io::Read;
use std::ops::Deref;

use thiserror::Error;

use crate::memory::MemoryError;

const MIB: u64 = 1 << 20;

/// What a decoder would produce, as headers declare it.
pub(crate) trait Order {
    fn price(&self) -> Price;
}

/// What an order costs.
#[derive(Default)]
pub(crate) struct Price {
    /// Counted items: name, number and limit.
    pub(crate) counts: Vec<(&'static str, u64, u64)>,
    /// Bytes that compressed streams unpack to.
    pub(crate) unpacked: u64,
    /// Memory of the decoded values and of their decoder, bytes. It stays reserved until the file is read.
    pub(crate) bytes: u64,
}

/// An order that was priced and fits the limits.
#[derive(Clone, Debug)]
pub(crate) struct Permit<T>(T);

impl<T: Default> Permit<T> {
    /// The permit of a document that this program made from a priced one.
    pub(crate) fn of_own_document() -> Self {
        Self(T::default())
    }
}

impl<T> Deref for Permit<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

/// A number of bytes that a stream unpacks to.
pub(crate) struct Stream {
    /// Size of the contents, bytes.
    pub(crate) unpacked: u64,
    /// Memory per byte of the contents, bytes.
    pub(crate) copies: u64,
}

impl Order for Stream {
    fn price(&self) -> Price {
        let bytes = self.unpacked.saturating_mul(self.copies);
        Price { unpacked: self.unpacked, bytes, ..Price::default() }
    }
}

impl Permit<Stream> {
    /// Unpacks the contents, and one byte more if the stream is longer than its order.
    pub(crate) fn unpack(&self, from: impl Read) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        from.take(self.unpacked.saturating_add(1)).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

/// Limits on the size of the contents of a compressed file, so that a small file does not take much memory.
#[derive(Clone, Copy)]
pub(crate) struct Expansion {
    /// Size up to which every file may be unpacked, bytes.
    least: u64,
    /// Larger contents may have at most this many times the size of the compressed file.
    ratio: u64,
    /// Limit for all files, bytes.
    most: u64,
}

impl Expansion {
    /// Text and arrays. Compression typically shrinks the XML of models to 1/10 of its size.
    pub(crate) const TEXT: Self = Self { least: 64 * MIB, ratio: 100, most: u64::MAX };
    /// Splats. Compression typically shrinks them to 1/2 of their size, and a byte takes up to 22 bytes of memory while a
    /// cage is generated.
    pub(crate) const SPLATS: Self = Self { least: 10 * MIB, ratio: 16, most: u64::MAX };
    /// Draco and meshopt, which typically shrink geometry to 1/10 of its size.
    pub(crate) const GEOMETRY: Self = Self { least: 256 * MIB, ratio: 100, most: 1024 * MIB };

    /// Size that the contents of a file of `file` bytes may have, bytes.
    fn limit(self, file: u64) -> u64 {
        self.least.max(file.saturating_mul(self.ratio)).min(self.most)
    }
}

impl fmt::Display for Expansion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} MiB or {} times its size", self.least / MIB, self.ratio)?;
        if self.most < u64::MAX {
            write!(f, ", and of {} MiB for all files", self.most / MIB)
        } else {
            Ok(())
        }
    }
}

/// Why an order is refused.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(crate) enum Refusal {
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// A file unpacks to too many bytes.
    #[error("{0}")]
    Unpacked(String),
    /// There are more items than the limit.
    #[error("it has {count} {what}, more than the limit of {limit}")]
    Count { what: &'static str, count: u64, limit: u64 },
}

/// Memory and streams of one file while it is read.
#[derive(Clone, Copy)]
pub(crate) struct Budget {
    /// Limit on the memory, bytes.
    limit: u64,
    /// Memory in use, and reserved for the orders so far, bytes.
    held: u64,
    /// Size of the compressed file, bytes.
    file: u64,
    /// Bytes that the streams of the orders so far unpack to.
    unpacked: u64,
    expansion: Expansion,
}

impl Budget {
    /// A budget for a file of `file` bytes. `held`: memory in use, bytes; `limit`: limit on this memory and that of all
    /// orders, bytes.
    pub(crate) fn new(file: u64, held: u64, limit: u64, expansion: Expansion) -> Self {
        Self { limit, held, file, unpacked: 0, expansion }
    }

    /// Memory in use, and reserved for the orders so far, bytes.
    pub(crate) fn held(&self) -> u64 {
        self.held
    }

    /// Bytes that further streams may unpack to. Headers of some formats do not declare all sizes.
    pub(crate) fn left(&self) -> u64 {
        let unpacked = self.expansion.limit(self.file).saturating_sub(self.unpacked);
        unpacked.min(self.limit.saturating_sub(self.held))
    }

    /// Prices an order and reserves its memory.
    ///
    /// # Errors
    /// [`Refusal`] if the order exceeds a limit.
    pub(crate) fn permit<T: Order>(&mut self, order: T) -> Result<Permit<T>, Refusal> {
        let Price { counts, unpacked, bytes } = order.price();
        if let Some(&(what, count, limit)) = counts.iter().find(|(_, count, limit)| count > limit) {
            return Err(Refusal::Count { what, count, limit });
        }
        self.unpacked = self.unpacked.saturating_add(unpacked);
        self.held = self.held.saturating_add(bytes);
        if self.unpacked > self.expansion.limit(self.file) {
            return Err(Refusal::Unpacked(format!(
                "its {} bytes unpack to {}, more than the limit of {}: save it again",
                self.file, self.unpacked, self.expansion
            )));
        }
        MemoryError::check(self.held, self.limit)?;
        Ok(Permit(order))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: u64 = 1 << 40;

    #[derive(Debug)]
    struct Items(u64);

    impl Order for Items {
        fn price(&self) -> Price {
            Price { counts: vec![("items", self.0, 10)], bytes: self.0, unpacked: 0 }
        }
    }

    #[test]
    fn orders_are_refused_by_their_sum() {
        let mut budget = Budget::new(0, 100, 112, Expansion::TEXT);
        assert_eq!(
            budget.permit(Items(11)).unwrap_err().to_string(),
            "it has 11 items, more than the limit of 10"
        );
        assert!(budget.permit(Items(8)).is_ok());
        assert_eq!(budget.held(), 108);
        assert_eq!(budget.permit(Items(5)).err(), Some(MemoryError { needed: 113, limit: 112 }.into()));
    }

    #[test]
    fn streams_of_small_files_unpack_to_a_fixed_size_and_of_all_files_to_the_most() {
        let refused = |file: u64, sizes: &[u64]| {
            let mut budget = Budget::new(file, file, LIMIT, Expansion::GEOMETRY);
            let mut permits = sizes.iter().map(|&unpacked| budget.permit(Stream { unpacked, copies: 1 }));
            permits.try_for_each(|permit| permit.map(|_| ()))
        };
        assert_eq!(refused(1000, &[200 * MIB, 56 * MIB]), Ok(()));
        assert_eq!(refused(100 * MIB, &[1024 * MIB]), Ok(()));
        for (file, sizes) in [(1000, &[200 * MIB, 57 * MIB][..]), (100 * MIB, &[1025 * MIB])] {
            let message = refused(file, sizes).unwrap_err().to_string();
            let limit = "more than the limit of 256 MiB or 100 times its size, and of 1024 MiB for all files: save it again";
            assert!(message.ends_with(limit), "{message}");
        }
    }

    #[test]
    fn longer_streams_are_cut_off_one_byte_after_their_order() {
        let mut budget = Budget::new(0, 0, LIMIT, Expansion::TEXT);
        let permit = budget.permit(Stream { unpacked: 5, copies: 2 }).unwrap();
        assert_eq!(permit.unpack(&[7; 100][..]).unwrap(), [7; 6]);
    }
}
