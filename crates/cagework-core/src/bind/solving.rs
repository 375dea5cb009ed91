//! Solve batch after batch, sample each and keep only the samples.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::progress::{Cancelled, Stage};
use crate::sample::Stencils;
use crate::solve::hierarchy::Hierarchy;
use crate::solve::jacobi::{self, StopRule};
use crate::solve::multigrid::{BatchReport, Stop, Workspace, histories};
use crate::solve::rows::Row;
use crate::solve::team::Team;

use super::pipeline::Solved;
use super::voxels::Voxels;
use super::watch::Watch;
use super::{BindOptions, Solver};

/// Delta falls roughly by this factor from the first sweep to tau: for the progress bar only.
const JACOBI_DECADES: f32 = 4.0;

pub(super) fn solve_and_sample(
    voxels: &Voxels,
    stencils: &Stencils,
    options: &BindOptions,
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Solved, Cancelled> {
    match options.solver {
        Solver::Jacobi => jacobi_columns(voxels, stencils, options, team, watch),
        Solver::Multigrid => {
            Ok(multigrid_columns(voxels, stencils, options, FieldFate::Reused, team, watch)?.0)
        }
    }
}

pub(super) fn sample(stencils: &Stencils, batch: usize, field: &[Row]) -> Vec<Row> {
    let mut block = Vec::with_capacity(stencils.len());
    stencils.sample_weights(batch, field, &mut block);
    block
}

/// Microseconds that threads spent in solving and in sampling.
#[derive(Default)]
struct Spent {
    solve_us: AtomicU64,
    sample_us: AtomicU64,
}

impl Spent {
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

/// What becomes of a batch's field once it has been sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FieldFate {
    /// The next batch overwrites it.
    Reused,
    /// It is handed out.
    Kept,
}

/// A batch of columns that was solved for.
pub(super) struct SolvedBatch {
    pub(super) report: BatchReport,
    /// At the mesh's vertices. `[n_points]`
    pub(super) samples: Vec<Row>,
    /// On the finest level, if it is kept. `[n_rows]`
    pub(super) field: Vec<Row>,
}

/// Hears of each cycle and its delta; stops the solve by returning false.
type CycleDone<'a> = &'a mut dyn FnMut(u32, f64) -> bool;

/// Solves a batch; none if it was stopped.
type SolveBatch<'a> = &'a (dyn Fn(&mut Workspace, usize, CycleDone<'_>) -> Option<BatchReport> + Sync);

/// Samples a batch from its field, `[n_rows]`.
type SampleBatch<'a> = &'a (dyn Fn(usize, &[Row]) -> Vec<Row> + Sync);

/// Solves batches, shared among threads: `solve(workspace, batch, progress)` solves one, `sample(batch, field)` takes its samples.
pub(super) fn solve_batches(
    hierarchy: &Hierarchy,
    n_batches: usize,
    fate: FieldFate,
    team: &Team,
    watch: &Watch<'_>,
    solve: SolveBatch<'_>,
    sample: SampleBatch<'_>,
) -> Result<(Vec<SolvedBatch>, f64), Cancelled> {
    let spent = Spent::default();
    let solved: Vec<Option<SolvedBatch>> = team.share(
        n_batches,
        || Workspace::new(hierarchy),
        |workspace, batch| {
            let begin = watch.now_ms();
            let report = solve(workspace, batch, &mut |cycle, delta| {
                let fraction = watch.done() as f32 / n_batches as f32;
                watch.report(Stage::Solve, fraction, cycle, Some(delta as f32)).is_ok()
            })?;
            let solved = watch.now_ms();
            let samples = sample(batch, workspace.field());
            let field = if fate == FieldFate::Kept { workspace.take_field() } else { Vec::new() };
            spent.add([begin, solved, watch.now_ms()]);
            watch.piece_done(Stage::Solve, n_batches).ok()?;
            Some(SolvedBatch { report, samples, field })
        },
    );
    let solved = solved.into_iter().collect::<Option<_>>().ok_or(Cancelled)?;
    Ok((solved, spent.solve_share()))
}

/// When each of so many batches is done. They add up in squares: each may keep its share of tau.
pub(super) fn stop_of_batches(tau: f32, max_cycles: u32, n_batches: usize) -> Stop {
    Stop::new(f64::from(tau) / (n_batches.max(1) as f64).sqrt(), max_cycles)
}

/// All columns by multigrid, and the batches' fields if they are kept.
pub(super) fn multigrid_columns(
    voxels: &Voxels,
    stencils: &Stencils,
    options: &BindOptions,
    fate: FieldFate,
    team: &Team,
    watch: &Watch<'_>,
) -> Result<(Solved, Vec<Vec<Row>>), Cancelled> {
    let hierarchy = &voxels.hierarchy;
    let n_batches = hierarchy.n_batches();
    let stop = stop_of_batches(options.tau, options.max_iterations, n_batches);
    let (batches, solve_share) = solve_batches(
        hierarchy,
        n_batches,
        fate,
        team,
        watch,
        &|workspace, batch, progress| workspace.solve(hierarchy, batch, stop, progress),
        &|batch, field| sample(stencils, batch, field),
    )?;
    let kept: usize = batches.iter().map(|b| size_of_val(b.field.as_slice())).sum();
    let mut solved = Solved {
        field_bytes: Workspace::bytes(hierarchy) * team.n_threads().min(n_batches) + kept,
        solve_share,
        blocks: Vec::with_capacity(n_batches),
        ..Solved::default()
    };
    solved.converged_as(&batches.iter().map(|b| &b.report).collect::<Vec<_>>());
    let mut fields = Vec::new();
    for batch in batches {
        solved.blocks.push(batch.samples);
        fields.push(batch.field);
    }
    Ok((solved, fields))
}

impl Solved {
    /// Takes down how the batches converged.
    pub(super) fn converged_as(&mut self, reports: &[&BatchReport]) {
        [self.delta_history, self.residual_history] = histories(reports);
        self.delta_interval = 1;
        self.iterations = self.delta_history.len() as u32;
        self.converged = reports.iter().all(|r| r.converged);
    }
}

fn jacobi_columns(
    voxels: &Voxels,
    stencils: &Stencils,
    options: &BindOptions,
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Solved, Cancelled> {
    let hierarchy = &voxels.hierarchy;
    let stop = StopRule { tau: options.tau, max_sweeps: options.max_iterations, norm: options.delta_norm };
    let begin = watch.now_ms();
    let (fields, report) = jacobi::solve(hierarchy, team, stop, |sweeps, delta| {
        let to_go = (delta / options.tau).max(1.0).log10() / JACOBI_DECADES;
        watch.report(Stage::Solve, 1.0 - to_go, sweeps, Some(delta)).is_ok()
    })?;
    let solved = watch.now_ms();
    let blocks = team.share(fields.len(), || (), |(), batch| sample(stencils, batch, &fields[batch]));
    let spent = Spent::default();
    spent.add([begin, solved, watch.now_ms()]);
    let level = &hierarchy.levels[0];
    Ok(Solved {
        blocks,
        iterations: report.delta_history.len() as u32,
        converged: report.converged,
        delta_history: report.delta_history,
        delta_interval: 1,
        field_bytes: jacobi::field_bytes(
            level.n_unknowns() as u64,
            level.n_cut() as u64,
            hierarchy.n_columns as u64,
            team.n_threads() as u64,
        ) as usize,
        solve_share: spent.solve_share(),
        ..Solved::default()
    })
}
