//! When a solve is done, and what it reports: one rule and one report for every solver and back end.
//!
//! Delta is what the rule looks at. Jacobi: Eq. 2, the average change of a cell in a sweep. Multigrid and conjugate gradients:
//! the error that is expected to remain, root mean square over cells, so that there tau bounds the error itself.

/// When a solve is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopRule {
    /// Done once delta is not above it. Dimensionless, as weights are.
    pub tolerance: f64,
    /// Largest number of iterations: sweeps, V-cycles, or steps of conjugate gradients.
    pub max_iterations: u32,
}

/// Most V-cycles, alone or as preconditioner, of a batch: halving 60 times is beyond f32.
pub const MAX_CYCLES: u32 = 60;

impl StopRule {
    /// The rule for a solver by V-cycles: see [`MAX_CYCLES`].
    #[must_use]
    pub fn of_cycles(self) -> Self {
        Self { max_iterations: self.max_iterations.min(MAX_CYCLES), ..self }
    }

    /// The rule for one of `n_batches` that are solved one by one. Deltas add up in squares: each may keep its share.
    #[must_use]
    pub fn of_batch(self, n_batches: usize) -> Self {
        Self { tolerance: self.tolerance / (n_batches.max(1) as f64).sqrt(), ..self }
    }
}

/// How a solve went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolveReport {
    /// Delta after each iteration.
    pub deltas: Vec<f64>,
    /// Root mean square residual before each iteration; empty for Jacobi.
    pub residuals: Vec<f64>,
    /// Whether delta met the tolerance, or f32 has no more digits to give.
    pub converged: bool,
    /// Whether it was f32 that ended it, above the tolerance.
    pub at_round_off: bool,
    /// Whether V-cycles converged slowly or diverged, so that conjugate gradients took over.
    pub stalled: bool,
}

/// Below this delta f32 may have no more digits to give: what is left of changes is rounding (3e-8 to 1e-7 on a C-shaped
/// cage, g = 16 to 40).
pub const ROUND_OFF: f64 = 1e-6;

impl SolveReport {
    /// Takes down an iteration. Returns whether it was the last.
    pub fn iteration_done(&mut self, rule: &StopRule, delta: f64, residual: Option<f64>) -> bool {
        self.deltas.push(delta);
        self.residuals.extend(residual);
        self.converged = delta <= rule.tolerance;
        self.converged || self.deltas.len() >= rule.max_iterations as usize
    }

    /// Ends the solve as converged if none of the latest `n` deltas is below all before, near [`ROUND_OFF`]. Returns whether
    /// it did.
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

    /// The report of batches that were solved one by one, as if together: deltas and residuals add up in squares.
    #[must_use]
    pub fn together(batches: &[Self]) -> Self {
        let history = |of: fn(&Self) -> &[f64]| -> Vec<f64> {
            let longest = batches.iter().map(|r| of(r).len()).max().unwrap_or(0);
            // A batch that was done earlier keeps what its last iteration left.
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
    fn batches_add_up_in_squares_and_the_finished_keep_their_last() {
        let rule = StopRule { tolerance: 5.0, max_iterations: 9 };
        // sqrt(3^2 + 4^2) = 5: two batches at their shares are together at the tolerance.
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
