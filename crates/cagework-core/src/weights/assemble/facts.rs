//! What is found out about each row of weights that is stored, and all rows together.

use crate::report::{RestError, WeightStats};
use crate::solve::rows::{LANES, Row, ZERO};

use super::Assembled;

/// What was found out about a row of weights.
#[derive(Clone, Copy, Debug)]
pub struct RowFacts {
    /// Distance between `sum w c` and the vertex over the cage's diagonal; none for vertices outside.
    pub error: Option<f32>,
    /// How far its sum is from 1.
    pub sum_error: f32,
    /// Its smallest weight that is not 0.
    pub low: f32,
    /// Its largest weight.
    pub high: f32,
}

impl RowFacts {
    /// Facts about a row (`[n_batches]`) with this sum, which misses the vertex by so much.
    // One copy for all callers in wasm: each would be downloaded.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[must_use]
    pub fn of(row: &[Row], sum: f64, miss: Option<f64>) -> Self {
        // Comparisons, not `min` and `max`: wasm has no instruction for theirs, which say what becomes of NaN.
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
        Self { error: miss.map(|miss| miss as f32), sum_error: (sum - 1.0).abs() as f32, low, high }
    }
}

impl Assembled {
    /// How well the rest pose is reconstructed by vertices inside a cage of this diagonal, and what the weights are like.
    #[must_use]
    pub fn statistics(&self, diagonal: f64) -> (RestError, WeightStats) {
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
        (rest_error, weights)
    }
}
