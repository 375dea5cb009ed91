//! Full multigrid and V(2,1) cycles on one batch of columns.
//!
//! Solves the discrete Laplace equation of the embedded boundary for [`LANES`] right-hand sides at once. Red-black
//! Gauss-Seidel relaxes; coarse levels are discretised anew from the cage. The first black half sweep of a cycle goes
//! `OMEGA` times as far (Yavneh 1996), which costs nothing and makes V(2,1) converge as V(2,2) does without.
//! Measured on the Armadillo, g = 64, root mean square error of a cell's 16 columns: 5.7e-4 after full multigrid, then
//! 3.1e-5, 2.5e-6, 2.3e-7 after each further cycle. The first guess of a level is the mean of the coarse solution, not
//! its trilinear interpolation with zeros outside: the solution is not zero on the cage (7.5e-2 -> 2.9e-2).
//!
//! A smoothing pass is one stream through memory: half sweeps follow each other one z-plane apart, and the residual
//! of the red cells (black ones have none after a black half sweep) trails them.

mod other;

use super::hierarchy::Hierarchy;
use super::rows::{
    LANES, Prolong, Rhs, Row, ZERO, over_relax_plane, prolong_plane, relax_plane, residual_plane,
    restrict_residual,
};
use crate::levels::Level;
use crate::simd::dispatch;
use crate::transfer::Transfer;

/// Over-relaxation of the first black half sweep: 1.1 to 1.3 all lower the error 1.5 to 2 times per cycle (Armadillo).
pub const OMEGA: f32 = 1.2;

/// Sweeps on the coarsest level, which has at most a few hundred unknowns, six or so across.
pub const COARSEST_SWEEPS: usize = 8;

/// Their over-relaxation. Six cells across, Jacobi leaves 0.90 of the error, for which 1.4 is Young's optimum: 0.4 are
/// left after a sweep, where 0.8 are without.
pub const COARSEST_OMEGA: f32 = 1.4;

/// What a cycle leaves of the error, at worst: 0.03 to 0.10 measured, on the Armadillo and on boxes.
const CONTRACTION: f64 = 0.12;

/// Below this correction, cycles that no longer make it [`STALLED`] times smaller move rounding about: f32 has no more digits
/// to give (3e-8 to 1e-7 on a C at g = 16 to 40), and a tau that asks for them is never met.
const ROUND_OFF: f64 = 1e-6;

/// See [`ROUND_OFF`].
const STALLED: f64 = 0.5;

/// See [`ROUND_OFF`]: one such cycle may be chance.
const MAX_STALLED: u32 = 2;

/// Fields of one batch on every level; allocated once per thread, used for batch after batch.
#[derive(Debug)]
pub struct Workspace {
    /// `u[k]`: the solution, on coarse levels the correction. `[n_rows]`
    u: Vec<Vec<Row>>,
    /// `f[0]`: one row per cut cell; `f[k]`: one row per cell.
    f: Vec<Vec<Row>>,
    /// Residual of the red cells of the level under way, and a zero row.
    residual: Vec<Row>,
    /// Whether `f[0]` has one row per cell, as on the other levels.
    dense: bool,
}

/// How one batch converged.
#[derive(Clone, Debug, Default)]
pub struct BatchReport {
    /// For each V-cycle on the finest level, the square of the error that it is expected to leave: Eq. 2's norm of the
    /// coarse correction for this batch's columns, root-mean-squared over coarse cells, times the contraction.
    pub delta_squares: Vec<f64>,
    /// For each V-cycle, the sum of squared residuals divided by the number of unknowns.
    pub residual_squares: Vec<f64>,
    /// Whether the error is expected to be below the threshold. It never is below f32's round-off, where cycles end.
    pub converged: bool,
}

/// When a batch is done.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// Threshold for the batch's share of the error's norm.
    pub tolerance: f64,
    /// Largest number of V-cycles on the finest level.
    pub max_cycles: u32,
}

/// A batch's way to convergence: the stop rule, the same on every back end.
#[derive(Clone, Debug)]
pub struct Convergence {
    stop: Stop,
    report: BatchReport,
    /// Norm of the latest coarse correction.
    correction: f64,
    delta: f64,
    /// Cycles in a row that only moved rounding about.
    stalled: u32,
}

impl Convergence {
    /// Before the first cycle.
    #[must_use]
    pub fn new(stop: Stop) -> Self {
        let report = BatchReport::default();
        Self { stop, report, correction: f64::INFINITY, delta: f64::INFINITY, stalled: 0 }
    }

    /// Takes down a cycle by the squared norm of its coarse correction and its mean squared residual; true when it was
    /// the last: the error that its contraction lets expect is below the threshold, the limit is reached, or f32 has
    /// no more digits.
    pub fn cycle_done(&mut self, correction_square: f64, residual_square: f64) -> bool {
        let correction = correction_square.sqrt();
        let delta = (correction / self.correction).clamp(CONTRACTION, 1.0) * correction;
        self.report.delta_squares.push(delta * delta);
        self.report.residual_squares.push(residual_square);
        self.report.converged = delta <= self.stop.tolerance;
        let stalls = correction < ROUND_OFF && correction > STALLED * self.correction;
        self.stalled = if stalls { self.stalled + 1 } else { 0 };
        (self.correction, self.delta) = (correction, delta);
        self.report.converged
            || self.stalled == MAX_STALLED
            || self.report.delta_squares.len() >= self.stop.max_cycles as usize
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

impl Workspace {
    /// Fields for all levels.
    #[must_use]
    pub fn new(hierarchy: &Hierarchy) -> Self {
        let u = hierarchy.levels.iter().map(|l| vec![ZERO; l.n_rows()]).collect();
        let f = hierarchy
            .levels
            .iter()
            .enumerate()
            .map(|(k, l)| vec![ZERO; if k == 0 { l.n_cut() } else { l.n_rows() }])
            .collect();
        Self { u, f, residual: vec![ZERO; hierarchy.levels[0].first_row(1)], dense: false }
    }

    /// Bytes of a workspace for `hierarchy`.
    #[must_use]
    pub fn bytes(hierarchy: &Hierarchy) -> usize {
        let rows: usize = hierarchy
            .levels
            .iter()
            .enumerate()
            .map(|(k, l)| if k == 0 { l.n_rows() + l.n_cut() + l.first_row(1) } else { 2 * l.n_rows() })
            .sum();
        rows * size_of::<Row>()
    }

    /// Solves a batch; returns how it converged. `cycle_done(cycle, delta)` may cancel by returning false.
    ///
    /// # Errors
    /// `None` when cancelled.
    pub fn solve(
        &mut self,
        hierarchy: &Hierarchy,
        batch: usize,
        stop: Stop,
        cycle_done: impl FnMut(u32, f64) -> bool,
    ) -> Option<BatchReport> {
        let coarsest = hierarchy.levels.len() - 1;
        hierarchy.fill_cut_rhs(batch, &mut self.f[0]);
        for k in (0..=coarsest).rev() {
            if k > 0 {
                hierarchy.fill_dense_rhs(k, batch, &mut self.f[k]);
            }
            if k == coarsest {
                self.u[k].fill(ZERO);
            } else {
                let (fine, coarse) = self.u.split_at_mut(k + 1);
                first_guess(&hierarchy.levels[k], &hierarchy.transfers[k], &coarse[0], &mut fine[k]);
            }
            if k > 0 {
                self.cycle(hierarchy, k);
            }
        }
        self.cycles(hierarchy, stop, cycle_done)
    }

    /// V-cycles until the stop rule holds.
    fn cycles(
        &mut self,
        hierarchy: &Hierarchy,
        stop: Stop,
        mut cycle_done: impl FnMut(u32, f64) -> bool,
    ) -> Option<BatchReport> {
        let mut convergence = Convergence::new(stop);
        loop {
            let (delta_square, residual_square) = self.cycle(hierarchy, 0);
            let done = convergence.cycle_done(delta_square, residual_square);
            let (cycle, delta) = convergence.latest();
            if !cycle_done(cycle, delta) {
                return None;
            }
            if done {
                return Some(convergence.into_report());
            }
        }
    }

    /// The finest level's field. `[n_rows]`
    #[must_use]
    pub fn field(&self) -> &[Row] {
        &self.u[0]
    }

    /// One full relaxation of the finest level, both colours, as the solver does it: the unit in which a solve's
    /// cost is measured.
    pub fn sweep(&mut self, hierarchy: &Hierarchy) {
        let (level, u, f) = (&hierarchy.levels[0], &mut self.u[0], Rhs::Cut(&self.f[0]));
        relax(level, u, f);
    }

    /// One V(2,1) cycle on the finest level, after [`Self::solve`] has set up a batch: for measuring.
    pub fn v_cycle(&mut self, hierarchy: &Hierarchy) {
        self.cycle(hierarchy, 0);
    }

    /// One V(2,1) cycle from level k down. Returns (squared norm of the coarse correction, mean squared residual).
    fn cycle(&mut self, hierarchy: &Hierarchy, k: usize) -> (f64, f64) {
        let level = &hierarchy.levels[k];
        let (f, coarse_f) = self.f.split_at_mut(k + 1);
        let rhs = if k == 0 && !self.dense { Rhs::Cut(&f[0]) } else { Rhs::Dense(&f[k]) };
        if k + 1 == hierarchy.levels.len() {
            return relax_coarsest(level, &mut self.u[k], rhs);
        }
        let (coarse, transfer) = (&hierarchy.levels[k + 1], &hierarchy.transfers[k]);
        let residual = &mut self.residual[..level.first_row(1)];
        let squares = pre_smooth(level, &mut self.u[k], rhs, residual);
        dispatch(
            #[inline(always)]
            || restrict_residual(coarse, transfer, residual, &mut coarse_f[0]),
        );
        self.u[k + 1].fill(ZERO);
        self.cycle(hierarchy, k + 1);
        let (f, _) = self.f.split_at(k + 1);
        let rhs = if k == 0 && !self.dense { Rhs::Cut(&f[0]) } else { Rhs::Dense(&f[k]) };
        let (fine_u, coarse_u) = self.u.split_at_mut(k + 1);
        let delta = if k == 0 { sum_squares(&coarse_u[0]) / coarse.n_unknowns().max(1) as f64 } else { 0.0 };
        post_smooth(level, transfer, &coarse_u[0], &mut fine_u[k], rhs);
        (delta, squares / level.n_unknowns() as f64)
    }
}

/// Full multigrid's first guess: the coarse solution on black cells. (The sweep that follows overwrites red ones.)
fn first_guess(level: &Level, transfer: &Transfer, coarse: &[Row], u: &mut [Row]) {
    dispatch(
        #[inline(always)]
        || {
            for plane in 0..level.grid.dims[2] as usize {
                prolong_plane(level, transfer, plane, coarse, u, Prolong::Replace);
            }
        },
    );
}

/// Two red-black sweeps, the first one's black half over-relaxed, and the residual of the red cells behind them.
/// Returns the sum of its squares.
fn pre_smooth(level: &Level, u: &mut [Row], f: Rhs<'_>, residual: &mut [Row]) -> f64 {
    dispatch(
        #[inline(always)]
        || {
            let n = level.grid.dims[2] as usize;
            let mut squares = ZERO;
            for step in 0..n + 4 {
                if step < n {
                    relax_plane(level, 0, step, u, f);
                }
                if (1..n + 1).contains(&step) {
                    over_relax_plane(level, 1, step - 1, OMEGA, u, f);
                }
                if (2..n + 2).contains(&step) {
                    relax_plane(level, 0, step - 2, u, f);
                }
                if (3..n + 3).contains(&step) {
                    relax_plane(level, 1, step - 3, u, f);
                }
                if step >= 4 {
                    residual_plane(level, step - 4, u, f, residual, &mut squares);
                }
            }
            // The row for neighbours that are no unknowns.
            if let Some(zero) = residual.last_mut() {
                *zero = ZERO;
            }
            squares.iter().map(|&s| f64::from(s)).sum()
        },
    )
}

/// The coarse correction on black cells, then one red-black sweep.
fn post_smooth(level: &Level, transfer: &Transfer, coarse: &[Row], u: &mut [Row], f: Rhs<'_>) {
    dispatch(
        #[inline(always)]
        || {
            let n = level.grid.dims[2] as usize;
            for step in 0..n + 2 {
                if step < n {
                    prolong_plane(level, transfer, step, coarse, u, Prolong::Correct);
                }
                if (1..n + 1).contains(&step) {
                    relax_plane(level, 0, step - 1, u, f);
                }
                if step >= 2 {
                    relax_plane(level, 1, step - 2, u, f);
                }
            }
        },
    );
}

/// A plain red-black sweep.
fn relax(level: &Level, u: &mut [Row], f: Rhs<'_>) {
    dispatch(
        #[inline(always)]
        || {
            for colour in 0..2 {
                for plane in 0..level.grid.dims[2] as usize {
                    relax_plane(level, colour, plane, u, f);
                }
            }
        },
    );
}

/// Sweeps on the coarsest level. Returns (squared norm of the change per unknown, 0).
fn relax_coarsest(level: &Level, u: &mut [Row], f: Rhs<'_>) -> (f64, f64) {
    let before = u.to_vec();
    dispatch(
        #[inline(always)]
        || {
            for _ in 0..COARSEST_SWEEPS {
                for colour in 0..2 {
                    for plane in 0..level.grid.dims[2] as usize {
                        over_relax_plane(level, colour, plane, COARSEST_OMEGA, u, f);
                    }
                }
            }
        },
    );
    let change: f64 = before
        .iter()
        .zip(u.iter())
        .flat_map(|(a, b)| a.iter().zip(b))
        .map(|(a, b)| f64::from(a - b).powi(2))
        .sum();
    (change / level.n_unknowns().max(1) as f64, 0.0)
}

/// Sum of squares over all rows and lanes.
fn sum_squares(rows: &[Row]) -> f64 {
    dispatch(
        #[inline(always)]
        || {
            // One partial sum per few thousand rows keeps f32 accurate enough for a stop rule.
            rows.chunks(4096)
                .map(|chunk| {
                    let mut sum = ZERO;
                    for row in chunk {
                        for k in 0..LANES {
                            sum[k] += row[k] * row[k];
                        }
                    }
                    sum.iter().map(|&s| f64::from(s)).sum::<f64>()
                })
                .sum()
        },
    )
}
