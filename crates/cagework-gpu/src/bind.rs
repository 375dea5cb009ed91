//! Bind on the GPU: solving and sampling run as kernels, geometry and assembly on the CPU.

use cagework_core::bind::Watch;
use cagework_core::bind::pipeline::{FieldStorage, PreparedBind, Solution};
use cagework_core::options::{BindOptions, Solver};
use cagework_core::solve::rows::{Row, ZERO};
use cagework_core::solve::stop::SolveReport;
use cagework_core::{Binding, Controls, Progress};
use glam::Vec3;

use crate::buffers::Allocator;
use crate::deform::GpuWeights;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::jacobi::{Jacobi, SWEEPS_PER_CHECK};
use crate::multigrid::Multigrid;
use crate::plan::Plan;
use crate::sample::Sampler;
use crate::stream::Stream;

/// Typical number of V-cycles per batch, for the progress bar.
const USUAL_CYCLES: f32 = 5.0;

/// Name of the allocated buffers in error messages.
const ALLOCATION_NAME: &str = "the fields of a bind";

/// Statistics of a solve on the GPU.
struct Outcome {
    report: SolveReport,
    iterations: u32,
    delta_interval: u32,
    solve_ms: f64,
    /// Allocated GPU memory, bytes.
    allocated: u64,
}

/// [`cagework_core::bind()`] on the GPU, with the same grid, stencils and assembly. The weights differ from those of
/// the CPU by less than 1e-4. Also returns the weights as GPU buffers for deformation.
///
/// `options.memory_limit` applies to the GPU's buffers and to the CPU's arrays separately.
///
/// # Errors
/// As [`bind_on`].
pub async fn bind_gpu<'a>(
    positions: &[Vec3],
    controls: impl Into<Controls<'a>>,
    options: &BindOptions,
    progress: &dyn Progress,
    context: &GpuContext,
) -> Result<(Binding, GpuWeights), GpuError> {
    let binding = bind_on(positions, controls, options, progress, context).await?;
    let weights = GpuWeights::new(context, &binding.weights, &binding.frames).await?;
    Ok((binding, weights))
}

/// Like [`bind_gpu`], without uploading the weights for deformation.
///
/// # Errors
/// [`GpuError::Bind`] as [`cagework_core::bind()`]; [`GpuError::Plan`] if the bind does not fit into memory;
/// [`GpuError::Solver`] for conjugate gradients; other variants for errors of the GPU.
pub async fn bind_on<'a>(
    positions: &[Vec3],
    controls: impl Into<Controls<'a>>,
    options: &BindOptions,
    progress: &dyn Progress,
    context: &GpuContext,
) -> Result<Binding, GpuError> {
    if options.solver == Solver::ConjugateGradient {
        return Err(GpuError::Solver(options.solver));
    }
    let watch = Watch::new(progress);
    let mut prepared = PreparedBind::new(positions, controls.into(), options, FieldStorage::Device, &watch)?;
    let (hierarchy, stencils) = (prepared.hierarchy(), prepared.stencils());
    let limit = options.memory_limit;
    let plan = Plan::new(hierarchy, stencils, options.solver, context.max_binding_bytes, limit)?;
    let mut solved = solve_and_sample(&prepared, options, &plan, &watch, context).await?;
    if solved.report.stalled {
        // Fall back to conjugate gradients, which only the CPU implements.
        solved = prepared.solve_on_host(&watch)?;
    }
    Ok(prepared.finish(solved, &watch)?)
}

/// Solves for all columns and samples the weights. Returns the input of [`PreparedBind::finish`].
async fn solve_and_sample(
    prepared: &PreparedBind<'_>,
    options: &BindOptions,
    plan: &Plan,
    watch: &Watch<'_>,
    context: &GpuContext,
) -> Result<Solution, GpuError> {
    let n_batches = prepared.hierarchy().n_batches();
    let mut blocks: Vec<Vec<Row>> = vec![vec![ZERO; prepared.stencils().len()]; n_batches];
    let began = watch.now_ms();
    let mut stream = Stream::new(context, watch).await?;
    let outcome = if options.solver == Solver::Jacobi {
        jacobi(prepared, options, plan, &mut stream, &mut blocks).await?
    } else {
        multigrid(prepared, options, plan, &mut stream, &mut blocks).await?
    };
    let all_ms = watch.now_ms() - began;
    Ok(Solution {
        blocks,
        report: outcome.report,
        iterations: outcome.iterations,
        delta_interval: outcome.delta_interval,
        field_bytes: outcome.allocated as usize,
        planned_bytes: plan.bytes(),
        solve_share: if all_ms > 0.0 { outcome.solve_ms / all_ms } else { 1.0 },
        adapter: Some(context.adapter_name()),
    })
}

async fn multigrid(
    prepared: &PreparedBind<'_>,
    options: &BindOptions,
    plan: &Plan,
    stream: &mut Stream<'_>,
    blocks: &mut [Vec<Row>],
) -> Result<Outcome, GpuError> {
    let hierarchy = prepared.hierarchy();
    let began = stream.now_ms();
    let rule = options.stop_rule().of_batch(plan.n_batches as usize);
    let mut allocator = Allocator::new(stream.context(), ALLOCATION_NAME);
    let sampler = Sampler::new(&mut allocator, prepared.stencils(), plan)?;
    let mut multigrid = Multigrid::new(stream, &mut allocator, hierarchy, plan)?;
    let allocated = allocator.settle().await?;
    let mut solve_ms = stream.now_ms() - began;
    let mut reports: Vec<SolveReport> = Vec::new();
    for batch in 0..plan.n_batches {
        let began = stream.now_ms();
        let first_column = batch * plan.n_lanes;
        let report = multigrid
            .solve(stream, hierarchy, first_column, rule, |stream, cycle, delta| {
                let part = (cycle as f32 / USUAL_CYCLES).min(1.0);
                let fraction = (batch as f32 + part) / plan.n_batches as f32;
                stream.set_status(fraction, cycle, Some(delta as f32));
            })
            .await?;
        solve_ms += stream.now_ms() - began;
        reports.push(report);
        if reports.iter().any(|report| report.stalled) {
            break;
        }
        sampler.sample(stream, multigrid.field(), first_column, blocks).await?;
    }
    let report = SolveReport::together(&reports);
    let iterations = report.latest().0;
    Ok(Outcome { report, iterations, delta_interval: 1, solve_ms, allocated })
}

async fn jacobi(
    prepared: &PreparedBind<'_>,
    options: &BindOptions,
    plan: &Plan,
    stream: &mut Stream<'_>,
    blocks: &mut [Vec<Row>],
) -> Result<Outcome, GpuError> {
    let began = stream.now_ms();
    let rule = options.stop_rule();
    let mut allocator = Allocator::new(stream.context(), ALLOCATION_NAME);
    let sampler = Sampler::new(&mut allocator, prepared.stencils(), plan)?;
    let jacobi = Jacobi::new(stream, &mut allocator, prepared.hierarchy(), plan)?;
    let allocated = allocator.settle().await?;
    let (sweeps, report) = jacobi
        .solve(stream, rule, |stream, sweeps, delta| {
            stream.set_status(rule.jacobi_progress(delta), sweeps, Some(delta as f32));
        })
        .await?;
    let solve_ms = stream.now_ms() - began;
    for batch in 0..plan.n_batches {
        let field = jacobi.field(batch as usize, sweeps);
        sampler.sample(stream, field, batch * plan.n_lanes, blocks).await?;
    }
    Ok(Outcome { report, iterations: sweeps, delta_interval: SWEEPS_PER_CHECK, solve_ms, allocated })
}
