//! What a V-cycle is expected to leave of the error, the same on every back end.

use crate::solve::stop::{ROUND_OFF, SolveReport, StopRule};

/// What a V-cycle leaves of the error, at worst: 0.03 to 0.10 measured, on the Armadillo and on boxes.
const CONTRACTION: f64 = 0.12;

/// Below [`ROUND_OFF`], cycles that no longer make the correction this many times smaller only move rounding about, and a
/// tau that asks for more is never met.
const STALLED: f64 = 0.5;

/// Cycles that leave more than this share of the error are slower than conjugate gradients that they precondition.
const SLOW: f64 = 0.5;

/// Cycles before contraction is judged by [`SLOW`].
const CYCLES_TO_JUDGE: usize = 4;

/// Largest contraction that is believed when the remaining error is extrapolated.
const SLOWEST: f64 = 0.99;

/// See [`STALLED`]: one such cycle may be chance.
const MAX_STALLED: u32 = 2;

/// A batch's way to convergence.
#[derive(Clone, Debug)]
pub struct Convergence {
    rule: StopRule,
    report: SolveReport,
    /// Norm of the latest coarse correction.
    correction: f64,
    /// Latest correction over the one before.
    ratio: f64,
    /// Cycles in a row that only moved rounding about.
    stalled: u32,
}

impl Convergence {
    /// Before the first cycle.
    #[must_use]
    pub fn new(rule: StopRule) -> Self {
        let report = SolveReport::default();
        let rule = rule.of_cycles();
        Self { rule, report, correction: f64::INFINITY, ratio: CONTRACTION, stalled: 0 }
    }

    /// Takes down a cycle by the mean squares of its coarse correction and of its residual, over cells. True if it was the
    /// last: the stop rule holds for the error that its contraction lets expect, or f32 has no more digits.
    pub fn cycle_done(&mut self, correction_square: f64, residual_square: f64) -> bool {
        let correction = correction_square.sqrt();
        let ratio = correction / self.correction;
        // A correction is the error before the cycle less the error after it: `1 - ratio` of the former.
        let ahead = ratio.min(SLOWEST);
        let extrapolated =
            if correction < ROUND_OFF { ratio.min(1.0) } else { (1.0 - CONTRACTION) * ahead / (1.0 - ahead) };
        // No weight is off by more than 1.
        let delta = (extrapolated.max(CONTRACTION) * correction).min(1.0);
        let done = self.report.iteration_done(&self.rule, delta, Some(residual_square.sqrt()));
        let stalls = correction < ROUND_OFF && correction > STALLED * self.correction;
        self.stalled = if stalls { self.stalled + 1 } else { 0 };
        // The first one has none before it.
        self.ratio = if ratio > 0.0 { ratio } else { self.ratio };
        self.correction = correction;
        if !done && self.stalled == MAX_STALLED {
            (self.report.converged, self.report.at_round_off) = (true, true);
        }
        done || self.report.at_round_off
    }

    /// Whether conjugate gradients should take over.
    #[must_use]
    pub fn stalls(&self) -> bool {
        let is_judged = self.report.deltas.len() >= CYCLES_TO_JUDGE && self.correction > ROUND_OFF;
        is_judged && self.ratio > SLOW && !self.report.converged
    }

    /// Whether the next cycle is expected to meet the tolerance with this factor to spare.
    #[must_use]
    pub fn is_nearly_done(&self, spare: f64) -> bool {
        spare * self.ratio * self.latest().1 <= self.rule.tolerance
    }

    /// Number and delta of the latest cycle.
    #[must_use]
    pub fn latest(&self) -> (u32, f64) {
        self.report.latest()
    }

    /// The report.
    #[must_use]
    pub fn into_report(self) -> SolveReport {
        SolveReport { stalled: self.stalls(), ..self.report }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_that_only_move_rounding_about_end_the_solve() {
        let mut convergence = Convergence::new(StopRule { tolerance: 0.0, max_iterations: 99 });
        let last = (1..99).find(|_| convergence.cycle_done(1e-7_f64.powi(2), 0.0));
        assert_eq!(last, Some(3));
        let report = convergence.into_report();
        assert!(report.converged && report.at_round_off);
    }

    /// Corrections that fall by 0.8 a cycle sum up to four times the latest: 0.8 + 0.64 + ... = 0.8 / (1 - 0.8). Conjugate
    /// gradients should take over then, but not at a contraction of 0.4.
    #[test]
    fn slow_cycles_are_seen_and_their_remainder_is_extrapolated() {
        for (contraction, stalls) in [(0.8, true), (1.5, true), (0.4, false)] {
            let mut convergence = Convergence::new(StopRule { tolerance: 1e-9, max_iterations: 99 });
            for cycle in 0..4 {
                assert!(!convergence.stalls());
                assert!(!convergence.cycle_done(1e-4 * f64::powi(contraction, 2 * cycle), 0.0));
            }
            assert_eq!(convergence.stalls(), stalls);
            let left = 1e-2 * f64::powi(contraction, 4) / (1.0 - contraction);
            let delta = convergence.latest().1;
            // The first cycles' usual contraction, 0.12, is taken off.
            assert!(contraction > 1.0 || (0.88 * left - delta).abs() < 1e-9, "{delta}, not {left}");
        }
    }
}
