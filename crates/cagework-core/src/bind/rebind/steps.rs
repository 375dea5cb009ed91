//! The stages of a rebind that work on whole batches or all vertices.

use std::collections::HashMap;

use crate::bind::BindOptions;
use crate::bind::pipeline::{Prepared, Solved};
use crate::bind::voxels::Voxels;
use crate::bind::watch::Watch;
use crate::grid::NO_CELL;
use crate::levels::Level;
use crate::progress::{Cancelled, Stage};
use crate::sample::Stencils;
use crate::simd::dispatch;
use crate::solve::multigrid::{BatchReport, Stop, Workspace, histories};
use crate::solve::rows::{LANES, Row, ZERO};
use crate::solve::team::Team;

use super::local::{OldCells, Region, add_scaled};

/// Vertices that a thread takes at a time.
const VERTEX_RUN: usize = 512;

/// Solves all batches and keeps their fields.
pub(super) fn solve_all(
    prepared: &Prepared<'_>,
    options: &BindOptions,
    watch: &Watch<'_>,
) -> Result<(Solved, Vec<Vec<Row>>), Cancelled> {
    let hierarchy = prepared.hierarchy();
    let n_batches = hierarchy.n_batches();
    let tolerance = f64::from(options.tau) / (n_batches as f64).sqrt();
    let stop = Stop { tolerance, max_cycles: options.max_iterations };
    let pieces: Vec<Option<Correction>> = prepared.team.share(
        n_batches,
        || Workspace::new(hierarchy),
        |workspace, batch| {
            let report = workspace.solve(hierarchy, batch, stop, |cycle, delta| {
                let fraction = watch.done() as f32 / n_batches as f32;
                watch.report(Stage::Solve, fraction, cycle, Some(delta as f32)).is_ok()
            })?;
            let mut samples = Vec::with_capacity(prepared.stencils.len());
            prepared.stencils.sample_weights(batch, workspace.field(), &mut samples);
            watch.piece_done(Stage::Solve, n_batches).ok()?;
            Some(Correction { report, samples, field: workspace.field().to_vec() })
        },
    );
    let pieces: Vec<Correction> = pieces.into_iter().collect::<Option<_>>().ok_or(Cancelled)?;
    let [delta_history, residual_history] = histories(&pieces.iter().map(|p| &p.report).collect::<Vec<_>>());
    let mut solved = Solved {
        iterations: delta_history.len() as u32,
        converged: pieces.iter().all(|p| p.report.converged),
        delta_history,
        residual_history,
        delta_interval: 1,
        field_bytes: pieces.iter().map(|p| size_of_val(p.field.as_slice())).sum(),
        solve_share: 1.0,
        ..Solved::default()
    };
    let mut fields = Vec::with_capacity(n_batches);
    for piece in pieces {
        solved.blocks.push(piece.samples);
        fields.push(piece.field);
    }
    Ok((solved, fields))
}

/// A solved batch.
pub(super) struct Correction {
    pub(super) report: BatchReport,
    /// At the mesh's vertices. `[n_points]`
    pub(super) samples: Vec<Row>,
    pub(super) field: Vec<Row>,
}

/// Solves for right-hand sides of cells, in batches of so many V-cycles each, and samples the solutions.
pub(super) fn solve_for(
    voxels: &Voxels,
    stencils: &Stencils,
    right: &[Vec<Row>],
    cycles: &[u32],
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Vec<Correction>, Cancelled> {
    let hierarchy = &voxels.hierarchy;
    let n = right.len();
    let solved: Vec<Option<Correction>> = team.share(
        n,
        || Workspace::new(hierarchy),
        |workspace, batch| {
            let report = workspace.solve_for(hierarchy, &right[batch], cycles[batch], |cycle, delta| {
                let fraction = watch.done() as f32 / n as f32;
                watch.report(Stage::Solve, fraction, cycle, Some(delta as f32)).is_ok()
            })?;
            let mut samples = Vec::with_capacity(stencils.len());
            // No column has this number: only the field is sampled, not the cage's values.
            stencils.sample_weights(usize::MAX / (2 * LANES), workspace.field(), &mut samples);
            watch.piece_done(Stage::Solve, n).ok()?;
            Some(Correction { report, samples, field: workspace.field().to_vec() })
        },
    );
    solved.into_iter().collect::<Option<_>>().ok_or(Cancelled)
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
    let mut cell_of = HashMap::new();
    for cell in region.cells.iter().map(|&cell| cell as usize) {
        if level.row_of[cell] != NO_CELL {
            cell_of.insert(level.row_of[cell], cell);
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
            if let Some(&cell) = cell_of.get(row) {
                add_scaled(&mut sum, old.at(cell), *weight);
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
pub(super) fn add_corrections(
    blocks: &mut [Vec<Row>],
    samples: &[&[Row]],
    shares: &[Vec<Row>],
    unfelt: f32,
    team: &Team,
) {
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
            || {
                let n = blocks.first().map_or(0, |rows| rows.len());
                let mut sum = vec![ZERO; blocks.len()];
                for v in 0..n {
                    sum.fill(ZERO);
                    for (k, share) in shares.iter().enumerate() {
                        let value = samples[k / LANES][*first + v][k % LANES];
                        if value.abs() > unfelt {
                            add_scaled(&mut sum, share, value);
                        }
                    }
                    for (rows, sum) in blocks.iter_mut().zip(&sum) {
                        for lane in 0..LANES {
                            rows[v][lane] += sum[lane];
                        }
                    }
                }
            },
        );
    });
}
