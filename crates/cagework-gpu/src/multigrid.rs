//! Full multigrid with V(2,1) cycles, batch by batch: the algorithm of `cagework_core::solve::multigrid`.
//!
//! Each cycle reads back two numbers: the squared norm of the coarse correction, from which delta (the remaining error)
//! is estimated, and the squared norm of the residual.

use cagework_core::solve::hierarchy::Hierarchy;
use cagework_core::solve::multigrid::{COARSEST_OMEGA, COARSEST_SWEEPS, Convergence, OMEGA};
use cagework_core::solve::stop::{SolveReport, StopRule};
use cagework_core::stencil::REDUCE_VALUES;

use crate::buffers::{Allocator, Readback};
use crate::error::GpuError;
use crate::kernels;
use crate::layout::{Work, mode};
use crate::levels::{GpuLevel, GpuTransfer, upload_rhs};
use crate::pipelines::Launch;
use crate::plan::{Plan, QUAD_BYTES};
use crate::stream::Stream;

// Indices in the buffer of numbers that are read back.
const RESIDUAL: u32 = 0;
const DELTA: u32 = 1;

/// Fields of one batch on all levels, and the kernels bound to them.
#[derive(Debug)]
pub struct Multigrid {
    n_quads: u32,
    levels: Vec<LevelWork>,
    squares: Squares,
    numbers: wgpu::Buffer,
    readback: Readback,
    scratch: Vec<f32>,
}

/// Fields of one batch on one level, and the kernels bound to them.
#[derive(Debug)]
struct LevelWork {
    level: GpuLevel,
    field: wgpu::Buffer,
    rhs: wgpu::Buffer,
    relax: Launch,
    /// Transfers to and from the next coarser level; `None` on the coarsest level.
    coarser: Option<CoarseTransfer>,
}

/// Transfers to and from the next coarser level.
#[derive(Debug)]
struct CoarseTransfer {
    residual: Launch,
    restrict: Launch,
    faces: Launch,
    corners: Launch,
    n_faces: u32,
    n_corners: u32,
}

/// Kernels for sums of squares on the finest level.
#[derive(Debug)]
enum Squares {
    /// Sums the squares of the red residuals and of the coarse correction.
    Levels { residual: Launch, correction: Launch, sum: Launch },
    /// Sums the squares of the changes from the values saved in `before`, if there is only one level.
    Single { before: wgpu::Buffer, changes: Launch, sum: Launch },
}

impl Multigrid {
    /// Uploads the hierarchy and allocates one batch.
    ///
    /// # Errors
    /// As [`Allocator::zeros`].
    pub fn new(
        stream: &Stream<'_>,
        allocator: &mut Allocator<'_>,
        hierarchy: &Hierarchy,
        plan: &Plan,
    ) -> Result<Self, GpuError> {
        let n_quads = plan.n_quads();
        let mut levels: Vec<LevelWork> = Vec::new();
        for (k, level) in hierarchy.levels.iter().enumerate() {
            let level = GpuLevel::new(allocator, level, k == 0)?;
            let field = level.field(allocator, n_quads)?;
            let rhs = level.rhs(allocator, n_quads)?;
            let relax = stream.launch(
                &kernels::RELAX_CELLS,
                &[&level.neighbours, &level.diagonal, &level.rhs_of_row, &rhs, &field],
            );
            levels.push(LevelWork { level, field, rhs, relax, coarser: None });
        }
        // All levels share one buffer for the residuals of red rows, which has the size of the finest level's. Each
        // level also writes the row of zeros that follows its red rows.
        let red_bytes = u64::from(levels[0].level.colours[0].1 + 1) * u64::from(n_quads) * QUAD_BYTES;
        let numbers = allocator.storage("numbers", 8)?;
        let squares = if levels.len() == 1 {
            let finest = &levels[0].level;
            let before = finest.field(allocator, n_quads)?;
            let changes = allocator.storage("changes", 4 * u64::from(finest.n_rows))?;
            Squares::Single {
                changes: stream.launch(&kernels::CHANGE_NORMS, &[&before, &levels[0].field, &changes]),
                sum: stream.launch(&kernels::REDUCE_SUM, &[&changes, &numbers]),
                before,
            }
        } else {
            let red_residual = allocator.storage("residual", red_bytes)?;
            for k in 0..hierarchy.transfers.len() {
                let transfer = GpuTransfer::new(allocator, hierarchy, k)?;
                let coarser =
                    CoarseTransfer::new(stream, &levels[k], &levels[k + 1], &transfer, &red_residual);
                levels[k].coarser = Some(coarser);
            }
            let most = n_groups(levels[0].level.n_rows * n_quads);
            let partials = allocator.storage("partial sums", 4 * u64::from(most))?;
            Squares::Levels {
                residual: stream.launch(&kernels::SUM_SQUARES, &[&red_residual, &partials]),
                correction: stream.launch(&kernels::SUM_SQUARES, &[&levels[1].field, &partials]),
                sum: stream.launch(&kernels::REDUCE_SUM, &[&partials, &numbers]),
            }
        };
        let readback = allocator.readback("numbers, read back", 8)?;
        Ok(Self { n_quads, levels, squares, numbers, readback, scratch: Vec::new() })
    }

    /// Field of the finest level, which contains the solution of the latest batch.
    #[must_use]
    pub fn field(&self) -> &wgpu::Buffer {
        &self.levels[0].field
    }

    /// Solves the batch that starts at `first_column`. In the report, `stalled` is true if conjugate gradients should
    /// continue the solve. Calls `cycle_done(stream, cycle, delta)` after each cycle.
    ///
    /// # Errors
    /// If cancelled, or on errors of the GPU.
    pub async fn solve(
        &mut self,
        stream: &mut Stream<'_>,
        hierarchy: &Hierarchy,
        first_column: u32,
        rule: StopRule,
        mut cycle_done: impl FnMut(&mut Stream<'_>, u32, f64),
    ) -> Result<SolveReport, GpuError> {
        for (k, level) in self.levels.iter().enumerate() {
            let n_lanes = 4 * self.n_quads;
            let context = stream.context();
            upload_rhs(context, hierarchy, k, first_column, n_lanes, &level.rhs, &mut self.scratch);
        }
        let coarsest = self.levels.len() - 1;
        stream.clear(&self.levels[coarsest].field);
        for k in (0..=coarsest).rev() {
            if k < coarsest {
                self.prolong(stream, k, mode::PROLONG_REPLACE).await?;
            }
            if k > 0 {
                self.cycle(stream, k).await?;
            }
        }
        let mut convergence = Convergence::new(rule);
        loop {
            self.cycle(stream, 0).await?;
            let [residual, delta] = stream
                .read(&self.numbers, &self.readback, 8, |bytes| {
                    bytemuck::pod_read_unaligned::<[f32; 2]>(bytes).map(f64::from)
                })
                .await?;
            let coarse = self.levels.get(1).map_or(&self.levels[0], |l| l).level.n_unknowns;
            let n_unknowns = self.levels[0].level.n_unknowns;
            let residual = if coarsest == 0 { 0.0 } else { residual / f64::from(n_unknowns) };
            let done = convergence.cycle_done(delta / f64::from(coarse.max(1)), residual);
            let (cycle, delta) = convergence.latest();
            cycle_done(stream, cycle, delta);
            if done || convergence.stalls() {
                return Ok(convergence.into_report());
            }
        }
    }

    /// Runs one V(2,1) cycle, starting at level k.
    async fn cycle(&self, stream: &mut Stream<'_>, k: usize) -> Result<(), GpuError> {
        let coarsest = self.levels.len() - 1;
        let n_quads = self.n_quads;
        for fine in k..coarsest {
            let (level, next) = (&self.levels[fine], &self.levels[fine + 1]);
            self.relax(stream, fine, 0, 1.0).await?;
            self.relax(stream, fine, 1, OMEGA).await?;
            self.relax(stream, fine, 0, 1.0).await?;
            self.relax(stream, fine, 1, 1.0).await?;
            let Some(coarser) = &level.coarser else { continue };
            let n_red = level.level.colours[0].1;
            let work = Work { n_quads, ..Work::default() };
            stream.run(&coarser.residual, work, (n_red + 1) * n_quads).await?;
            if fine == 0
                && let Squares::Levels { residual, sum, .. } = &self.squares
            {
                sum_into(stream, residual, sum, n_red * n_quads, RESIDUAL).await?;
            }
            stream.run(&coarser.restrict, work, next.level.n_rows * n_quads).await?;
            stream.clear(&next.field);
        }
        self.relax_coarsest(stream, k == coarsest).await?;
        for fine in (k..coarsest).rev() {
            if fine == 0
                && let Squares::Levels { correction, sum, .. } = &self.squares
            {
                sum_into(stream, correction, sum, self.levels[1].level.n_rows * n_quads, DELTA).await?;
            }
            self.prolong(stream, fine, 0).await?;
            self.relax(stream, fine, 0, 1.0).await?;
            self.relax(stream, fine, 1, 1.0).await?;
        }
        Ok(())
    }

    /// Runs the sweeps on the coarsest level. Also computes delta if the coarsest level is the only level.
    async fn relax_coarsest(&self, stream: &mut Stream<'_>, only: bool) -> Result<(), GpuError> {
        let coarsest = self.levels.len() - 1;
        let LevelWork { level, field, .. } = &self.levels[coarsest];
        let measured = match &self.squares {
            Squares::Single { before, changes, sum } if only => Some((before, changes, sum)),
            _ => None,
        };
        if let Some((before, _, _)) = measured {
            let bytes = u64::from(level.n_rows) * u64::from(self.n_quads) * QUAD_BYTES;
            stream.copy(field, before, bytes);
        }
        for _ in 0..COARSEST_SWEEPS {
            self.relax(stream, coarsest, 0, COARSEST_OMEGA).await?;
            self.relax(stream, coarsest, 1, COARSEST_OMEGA).await?;
        }
        if let Some((_, changes, sum)) = measured {
            let work = Work { n_quads: self.n_quads, mode: mode::CHANGE_FIRST, ..Work::default() };
            stream.run(changes, work, level.n_rows).await?;
            let work = Work { first_row: DELTA, ..Work::default() };
            stream.reduce(sum, work, level.n_rows, 1).await?;
        }
        Ok(())
    }

    async fn relax(
        &self,
        stream: &mut Stream<'_>,
        k: usize,
        colour: usize,
        omega: f32,
    ) -> Result<(), GpuError> {
        let LevelWork { level, relax, .. } = &self.levels[k];
        let (first_row, n_cells) = level.colours[colour];
        let work = Work { n_quads: self.n_quads, first_row, omega, ..Work::default() };
        stream.run(relax, work, n_cells * self.n_quads).await
    }

    async fn prolong(&self, stream: &mut Stream<'_>, k: usize, mode: u32) -> Result<(), GpuError> {
        let Some(coarser) = &self.levels[k].coarser else { return Ok(()) };
        let work = Work { n_quads: self.n_quads, mode, ..Work::default() };
        let faces = Work { n_sources: 2, ..work };
        stream.run(&coarser.faces, faces, coarser.n_faces * self.n_quads).await?;
        let corners = Work { n_sources: 8, ..work };
        stream.run(&coarser.corners, corners, coarser.n_corners * self.n_quads).await
    }
}

impl CoarseTransfer {
    fn new(
        stream: &Stream<'_>,
        fine: &LevelWork,
        coarse: &LevelWork,
        transfer: &GpuTransfer,
        red_residual: &wgpu::Buffer,
    ) -> Self {
        let LevelWork { level, field, rhs, .. } = fine;
        let prolong = |entries| stream.launch(&kernels::PROLONG_CORRECTION, &[entries, &coarse.field, field]);
        Self {
            residual: stream.launch(
                &kernels::RESIDUAL,
                &[&level.neighbours, &level.diagonal, &level.rhs_of_row, rhs, field, red_residual],
            ),
            restrict: stream
                .launch(&kernels::RESTRICT_RESIDUAL, &[&transfer.around, red_residual, &coarse.rhs]),
            faces: prolong(&transfer.faces),
            corners: prolong(&transfer.corners),
            n_faces: transfer.n_faces,
            n_corners: transfer.n_corners,
        }
    }
}

/// Number of workgroups that reduce `count` values.
pub(crate) fn n_groups(count: u32) -> u32 {
    count.div_ceil(REDUCE_VALUES as u32)
}

/// Sums the squares or roots of `count` values with the kernels `partial` and `sum`. Stores the result in element
/// `slot` of the buffer that `sum` writes.
pub(crate) async fn sum_into(
    stream: &mut Stream<'_>,
    partial: &Launch,
    sum: &Launch,
    count: u32,
    slot: u32,
) -> Result<(), GpuError> {
    let groups = n_groups(count);
    stream.reduce(partial, Work::default(), count, groups).await?;
    stream.reduce(sum, Work { first_row: slot, ..Work::default() }, groups, 1).await
}
