//! The stages of a rebind that work on whole batches or all vertices.

use std::sync::Arc;

use crate::bind::BindOptions;
use crate::bind::solving::{FieldFate, SolvedBatch, sample, solve_batches, stop_of_batches};
use crate::bind::watch::Watch;
use crate::progress::Cancelled;
use crate::sample::Stencils;
use crate::solve::hierarchy::Hierarchy;
use crate::solve::multigrid::{Places, Stop};
use crate::solve::rows::{LANES, Row, ZERO};
use crate::solve::team::Team;

use super::known::MAX_KNOWN;
use super::lenience;
use super::local::OldCells;
use super::shares::{Shares, add_scaled};

/// What corrections may leave in any cell, over the threshold, [`lenience`] aside, before sweeps around the edit. They may live
/// in few cells, and the norm is a mean over all: solved to the threshold as a mean, a weight near the edit was 3 to 7 times as
/// far off as after a whole bind. With this it is 1.0 to 3.1 times (samples; with 1.8, 7.1e-5 instead of 3.8e-5 in the humanoid).
const IN_ANY_CELL: f32 = 1.5;

/// Where a last cycle leaves no more than this on average, over what it may leave in a cell, its coarse correction is followed by
/// half a sweep everywhere and by others around the edit only; [`lenience`] times as much with few vertices: with 24 always.
/// (With 0.05 the largest error of a weight is 5.3e-5 instead of 3.9e-5 after edits of three cages of 200 by 0.1 to 1 %.)
const LITTLE: f32 = 0.035;

/// What a V-cycle leaves of a correction's error, at worst: 0.03 to 0.05 measured, from zero and by coarse corrections that go
/// further (generated cages of 24 vertices, 1 % of the model).
const CONTRACTION: f64 = 0.05;

/// Solves for right-hand sides, `[n_batches]` of what is in `cells`, and samples the solutions.
pub(super) fn solve_for(
    hierarchy: &Hierarchy,
    stencils: &Stencils,
    (cells, right): (&[u32], &[Vec<Row>]),
    options: &BindOptions,
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Vec<SolvedBatch>, Cancelled> {
    let stop = stop_of_batches(options.tau, options.max_iterations, right.len());
    let lenience = lenience(hierarchy.n_batches());
    let in_any_cell = f64::from(IN_ANY_CELL * lenience * options.tau);
    let little = f64::from(LITTLE * lenience) * in_any_cell;
    let stop = Stop { in_any_cell, little, contraction: CONTRACTION, ..stop };
    let places = Arc::new(Places::new(&hierarchy.levels[0], cells));
    let (solved, _) = solve_batches(
        hierarchy,
        right.len(),
        FieldFate::Kept,
        team,
        watch,
        &|workspace, batch, progress| {
            workspace.solve_for(hierarchy, (&places, &right[batch]), stop, progress)
        },
        // No column has this number: only the field is sampled, not the cage's values.
        &|_, field| sample(stencils, usize::MAX / (2 * LANES), field),
    )?;
    Ok(solved)
}

/// Samples the old fields, with the corrections that are known, by stencils that are new; `cell_of`: the cell of each row
/// they ask for. Returns the rows of the vertices `changed`: `[n_changed][n_batches]`.
pub(super) fn resample(
    stencils: &Stencils,
    changed: &[u32],
    cell_of: &[u32],
    old: &OldCells<'_>,
    shares: &Shares,
    n_batches: usize,
) -> Vec<Row> {
    let mut rows = vec![ZERO; changed.len() * n_batches];
    for (sum, &v) in rows.chunks_exact_mut(n_batches).zip(changed) {
        let (nodes, hats) = stencils.at(v as usize);
        let mut of_moved = [0.0; MAX_KNOWN];
        for (row, weight) in nodes {
            let cell = cell_of[*row as usize] as usize;
            add_scaled(sum, old.at(cell), *weight);
            for (sum, of) in of_moved.iter_mut().zip(old.of_moved(cell)) {
                *sum += weight * of;
            }
        }
        shares.known.add(of_moved, sum);
        for &(column, weight) in hats {
            sum[column as usize / LANES][column as usize % LANES] += weight;
        }
    }
    rows
}
