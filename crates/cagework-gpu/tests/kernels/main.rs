//! Each kernel versus its CPU implementation in `cagework_core::stencil`, for sizes that are not multiples of
//! workgroups.

mod deforming;
mod splats;
#[path = "../support/mod.rs"]
mod support;

use cagework_core::bind::Watch;
use cagework_core::levels::Level;
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::sample::Stencils;
use cagework_core::solve::hierarchy::Hierarchy;
use cagework_core::solve::rows::ProlongationMode;
use cagework_core::stencil;
use cagework_core::stencil::tables::{LevelTable, SamplingTable, TransferTable};
use cagework_gpu::buffers::Allocator;
use cagework_gpu::kernels::{self, Kernel};
use cagework_gpu::layout::{Work, mode};
use cagework_gpu::stream::Stream;
use cagework_gpu::{GpuContext, GpuError};
use glam::Vec3;
use support::{Rng, assert_close, cage, egg, gpu, with_prepared};

/// Tolerance for row sums of up to 14 numbers in [0, 1) with factors of at most 6. Fused multiply-adds and WGSL's
/// division error of 2.5 ulp change these sums by a few ulp of 8.
const ROW_TOLERANCE: f32 = 8e-6;

/// Tolerance relative to the largest value, for sums of thousands of positive numbers. GPU and CPU add them in the same
/// order, but products may be fused.
const SUM_TOLERANCE: f32 = 2e-6;

/// Number of columns of a batch. It is an odd number of quads, so that rows do not align with workgroups.
const N_LANES: usize = 12;
/// Number of quads of a batch; a quad is four columns.
const N_QUADS: u32 = 3;

/// Number of cells along the cage's longest side.
const GRID: u32 = 13;

fn hierarchy_of<T>(use_it: impl FnOnce(&Hierarchy, &Stencils) -> T) -> T {
    let options = BindOptions { grid: GRID, ..BindOptions::default() };
    // The points extend beyond the cage.
    let positions: Vec<Vec3> = egg(7, 9).positions.iter().map(|p| 1.3 * p).collect();
    with_prepared(&positions, &cage([2, 2, 3]), &options, |prepared| {
        let hierarchy = prepared.hierarchy();
        assert!(hierarchy.levels.len() >= 2, "the test needs a transfer");
        use_it(hierarchy, prepared.stencils())
    })
}

/// Uploads `inputs`, runs the kernel once, and reads the last input back.
fn run(kernel: &Kernel, work: Work, count: u32, inputs: &[&[u8]]) -> Vec<f32> {
    pollster::block_on(step(&gpu(), kernel, work, count, inputs)).expect("the kernel runs")
}

async fn step(
    context: &GpuContext,
    kernel: &Kernel,
    work: Work,
    count: u32,
    inputs: &[&[u8]],
) -> Result<Vec<f32>, GpuError> {
    let watch = Watch::new(&NoProgress);
    let mut stream = Stream::new(context, &watch).await?;
    let mut allocator = Allocator::new(context, "one step");
    let mut buffers = Vec::new();
    for input in inputs {
        buffers.push(allocator.table(kernel.name, input)?);
    }
    let launch = stream.launch(kernel, &buffers.iter().collect::<Vec<_>>());
    let bytes = inputs[inputs.len() - 1].len() as u64;
    let through = allocator.readback("result", bytes)?;
    allocator.settle().await?;
    if kernel.workgroup == stencil::REDUCE_LANES as u32 {
        let groups =
            if kernel.name == "reduce_sum" { 1 } else { count.div_ceil(stencil::REDUCE_VALUES as u32) };
        stream.reduce(&launch, work, count, groups).await?;
    } else {
        stream.run(&launch, work, count).await?;
    }
    stream.read(&buffers[buffers.len() - 1], &through, bytes, bytemuck::pod_collect_to_vec).await
}

fn bytes<T: bytemuck::Pod>(data: &[T]) -> &[u8] {
    bytemuck::cast_slice(data)
}

/// A random field, with zeros in the row of zeros that follows the rows of each colour.
fn field(rng: &mut Rng, level: &Level) -> Vec<f32> {
    let mut values = rng.values(level.n_rows() * N_LANES);
    for row in [level.zero_row() as usize, level.n_rows() - 1] {
        values[row * N_LANES..(row + 1) * N_LANES].fill(0.0);
    }
    values
}

/// Parameters for kernels over rows and quads.
const ROWS: Work = Work {
    first: 0,
    count: 0,
    stride: 0,
    n_quads: N_QUADS,
    first_row: 0,
    first_quad: 0,
    mode: 0,
    n_sources: 0,
    omega: 1.0,
};

#[test]
fn relax_cells_matches_cpu() {
    hierarchy_of(|hierarchy, _| {
        for (k, omega, colour) in [(0, 1.0, 0), (0, 1.2, 1), (1, 1.0, 1), (1, 1.2, 0)] {
            let level = &hierarchy.levels[k];
            let table = LevelTable::new(level, k == 0);
            let mut rng = Rng(1 + k as u64);
            let n_rhs = if k == 0 { level.n_cut() } else { level.n_rows() };
            let rhs = rng.values(n_rhs * N_LANES);
            let mut expected = field(&mut rng, level);
            let first = level.first_row(colour);
            let n = level.colours[colour].n_cells;
            let inputs = [
                bytes(&table.neighbours),
                bytes(&table.diagonal),
                bytes(&table.rhs_of_row),
                bytes(&rhs),
                bytes(&expected),
            ];
            let work = Work { first_row: first as u32, omega, ..ROWS };
            let result = run(&kernels::RELAX_CELLS, work, n * N_QUADS, &inputs);
            stencil::relax_cells(first..first + n as usize, N_LANES, omega, &table, &rhs, &mut expected);
            assert_close(&result, &expected, ROW_TOLERANCE);
        }
    });
}

#[test]
fn jacobi_cells_matches_cpu() {
    hierarchy_of(|hierarchy, _| {
        let level = &hierarchy.levels[0];
        let table = LevelTable::new(level, true);
        let mut rng = Rng(2);
        let rhs = rng.values(level.n_cut() * N_LANES);
        let u_in = field(&mut rng, level);
        let mut expected = vec![0.5; u_in.len()];
        let inputs = [
            bytes(&table.neighbours),
            bytes(&table.diagonal),
            bytes(&table.rhs_of_row),
            bytes(&rhs),
            bytes(&u_in),
            bytes(&expected),
        ];
        let result = run(&kernels::JACOBI_CELLS, ROWS, level.n_rows() as u32 * N_QUADS, &inputs);
        stencil::jacobi_cells(0..level.n_rows(), N_LANES, &table, &rhs, &u_in, &mut expected);
        assert_close(&result, &expected, ROW_TOLERANCE);
    });
}

#[test]
fn change_norms_matches_cpu() {
    const N_ROWS: usize = 1013;
    for first in [true, false] {
        let mut rng = Rng(3);
        let (old, new) = (rng.values(N_ROWS * N_LANES), rng.values(N_ROWS * N_LANES));
        let mut expected = rng.values(N_ROWS);
        let work = Work { mode: if first { mode::CHANGE_FIRST } else { 0 }, ..ROWS };
        let inputs = [bytes(&old), bytes(&new), bytes(&expected)];
        let result = run(&kernels::CHANGE_NORMS, work, N_ROWS as u32, &inputs);
        stencil::change_norms(N_LANES, first, &old, &new, &mut expected);
        assert_close(&result, &expected, ROW_TOLERANCE);
    }
}

#[test]
fn residual_matches_cpu() {
    hierarchy_of(|hierarchy, _| {
        for k in [0, 1] {
            let level = &hierarchy.levels[k];
            let table = LevelTable::new(level, k == 0);
            let mut rng = Rng(4);
            let n_rhs = if k == 0 { level.n_cut() } else { level.n_rows() };
            let mut rhs = rng.values(n_rhs * N_LANES);
            if k > 0 {
                // Coarse right-hand sides also have a row of zeros.
                let zero = level.zero_row() as usize;
                rhs[zero * N_LANES..(zero + 1) * N_LANES].fill(0.0);
            }
            let u = field(&mut rng, level);
            let n_rows = level.first_row(1);
            let mut expected = vec![0.5; n_rows * N_LANES];
            let inputs = [
                bytes(&table.neighbours),
                bytes(&table.diagonal),
                bytes(&table.rhs_of_row),
                bytes(&rhs),
                bytes(&u),
                bytes(&expected),
            ];
            let result = run(&kernels::RESIDUAL, ROWS, n_rows as u32 * N_QUADS, &inputs);
            stencil::residual(n_rows, N_LANES, &table, &rhs, &u, &mut expected);
            assert_close(&result, &expected, ROW_TOLERANCE);
            assert!(result[(n_rows - 1) * N_LANES..].iter().all(|&r| r == 0.0), "the zero row is still zero");
        }
    });
}

#[test]
fn restrict_residual_matches_cpu() {
    hierarchy_of(|hierarchy, _| {
        let (fine, coarse) = (&hierarchy.levels[0], &hierarchy.levels[1]);
        let table = TransferTable::new(fine, coarse, &hierarchy.transfers[0]);
        let red = &field(&mut Rng(5), fine)[..fine.first_row(1) * N_LANES];
        let mut expected = vec![0.5; coarse.n_rows() * N_LANES];
        let inputs = [bytes(&table.around), bytes(red), bytes(&expected)];
        let result = run(&kernels::RESTRICT_RESIDUAL, ROWS, coarse.n_rows() as u32 * N_QUADS, &inputs);
        stencil::restrict_residual(N_LANES, &table.around, red, &mut expected);
        assert_close(&result, &expected, ROW_TOLERANCE);
    });
}

#[test]
fn prolong_correction_matches_cpu() {
    hierarchy_of(|hierarchy, _| {
        let (fine, coarse) = (&hierarchy.levels[0], &hierarchy.levels[1]);
        let transfer = &hierarchy.transfers[0];
        let table = TransferTable::new(fine, coarse, transfer);
        for (prolong, bits) in
            [(ProlongationMode::Correct, 0), (ProlongationMode::Replace, mode::PROLONG_REPLACE)]
        {
            for (n_sources, entries, count) in
                [(2, &table.faces, transfer.faces.len()), (8, &table.corners, transfer.corners.len())]
            {
                let mut rng = Rng(6);
                let from = field(&mut rng, coarse);
                let mut expected = field(&mut rng, fine);
                let inputs = [bytes(entries), bytes(&from), bytes(&expected)];
                let work = Work { mode: bits, n_sources, ..ROWS };
                let result = run(&kernels::PROLONG_CORRECTION, work, count as u32 * N_QUADS, &inputs);
                stencil::prolong_correction(
                    N_LANES,
                    prolong,
                    n_sources as usize,
                    entries,
                    &from,
                    &mut expected,
                );
                assert_close(&result, &expected, ROW_TOLERANCE);
            }
        }
    });
}

/// Asserts that the results of GPU and CPU are close, relative to the largest value.
#[track_caller]
fn assert_sums_close(gpu: &[f32], cpu: &[f32]) {
    let largest = cpu.iter().fold(0.0f32, |m, x| m.max(x.abs()));
    assert_close(gpu, cpu, SUM_TOLERANCE * largest);
}

#[test]
fn sum_squares_matches_cpu() {
    for n_quads in [1, 255, 4096, 9001] {
        let values = Rng(7).values(4 * n_quads);
        let expected = stencil::sum_squares(&values);
        let room = vec![0.0f32; expected.len()];
        let result = run(&kernels::SUM_SQUARES, ROWS, n_quads as u32, &[bytes(&values), bytes(&room)]);
        assert_sums_close(&result, &expected);
    }
}

#[test]
fn sum_roots_matches_cpu() {
    for n in [1, 257, 4097, 12_289] {
        let values = Rng(8).values(n);
        let expected = stencil::sum_roots(&values);
        let room = vec![0.0f32; expected.len()];
        let result = run(&kernels::SUM_ROOTS, ROWS, n as u32, &[bytes(&values), bytes(&room)]);
        assert_sums_close(&result, &expected);
    }
}

#[test]
fn reduce_sum_matches_cpu() {
    for n in [1, 255, 256, 10_007] {
        let values = Rng(9).values(n);
        let work = Work { first_row: 2, ..ROWS };
        let result = run(&kernels::REDUCE_SUM, work, n as u32, &[bytes(&values), bytes(&[0.0f32; 3])]);
        assert_sums_close(&result, &[0.0, 0.0, stencil::reduce_sum(&values)]);
    }
}

#[test]
fn sample_weights_matches_cpu() {
    hierarchy_of(|hierarchy, stencils| {
        let table = SamplingTable::new(stencils);
        assert!(!table.hats.is_empty(), "some vertices are near the cage");
        let u = field(&mut Rng(10), &hierarchy.levels[0]);
        // Sample the second batch, starting at a later vertex.
        let (first_vertex, first_column) = (5, N_LANES);
        let n = stencils.len() - first_vertex;
        let mut expected = vec![0.5; n * N_LANES];
        let inputs =
            [bytes(&table.starts), bytes(&table.nodes), bytes(&table.hats), bytes(&u), bytes(&expected)];
        let work = Work { first_row: first_vertex as u32, first_quad: N_QUADS, ..ROWS };
        let result = run(&kernels::SAMPLE_WEIGHTS, work, n as u32 * N_QUADS, &inputs);
        let vertices = first_vertex..stencils.len();
        stencil::sample_weights(vertices, N_LANES, first_column, &table, &u, &mut expected);
        assert_close(&result, &expected, ROW_TOLERANCE);
    });
}
