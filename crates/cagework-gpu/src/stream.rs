//! Submits work in short slices: the page stays responsive, drivers' watchdogs do not fire, and progress and
//! cancellation work.
//!
//! Dispatches are recorded until their estimated cost reaches the budget. They are then submitted as one slice. A
//! dispatch above the budget is split by items. The budget is adapted to measured times. At most two slices are
//! pending. Splitting does not change results: items are independent, and reductions are not split.

use std::collections::VecDeque;

use cagework_core::bind::Watch;
use cagework_core::progress::Stage;
use futures_channel::oneshot;

use crate::buffers::{Allocator, Readback};
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::kernels::Kernel;
use crate::layout::{WORK_STRIDE, Work};
use crate::pipelines::Launch;

/// Target time of a slice, ms: three frames at 60 Hz; watchdogs of drivers allow 2 s.
const SLICE_MS: f64 = 50.0;

/// Maximum number of slices that are submitted but not finished: one runs, one is queued. More slices delay
/// cancellation, and caused crashes on iOS 26.
const MAX_PENDING_SLICES: usize = 2;

/// Initial budget of a slice, memory accesses. The slice takes 10 to 100 ms on a software adapter with two threads, and
/// less than 1 ms on a GPU.
const INITIAL_BUDGET: u64 = 1 << 25;

/// Range of the budget, memory accesses. The lower limit bounds the overhead of submissions, the upper one the wait for
/// a readback.
const BUDGET_RANGE: [u64; 2] = [1 << 20, 1 << 36];

/// Maximum number of dispatches in a slice.
const MAX_WORKS: u64 = 1024;

/// A command that is recorded but not submitted.
#[derive(Debug)]
enum Command {
    Dispatch { launch: Launch, offset: u32, groups: [u32; 2] },
    Clear(wgpu::Buffer),
    Copy { from: wgpu::Buffer, to: wgpu::Buffer, bytes: u64 },
}

/// A slice that is submitted but not finished.
#[derive(Debug)]
struct PendingSlice {
    submission: wgpu::SubmissionIndex,
    done: oneshot::Receiver<()>,
    cost: u64,
    submitted_ms: f64,
}

/// Progress of the solve, reported with each slice.
#[derive(Clone, Copy, Debug, Default)]
struct Status {
    fraction: f32,
    iteration: u32,
    delta: Option<f32>,
}

/// Recorder of the commands of one solve, which it submits in slices.
pub struct Stream<'a> {
    context: &'a GpuContext,
    watch: &'a Watch<'a>,
    works: wgpu::Buffer,
    parameters: Vec<u8>,
    commands: Vec<Command>,
    cost: u64,
    budget: u64,
    pending: VecDeque<PendingSlice>,
    last_done_ms: f64,
    status: Status,
}

impl<'a> Stream<'a> {
    /// Creates a stream without recorded commands.
    ///
    /// # Errors
    /// As [`Allocator::zeros`] and [`Allocator::settle`].
    pub async fn new(context: &'a GpuContext, watch: &'a Watch<'a>) -> Result<Self, GpuError> {
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let mut allocator = Allocator::new(context, "the parameters of kernels");
        let works = allocator.zeros("work parameters", MAX_WORKS * WORK_STRIDE, usage)?;
        allocator.settle().await?;
        Ok(Self {
            context,
            watch,
            works,
            parameters: Vec::new(),
            commands: Vec::new(),
            cost: 0,
            budget: INITIAL_BUDGET,
            pending: VecDeque::new(),
            last_done_ms: 0.0,
            status: Status::default(),
        })
    }

    /// The GPU that runs the work.
    #[must_use]
    pub fn context(&self) -> &'a GpuContext {
        self.context
    }

    /// Time on the clock of the bind's [`Watch`], ms.
    #[must_use]
    pub fn now_ms(&self) -> f64 {
        self.watch.now_ms()
    }

    /// Binds a kernel to buffers, in the order of the kernel table after the uniform.
    #[must_use]
    pub fn launch(&self, kernel: &Kernel, buffers: &[&wgpu::Buffer]) -> Launch {
        self.context.pipelines.launch(&self.context.device, kernel, &self.works, buffers)
    }

    /// Sets the progress to report with the next slices: fraction, iterations, delta.
    pub fn set_status(&mut self, fraction: f32, iteration: u32, delta: Option<f32>) {
        self.status = Status { fraction, iteration, delta };
    }

    /// Records a kernel for `count` items. Overwrites `first`, `count` and `stride` of `work`.
    ///
    /// # Errors
    /// If cancelled, or on errors of the GPU.
    pub async fn run(&mut self, launch: &Launch, work: Work, count: u32) -> Result<(), GpuError> {
        let cost = u64::from(launch.cost.max(1));
        let mut first = 0;
        while first < count {
            if self.cost >= self.budget {
                self.submit().await?;
            }
            let room =
                ((self.budget - self.cost) / cost).max(1).next_multiple_of(u64::from(launch.workgroup));
            let part = u64::from(count - first).min(room) as u32;
            let (groups, stride) = launch.groups(part);
            self.dispatch(
                launch,
                Work { first, count: part, stride, ..work },
                groups,
                cost * u64::from(part),
            );
            self.submit_if_full().await?;
            first += part;
        }
        Ok(())
    }

    /// Records a reducing kernel: `groups` workgroups over `count` values.
    ///
    /// # Errors
    /// If cancelled, or on errors of the GPU.
    pub async fn reduce(
        &mut self,
        launch: &Launch,
        work: Work,
        count: u32,
        groups: u32,
    ) -> Result<(), GpuError> {
        self.dispatch(launch, Work { count, ..work }, [groups, 1], u64::from(count));
        self.submit_if_full().await
    }

    /// Records a command that fills a buffer with zeros.
    pub fn clear(&mut self, buffer: &wgpu::Buffer) {
        self.commands.push(Command::Clear(buffer.clone()));
    }

    /// Records a command that copies the first `bytes` bytes of `from` to `to`.
    pub fn copy(&mut self, from: &wgpu::Buffer, to: &wgpu::Buffer, bytes: u64) {
        self.commands.push(Command::Copy { from: from.clone(), to: to.clone(), bytes });
    }

    /// Submits all commands, waits for them, and passes the first `bytes` bytes of `from` to `take`.
    ///
    /// # Errors
    /// If cancelled, or on errors of the GPU.
    pub async fn read<T>(
        &mut self,
        from: &wgpu::Buffer,
        through: &Readback,
        bytes: u64,
        take: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, GpuError> {
        self.copy(from, &through.buffer, bytes);
        let submission = self.submit().await?;
        let taken = through.read(self.context, &submission, bytes, take).await?;
        while let Some(slice) = self.pending.pop_front() {
            self.land(slice).await?;
        }
        Ok(taken)
    }

    fn dispatch(&mut self, launch: &Launch, work: Work, groups: [u32; 2], cost: u64) {
        let offset = self.parameters.len() as u32;
        self.parameters.extend_from_slice(bytemuck::bytes_of(&work));
        self.parameters.resize(offset as usize + WORK_STRIDE as usize, 0);
        self.commands.push(Command::Dispatch { launch: launch.clone(), offset, groups });
        self.cost += cost;
    }

    async fn submit_if_full(&mut self) -> Result<(), GpuError> {
        if self.cost >= self.budget || self.parameters.len() as u64 >= MAX_WORKS * WORK_STRIDE {
            self.submit().await?;
        }
        Ok(())
    }

    /// Submits the recorded commands. Waits if too many slices are pending.
    async fn submit(&mut self) -> Result<wgpu::SubmissionIndex, GpuError> {
        let Status { fraction, iteration, delta } = self.status;
        self.watch.report(Stage::Solve, fraction, iteration, delta)?;
        if self.pending.len() >= MAX_PENDING_SLICES
            && let Some(slice) = self.pending.pop_front()
        {
            self.land(slice).await?;
        }
        let queue = &self.context.queue;
        if !self.parameters.is_empty() {
            queue.write_buffer(&self.works, 0, &self.parameters);
        }
        let submitted_ms = self.now_ms();
        let submission = queue.submit([encode(self.context, &self.commands)]);
        let (sender, done) = oneshot::channel();
        queue.on_submitted_work_done(move || {
            // Ignore the error: cancelling drops the receiver.
            let _ = sender.send(());
        });
        self.pending.push_back(PendingSlice {
            submission: submission.clone(),
            done,
            cost: self.cost,
            submitted_ms,
        });
        self.commands.clear();
        self.parameters.clear();
        self.cost = 0;
        Ok(submission)
    }

    /// Waits for a slice and adapts the budget to its time.
    async fn land(&mut self, slice: PendingSlice) -> Result<(), GpuError> {
        self.context.wait(&slice.submission, slice.done).await?;
        let now = self.now_ms();
        let elapsed = now - self.last_done_ms.max(slice.submitted_ms);
        self.last_done_ms = now;
        // The time of a small slice, below half the budget, is not representative.
        if elapsed > 0.0 && 2 * slice.cost >= self.budget {
            let wanted = (slice.cost as f64 * SLICE_MS / elapsed) as u64;
            let [least, most] = BUDGET_RANGE;
            self.budget = wanted.clamp(self.budget / 4, 2 * self.budget).clamp(least, most);
        }
        Ok(())
    }
}

fn encode(context: &GpuContext, commands: &[Command]) -> wgpu::CommandBuffer {
    let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: None });
    let mut rest = commands;
    while let Some(command) = rest.first() {
        match command {
            Command::Dispatch { .. } => {
                let n = rest.iter().take_while(|c| matches!(c, Command::Dispatch { .. })).count();
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                for command in &rest[..n] {
                    if let Command::Dispatch { launch, offset, groups } = command {
                        pass.set_pipeline(&launch.pipeline);
                        pass.set_bind_group(0, &launch.bind_group, &[*offset]);
                        pass.dispatch_workgroups(groups[0], groups[1], 1);
                    }
                }
                rest = &rest[n..];
            }
            Command::Clear(buffer) => {
                encoder.clear_buffer(buffer, 0, None);
                rest = &rest[1..];
            }
            Command::Copy { from, to, bytes } => {
                encoder.copy_buffer_to_buffer(from, 0, to, 0, *bytes);
                rest = &rest[1..];
            }
        }
    }
    encoder.finish()
}
