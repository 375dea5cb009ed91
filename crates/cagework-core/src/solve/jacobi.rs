//! The solver of K. Smith's paper (`docs/method.md`, sources): Jacobi sweeps (Algorithm 3), with Eq. 2 as stopping
//! rule.
//!
//! Every sweep replaces each unknown by the average of its neighbours' old values, until delta, the mean change of a
//! cell's weight vector, falls below the tolerance tau.
//!
//! Differences from the paper:
//! - Two buffers are swapped instead of copied.
//! - Each thread owns whole batches of columns, so no two threads write the same value. This avoids the paper's locks
//!   and queue of cells, which made several threads slower than one.
//! - A batch runs a round of several sweeps while it is in the cache. The changes of each sweep are stored separately
//!   and summed over batches afterwards, so delta is known after every sweep. The number of sweeps per round is
//!   predicted from delta's decay, so that the last round hardly runs past the sweep at which the rule holds.
//!
//! Eq. 2 couples all columns of a cell, so the fields of all batches are in memory at the same time, unlike in
//! multigrid.

use super::hierarchy::Hierarchy;
use super::rows::{LANES, Rhs, Row, ZERO, jacobi_plane};
use super::stop::{SolveReport, StopRule};
use crate::levels::Level;
use crate::progress::Cancellation;
use crate::simd::dispatch;
use crate::team::Team;

/// Largest number of sweeps of a batch per round: enough to amortise loading the batch into the cache.
const MAX_ROUND_SWEEPS: usize = 8;

/// Fraction of the predicted remaining sweeps that the next round runs.
const PREDICTION_SHARE: f64 = 0.8;

/// Number of cells per task when changes are summed.
const CELLS_PER_PIECE: usize = 4096;

/// Old and new values of a batch, with its right-hand side.
#[derive(Debug)]
struct BatchFields {
    old: Vec<Row>,
    new: Vec<Row>,
    f: Vec<Row>,
    batch: usize,
}

/// Batches of a thread, with the summed changes of each cell for each sweep of a round.
#[derive(Debug)]
struct ThreadBatches {
    batches: Vec<BatchFields>,
    changes: Vec<Vec<f32>>,
}

/// Bytes of the fields for `n_unknowns` cells, of which `n_cut` are cut, and of the changes per cell.
#[must_use]
pub fn field_bytes(n_unknowns: u64, n_cut: u64, n_columns: u64, threads: u64) -> u64 {
    let row = size_of::<Row>() as u64;
    n_columns.div_ceil(LANES as u64) * (2 * (n_unknowns + 2) + n_cut) * row
        + threads * MAX_ROUND_SWEEPS as u64 * 4 * (n_unknowns + 2)
}

/// Stop after this many sweeps without a smaller delta: further changes are rounding noise.
pub const STALLED_SWEEPS: usize = 128;

/// Solves all columns on the finest level. Returns the fields of the batches in order.
///
/// Calls `sweep_done(sweeps, delta)` after each round; returning false cancels.
///
/// # Errors
/// [`Cancellation`] if `sweep_done` returns false.
pub fn solve(
    hierarchy: &Hierarchy,
    team: &Team,
    rule: StopRule,
    mut sweep_done: impl FnMut(u32, f64) -> bool,
) -> Result<(Vec<Vec<Row>>, SolveReport), Cancellation> {
    let level = &hierarchy.levels[0];
    let n_shares = team.n_threads().min(hierarchy.n_batches()).max(1);
    let mut shares: Vec<ThreadBatches> =
        team.share(n_shares, || (), |(), s| ThreadBatches::new(hierarchy, s, n_shares));
    let mut report = SolveReport::default();
    let (mut round, mut is_done) = (1, false);
    while !is_done {
        round = round.min(rule.max_iterations as usize - report.deltas.len());
        team.each_mut(&mut shares, |share| share.sweep(level, round));
        for delta in &mean_deltas(&shares, level, team)[..round] {
            // A round may run past the sweep at which the rule holds.
            let had_converged = report.converged;
            is_done |= report.iteration_done(&rule, *delta, None);
            report.converged |= had_converged;
            is_done = is_done || report.ends_at_round_off(STALLED_SWEEPS);
        }
        let (sweeps, delta) = report.latest();
        if !sweep_done(sweeps, delta) {
            return Err(Cancellation);
        }
        round = next_round(&report.deltas, rule.tolerance);
    }
    let mut fields = vec![Vec::new(); hierarchy.n_batches()];
    for batch in shares.into_iter().flat_map(|s| s.batches) {
        fields[batch.batch] = batch.old;
    }
    Ok((fields, report))
}

/// Number of sweeps of the next round, chosen so that the round ends before the sweep at which delta, extrapolated
/// geometrically, meets tau.
fn next_round(history: &[f64], tau: f64) -> usize {
    let n = history.len();
    if n < 4 {
        return 1;
    }
    let rate = history[n - 1].ln() - history[n - 2].ln();
    let remaining = (tau.ln() - history[n - 1].ln()) / rate;
    if remaining.is_finite() && remaining > 0.0 {
        ((PREDICTION_SHARE * remaining) as usize).clamp(1, MAX_ROUND_SWEEPS)
    } else {
        1
    }
}

/// Delta (Eq. 2) averaged over cells for each sweep of a round, from the squared changes of all threads.
fn mean_deltas(shares: &[ThreadBatches], level: &Level, team: &Team) -> [f64; MAX_ROUND_SWEEPS] {
    let n_rows = level.n_rows();
    let pieces = team.share(
        n_rows.div_ceil(CELLS_PER_PIECE),
        || (),
        |(), piece| {
            let range = piece * CELLS_PER_PIECE..((piece + 1) * CELLS_PER_PIECE).min(n_rows);
            dispatch(
                #[inline(always)]
                || std::array::from_fn(|sweep| sum_of_roots(shares, sweep, range.clone())),
            )
        },
    );
    let sums = pieces.iter().fold([0.0f64; MAX_ROUND_SWEEPS], |mut sums, piece: &[f64; MAX_ROUND_SWEEPS]| {
        for (sum, part) in sums.iter_mut().zip(piece) {
            *sum += part;
        }
        sums
    });
    sums.map(|sum| sum / level.n_unknowns().max(1) as f64)
}

/// Sum over a range of cells of each cell's change in one sweep: the square root of its squared changes, summed over
/// all threads.
#[inline(always)]
fn sum_of_roots(shares: &[ThreadBatches], sweep: usize, cells: std::ops::Range<usize>) -> f64 {
    let mut sums = ZERO;
    let mut changes = ZERO;
    for start in cells.clone().step_by(LANES) {
        let n = LANES.min(cells.end - start);
        changes.fill(0.0);
        for share in shares {
            for (change, more) in changes.iter_mut().zip(&share.changes[sweep][start..start + n]) {
                *change += more;
            }
        }
        for k in 0..LANES {
            sums[k] += changes[k].sqrt();
        }
    }
    sums.iter().map(|&s| f64::from(s)).sum()
}

impl ThreadBatches {
    /// Allocates the batches `share`, `share + n_shares`, ...: a fixed assignment keeps sums reproducible.
    fn new(hierarchy: &Hierarchy, share: usize, n_shares: usize) -> Self {
        let n_rows = hierarchy.levels[0].n_rows();
        let batches = (share..hierarchy.n_batches())
            .step_by(n_shares)
            .map(|batch| {
                let mut f = Vec::new();
                hierarchy.fill_cut_rhs(batch, &mut f);
                BatchFields { old: vec![ZERO; n_rows], new: vec![ZERO; n_rows], f, batch }
            })
            .collect();
        Self { batches, changes: vec![vec![0.0; n_rows]; MAX_ROUND_SWEEPS] }
    }

    fn sweep(&mut self, level: &Level, round: usize) {
        for changes in &mut self.changes[..round] {
            changes.fill(0.0);
        }
        for batch in &mut self.batches {
            for changes in &mut self.changes[..round] {
                let (old, new, f) = (&batch.old, &mut batch.new, Rhs::Cut(&batch.f));
                sweep(level, old, new, f, changes);
                std::mem::swap(&mut batch.old, &mut batch.new);
            }
        }
    }
}

/// Sweeps both colours, plane by plane, so that both read a plane while it is cached.
fn sweep(level: &Level, old: &[Row], new: &mut [Row], f: Rhs<'_>, changes: &mut [f32]) {
    dispatch(
        #[inline(always)]
        || {
            for plane in 0..level.grid.dims[2] as usize {
                for colour in 0..2 {
                    let of_cells = &mut changes[level.first_row(colour)..];
                    jacobi_plane(level, colour, plane, old, new, f, of_cells);
                }
            }
        },
    );
}
