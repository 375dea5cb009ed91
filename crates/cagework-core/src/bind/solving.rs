//! Solve batch after batch, sample each and keep only the samples.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::progress::{Cancelled, Stage};
use crate::sample::Stencils;
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
        Solver::Multigrid => multigrid_columns(voxels, stencils, options, team, watch),
    }
}

fn sample(stencils: &Stencils, batch: usize, field: &[Row]) -> Vec<Row> {
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

fn multigrid_columns(
    voxels: &Voxels,
    stencils: &Stencils,
    options: &BindOptions,
    team: &Team,
    watch: &Watch<'_>,
) -> Result<Solved, Cancelled> {
    let hierarchy = &voxels.hierarchy;
    let n_batches = hierarchy.n_batches();
    let stop = Stop {
        // Batches add up in squares: each may keep its share of tau.
        tolerance: f64::from(options.tau) / (n_batches as f64).sqrt(),
        max_cycles: options.max_iterations,
    };
    let spent = Spent::default();
    let done: Vec<Option<(BatchReport, Vec<Row>)>> = team.share(
        n_batches,
        || Workspace::new(hierarchy),
        |workspace, batch| {
            let begin = watch.now_ms();
            let report = workspace.solve(hierarchy, batch, stop, |cycle, delta| {
                let fraction = watch.done() as f32 / n_batches as f32;
                watch.report(Stage::Solve, fraction, cycle, Some(delta as f32)).is_ok()
            })?;
            let solved = watch.now_ms();
            let block = sample(stencils, batch, workspace.field());
            spent.add([begin, solved, watch.now_ms()]);
            watch.piece_done(Stage::Solve, n_batches).ok()?;
            Some((report, block))
        },
    );
    let done: Vec<(BatchReport, Vec<Row>)> = done.into_iter().collect::<Option<_>>().ok_or(Cancelled)?;
    let [delta_history, residual_history] =
        histories(&done.iter().map(|(report, _)| report).collect::<Vec<_>>());
    Ok(Solved {
        iterations: delta_history.len() as u32,
        converged: done.iter().all(|(r, _)| r.converged),
        residual_history,
        delta_history,
        delta_interval: 1,
        planned_bytes: 0,
        adapter: None,
        field_bytes: Workspace::bytes(hierarchy) * team.n_threads().min(n_batches),
        solve_share: spent.solve_share(),
        blocks: done.into_iter().map(|(_, block)| block).collect(),
    })
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
        planned_bytes: 0,
        adapter: None,
        residual_history: Vec::new(),
        field_bytes: jacobi::field_bytes(
            level.n_unknowns() as u64,
            level.n_cut() as u64,
            hierarchy.n_columns as u64,
            team.n_threads() as u64,
        ) as usize,
        solve_share: spent.solve_share(),
    })
}
