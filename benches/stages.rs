//! Times of the stages of an embedded bind on one thread: voxelize, sweep, V-cycle, solve, sample.
#![allow(missing_docs, reason = "criterion's macros make public functions without documentation")]

use std::hint::black_box;
use std::time::Duration;

use cagework_benches::{GRIDS, Input, resident_workspaces, solve_all, solve_batch};
use cagework_core::assemble::{RowOptions, assemble};
use cagework_core::solve::BatchSolver as _;
use cagework_core::solve::multigrid::Workspace;
use cagework_core::team::Team;
use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};

fn stages(criterion: &mut Criterion) {
    let input = Input::load();
    for grid in GRIDS {
        voxelize(criterion, &input, grid);
        solve(criterion, &input, grid);
        sample(criterion, &input, grid);
    }
}

fn voxelize(criterion: &mut Criterion, input: &Input, grid: u32) {
    let mut group = criterion.benchmark_group("voxelize");
    group.bench_function(BenchmarkId::new("embedded, levels and transfers", grid), |b| {
        b.iter(|| black_box(input.hierarchy(grid)));
    });
}

fn solve(criterion: &mut Criterion, input: &Input, grid: u32) {
    let hierarchy = input.hierarchy(grid);
    let mut all = resident_workspaces(&hierarchy);
    criterion.benchmark_group("sweep").bench_function(
        BenchmarkId::new("all columns, every field in memory", grid),
        |b| {
            b.iter(|| {
                for workspace in &mut all {
                    workspace.sweep(&hierarchy);
                }
            });
        },
    );
    drop(all);
    let mut workspace = Workspace::new(&hierarchy);
    solve_batch(&mut workspace, &hierarchy, 0);
    criterion.benchmark_group("sweep").bench_function(
        BenchmarkId::new("one batch of 8 columns, repeated", grid),
        |b| {
            b.iter(|| workspace.sweep(&hierarchy));
        },
    );
    criterion.benchmark_group("V-cycle").bench_function(
        BenchmarkId::new("one batch of 8 columns", grid),
        |b| {
            b.iter(|| workspace.v_cycle(&hierarchy));
        },
    );
    criterion.benchmark_group("solve").bench_function(BenchmarkId::new("all columns", grid), |b| {
        b.iter(|| solve_all(&mut workspace, &hierarchy));
    });
}

fn sample(criterion: &mut Criterion, input: &Input, grid: u32) {
    let hierarchy = input.hierarchy(grid);
    let stencils = input.stencils(&hierarchy);
    let mut workspace = Workspace::new(&hierarchy);
    let blocks: Vec<_> = (0..hierarchy.n_batches())
        .map(|batch| {
            solve_batch(&mut workspace, &hierarchy, batch);
            let mut block = Vec::new();
            stencils.sample_weights(batch, workspace.field(), &mut block);
            block
        })
        .collect();
    let mut group = criterion.benchmark_group("sample");
    group.bench_function(BenchmarkId::new("stencils", grid), |b| {
        b.iter(|| black_box(input.stencils(&hierarchy)));
    });
    let mut block = Vec::new();
    group.bench_function(BenchmarkId::new("apply to one batch of 8 columns", grid), |b| {
        b.iter(|| stencils.sample_weights(0, workspace.field(), &mut block));
    });
    let team = Team::new(1);
    let options = RowOptions { threshold: 0.0, preserve_affine: true };
    group.bench_function(BenchmarkId::new("assemble rows", grid), |b| {
        b.iter_batched(
            || blocks.clone(),
            |mut blocks| {
                let is_outside = |v: usize| stencils.is_outside(v);
                black_box(assemble(
                    (&input.cage).into(),
                    &mut blocks,
                    &input.points,
                    options,
                    is_outside,
                    &team,
                ))
            },
            BatchSize::LargeInput,
        );
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(2));
    targets = stages
}
criterion_main!(benches);
