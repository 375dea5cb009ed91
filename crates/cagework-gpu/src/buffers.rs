//! Buffers: made, filled, read back; out of memory is an error, not a crash.

use bytemuck::Pod;
use futures_channel::oneshot;

use crate::device::GpuContext;
use crate::error::GpuError;
use crate::plan::PlanError;

/// Smallest buffer: bindings must not be empty, and no kernel reads more of an empty one.
const MIN_BYTES: u64 = 16;

/// Makes the buffers and textures of one thing and notices when there is no memory left.
///
/// A GPU answers late: behind all frames under way. So everything is made, filled and bound first, which never waits,
/// and asked about once, by [`Self::settle`]; whatever went wrong until then went wrong here. (Opening a page on a
/// software GPU, an answer for each buffer took 2 s.)
#[derive(Debug)]
#[must_use = "nothing is known to be there before it has settled"]
pub struct Allocator<'a> {
    context: &'a GpuContext,
    what: &'static str,
    allocated: u64,
    // In the order in which they have to be popped.
    memory: wgpu::ErrorScopeGuard,
    refused: wgpu::ErrorScopeGuard,
}

impl<'a> Allocator<'a> {
    /// An allocator for `what`, as error messages call it, that has made nothing yet. Until it settles, nothing may be
    /// awaited: the device's errors are its own.
    pub fn new(context: &'a GpuContext, what: &'static str) -> Self {
        let refused = context.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let memory = context.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        Self { context, what, allocated: 0, memory, refused }
    }

    /// Waits for the GPU's answer; bytes of everything made.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`], [`GpuError::Refused`], [`GpuError::DeviceLost`].
    pub async fn settle(self) -> Result<u64, GpuError> {
        // Popped before anything is awaited: other work may push scopes of its own meanwhile.
        let (memory, refused) = (self.memory.pop(), self.refused.pop());
        let (no_memory, refusal) = (memory.await, refused.await);
        // A lost device refuses everything, and that it is lost is the better message.
        self.context.check()?;
        if no_memory.is_some() {
            return Err(GpuError::OutOfMemory { what: self.what.to_owned(), bytes: self.allocated });
        }
        if let Some(error) = refusal {
            return Err(GpuError::Refused { reason: error.to_string() });
        }
        Ok(self.allocated)
    }

    /// What is made elsewhere, but belongs to it.
    pub(crate) fn count(&mut self, bytes: u64) {
        self.allocated += bytes;
    }

    /// A buffer of zeros.
    ///
    /// # Errors
    /// [`PlanError::Binding`] for a storage buffer that is larger than a binding may be.
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

    /// A storage buffer of zeros that can be copied from and to.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub fn storage(&mut self, what: &'static str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        self.zeros(what, bytes, usage)
    }

    /// A storage buffer that holds `data`.
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

    /// A buffer to read results back through.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub fn readback(&mut self, what: &'static str, bytes: u64) -> Result<Readback, GpuError> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        Ok(Readback { buffer: self.zeros(what, bytes, usage)? })
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
