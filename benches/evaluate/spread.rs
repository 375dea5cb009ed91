//! Ranges of repeated time measurements, and comparisons of such ranges.

/// Shortest and longest of repeated time measurements, and their number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spread {
    pub(super) n: u32,
    pub(super) min: f64,
    pub(super) max: f64,
}

/// Result of comparing the times of one implementation with those of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Comparison {
    /// All times of the first implementation are shorter than those of the other one, by a factor between `least` and
    /// `most`.
    Faster { least: f64, most: f64 },
    /// All times of the first implementation are longer than those of the other one.
    Slower,
    /// The two ranges overlap.
    WithinSpread,
    /// One of the ranges has fewer than two measurements.
    Unknown,
}

impl Spread {
    /// Returns the range of `values`; `None` if there are no values.
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        values.fold(None, |spread, value| {
            let Self { n, min, max } = spread.unwrap_or(Self { n: 0, min: value, max: value });
            Some(Self { n: n + 1, min: min.min(value), max: max.max(value) })
        })
    }

    /// Compares this range of times with another.
    pub(super) fn against(self, other: Self) -> Comparison {
        if self.n < 2 || other.n < 2 {
            Comparison::Unknown
        } else if self.max < other.min {
            Comparison::Faster { least: other.min / self.max, most: other.max / self.min }
        } else if self.min > other.max {
            Comparison::Slower
        } else {
            Comparison::WithinSpread
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Comparison, Spread};

    fn spread(values: &[f64]) -> Spread {
        Spread::of(values.iter().copied()).expect("there are values")
    }

    #[test]
    fn disjoint_ranges_are_faster_or_slower_and_overlapping_ones_neither() {
        let fast = spread(&[12.0, 10.0, 11.0]);
        let slow = spread(&[30.0, 24.0]);
        assert_eq!(fast.against(slow), Comparison::Faster { least: 2.0, most: 3.0 });
        assert_eq!(slow.against(fast), Comparison::Slower);
        assert_eq!(fast.against(spread(&[9.0, 10.5])), Comparison::WithinSpread);
        assert_eq!(fast.against(spread(&[12.0, 13.0])), Comparison::WithinSpread, "common end point");
    }

    #[test]
    fn comparison_with_a_single_measurement_is_unknown() {
        assert_eq!(spread(&[1.0]).against(spread(&[1e6, 2e6])), Comparison::Unknown);
        assert_eq!(spread(&[1e6, 2e6]).against(spread(&[1.0])), Comparison::Unknown);
        assert_eq!(Spread::of(std::iter::empty()), None);
    }
}
