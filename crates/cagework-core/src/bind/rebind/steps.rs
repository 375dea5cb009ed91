//! The stages of a rebind that work on whole batches or all vertices.

use crate::bind::solving::{FieldFate, SolvedBatch, sample, solve_batches};
use crate::bind::watch::Watch;
use crate::grid::NO_CELL;
use crate::levels::Level;
use crate::progress::Cancelled;
use crate::sample::Stencils;
use crate::simd::dispatch;
use crate::solve::hierarchy::Hierarchy;
use crate::solve::rows::{LANES, Row, ZERO};
use crate::solve::team::Team;

use super::local::{Felt, OldCells, Region, Share, add_scaled, combined, felt_in};

/// Vertices that a thread takes at a time.
const VERTEX_RUN: usize = 512;

/// Solves for right-hand sides of cells, in batches of so many V-cycles each, and samples the solutions.
pub(super) fn solve_for(
    hierarchy: &Hierarchy,
    stencils: &Stencils,
    right: &[Vec<Row>],
    cycles: &[u32],
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Vec<SolvedBatch>, Cancelled> {
    let (solved, _) = solve_batches(
        hierarchy,
        right.len(),
        FieldFate::Kept,
        team,
        watch,
        &|workspace, batch, progress| workspace.solve_for(hierarchy, &right[batch], cycles[batch], progress),
        // No column has this number: only the field is sampled, not the cage's values.
        &|_, field| sample(stencils, usize::MAX / (2 * LANES), field),
    )?;
    Ok(solved)
}

/// Samples the old fields by stencils that are new.
pub(super) fn resample(
    stencils: &Stencils,
    changed: &[u32],
    level: &Level,
    old: &OldCells<'_>,
    region: &Region,
    blocks: &mut [Vec<Row>],
) {
    let mut cell_of = vec![NO_CELL; level.n_rows()];
    for &cell in &region.cells {
        let row = level.row_of[cell as usize];
        if row != NO_CELL {
            cell_of[row as usize] = cell;
        }
    }
    let mut sum = vec![ZERO; blocks.len()];
    let mut next = changed.iter().peekable();
    for (v, (nodes, hats)) in stencils.iter().enumerate() {
        if next.next_if_eq(&&(v as u32)).is_none() {
            continue;
        }
        sum.fill(ZERO);
        for (row, weight) in nodes {
            let cell = cell_of[*row as usize];
            if cell != NO_CELL {
                add_scaled(&mut sum, old.at(cell as usize), *weight);
            }
        }
        for &(column, weight) in hats {
            sum[column as usize / LANES][column as usize % LANES] += weight;
        }
        for (block, row) in blocks.iter_mut().zip(&sum) {
            block[v] = *row;
        }
    }
}

/// Adds to every vertex's weights its share of the corrections.
pub(super) fn add_corrections(blocks: &mut [Vec<Row>], samples: &[&[Row]], shares: &[Share], team: &Team) {
    let mut runs: Vec<(usize, Vec<&mut [Row]>)> = Vec::new();
    for block in blocks.iter_mut() {
        for (k, rows) in block.chunks_mut(VERTEX_RUN).enumerate() {
            if k == runs.len() {
                runs.push((k * VERTEX_RUN, Vec::new()));
            }
            runs[k].1.push(rows);
        }
    }
    team.each_mut(&mut runs, |(first, blocks)| {
        dispatch(
            #[inline(always)]
            || add_to_run(*first, blocks, samples, shares),
        );
    });
}

/// The same for one run of vertices, which begins with `first`.
#[inline(always)]
fn add_to_run(first: usize, blocks: &mut [&mut [Row]], samples: &[&[Row]], shares: &[Share]) {
    let n = blocks.first().map_or(0, |rows| rows.len());
    let mut felt = Felt::with_capacity(shares.len());
    for v in 0..n {
        felt.clear();
        felt_in(shares, &mut felt, |k| samples[k / LANES][first + v][k % LANES]);
        for (batch, rows) in blocks.iter_mut().enumerate() {
            rows[v] = combined(rows[v], batch, &felt);
        }
    }
}
