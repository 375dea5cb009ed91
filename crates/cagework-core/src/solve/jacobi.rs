//! The paper's smoothing: Algorithm 3, with Eq. 2 as the stop rule.
//!
//! Every sweep replaces each unknown by the average of its neighbours, old values on the right-hand side, until the
//! average over cells of the change of a cell's weight vector falls below tau.
//!
//! Changes versus the paper:
//! - Two buffers change roles instead of being copied.
//! - Threads own whole batches of columns, so that no two ever write the same cell: no lock and no queue of cells,
//!   the two costs that made the paper's threads slower than one.
//! - A batch runs several sweeps while it is in the cache. The changes of each sweep are kept apart and added over
//!   batches afterwards, so delta is known after every sweep, and the number of sweeps in a round is chosen from
//!   delta's decay so that the last round ends where the rule stops.
//!
//! Eq. 2 couples all columns of a cell, so all batches' fields are alive together here, unlike in multigrid.

use super::hierarchy::Hierarchy;
use super::rows::{Changes, LANES, Rhs, Row, ZERO, jacobi_plane};
use super::stop::{SolveReport, StopRule};
use crate::levels::Level;
use crate::options::DeltaNorm;
use crate::progress::Cancelled;
use crate::simd::dispatch;
use crate::team::Team;

/// Most sweeps of a batch in one round: enough to hide a batch's way into the cache.
const MAX_ROUND: usize = 8;

/// Share of the predicted number of remaining sweeps that a round dares to do.
const CAUTION: f64 = 0.8;

/// Cells whose changes a thread adds up at a time.
const CELLS_PER_PIECE: usize = 4096;

/// Old and new values of one batch, and its right-hand side.
#[derive(Debug)]
struct BatchFields {
    old: Vec<Row>,
    new: Vec<Row>,
    f: Vec<Row>,
    batch: usize,
}

/// The batches of one thread, and per sweep of a round the changes of its cells.
#[derive(Debug)]
struct Share {
    batches: Vec<BatchFields>,
    changes: Vec<Vec<f32>>,
}

/// Bytes of fields for `n_unknowns` cells, `n_cut` of them next to the boundary.
#[must_use]
pub fn field_bytes(n_unknowns: u64, n_cut: u64, n_columns: u64, threads: u64) -> u64 {
    let row = size_of::<Row>() as u64;
    n_columns.div_ceil(LANES as u64) * (2 * (n_unknowns + 2) + n_cut) * row
        + threads * MAX_ROUND as u64 * 4 * (n_unknowns + 2)
}

/// So many sweeps without a smaller delta only move rounding about.
pub const STALLED_SWEEPS: usize = 128;

/// Solves all columns on the finest level. Returns the batches' fields in order.
///
/// `sweep_done(sweeps, delta)` is called after each round and cancels by returning false.
///
/// # Errors
/// [`Cancelled`].
pub fn solve(
    hierarchy: &Hierarchy,
    team: &Team,
    rule: StopRule,
    norm: DeltaNorm,
    mut sweep_done: impl FnMut(u32, f64) -> bool,
) -> Result<(Vec<Vec<Row>>, SolveReport), Cancelled> {
    let level = &hierarchy.levels[0];
    let n_shares = team.n_threads().min(hierarchy.n_batches()).max(1);
    let mut shares: Vec<Share> = team.share(n_shares, || (), |(), s| Share::new(hierarchy, s, n_shares));
    let mut report = SolveReport::default();
    let (mut round, mut is_done) = (1, false);
    while !is_done {
        round = round.min(rule.max_iterations as usize - report.deltas.len());
        team.each_mut(&mut shares, |share| share.sweep(level, round, norm));
        for delta in &mean_deltas(&shares, level, team)[..round] {
            // A round may pass the sweep at which the rule holds.
            let had_converged = report.converged;
            is_done |= report.iteration_done(&rule, *delta, None);
            report.converged |= had_converged;
            is_done = is_done || report.ends_at_round_off(STALLED_SWEEPS);
        }
        let (sweeps, delta) = report.latest();
        if !sweep_done(sweeps, delta) {
            return Err(Cancelled);
        }
        round = next_round(&report.deltas, rule.tolerance);
    }
    let mut fields = vec![Vec::new(); hierarchy.n_batches()];
    for batch in shares.into_iter().flat_map(|s| s.batches) {
        fields[batch.batch] = batch.old;
    }
    Ok((fields, report))
}

/// Sweeps that can be done at once without passing the sweep at which delta, which decays geometrically, meets tau.
fn next_round(history: &[f64], tau: f64) -> usize {
    let n = history.len();
    if n < 4 {
        return 1;
    }
    let rate = history[n - 1].ln() - history[n - 2].ln();
    let remaining = (tau.ln() - history[n - 1].ln()) / rate;
    if remaining.is_finite() && remaining > 0.0 {
        ((CAUTION * remaining) as usize).clamp(1, MAX_ROUND)
    } else {
        1
    }
}

/// Eq. 2 averaged over cells for each sweep of a round, from the changes of all threads' columns. Both readings take
/// the root of what the kernel summed: squares or absolute values.
fn mean_deltas(shares: &[Share], level: &Level, team: &Team) -> [f64; MAX_ROUND] {
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
    let sums = pieces.iter().fold([0.0f64; MAX_ROUND], |mut sums, piece: &[f64; MAX_ROUND]| {
        for (sum, part) in sums.iter_mut().zip(piece) {
            *sum += part;
        }
        sums
    });
    sums.map(|sum| sum / level.n_unknowns().max(1) as f64)
}

/// Sum over cells of the root of their change.
#[inline(always)]
fn sum_of_roots(shares: &[Share], sweep: usize, cells: std::ops::Range<usize>) -> f64 {
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

impl Share {
    /// Batches `share`, `share + n_shares`, ...: the same ones in every run, so that sums are too.
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
        Self { batches, changes: vec![vec![0.0; n_rows]; MAX_ROUND] }
    }

    /// `round` sweeps of each batch.
    fn sweep(&mut self, level: &Level, round: usize, norm: DeltaNorm) {
        for changes in &mut self.changes[..round] {
            changes.fill(0.0);
        }
        for batch in &mut self.batches {
            for changes in &mut self.changes[..round] {
                let (old, new, f) = (&batch.old, &mut batch.new, Rhs::Cut(&batch.f));
                sweep(level, old, new, f, norm, changes);
                std::mem::swap(&mut batch.old, &mut batch.new);
            }
        }
    }
}

/// One sweep of both colours; plane by plane, so that both read a plane while it is near.
fn sweep(level: &Level, old: &[Row], new: &mut [Row], f: Rhs<'_>, norm: DeltaNorm, changes: &mut [f32]) {
    dispatch(
        #[inline(always)]
        || {
            for plane in 0..level.grid.dims[2] as usize {
                for colour in 0..2 {
                    let of_cells = &mut changes[level.first_row(colour)..];
                    jacobi_plane(level, colour, plane, old, new, f, Changes { norm, of_cells });
                }
            }
        },
    );
}
