//! Times of whole binds by the embedded method with multigrid and by the classic (published) method with Jacobi, on one
//! thread and on all threads.
#![allow(missing_docs, reason = "criterion's macros make public functions without documentation")]

use std::hint::black_box;
use std::time::Duration;

use cagework_benches::{GRIDS, Input};
use cagework_core::options::{Method, Solver};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

fn bind(criterion: &mut Criterion) {
    let input = Input::load();
    let mut group = criterion.benchmark_group("bind");
    for (name, threads) in [("one thread", 1), ("all threads", 0)] {
        for grid in GRIDS {
            group.bench_function(BenchmarkId::new(format!("embedded multigrid, {name}"), grid), |b| {
                b.iter(|| black_box(input.bind(Method::Embedded, Solver::Multigrid, grid, threads)));
            });
        }
        // A classic bind takes seconds, so it is timed at one grid size only, the same as in benches/ratios.rs.
        group.bench_function(BenchmarkId::new(format!("classic Jacobi, {name}"), 64), |b| {
            b.iter(|| black_box(input.bind(Method::Classic, Solver::Jacobi, 64, threads)));
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(3));
    targets = bind
}
criterion_main!(benches);
