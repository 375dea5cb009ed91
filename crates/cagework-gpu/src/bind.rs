//! The bind on the GPU: geometry and assembly are the CPU's own, what lies between runs as kernels.

use cagework_core::bind::pipeline::{FieldsOn, Prepared, Solved};
use cagework_core::bind::{BindOptions, Rebinder, Solver, Watch};
use cagework_core::solve::jacobi::StopRule;
use cagework_core::solve::multigrid::{BatchReport, Stop, histories};
use cagework_core::solve::rows::{Row, ZERO};
use cagework_core::{Binding, Cage, Progress};
use glam::Vec3;

use crate::buffers::Allocator;
use crate::deform::GpuWeights;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::jacobi::{INTERVAL, Jacobi};
use crate::multigrid::Multigrid;
use crate::plan::{Fields, Plan};
use crate::sample::{Sampler, scatter};
use crate::stream::Stream;

/// Delta falls roughly by this factor from the first sweep to tau: for the progress bar only.
const JACOBI_DECADES: f32 = 4.0;

/// V-cycles that a batch usually takes: for the progress bar only.
const USUAL_CYCLES: f32 = 5.0;

/// What a bind makes room for, in error messages.
const ROOM: &str = "the fields of a bind";

/// What a solve leaves besides its blocks.
#[derive(Default)]
struct Outcome {
    iterations: u32,
    converged: bool,
    delta_history: Vec<f32>,
    delta_interval: u32,
    residual_history: Vec<f32>,
    solve_ms: f64,
    /// Bytes on the GPU.
    allocated: u64,
}

/// [`cagework_core::bind()`] on the GPU: the same grid, stencils and assembly, the same weights to 1e-4. The weights are
/// on the GPU afterwards as well.
///
/// `options.memory_limit` holds for the GPU's buffers and for the CPU's arrays, each.
///
/// # Errors
/// Those of a bind, [`crate::PlanError`] if it does not fit, or the GPU failed.
pub async fn bind_gpu(
    positions: &[Vec3],
    cage: &Cage,
    options: &BindOptions,
    progress: &dyn Progress,
    context: &GpuContext,
) -> Result<(Binding, GpuWeights), GpuError> {
    let (binding, _) = bind_gpu_to_edit(positions, cage, options, 0, progress, context).await?;
    let weights = GpuWeights::new(context, &binding.weights, &binding.outside).await?;
    Ok((binding, weights))
}

/// [`bind_gpu`] for weights that go elsewhere: nothing is uploaded.
///
/// # Errors
/// As [`bind_gpu`].
pub async fn bind_on(
    positions: &[Vec3],
    cage: &Cage,
    options: &BindOptions,
    progress: &dyn Progress,
    context: &GpuContext,
) -> Result<Binding, GpuError> {
    Ok(bind_gpu_to_edit(positions, cage, options, 0, progress, context).await?.0)
}

/// [`bind_gpu`] for a cage that will be edited: the fields are read back, so that the next bind can start from them, on the
/// CPU. Without them if there are none to keep ([`Rebinder::can_keep`]) or if they and the CPU's arrays exceed
/// `most_to_keep`, bytes.
///
/// # Errors
/// As [`bind_gpu`].
pub async fn bind_gpu_to_edit(
    positions: &[Vec3],
    cage: &Cage,
    options: &BindOptions,
    most_to_keep: u64,
    progress: &dyn Progress,
    context: &GpuContext,
) -> Result<(Binding, Option<Rebinder>), GpuError> {
    let watch = Watch::new(progress);
    let mut prepared = Prepared::new(positions, cage, options, FieldsOn::Device, &watch)?;
    let (hierarchy, stencils) = (prepared.hierarchy(), prepared.stencils());
    let plan = |fields| {
        let limit = options.memory_limit;
        Plan::new(hierarchy, stencils, options.solver, context.max_binding_bytes, limit, fields)
    };
    let keep = Rebinder::can_keep(options) && Rebinder::bytes_to_keep(&prepared) <= most_to_keep;
    let (plan, fate) = match keep.then(|| plan(Fields::ReadBack)) {
        Some(Ok(plan)) => (plan, Fields::ReadBack),
        // Without them it may fit.
        _ => (plan(Fields::Dropped)?, Fields::Dropped),
    };
    if fate == Fields::Dropped {
        prepared.forget_edits();
    }
    let (solved, fields) = solve_and_sample(&prepared, options, (&plan, fate), &watch, context).await?;
    if fate == Fields::Dropped {
        return Ok((prepared.finish(solved, &watch)?, None));
    }
    let (rebinder, binding) = Rebinder::taken_over(prepared, solved, fields, most_to_keep, &watch)?;
    Ok((binding, Some(rebinder)))
}

/// Solves all columns. Returns what [`Prepared::finish`] needs, and the fields as the CPU would have kept them, none if they
/// are dropped: `[n_batches of LANES][n_rows]`.
async fn solve_and_sample(
    prepared: &Prepared<'_>,
    options: &BindOptions,
    (plan, fate): (&Plan, Fields),
    watch: &Watch<'_>,
    context: &GpuContext,
) -> Result<(Solved, Vec<Vec<Row>>), GpuError> {
    let (hierarchy, stencils) = (prepared.hierarchy(), prepared.stencils());
    let n_batches = hierarchy.n_batches();
    let mut blocks: Vec<Vec<Row>> = vec![vec![ZERO; stencils.len()]; n_batches];
    let n_kept = if fate == Fields::ReadBack { n_batches } else { 0 };
    let mut fields: Vec<Vec<Row>> = vec![vec![ZERO; hierarchy.levels[0].n_rows()]; n_kept];
    let began = watch.now_ms();
    let mut stream = Stream::new(context, watch).await?;
    let outcome = match options.solver {
        Solver::Multigrid => {
            multigrid(prepared, options, plan, &mut stream, &mut blocks, &mut fields).await?
        }
        Solver::Jacobi => jacobi(prepared, options, plan, &mut stream, &mut blocks).await?,
    };
    let all_ms = watch.now_ms() - began;
    let solved = Solved {
        blocks,
        corrections: None,
        iterations: outcome.iterations,
        converged: outcome.converged,
        delta_history: outcome.delta_history,
        delta_interval: outcome.delta_interval,
        residual_history: outcome.residual_history,
        field_bytes: outcome.allocated as usize,
        planned_bytes: plan.bytes(),
        solve_share: if all_ms > 0.0 { outcome.solve_ms / all_ms } else { 1.0 },
        adapter: Some(context.adapter_name()),
    };
    Ok((solved, fields))
}

async fn multigrid(
    prepared: &Prepared<'_>,
    options: &BindOptions,
    plan: &Plan,
    stream: &mut Stream<'_>,
    blocks: &mut [Vec<Row>],
    fields: &mut [Vec<Row>],
) -> Result<Outcome, GpuError> {
    let hierarchy = prepared.hierarchy();
    let began = stream.now_ms();
    // Batches add up in squares: each may keep its share of tau.
    let tolerance = f64::from(options.tau) / f64::from(plan.n_batches).sqrt();
    let stop = Stop::new(tolerance, options.max_iterations);
    let mut allocator = Allocator::new(stream.context(), ROOM);
    let sampler = Sampler::new(&mut allocator, prepared.stencils(), plan)?;
    let mut multigrid = Multigrid::new(stream, &mut allocator, hierarchy, plan)?;
    let bytes = multigrid.field_bytes();
    let read_back = match fields {
        [] => None,
        _ => Some(allocator.readback("field, read back", bytes)?),
    };
    let allocated = allocator.settle().await?;
    let mut solve_ms = stream.now_ms() - began;
    let mut reports: Vec<BatchReport> = Vec::new();
    for batch in 0..plan.n_batches {
        let began = stream.now_ms();
        let first_column = batch * plan.n_lanes;
        let report = multigrid
            .solve(stream, hierarchy, first_column, stop, |stream, cycle, delta| {
                let part = (cycle as f32 / USUAL_CYCLES).min(1.0);
                let fraction = (batch as f32 + part) / plan.n_batches as f32;
                stream.set_status(fraction, cycle, Some(delta as f32));
            })
            .await?;
        solve_ms += stream.now_ms() - began;
        reports.push(report);
        sampler.sample(stream, multigrid.field(), first_column, blocks).await?;
        if let Some(read_back) = &read_back {
            let take =
                |bytes: &[u8]| scatter(bytes, plan.n_quads() as usize, first_column as usize, 0, fields);
            stream.read(multigrid.field(), read_back, bytes, take).await?;
        }
    }
    let [delta_history, residual_history] = histories(&reports.iter().collect::<Vec<_>>());
    Ok(Outcome {
        iterations: delta_history.len() as u32,
        converged: reports.iter().all(|r| r.converged),
        delta_history,
        delta_interval: 1,
        residual_history,
        solve_ms,
        allocated,
    })
}

async fn jacobi(
    prepared: &Prepared<'_>,
    options: &BindOptions,
    plan: &Plan,
    stream: &mut Stream<'_>,
    blocks: &mut [Vec<Row>],
) -> Result<Outcome, GpuError> {
    let began = stream.now_ms();
    let stop = StopRule { tau: options.tau, max_sweeps: options.max_iterations, norm: options.delta_norm };
    let mut allocator = Allocator::new(stream.context(), ROOM);
    let sampler = Sampler::new(&mut allocator, prepared.stencils(), plan)?;
    let jacobi = Jacobi::new(stream, &mut allocator, prepared.hierarchy(), plan)?;
    let allocated = allocator.settle().await?;
    let (sweeps, report) = jacobi
        .solve(stream, stop, |stream, sweeps, delta| {
            let to_go = (delta / options.tau).max(1.0).log10() / JACOBI_DECADES;
            stream.set_status(1.0 - to_go, sweeps, Some(delta));
        })
        .await?;
    let solve_ms = stream.now_ms() - began;
    for batch in 0..plan.n_batches {
        let field = jacobi.field(batch as usize, sweeps);
        sampler.sample(stream, field, batch * plan.n_lanes, blocks).await?;
    }
    Ok(Outcome {
        iterations: sweeps,
        converged: report.converged,
        delta_history: report.delta_history,
        delta_interval: INTERVAL,
        residual_history: Vec::new(),
        solve_ms,
        allocated,
    })
}
