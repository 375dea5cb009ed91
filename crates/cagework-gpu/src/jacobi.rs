//! Jacobi sweeps on the GPU: Algorithm 3 of K. Smith's paper (`docs/method.md`, sources), with Eq. 2 as stopping rule.
//!
//! Eq. 2 stops the sweeps when delta, the mean change of a cell's weights in a sweep, falls below tau. Unlike in the
//! paper, two fields are swapped instead of copied, and only delta is read back, once every [`SWEEPS_PER_CHECK`]
//! sweeps. Eq. 2 couples all columns of a cell, so the fields of all batches are in memory at the same time, and every
//! batch adds its changes to one shared buffer with a value per cell.

use cagework_core::solve::hierarchy::Hierarchy;
use cagework_core::solve::jacobi::STALLED_SWEEPS;
use cagework_core::solve::stop::{SolveReport, StopRule};

use crate::buffers::{Allocator, Readback};
use crate::error::GpuError;
use crate::kernels;
use crate::layout::{Work, mode};
use crate::levels::{GpuLevel, upload_rhs};
use crate::multigrid::{n_groups, sum_into};
use crate::pipelines::Launch;
use crate::plan::Plan;
use crate::stream::Stream;

/// Number of sweeps between checks of delta. It is not adapted to measured times, so that results are reproducible.
pub const SWEEPS_PER_CHECK: u32 = 10;

/// Fields of all batches, and the kernels bound to them.
#[derive(Debug)]
pub struct Jacobi {
    level: GpuLevel,
    n_quads: u32,
    batches: Vec<BatchFields>,
    roots: Launch,
    sum: Launch,
    numbers: wgpu::Buffer,
    readback: Readback,
}

/// Fields of one batch. Sweep k reads `fields[k % 2]` and writes the other one.
#[derive(Debug)]
struct BatchFields {
    fields: [wgpu::Buffer; 2],
    sweeps: [Launch; 2],
    changes: [Launch; 2],
}

impl Jacobi {
    /// Uploads the finest level and the boundary values of all columns.
    ///
    /// # Errors
    /// As [`Allocator::zeros`].
    pub fn new(
        stream: &Stream<'_>,
        allocator: &mut Allocator<'_>,
        hierarchy: &Hierarchy,
        plan: &Plan,
    ) -> Result<Self, GpuError> {
        let level = GpuLevel::new(allocator, &hierarchy.levels[0], true)?;
        let changes = allocator.storage("changes", 4 * u64::from(level.n_rows))?;
        let partials = allocator.storage("partial sums", 4 * u64::from(n_groups(level.n_rows)))?;
        let numbers = allocator.storage("numbers", 4)?;
        let (n_quads, n_lanes) = (plan.n_quads(), plan.n_lanes);
        let mut batches = Vec::new();
        let mut scratch = Vec::new();
        for batch in 0..plan.n_batches {
            let rhs = level.rhs(allocator, n_quads)?;
            upload_rhs(stream.context(), hierarchy, 0, batch * n_lanes, n_lanes, &rhs, &mut scratch);
            let fields = [level.field(allocator, n_quads)?, level.field(allocator, n_quads)?];
            let sweep = |from, to| {
                stream.launch(
                    &kernels::JACOBI_CELLS,
                    &[&level.neighbours, &level.diagonal, &level.rhs_of_row, &rhs, from, to],
                )
            };
            let change = |old, new| stream.launch(&kernels::CHANGE_NORMS, &[old, new, &changes]);
            let [a, b] = &fields;
            let (sweeps, changes) = ([sweep(a, b), sweep(b, a)], [change(a, b), change(b, a)]);
            batches.push(BatchFields { fields, sweeps, changes });
        }
        Ok(Self {
            roots: stream.launch(&kernels::SUM_ROOTS, &[&changes, &partials]),
            sum: stream.launch(&kernels::REDUCE_SUM, &[&partials, &numbers]),
            readback: allocator.readback("delta, read back", 4)?,
            level,
            n_quads,
            batches,
            numbers,
        })
    }

    /// Sweeps until delta falls below the tau of `rule`, or stops falling because of rounding, or the maximum number of
    /// iterations is reached. Calls `checked(stream, sweeps, delta)` after each check.
    ///
    /// # Errors
    /// If cancelled, or on errors of the GPU.
    pub async fn solve(
        &self,
        stream: &mut Stream<'_>,
        rule: StopRule,
        mut checked: impl FnMut(&mut Stream<'_>, u32, f64),
    ) -> Result<(u32, SolveReport), GpuError> {
        let mut report = SolveReport::default();
        let work = Work { n_quads: self.n_quads, ..Work::default() };
        let (mut done, mut is_last) = (0, false);
        while !is_last {
            let round = SWEEPS_PER_CHECK.min(rule.max_iterations - done);
            for (number, batch) in self.batches.iter().enumerate() {
                for sweep in done..done + round {
                    let launch = &batch.sweeps[sweep as usize % 2];
                    stream.run(launch, work, self.level.n_rows * self.n_quads).await?;
                }
                let mode = if number == 0 { mode::CHANGE_FIRST } else { 0 };
                let launch = &batch.changes[(done + round - 1) as usize % 2];
                stream.run(launch, Work { mode, ..work }, self.level.n_rows).await?;
            }
            done += round;
            sum_into(stream, &self.roots, &self.sum, self.level.n_rows, 0).await?;
            let sum =
                stream.read(&self.numbers, &self.readback, 4, bytemuck::pod_read_unaligned::<f32>).await?;
            let delta = f64::from(sum) / f64::from(self.level.n_unknowns.max(1));
            is_last = report.iteration_done(&rule, delta, None)
                || done >= rule.max_iterations
                || report.ends_at_round_off(STALLED_SWEEPS / SWEEPS_PER_CHECK as usize);
            checked(stream, done, delta);
        }
        Ok((done, report))
    }

    /// Field of a batch after `sweeps` sweeps.
    #[must_use]
    pub fn field(&self, batch: usize, sweeps: u32) -> &wgpu::Buffer {
        &self.batches[batch].fields[sweeps as usize % 2]
    }
}
