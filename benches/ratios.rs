//! The ratios that bars are set on, each measured within one run: what a solve costs in sweeps, what a finer grid
//! costs, and how much faster the embedded method is than the published one.

use cagework_benches::{GRIDS, Input, fastest_ms, resident_workspaces, solve_all};
use cagework_core::bind::{Method, Solver};
use cagework_core::report::Timings;
use cagework_core::solve::multigrid::Workspace;

/// How often a fast thing is measured.
const TIMES: usize = 20;

/// How often a bind of seconds is measured.
const TIMES_SLOW: usize = 3;

fn main() {
    // `cargo test --benches` runs this too, and wants to know only that it compiles.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let input = Input::load();
    for grid in GRIDS {
        let hierarchy = input.hierarchy(grid);
        let mut all = resident_workspaces(&hierarchy);
        let sweep = fastest_ms(TIMES, || all.iter_mut().for_each(|w| w.sweep(&hierarchy)));
        drop(all);
        let mut workspace = Workspace::new(&hierarchy);
        let solve = fastest_ms(TIMES, || solve_all(&mut workspace, &hierarchy));
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
