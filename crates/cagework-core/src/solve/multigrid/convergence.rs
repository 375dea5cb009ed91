//! Convergence estimate of V-cycles, shared by all back ends.

use crate::solve::stop::{ROUND_OFF, SolveReport, StopRule};

/// Smallest contraction of a V-cycle that error estimates assume, slightly above the 0.03 to 0.10 measured on the
/// Armadillo and on boxes.
const CONTRACTION: f64 = 0.12;

/// Below [`ROUND_OFF`], a cycle makes no progress if its correction exceeds this multiple of the previous correction.
/// The remaining changes are rounding noise, and the tolerance may be unreachable.
const MAX_CORRECTION_RATIO: f64 = 0.5;

/// Contraction above which plain cycles are slower than conjugate gradients preconditioned by cycles.
const MAX_CONTRACTION: f64 = 0.5;

/// Number of cycles before contraction is compared with [`MAX_CONTRACTION`].
const CYCLES_TO_JUDGE: usize = 4;

/// Upper bound on the contraction with which the remaining error is extrapolated.
const CONTRACTION_BOUND: f64 = 0.99;

/// Number of consecutive cycles without progress (see [`MAX_CORRECTION_RATIO`]) that end the solve. A single such cycle
/// may occur by chance.
const MAX_STALLED_CYCLES: u32 = 2;

/// Convergence history of a batch.
#[derive(Clone, Debug)]
pub struct Convergence {
    rule: StopRule,
    report: SolveReport,
    /// Norm of the latest coarse correction.
    correction: f64,
    /// Ratio of the latest correction to the previous one.
    ratio: f64,
    /// Number of consecutive cycles without progress up to the latest one.
    stalled: u32,
}

impl Convergence {
    /// Starts the history of a batch, before its first cycle.
    #[must_use]
    pub fn new(rule: StopRule) -> Self {
        let report = SolveReport::default();
        let rule = rule.of_cycles();
        Self { rule, report, correction: f64::INFINITY, ratio: CONTRACTION, stalled: 0 }
    }

    /// Records a cycle by the mean squared coarse correction and residual over cells. Returns whether it is the last
    /// one: the estimated error meets the stopping rule, or f32 precision is exhausted.
    pub fn cycle_done(&mut self, correction_square: f64, residual_square: f64) -> bool {
        let correction = correction_square.sqrt();
        let ratio = correction / self.correction;
        // The correction is the error before the cycle minus the error after it: a fraction `1 - ratio` of the error
        // before.
        let ahead = ratio.min(CONTRACTION_BOUND);
        let extrapolated =
            if correction < ROUND_OFF { ratio.min(1.0) } else { (1.0 - CONTRACTION) * ahead / (1.0 - ahead) };
        // Weights lie between 0 and 1, so no error exceeds 1.
        let delta = (extrapolated.max(CONTRACTION) * correction).min(1.0);
        let done = self.report.iteration_done(&self.rule, delta, Some(residual_square.sqrt()));
        let stalls = correction < ROUND_OFF && correction > MAX_CORRECTION_RATIO * self.correction;
        self.stalled = if stalls { self.stalled + 1 } else { 0 };
        // The first cycle has no previous correction.
        self.ratio = if ratio > 0.0 { ratio } else { self.ratio };
        self.correction = correction;
        if !done && self.stalled == MAX_STALLED_CYCLES {
            (self.report.converged, self.report.at_round_off) = (true, true);
        }
        done || self.report.at_round_off
    }

    /// Whether conjugate gradients should continue the solve.
    #[must_use]
    pub fn stalls(&self) -> bool {
        let is_judged = self.report.deltas.len() >= CYCLES_TO_JUDGE && self.correction > ROUND_OFF;
        is_judged && self.ratio > MAX_CONTRACTION && !self.report.converged
    }

    /// Whether delta is predicted to be a factor `spare` below tolerance after the next cycle.
    #[must_use]
    pub fn is_nearly_done(&self, spare: f64) -> bool {
        spare * self.ratio * self.latest().1 <= self.rule.tolerance
    }

    /// Number and delta of the latest cycle.
    #[must_use]
    pub fn latest(&self) -> (u32, f64) {
        self.report.latest()
    }

    /// Ends the history and returns the report, with `stalled` set if conjugate gradients should continue the solve.
    #[must_use]
    pub fn into_report(self) -> SolveReport {
        SolveReport { stalled: self.stalls(), ..self.report }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_without_progress_end_the_solve() {
        let mut convergence = Convergence::new(StopRule { tolerance: 0.0, max_iterations: 99 });
        let last = (1..99).find(|_| convergence.cycle_done(1e-7_f64.powi(2), 0.0));
        assert_eq!(last, Some(3));
        let report = convergence.into_report();
        assert!(report.converged && report.at_round_off);
    }

    /// If corrections decrease by a factor of 0.8 per cycle, the remaining ones sum to 0.8 / (1 - 0.8) = 4 times the
    /// latest. Conjugate gradients should then continue the solve, but not at a contraction of 0.4.
    #[test]
    fn slow_cycles_are_detected_and_their_remaining_error_extrapolated() {
        for (contraction, stalls) in [(0.8, true), (1.5, true), (0.4, false)] {
            let mut convergence = Convergence::new(StopRule { tolerance: 1e-9, max_iterations: 99 });
            for cycle in 0..4 {
                assert!(!convergence.stalls());
                assert!(!convergence.cycle_done(1e-4 * f64::powi(contraction, 2 * cycle), 0.0));
            }
            assert_eq!(convergence.stalls(), stalls);
            let left = 1e-2 * f64::powi(contraction, 4) / (1.0 - contraction);
            let delta = convergence.latest().1;
            // `delta` is 1 - `CONTRACTION` = 0.88 times `left`, the sum of the remaining corrections. If the cycles
            // diverge, that sum is infinite.
            assert!(contraction > 1.0 || (0.88 * left - delta).abs() < 1e-9, "{delta}, not {left}");
        }
    }
}
