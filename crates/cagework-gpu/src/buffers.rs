//! Allocates and reads back buffers. Running out of memory is reported as an error.

use bytemuck::Pod;
use futures_channel::oneshot;

use crate::device::GpuContext;
use crate::error::GpuError;
use crate::plan::PlanError;

/// Minimum buffer size, bytes: bindings must not be empty.
const MIN_BYTES: u64 = 16;

/// Allocates the buffers and textures of one object and detects failures.
///
/// The GPU reports an error only after it has executed all previously submitted work. Buffers are therefore created and
/// filled without waiting, and [`Self::settle`] checks once for all errors since [`Self::new`]. Waiting for each buffer
/// would delay opening a page on a software GPU by 2 s.
#[derive(Debug)]
#[must_use = "allocation errors are reported by settle"]
pub struct Allocator<'a> {
    context: &'a GpuContext,
    what: &'static str,
    allocated: u64,
    /// Scope for out-of-memory errors, pushed last and therefore popped first.
    memory: wgpu::ErrorScopeGuard,
    /// Scope for validation errors.
    refused: wgpu::ErrorScopeGuard,
}

impl<'a> Allocator<'a> {
    /// Begins an allocation. `what`: name of the object in error messages. Callers must not await anything before
    /// [`Self::settle`]: error scopes form a stack, of the device in browsers and of the thread elsewhere, on which other
    /// tasks could push and pop scopes of their own during the wait.
    pub fn new(context: &'a GpuContext, what: &'static str) -> Self {
        let refused = context.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let memory = context.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        Self { context, what, allocated: 0, memory, refused }
    }

    /// Waits for the GPU. Returns the total allocated bytes.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`], [`GpuError::Refused`], [`GpuError::DeviceLost`].
    pub async fn settle(self) -> Result<u64, GpuError> {
        // Pop before awaiting: other tasks may push scopes of their own.
        let (memory, refused) = (self.memory.pop(), self.refused.pop());
        let (no_memory, refusal) = (memory.await, refused.await);
        // A lost device rejects every command: report the loss instead.
        self.context.check()?;
        if no_memory.is_some() {
            return Err(GpuError::OutOfMemory { what: self.what.to_owned(), bytes: self.allocated });
        }
        if let Some(error) = refusal {
            return Err(GpuError::Refused { reason: error.to_string() });
        }
        Ok(self.allocated)
    }

    /// Adds `bytes` of memory that were allocated elsewhere to the total.
    pub(crate) fn count(&mut self, bytes: u64) {
        self.allocated += bytes;
    }

    /// Creates a buffer of zeros.
    ///
    /// # Errors
    /// [`PlanError::Binding`] if a storage buffer exceeds the binding limit.
    pub fn zeros(
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
        self.allocated += bytes;
        Ok(self.context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size: bytes,
            usage,
            mapped_at_creation: false,
        }))
    }

    /// Creates a storage buffer of zeros that can be copied from and to.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub fn storage(&mut self, what: &'static str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        self.zeros(what, bytes, usage)
    }

    /// Creates a storage buffer with contents `data`.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub fn table<T: Pod>(&mut self, what: &'static str, data: &[T]) -> Result<wgpu::Buffer, GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = self.storage(what, bytes.len() as u64)?;
        if !bytes.is_empty() {
            self.context.queue.write_buffer(&buffer, 0, bytes);
        }
        Ok(buffer)
    }

    /// Creates a buffer for reading results back.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub fn readback(&mut self, what: &'static str, bytes: u64) -> Result<Readback, GpuError> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        Ok(Readback { buffer: self.zeros(what, bytes, usage)? })
    }
}

/// A buffer to which results are copied, and which the CPU can map.
#[derive(Debug)]
pub struct Readback {
    pub(crate) buffer: wgpu::Buffer,
}

impl Readback {
    /// Waits for `submission`, which copies results into this buffer, and passes the first `bytes` bytes to `take`.
    pub(crate) async fn read<T>(
        &self,
        context: &GpuContext,
        submission: &wgpu::SubmissionIndex,
        bytes: u64,
        take: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, GpuError> {
        let (sender, receiver) = oneshot::channel();
        self.buffer.map_async(wgpu::MapMode::Read, ..bytes, move |result| {
            // Ignore the error: the receiver is dropped if the wait timed out.
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
