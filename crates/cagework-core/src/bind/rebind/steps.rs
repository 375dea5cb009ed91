//! The stages of a rebind that work on whole batches or all vertices.

use crate::bind::BindOptions;
use crate::bind::solving::{FieldFate, SolvedBatch, sample, solve_batches, stop_of_batches};
use crate::bind::watch::Watch;
use crate::grid::NO_CELL;
use crate::levels::Level;
use crate::progress::Cancelled;
use crate::sample::Stencils;
use crate::solve::hierarchy::Hierarchy;
use crate::solve::rows::{LANES, Row, ZERO};
use crate::solve::team::Team;

use super::local::OldCells;
use super::region::Region;
use super::shares::add_scaled;

/// Share of the threshold that corrections are solved to. They live in few cells, and the norm is a mean over all: solved to
/// the threshold itself, a weight near the edit was 3 to 7 times as far off as after a whole bind; so it is as exact.
const SHARPER: f32 = 0.1;

/// Solves for right-hand sides of cells, and samples the solutions.
pub(super) fn solve_for(
    hierarchy: &Hierarchy,
    stencils: &Stencils,
    right: &[Vec<Row>],
    options: &BindOptions,
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Vec<SolvedBatch>, Cancelled> {
    let stop = stop_of_batches(SHARPER * options.tau, options.max_iterations, right.len());
    let (solved, _) = solve_batches(
        hierarchy,
        right.len(),
        FieldFate::Kept,
        team,
        watch,
        &|workspace, batch, progress| workspace.solve_for(hierarchy, &right[batch], stop, progress),
        // No column has this number: only the field is sampled, not the cage's values.
        &|_, field| sample(stencils, usize::MAX / (2 * LANES), field),
    )?;
    Ok(solved)
}

/// Samples the old fields by stencils that are new. Returns the rows of the vertices `changed`: `[n_changed][n_batches]`.
pub(super) fn resample(
    stencils: &Stencils,
    changed: &[u32],
    level: &Level,
    old: &OldCells<'_>,
    region: &Region,
    n_batches: usize,
) -> Vec<Row> {
    let mut cell_of = vec![NO_CELL; level.n_rows()];
    for &cell in &region.cells {
        let row = level.row_of[cell as usize];
        if row != NO_CELL {
            cell_of[row as usize] = cell;
        }
    }
    let mut rows = vec![ZERO; changed.len() * n_batches];
    for (sum, &v) in rows.chunks_exact_mut(n_batches).zip(changed) {
        let (nodes, hats) = stencils.at(v as usize);
        for (row, weight) in nodes {
            let cell = cell_of[*row as usize];
            if cell != NO_CELL {
                add_scaled(sum, old.at(cell as usize), *weight);
            }
        }
        for &(column, weight) in hats {
            sum[column as usize / LANES][column as usize % LANES] += weight;
        }
    }
    rows
}
