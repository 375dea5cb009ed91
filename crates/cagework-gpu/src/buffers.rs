//! Buffers: made, filled, read back; out of memory is an error, not a crash.

use bytemuck::Pod;
use futures_channel::oneshot;

use crate::device::GpuContext;
use crate::error::GpuError;
use crate::plan::PlanError;

/// Smallest buffer: bindings must not be empty, and no kernel reads more of an empty one.
const MIN_BYTES: u64 = 16;

/// Makes buffers and notices when there is no memory left.
#[derive(Debug)]
pub struct Allocator<'a> {
    context: &'a GpuContext,
    allocated: u64,
}

impl<'a> Allocator<'a> {
    /// An allocator that has made nothing yet.
    #[must_use]
    pub fn new(context: &'a GpuContext) -> Self {
        Self { context, allocated: 0 }
    }

    /// Bytes of all buffers made.
    #[must_use]
    pub fn allocated(&self) -> u64 {
        self.allocated
    }

    /// A buffer of zeros.
    ///
    /// # Errors
    /// [`PlanError::Binding`] for a storage buffer that is larger than a binding may be, [`GpuError::OutOfMemory`],
    /// [`GpuError::Refused`], [`GpuError::DeviceLost`].
    pub async fn zeros(
        &mut self,
        what: &'static str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        let bytes = bytes.max(MIN_BYTES).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
        let limit = self.context.max_binding_bytes;
        if usage.contains(wgpu::BufferUsages::STORAGE) && bytes > limit {
            return Err(PlanError::Binding { what, needed: bytes, limit }.into());
        }
        let device = &self.context.device;
        let refused = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size: bytes,
            usage,
            mapped_at_creation: false,
        });
        // Popped before anything is awaited: other work may push scopes of its own meanwhile.
        let (memory, refused) = (memory.pop(), refused.pop());
        let (no_memory, refusal) = (memory.await, refused.await);
        // A lost device refuses everything, and that it is lost is the better message.
        self.context.check()?;
        if no_memory.is_some() {
            return Err(GpuError::OutOfMemory { what: what.to_owned(), bytes });
        }
        if let Some(error) = refusal {
            return Err(GpuError::Refused { reason: error.to_string() });
        }
        self.allocated += bytes;
        Ok(buffer)
    }

    /// A storage buffer of zeros that can be copied from and to.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub async fn storage(&mut self, what: &'static str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        self.zeros(what, bytes, usage).await
    }

    /// A storage buffer that holds `data`.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub async fn table<T: Pod>(&mut self, what: &'static str, data: &[T]) -> Result<wgpu::Buffer, GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = self.storage(what, bytes.len() as u64).await?;
        if !bytes.is_empty() {
            self.context.queue.write_buffer(&buffer, 0, bytes);
        }
        Ok(buffer)
    }

    /// A buffer to read results back through.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub async fn readback(&mut self, what: &'static str, bytes: u64) -> Result<Readback, GpuError> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        Ok(Readback { buffer: self.zeros(what, bytes, usage).await? })
    }
}

/// A buffer that results are copied to and then read from.
#[derive(Debug)]
pub struct Readback {
    pub(crate) buffer: wgpu::Buffer,
}

impl Readback {
    /// Hands the first `bytes`, which `submission` copied here, to `take`.
    pub(crate) async fn read<T>(
        &self,
        context: &GpuContext,
        submission: &wgpu::SubmissionIndex,
        bytes: u64,
        take: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, GpuError> {
        let (sender, receiver) = oneshot::channel();
        self.buffer.map_async(wgpu::MapMode::Read, ..bytes, move |result| {
            // Nobody listens any more when the wait was given up.
            let _ = sender.send(result);
        });
        let lost = |reason: String| GpuError::DeviceLost { reason };
        context.wait(submission, receiver).await?.map_err(|error| lost(error.to_string()))?;
        let view = self.buffer.get_mapped_range(..bytes).map_err(|error| lost(error.to_string()))?;
        let taken = take(&view);
        drop(view);
        self.buffer.unmap();
        Ok(taken)
    }
}
