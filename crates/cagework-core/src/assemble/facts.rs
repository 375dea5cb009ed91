//! Statistics of stored rows of weights.

use crate::report::{MeanMax, RawError, RestError, WeightStats};
use crate::solve::rows::{LANES, Row, ZERO};

use super::AssembledWeights;
use super::affine::Sums;

/// Statistics of one row of weights.
#[derive(Clone, Copy, Debug)]
pub struct RowFacts {
    /// Distance of `sum w c` from the vertex, as a fraction of the cage's diagonal; `None` for a row whose offset is
    /// not known yet.
    pub error: Option<f32>,
    /// Distance of the row's sum from 1.
    pub sum_error: f32,
    /// Smallest non-zero weight of the row.
    pub low: f32,
    /// Largest weight of the row.
    pub high: f32,
    /// Statistics of the sampled row before any correction; `None` if an offset compensates the row's error.
    pub raw: Option<RawRow>,
}

/// Statistics of a sampled row before correction.
#[derive(Clone, Copy, Debug)]
pub struct RawRow {
    /// Sum of the row's weights, and distance of `sum w c` from the vertex.
    pub sums: Sums,
    /// Smallest value of the row, before negative values are clamped to 0.
    pub lowest: f32,
}

impl RowFacts {
    /// Computes the statistics of a row (`[n_batches]`) with the given `sums`. `raw`: as in [`Self::raw`].
    // wasm keeps one copy for all callers to save download size.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[must_use]
    pub fn from_row(row: &[Row], sums: Sums, raw: Option<RawRow>) -> Self {
        // Comparisons instead of `min` and `max`, whose NaN handling has no single wasm instruction.
        let (mut lows, mut highs) = ([f32::INFINITY; LANES], ZERO);
        for row in row {
            for k in 0..LANES {
                let stored = if row[k] != 0.0 { row[k] } else { f32::INFINITY };
                lows[k] = if stored < lows[k] { stored } else { lows[k] };
                highs[k] = if row[k] > highs[k] { row[k] } else { highs[k] };
            }
        }
        let (mut low, mut high) = (lows[0], highs[0]);
        for k in 1..LANES {
            low = if lows[k] < low { lows[k] } else { low };
            high = if highs[k] > high { highs[k] } else { high };
        }
        let sum_error = (sums.sum - 1.0).abs() as f32;
        Self { error: raw.map(|_| sums.miss as f32), sum_error, low, high, raw }
    }
}

impl AssembledWeights {
    /// Computes the rest error after correction, the error before correction of the rows without offsets (`None` if all
    /// rows have offsets), and statistics of the weights. `diagonal`: diagonal of the cage, object units.
    #[must_use]
    pub fn statistics(&self, diagonal: f64) -> (RestError, Option<RawError>, WeightStats) {
        let mut errors: Vec<f32> = self.facts.iter().filter_map(|facts| facts.error).collect();
        let mut rest_error = RestError::default();
        if !errors.is_empty() {
            rest_error.mean_rel = errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64;
            rest_error.max_rel = errors.iter().fold(0.0, |m, &e| m.max(f64::from(e)));
            let rank = ((errors.len() as f64 * 0.99).ceil() as usize).clamp(1, errors.len()) - 1;
            rest_error.p99 = diagonal * f64::from(*errors.select_nth_unstable_by(rank, f32::total_cmp).1);
            rest_error.mean = diagonal * rest_error.mean_rel;
            rest_error.max = diagonal * rest_error.max_rel;
        }
        let mut weights =
            WeightStats { nonzeros: self.weights.data().len() as u64, ..WeightStats::default() };
        if weights.nonzeros > 0 {
            let over = |of: fn(&RowFacts) -> f32, pick: fn(f32, f32) -> f32| {
                self.facts.iter().map(of).reduce(pick).unwrap_or_default()
            };
            weights.min = over(|f| f.low, f32::min);
            weights.max = over(|f| f.high, f32::max);
            weights.max_sum_error = f64::from(over(|f| f.sum_error, f32::max));
        }
        let raw = || self.facts.iter().filter_map(|facts| facts.raw);
        let n = raw().count() as f64;
        let mean_max = |of: fn(RawRow) -> f64| MeanMax {
            mean: raw().map(of).sum::<f64>() / n,
            max: raw().map(of).fold(0.0, f64::max),
        };
        let raw_error = raw().map(|r| r.lowest).reduce(f32::min).map(|min_weight| RawError {
            sum: mean_max(|r| (r.sums.sum - 1.0).abs()),
            point_rel: mean_max(|r| r.sums.miss),
            min_weight,
        });
        (rest_error, raw_error, weights)
    }
}
