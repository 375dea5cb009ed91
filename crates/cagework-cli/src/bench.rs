//! `cagework bench`: times the published method (classic grid, Jacobi) and the default method (embedded boundary,
//! multigrid), each on one thread and on all threads.

use std::fmt::Write as _;

use cagework_core::options::{BindOptions, Method, Solver};
use cagework_core::report::Timings;
use cagework_core::{BindReport, Cage};
use cagework_io::{Model, UpAxis, shown};
use serde::Serialize;

use crate::args::{BenchArgs, ControlArgs, MemoryArgs};
use crate::bind::bind_model;
use crate::card::duration;
use crate::error::CliError;
use crate::files::{json, print};
use crate::load::{built_in, load_cage, load_model};

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct Bench {
    mesh: String,
    vertices: usize,
    cage_vertices: usize,
    /// Number of threads in the cases that use all threads.
    threads: usize,
    runs: u32,
    grids: Vec<GridBench>,
}

/// Results on one grid.
#[derive(Debug, Serialize)]
struct GridBench {
    grid: u32,
    cases: Vec<Case>,
    /// Ratios of the median total times of the cases.
    ratios: Ratios,
}

/// Timings of one method with one number of threads.
#[derive(Debug, Serialize)]
struct Case {
    method: Method,
    solver: Solver,
    threads: usize,
    iterations: u32,
    converged: bool,
    /// Median time of each stage over all runs.
    median_ms: Timings,
    min_total_ms: f64,
    max_total_ms: f64,
}

/// Ratios of median total times. A value above 1 means that the first case named is slower.
#[derive(Clone, Copy, Debug, Serialize)]
struct Ratios {
    /// Classic Jacobi over embedded multigrid, both with one thread.
    classic_over_embedded_one_thread: f64,
    /// Classic Jacobi over embedded multigrid, both with all threads.
    classic_over_embedded_all_threads: f64,
    /// Classic Jacobi: time with one thread over time with all threads.
    classic_threads: f64,
    /// Embedded multigrid: time with one thread over time with all threads.
    embedded_threads: f64,
}

/// Method, solver and number of threads (0 for all) of each case, in the order that [`Ratios::of`] expects.
const CASES: [(Method, Solver, usize); 4] = [
    (Method::Classic, Solver::Jacobi, 1),
    (Method::Classic, Solver::Jacobi, 0),
    (Method::Embedded, Solver::Multigrid, 1),
    (Method::Embedded, Solver::Multigrid, 0),
];

/// Runs `cagework bench`.
///
/// # Errors
/// If a file cannot be read, or a bind fails or is cancelled.
pub(crate) fn run(args: &BenchArgs, as_json: bool) -> Result<(), CliError> {
    let (name, model, cage) = match (&args.mesh, &args.cage) {
        (Some(mesh), Some(cage)) => {
            let model = load_model(mesh, UpAxis::Y, MemoryArgs::default())?;
            let cage = load_cage(cage, &model, MemoryArgs::default(), &ControlArgs::default())?.cage;
            (mesh.display().to_string(), model, cage)
        }
        _ => {
            let sample = built_in()?;
            (format!("built-in sample, {}", sample.name), sample.model, sample.cage)
        }
    };
    let grids =
        args.grid.iter().map(|&g| bench_grid(&model, &cage, g, args.runs)).collect::<Result<_, _>>()?;
    let bench = Bench {
        mesh: name,
        vertices: model.positions.len(),
        cage_vertices: cage.positions().len(),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        runs: args.runs,
        grids,
    };
    print(&if as_json { json(&bench) } else { text(&bench) })
}

fn bench_grid(model: &Model, cage: &Cage, grid: u32, runs: u32) -> Result<GridBench, CliError> {
    let mut reports: [Vec<BindReport>; CASES.len()] = Default::default();
    // Interleave the cases, so that a change in the machine's speed affects all of them equally and cancels in the
    // ratios.
    for _ in 0..runs {
        for (reports, (method, solver, threads)) in reports.iter_mut().zip(CASES) {
            let options = BindOptions { grid, method, solver, threads, ..BindOptions::default() };
            reports.push(bind_model(model, cage, &options)?.report);
        }
    }
    let cases = reports.each_ref().map(|reports| Case::of(reports));
    let ratios = Ratios::of(&cases);
    Ok(GridBench { grid, cases: cases.into(), ratios })
}

impl Case {
    /// Summarises the bind reports of one case. `reports` must not be empty.
    fn of(reports: &[BindReport]) -> Self {
        let sorted = |time: fn(&Timings) -> f64| -> Vec<f64> {
            let mut times: Vec<f64> = reports.iter().map(|r| time(&r.timings_ms)).collect();
            times.sort_by(f64::total_cmp);
            times
        };
        let total = sorted(|t| t.total);
        let last = &reports[reports.len() - 1];
        Self {
            method: last.method,
            solver: last.solver,
            threads: last.threads,
            iterations: last.iterations,
            converged: last.converged,
            median_ms: Timings {
                voxelize: median(&sorted(|t| t.voxelize)),
                solve: median(&sorted(|t| t.solve)),
                sample: median(&sorted(|t| t.sample)),
                total: median(&total),
            },
            min_total_ms: total[0],
            max_total_ms: total[total.len() - 1],
        }
    }
}

impl Ratios {
    fn of(cases: &[Case; CASES.len()]) -> Self {
        let [classic_one, classic_all, embedded_one, embedded_all] =
            cases.each_ref().map(|case| case.median_ms.total);
        Self {
            classic_over_embedded_one_thread: classic_one / embedded_one,
            classic_over_embedded_all_threads: classic_all / embedded_all,
            classic_threads: classic_one / classic_all,
            embedded_threads: embedded_one / embedded_all,
        }
    }
}

/// Median of sorted values. `sorted` must not be empty.
fn median(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    0.5 * (sorted[(n - 1) / 2] + sorted[n / 2])
}

fn text(bench: &Bench) -> String {
    let mut out = format!(
        "{}: {} vertices, {} cage vertices; medians of {} binds\n",
        shown(&bench.mesh),
        bench.vertices,
        bench.cage_vertices,
        bench.runs
    );
    for grid in &bench.grids {
        let _ = writeln!(
            out,
            "\ngrid {}\n  {:<22}{:>8}{:>12}{:>12}{:>12}{:>12}{:>12}",
            grid.grid, "method", "threads", "iterations", "voxelize", "solve", "sample", "total"
        );
        for case in &grid.cases {
            let name = match case.method {
                Method::Classic => "classic Jacobi",
                Method::Embedded => "embedded multigrid",
            };
            let t = case.median_ms;
            let _ = writeln!(
                out,
                "  {name:<22}{:>8}{:>12}{:>12}{:>12}{:>12}{:>12}{}",
                case.threads,
                case.iterations,
                duration(t.voxelize),
                duration(t.solve),
                duration(t.sample),
                duration(t.total),
                if case.converged { "" } else { "  NOT converged" }
            );
        }
        let r = grid.ratios;
        let _ = writeln!(
            out,
            "  embedded multigrid is {:.0} times as fast as classic Jacobi on one thread, {:.0} times on all;\n  \
             all threads are {:.2} times as fast as one for classic Jacobi, {:.2} times for embedded multigrid",
            r.classic_over_embedded_one_thread,
            r.classic_over_embedded_all_threads,
            r.classic_threads,
            r.embedded_threads
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    #[expect(clippy::float_cmp, reason = "halves of small whole numbers are exact")]
    fn median_averages_the_two_middle_values() {
        assert_eq!(median(&[3.0]), 3.0);
        assert_eq!(median(&[1.0, 2.0, 9.0]), 2.0);
        assert_eq!(median(&[1.0, 2.0, 5.0, 9.0]), 3.5);
    }
}
