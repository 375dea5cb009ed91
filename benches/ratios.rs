//! Ratios of times measured in the same run: the cost of a solve in sweeps, the cost of a finer grid, and the speed-up
//! of the embedded method over the classic (published) method.

use cagework_benches::{GRIDS, Input, fastest_ms, resident_workspaces, solve_batch};
use cagework_core::options::{Method, Solver};
use cagework_core::report::Timings;
use cagework_core::solve::multigrid::Workspace;

/// Number of repetitions; the fastest time counts.
const TIMES: usize = 60;

/// Number of repetitions of binds that take seconds.
const TIMES_SLOW: usize = 3;

/// Sums the shortest time of `call(batch)` over all batches, ms. The batches are called in turn, so that each batch
/// finds the processor's caches as the previous batch left them.
fn fastest_sum_ms(n_batches: usize, mut call: impl FnMut(usize)) -> f64 {
    let mut fastest = vec![f64::INFINITY; n_batches];
    for _ in 0..TIMES {
        for (batch, fastest) in fastest.iter_mut().enumerate() {
            *fastest = fastest.min(fastest_ms(1, || call(batch)));
        }
    }
    fastest.iter().sum()
}

fn main() {
    // `cargo test --benches` also runs this program, without `--bench`. Skip the measurements then.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let input = Input::load();
    for grid in GRIDS {
        let hierarchy = input.hierarchy(grid);
        let mut all = resident_workspaces(&hierarchy);
        let sweep = fastest_sum_ms(all.len(), |batch| all[batch].sweep(&hierarchy));
        drop(all);
        let mut workspace = Workspace::new(&hierarchy);
        let solve = fastest_sum_ms(hierarchy.n_batches(), |batch| {
            solve_batch(&mut workspace, &hierarchy, batch);
        });
        println!(
            "g = {grid}: solve costs {:.1} sweeps ({solve:.1} ms over {sweep:.2} ms, all columns, one thread)",
            solve / sweep
        );
    }
    for (name, threads) in [("one thread", 1), ("all threads", 0)] {
        let times = GRIDS.map(|grid| {
            let binds = (0..TIMES).map(|_| input.bind(Method::Embedded, Solver::Multigrid, grid, threads));
            let fastest = binds
                .map(|binding| binding.report.timings_ms)
                .min_by(|a, b| a.total.total_cmp(&b.total))
                .expect("at least one bind");
            let Timings { voxelize, solve, sample, total } = fastest;
            println!(
                "embedded multigrid, {name}, g = {grid}: {total:.1} ms \
                 (voxelize {voxelize:.1}, solve {solve:.1}, sample {sample:.1})"
            );
            total
        });
        println!(
            "embedded multigrid, {name}: g = 128 takes {:.1} times as long as g = 64",
            times[2] / times[1]
        );
        for (solver, which) in [(Solver::Jacobi, "Jacobi"), (Solver::Multigrid, "multigrid")] {
            let classic = fastest_ms(TIMES_SLOW, || drop(input.bind(Method::Classic, solver, 64, threads)));
            println!(
                "classic {which}, {name}, g = 64: {classic:.0} ms, {:.1} times embedded multigrid",
                classic / times[1]
            );
        }
    }
}
