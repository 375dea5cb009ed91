//! Solves batch after batch. Samples each solution at the vertices, or keeps the solutions for binding many models.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::options::{BindOptions, Solver};
use crate::progress::{Cancellation, Stage};
use crate::sample::Stencils;
use crate::solve::BatchSolver;
use crate::solve::conjugate_gradient::ConjugateGradient;
use crate::solve::hierarchy::Hierarchy;
use crate::solve::jacobi;
use crate::solve::multigrid::Workspace;
use crate::solve::rows::Row;
use crate::solve::stop::{SolveReport, StopRule};
use crate::team::Team;

use super::watch::Watch;

/// Sampled columns with statistics of the solve.
#[derive(Clone, Debug, Default)]
pub struct Solution {
    /// Sampled values, `[n_batches][n_points]` rows of lanes.
    pub blocks: Vec<Vec<Row>>,
    /// Report of the solve of all columns.
    pub report: SolveReport,
    /// Number of iterations of the solver: Jacobi sweeps, V-cycles or steps of conjugate gradients.
    pub iterations: u32,
    /// Number of iterations per delta of the report: 1 except for Jacobi sweeps on the GPU.
    pub delta_interval: u32,
    /// Peak size of the fields, bytes.
    pub field_bytes: usize,
    /// Bytes planned for fields on a device, which the host's estimate excludes; 0 if the fields are in host memory.
    pub planned_bytes: u64,
    /// Time spent solving divided by the time spent solving and sampling.
    pub solve_share: f64,
    /// Name of the GPU; `None` for the CPU.
    pub adapter: Option<String>,
}

/// Solves all columns and samples them.
///
/// # Errors
/// [`Cancellation`] if the progress callback cancels the bind.
pub(super) fn solve_and_sample(
    hierarchy: &Hierarchy,
    stencils: &Stencils,
    options: &BindOptions,
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Solution, Cancellation> {
    if options.solver == Solver::Jacobi {
        let begin = watch.now_ms();
        let (fields, mut solved) = jacobi_fields(hierarchy, options, team, watch)?;
        let sampling = watch.now_ms();
        solved.blocks = sample_fields(stencils, &fields, team);
        let spent = SolveTimes::default();
        spent.add([begin, sampling, watch.now_ms()]);
        solved.solve_share = spent.solve_share();
        return Ok(solved);
    }
    let take = |batch, field: &[Row]| sample(stencils, batch, field);
    let (blocks, solved) = solve_batches(hierarchy, options, team, watch, take)?;
    Ok(Solution { blocks, ..solved })
}

/// Solves all columns and returns their fields, `[n_batches][n_rows]`, for [`sample_fields`].
///
/// # Errors
/// [`Cancellation`] if the progress callback cancels the bind.
pub(super) fn solve_fields(
    hierarchy: &Hierarchy,
    options: &BindOptions,
    team: &Team,
    watch: &Watch<'_>,
) -> Result<(Vec<Vec<Row>>, Solution), Cancellation> {
    if options.solver == Solver::Jacobi {
        return jacobi_fields(hierarchy, options, team, watch);
    }
    solve_batches(hierarchy, options, team, watch, |_, field: &[Row]| field.to_vec())
}

/// Samples the `fields` of all batches at the points of the stencils. `[n_batches][n_points]`
pub(super) fn sample_fields(stencils: &Stencils, fields: &[Vec<Row>], team: &Team) -> Vec<Vec<Row>> {
    team.share(fields.len(), || (), |(), batch| sample(stencils, batch, &fields[batch]))
}

/// Solves batch after batch and collects `take(batch, field)`.
fn solve_batches<T: Send>(
    hierarchy: &Hierarchy,
    options: &BindOptions,
    team: &Team,
    watch: &Watch<'_>,
    take: impl Fn(usize, &[Row]) -> T + Sync,
) -> Result<(Vec<T>, Solution), Cancellation> {
    let n_batches = hierarchy.n_batches();
    let rule = options.stop_rule().of_batch(n_batches);
    let (spent, bytes) = (SolveTimes::default(), AtomicU64::new(0));
    let solved: Vec<Option<(SolveReport, T)>> = team.share(
        n_batches,
        || batch_solver(hierarchy, options, team.n_threads().min(n_batches)),
        |solver, batch| {
            // The first progress report of a batch comes after the most expensive part of its solve, so poll for
            // cancellation first.
            if watch.is_cancelled() {
                return None;
            }
            let begin = watch.now_ms();
            let report = solver.solve(hierarchy, batch, rule, &mut |iteration, delta| {
                let fraction = watch.done() as f32 / n_batches as f32;
                watch.report(Stage::Solve, fraction, iteration, Some(delta as f32)).is_ok()
            })?;
            let solved = watch.now_ms();
            let taken = take(batch, solver.field());
            spent.add([begin, solved, watch.now_ms()]);
            bytes.fetch_max(solver.bytes() as u64, Ordering::Relaxed);
            watch.piece_done(Stage::Solve, n_batches).ok()?;
            Some((report, taken))
        },
    );
    let solved: Vec<_> = solved.into_iter().collect::<Option<_>>().ok_or(Cancellation)?;
    let (reports, taken): (Vec<_>, Vec<_>) = solved.into_iter().unzip();
    let report = SolveReport::together(&reports);
    let solved = Solution {
        iterations: report.latest().0,
        delta_interval: 1,
        report,
        field_bytes: bytes.into_inner() as usize * team.n_threads().min(n_batches),
        solve_share: spent.solve_share(),
        ..Solution::default()
    };
    Ok((taken, solved))
}

/// `threads`: number of threads that have a solver.
fn batch_solver(hierarchy: &Hierarchy, options: &BindOptions, threads: usize) -> Box<dyn BatchSolver> {
    match options.solver {
        Solver::ConjugateGradient => Box::new(ConjugateGradient::new(hierarchy)),
        Solver::Multigrid | Solver::Jacobi => {
            let workspace = Workspace::new(hierarchy);
            let with_fallback = workspace.bytes() + ConjugateGradient::bytes_of(hierarchy);
            let needed = options.held + (hierarchy.bytes() + threads * with_fallback) as u64;
            Box::new(if needed <= options.memory_limit { workspace } else { workspace.without_fallback() })
        }
    }
}

fn sample(stencils: &Stencils, batch: usize, field: &[Row]) -> Vec<Row> {
    let mut block = Vec::with_capacity(stencils.len());
    stencils.sample_weights(batch, field, &mut block);
    block
}

/// Microseconds spent on solving and on sampling, over all threads.
#[derive(Default)]
struct SolveTimes {
    solve_us: AtomicU64,
    sample_us: AtomicU64,
}

impl SolveTimes {
    fn add(&self, times_ms: [f64; 3]) {
        self.solve_us.fetch_add(((times_ms[1] - times_ms[0]) * 1e3) as u64, Ordering::Relaxed);
        self.sample_us.fetch_add(((times_ms[2] - times_ms[1]) * 1e3) as u64, Ordering::Relaxed);
    }

    fn solve_share(&self) -> f64 {
        let solve = self.solve_us.load(Ordering::Relaxed) as f64;
        let all = solve + self.sample_us.load(Ordering::Relaxed) as f64;
        if all > 0.0 { solve / all } else { 1.0 }
    }
}

fn jacobi_fields(
    hierarchy: &Hierarchy,
    options: &BindOptions,
    team: &Team,
    watch: &Watch<'_>,
) -> Result<(Vec<Vec<Row>>, Solution), Cancellation> {
    let rule = options.stop_rule();
    let (fields, report) = jacobi::solve(hierarchy, team, rule, |sweeps, delta| {
        watch.report(Stage::Solve, rule.jacobi_progress(delta), sweeps, Some(delta as f32)).is_ok()
    })?;
    let level = &hierarchy.levels[0];
    let solved = Solution {
        iterations: report.latest().0,
        delta_interval: 1,
        report,
        field_bytes: jacobi::field_bytes(
            level.n_unknowns() as u64,
            level.n_cut() as u64,
            hierarchy.n_columns as u64,
            team.n_threads() as u64,
        ) as usize,
        solve_share: 1.0,
        ..Solution::default()
    };
    Ok((fields, solved))
}

impl BindOptions {
    /// Stopping rule of a solve of all columns.
    #[must_use]
    pub fn stop_rule(&self) -> StopRule {
        StopRule { tolerance: f64::from(self.tau), max_iterations: self.max_iterations }
    }
}
