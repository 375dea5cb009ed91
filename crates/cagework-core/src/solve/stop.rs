//! Stopping rule and report, shared by all solvers and back ends.
//!
//! The rule compares *delta* with a tolerance. Jacobi: delta is the mean change of a cell per sweep (Eq. 2 in
//! K. Smith's paper; `docs/method.md`, sources). Multigrid and conjugate gradients: delta is the estimated remaining
//! error, RMS over cells, so that the tolerance bounds the error itself.

/// Tolerance and limit on iterations at which a solve stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopRule {
    /// The solve has converged if delta is at most this. Dimensionless, like weights.
    pub tolerance: f64,
    /// Limit on iterations: sweeps, V-cycles, or steps of conjugate gradients.
    pub max_iterations: u32,
}

/// Limit on V-cycles of a batch, whether they solve alone or as a preconditioner. Even cycles that only halve the error
/// reach the precision of f32 before this limit.
pub const MAX_CYCLES: u32 = 60;

/// Rough number of decades by which delta falls from the first Jacobi sweep to the tolerance.
const JACOBI_DECADES: f64 = 4.0;

impl StopRule {
    /// Rough share of a Jacobi solve that is complete when a sweep has this delta, for a progress bar; below 0 at the
    /// start of solves that take longer than usual.
    #[must_use]
    pub fn jacobi_progress(&self, delta: f64) -> f32 {
        (1.0 - (delta / self.tolerance).max(1.0).log10() / JACOBI_DECADES) as f32
    }

    /// The rule for V-cycles, limited by [`MAX_CYCLES`].
    #[must_use]
    pub fn of_cycles(self) -> Self {
        Self { max_iterations: self.max_iterations.min(MAX_CYCLES), ..self }
    }

    /// The rule for one of `n_batches` batches. Squares of deltas add up over batches, so each batch gets an equal
    /// share.
    #[must_use]
    pub fn of_batch(self, n_batches: usize) -> Self {
        Self { tolerance: self.tolerance / (n_batches.max(1) as f64).sqrt(), ..self }
    }
}

/// History and outcome of a solve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolveReport {
    /// Delta after each iteration.
    pub deltas: Vec<f64>,
    /// RMS residual before each iteration; empty for Jacobi.
    pub residuals: Vec<f64>,
    /// Whether delta met the tolerance, or f32 precision was exhausted.
    pub converged: bool,
    /// Whether f32 precision ended the solve above the tolerance.
    pub at_round_off: bool,
    /// Whether V-cycles converged slowly or diverged, and conjugate gradients continued.
    pub stalled: bool,
}

/// Delta below which f32 precision may be exhausted. Rounding noise alone causes deltas of 3e-8 to 1e-7 (measured on a
/// C-shaped cage, g = 16 to 40); the threshold is ten times the largest of them.
pub const ROUND_OFF: f64 = 1e-6;

impl SolveReport {
    /// Records an iteration. Returns whether it is the last one.
    pub fn iteration_done(&mut self, rule: &StopRule, delta: f64, residual: Option<f64>) -> bool {
        self.deltas.push(delta);
        self.residuals.extend(residual);
        self.converged = delta <= rule.tolerance;
        self.converged || self.deltas.len() >= rule.max_iterations as usize
    }

    /// Ends the solve as converged if none of the latest `n` deltas is below all earlier ones and delta has been below
    /// [`ROUND_OFF`]. Returns whether it ended the solve.
    pub fn ends_at_round_off(&mut self, n: usize) -> bool {
        let (before, latest) = self.deltas.split_at(self.deltas.len().saturating_sub(n));
        let least = |deltas: &[f64]| deltas.iter().copied().fold(f64::INFINITY, f64::min);
        let best = least(before);
        self.at_round_off = !self.converged && best < ROUND_OFF && least(latest) >= best;
        self.converged |= self.at_round_off;
        self.at_round_off
    }

    /// Number and delta of the latest iteration.
    #[must_use]
    pub fn latest(&self) -> (u32, f64) {
        (self.deltas.len() as u32, self.deltas.last().copied().unwrap_or(f64::INFINITY))
    }

    /// Combines the reports of batches that were solved separately. Squares of deltas and residuals add up.
    #[must_use]
    pub fn together(batches: &[Self]) -> Self {
        let history = |of: fn(&Self) -> &[f64]| -> Vec<f64> {
            let longest = batches.iter().map(|r| of(r).len()).max().unwrap_or(0);
            // A batch that needed fewer iterations counts with its last value.
            let at = |r: &Self, k: usize| of(r).get(k).or(of(r).last()).copied();
            (0..longest)
                .map(|k| batches.iter().filter_map(|r| at(r, k)).map(|x| x * x).sum::<f64>().sqrt())
                .collect()
        };
        Self {
            deltas: history(|r| &r.deltas),
            residuals: history(|r| &r.residuals),
            converged: batches.iter().all(|r| r.converged),
            at_round_off: batches.iter().any(|r| r.at_round_off),
            stalled: batches.iter().any(|r| r.stalled),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solve_ends_at_the_tolerance_or_at_the_limit() {
        let rule = StopRule { tolerance: 1e-3, max_iterations: 3 };
        let mut report = SolveReport::default();
        assert!(!report.iteration_done(&rule, 1e-2, None));
        assert!(report.iteration_done(&rule, 1e-3, None) && report.converged);
        let mut report = SolveReport::default();
        let ends = [1.0, 1.0, 1.0].map(|delta| report.iteration_done(&rule, delta, None));
        assert_eq!((ends, report.converged), ([false, false, true], false));
    }

    #[test]
    fn batches_add_in_squares_and_finished_ones_keep_their_last_value() {
        let rule = StopRule { tolerance: 5.0, max_iterations: 9 };
        // Four batches that each meet a tolerance of 2.5 together meet the tolerance sqrt(4 * 2.5^2) = 5.
        assert_eq!(rule.of_batch(4).tolerance, 2.5);
        let batch = |deltas: &[f64]| SolveReport {
            deltas: deltas.to_vec(),
            residuals: deltas.to_vec(),
            converged: true,
            ..SolveReport::default()
        };
        let all = SolveReport::together(&[batch(&[30.0, 3.0]), batch(&[40.0, 8.0, 4.0])]);
        assert_eq!(all.deltas, [50.0, 73f64.sqrt(), 5.0]);
        assert_eq!(all.residuals, all.deltas);
    }
}
