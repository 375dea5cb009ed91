//! When a batch of columns is done, the same on every back end; corrections, on the CPU, ask for more.

/// What a cycle leaves of the error, at worst: 0.03 to 0.10 measured, on the Armadillo and on boxes.
const CONTRACTION: f64 = 0.12;

/// Below this correction, cycles that no longer make it [`STALLED`] times smaller move rounding about: f32 has no more digits
/// to give (3e-8 to 1e-7 on a C at g = 16 to 40), and a tau that asks for them is never met.
const ROUND_OFF: f64 = 1e-6;

/// See [`ROUND_OFF`].
const STALLED: f64 = 0.5;

/// See [`ROUND_OFF`]: one such cycle may be chance.
const MAX_STALLED: u32 = 2;

/// How one batch converged.
#[derive(Clone, Debug, Default)]
pub struct BatchReport {
    /// For each V-cycle on the finest level, the square of the error that it is expected to leave: Eq. 2's norm of the
    /// coarse correction for this batch's columns, root-mean-squared over coarse cells, times the contraction.
    pub delta_squares: Vec<f64>,
    /// For each V-cycle, the sum of squared residuals divided by the number of unknowns.
    pub residual_squares: Vec<f64>,
    /// Error that the last cycle is expected to leave in the cell with the largest; 0 if nobody asked.
    pub largest: f64,
    /// Whether the error is expected to be below the threshold. It never is below f32's round-off, where cycles end.
    pub converged: bool,
}

/// When a batch is done.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// Threshold for the batch's share of the error's norm, a mean over cells.
    pub tolerance: f64,
    /// The same for the cell with the largest; infinite if only the mean counts.
    pub in_any_cell: f64,
    /// A last cycle that leaves no more than this, as a mean, has had little to do: half a sweep follows, and others
    /// around right-hand sides only.
    pub little: f64,
    /// What a cycle leaves of the error, at worst.
    pub contraction: f64,
    /// Largest number of V-cycles on the finest level.
    pub max_cycles: u32,
}

impl BatchReport {
    /// Whether the last coarse correction was so small that only cells around the right-hand sides need a sweep after it.
    pub(super) fn leaves_little(&self, stop: &Stop) -> bool {
        self.delta_squares.last().is_some_and(|square| square.sqrt() <= stop.little)
    }
}

impl Stop {
    /// By the mean over cells.
    #[must_use]
    pub fn new(tolerance: f64, max_cycles: u32) -> Self {
        Self { tolerance, in_any_cell: f64::INFINITY, little: 0.0, contraction: CONTRACTION, max_cycles }
    }
}

/// A batch's way to convergence: the stop rule, the same on every back end.
#[derive(Clone, Debug)]
pub struct Convergence {
    stop: Stop,
    report: BatchReport,
    /// Norm of the latest coarse correction.
    correction: f64,
    delta: f64,
    /// Latest correction over the one before.
    ratio: f64,
    /// Cycles in a row that only moved rounding about.
    stalled: u32,
}

impl Convergence {
    /// Before the first cycle.
    #[must_use]
    pub fn new(stop: Stop) -> Self {
        let report = BatchReport { largest: f64::INFINITY, ..BatchReport::default() };
        Self {
            stop,
            report,
            correction: f64::INFINITY,
            delta: f64::INFINITY,
            ratio: stop.contraction,
            stalled: 0,
        }
    }

    /// Takes down a cycle by the squared norm of its coarse correction, as a mean over cells and in the cell with the largest (0
    /// if nobody asks), and its mean squared residual; true when it was the last: the error that its contraction lets
    /// expect is below the thresholds, the limit is reached, or f32 has no more digits.
    pub fn cycle_done(&mut self, correction_square: f64, largest_square: f64, residual_square: f64) -> bool {
        let correction = correction_square.sqrt();
        let ratio = correction / self.correction;
        let contraction = ratio.clamp(self.stop.contraction, 1.0);
        let (delta, largest) = (contraction * correction, contraction * largest_square.sqrt());
        self.report.delta_squares.push(delta * delta);
        self.report.residual_squares.push(residual_square);
        self.report.converged = delta <= self.stop.tolerance && largest <= self.stop.in_any_cell;
        let stalls = correction < ROUND_OFF
            && correction > STALLED * self.correction
            && largest >= STALLED * self.report.largest;
        self.stalled = if stalls { self.stalled + 1 } else { 0 };
        // The first one has none before it.
        self.ratio = if ratio > 0.0 { ratio } else { self.ratio };
        (self.correction, self.delta, self.report.largest) = (correction, delta, largest);
        self.report.converged
            || self.stalled == MAX_STALLED
            || self.report.delta_squares.len() >= self.stop.max_cycles as usize
    }

    /// Whether the next cycle is expected to be the last, with so much to spare.
    #[must_use]
    pub fn is_nearly_done(&self, spare: f64) -> bool {
        let expected = spare * self.ratio;
        expected * self.delta <= self.stop.tolerance
            && expected * self.report.largest <= self.stop.in_any_cell
    }

    /// Number and delta of the latest cycle.
    #[must_use]
    pub fn latest(&self) -> (u32, f64) {
        (self.report.delta_squares.len() as u32, self.delta)
    }

    /// The report.
    #[must_use]
    pub fn into_report(self) -> BatchReport {
        self.report
    }
}

/// Delta and residual of all batches together after each cycle: batches add up in squares.
#[must_use]
pub fn histories(reports: &[&BatchReport]) -> [Vec<f32>; 2] {
    let history = |of: fn(&BatchReport) -> &[f64]| -> Vec<f32> {
        let longest = reports.iter().map(|r| of(r).len()).max().unwrap_or(0);
        // A batch that was done earlier keeps what its last cycle left.
        let at = |r: &&BatchReport, k: usize| of(r).get(k).or(of(r).last()).copied();
        (0..longest).map(|k| reports.iter().filter_map(|r| at(r, k)).sum::<f64>().sqrt() as f32).collect()
    };
    [history(|r| &r.delta_squares), history(|r| &r.residual_squares)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mean below its tolerance is not enough while some cell is above its own.
    #[test]
    fn the_cell_with_the_most_counts_too() {
        let stop = Stop { in_any_cell: 1e-4, ..Stop::new(1e-5, 9) };
        let mut both = Convergence::new(stop);
        let mut mean = Convergence::new(Stop::new(1e-5, 9));
        // Corrections, of which a contraction of 0.12 leaves 1.2e-6 on average and 1.2e-3 in one cell.
        assert!(mean.cycle_done(1e-5_f64.powi(2), 1e-2_f64.powi(2), 0.0));
        assert!(!both.cycle_done(1e-5_f64.powi(2), 1e-2_f64.powi(2), 0.0));
        assert!(!both.is_nearly_done(1.0));
        assert!(!both.cycle_done(1e-6_f64.powi(2), 1e-3_f64.powi(2), 0.0));
        assert!(both.is_nearly_done(1.0));
        assert!(both.cycle_done(1e-7_f64.powi(2), 1e-4_f64.powi(2), 0.0));
        assert!(both.into_report().converged);
    }

    /// Rounding ends a solve only where no cell gains anything from another cycle.
    #[test]
    fn cycles_that_move_rounding_about_are_the_last() {
        let stop = Stop { in_any_cell: 0.0, ..Stop::new(0.0, 99) };
        let n_cycles = |largest: &dyn Fn(i32) -> f64| {
            let mut convergence = Convergence::new(stop);
            (1..99).find(|&k| convergence.cycle_done(1e-7_f64.powi(2), largest(k).powi(2), 0.0)).unwrap()
        };
        assert_eq!(n_cycles(&|_| 1e-6), 3);
        let falls_until_the_tenth = |k: i32| if k < 10 { 0.1_f64.powi(k) } else { 1e-10 };
        assert!(n_cycles(&falls_until_the_tenth) > 10);
    }
}
