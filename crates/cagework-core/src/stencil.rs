//! CPU twins of the GPU kernels: the same computation in plain serial f32 loops, with additions in the same order.
//!
//! These functions specify the kernels in `shaders/`, with arguments in the order of the shaders' bindings. They are
//! not optimised; solvers use the fast versions in [`crate::solve::rows`]. Fields are flat, `[row][lane]`, with rows in
//! the level's order and `n_lanes` columns of one batch. Geometry comes in the arrays of [`tables`], which the GPU
//! receives as well.

mod reduce;
pub mod tables;
#[cfg(test)]
mod tests;

pub use reduce::{REDUCE_LANES, REDUCE_VALUES, reduce_sum, sum_roots, sum_squares};

use std::ops::Range;

use glam::Vec3;

use crate::grid::NO_CELL;
use crate::solve::rows::{MIN_CHANGE, ProlongationMode};
use crate::transfer::{RESTRICT_CENTRE, RESTRICT_EDGE};
use tables::{BUNDLE, LevelTable, NormalTable, SLICE, SamplingTable, SlicedWeights};

/// Right-hand side of a row plus the values of its neighbours, summed in the kernels' order.
fn gather(level: &LevelTable, n_lanes: usize, row: usize, lane: usize, rhs: &[f32], field: &[f32]) -> f32 {
    let mut sum = 0.0;
    if level.rhs_of_row[row] != NO_CELL {
        sum = rhs[level.rhs_of_row[row] as usize * n_lanes + lane];
    }
    for neighbour in level.neighbours[row] {
        sum += field[neighbour as usize * n_lanes + lane];
    }
    sum
}

/// Applies Gauss-Seidel to the rows of one colour, in place: `u += omega ((f + sum of neighbours) / diagonal - u)`.
///
/// `field`: `[row][lane]`, dimensionless. GPU kernel: `shaders/relax_cells.wgsl`.
pub fn relax_cells(
    rows: Range<usize>,
    n_lanes: usize,
    omega: f32,
    level: &LevelTable,
    rhs: &[f32],
    field: &mut [f32],
) {
    for row in rows {
        for lane in 0..n_lanes {
            let sum = gather(level, n_lanes, row, lane, rhs, field);
            let own = &mut field[row * n_lanes + lane];
            *own += omega * (sum / level.diagonal[row] - *own);
        }
    }
}

/// Runs a Jacobi sweep (K. Smith, Algorithm 3) from `u_in` to `u_out`, both `[row][lane]`. GPU kernel:
/// `shaders/jacobi_cells.wgsl`.
pub fn jacobi_cells(
    rows: Range<usize>,
    n_lanes: usize,
    level: &LevelTable,
    rhs: &[f32],
    u_in: &[f32],
    u_out: &mut [f32],
) {
    for row in rows {
        for lane in 0..n_lanes {
            u_out[row * n_lanes + lane] = gather(level, n_lanes, row, lane, rhs, u_in) / level.diagonal[row];
        }
    }
}

/// Adds the squared changes of each row, summed over the lanes, to `changes` (`[row]`), which the `first` batch
/// overwrites. GPU kernel: `shaders/change_norms.wgsl`.
pub fn change_norms(n_lanes: usize, first: bool, u_old: &[f32], u_new: &[f32], changes: &mut [f32]) {
    for (row, change) in changes.iter_mut().enumerate() {
        let mut sum = if first { 0.0 } else { *change };
        for quad in (row * n_lanes..(row + 1) * n_lanes).step_by(4) {
            let term = |k: usize| {
                let d = (u_new[quad + k] - u_old[quad + k]).abs();
                let d = if d > MIN_CHANGE { d } else { 0.0 };
                d * d
            };
            sum += (term(0) + term(1)) + (term(2) + term(3));
        }
        *change = sum;
    }
}

/// Computes the residual `f + sum of neighbours - diagonal u` of the first `n_rows` rows: the red rows and their zero
/// row. GPU kernel: `shaders/residual.wgsl`.
pub fn residual(
    n_rows: usize,
    n_lanes: usize,
    level: &LevelTable,
    rhs: &[f32],
    field: &[f32],
    red_residual: &mut [f32],
) {
    for row in 0..n_rows {
        for lane in 0..n_lanes {
            let own = row * n_lanes + lane;
            red_residual[own] =
                gather(level, n_lanes, row, lane, rhs, field) - level.diagonal[row] * field[own];
        }
    }
}

/// Restriction: computes the coarse right-hand side, `[coarse row][lane]`, from the red residuals around each coarse
/// cell. GPU kernel: `shaders/restrict_residual.wgsl`.
pub fn restrict_residual(n_lanes: usize, around: &[[u32; 13]], red_residual: &[f32], coarse_rhs: &mut [f32]) {
    for (row, around) in around.iter().enumerate() {
        for lane in 0..n_lanes {
            let value = |fine: u32| red_residual[fine as usize * n_lanes + lane];
            let mut edges = 0.0;
            for &fine in &around[1..] {
                edges += value(fine);
            }
            coarse_rhs[row * n_lanes + lane] = RESTRICT_CENTRE * value(around[0]) + RESTRICT_EDGE * edges;
        }
    }
}

/// Prolongs `coarse` to the black rows of `field` listed in `entries`, with `n_sources` coarse rows each. GPU kernel:
/// `shaders/prolong_correction.wgsl`.
pub fn prolong_correction(
    n_lanes: usize,
    mode: ProlongationMode,
    n_sources: usize,
    entries: &[u32],
    coarse: &[f32],
    field: &mut [f32],
) {
    for entry in entries.chunks_exact(tables::ENTRY_HEAD + n_sources) {
        let (head, sources) = entry.split_at(tables::ENTRY_HEAD);
        for lane in 0..n_lanes {
            let mut sum = 0.0;
            for &row in sources {
                sum += coarse[row as usize * n_lanes + lane];
            }
            let own = &mut field[head[0] as usize * n_lanes + lane];
            match mode {
                ProlongationMode::Correct => *own += sum * (1.0 / n_sources as f32),
                ProlongationMode::Replace => *own = sum * f32::from_bits(head[1]),
            }
        }
    }
}

/// Samples the weights of `vertices` for the columns `first_column..first_column + n_lanes`. `block`: `[vertex][lane]`.
/// GPU kernel: `shaders/sample_weights.wgsl`.
pub fn sample_weights(
    vertices: Range<usize>,
    n_lanes: usize,
    first_column: usize,
    table: &SamplingTable,
    field: &[f32],
    block: &mut [f32],
) {
    for (vertex, out) in vertices.zip(block.chunks_exact_mut(n_lanes)) {
        let ([node, hat], [node_end, hat_end]) = (table.starts[vertex], table.starts[vertex + 1]);
        for (lane, out) in out.iter_mut().enumerate() {
            let mut sum = 0.0;
            for &[row, weight] in &table.nodes[node as usize..node_end as usize] {
                sum += f32::from_bits(weight) * field[row as usize * n_lanes + lane];
            }
            for &[column, weight] in &table.hats[hat as usize..hat_end as usize] {
                if column as usize == first_column + lane {
                    sum += f32::from_bits(weight);
                }
            }
            *out = sum;
        }
    }
}

/// Computes deformed positions, `[n_vertices]`, object units, for a posed cage. GPU kernel:
/// `shaders/deform_vertices.wgsl`.
pub fn deform_vertices(weights: &SlicedWeights, cage: &[Vec3], positions: &mut [Vec3]) {
    for (number, bundle) in positions.chunks_mut(BUNDLE).enumerate() {
        let (slice, lane) = (number / SLICE, number % SLICE);
        let mut sums = [Vec3::ZERO; BUNDLE];
        for k in weights.slices[slice]..weights.slices[slice + 1] {
            let entry = k as usize * SLICE + lane;
            let c = cage[weights.columns[entry] as usize];
            for (sum, &weight) in sums.iter_mut().zip(&weights.weights[entry]) {
                *sum += weight * c;
            }
        }
        bundle.copy_from_slice(&sums[..bundle.len()]);
    }
}

/// Computes area-weighted unit normals, `[n_vertices]`; zero for vertices without triangles. GPU kernel:
/// `shaders/vertex_normals.wgsl`.
pub fn vertex_normals(table: &NormalTable, positions: &[Vec3], normals: &mut [Vec3]) {
    for (vertex, normal) in normals.iter_mut().enumerate() {
        let p = positions[vertex];
        let mut sum = Vec3::ZERO;
        for &[a, b] in &table.others[table.starts[vertex] as usize..table.starts[vertex + 1] as usize] {
            sum += (positions[a as usize] - p).cross(positions[b as usize] - p);
        }
        *normal = if sum == Vec3::ZERO { sum } else { sum * sum.length_squared().sqrt().recip() };
    }
}
