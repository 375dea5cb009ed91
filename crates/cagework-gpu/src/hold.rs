//! Replaces the deformed positions of fixed and rigid parts of the mesh. Runs on the GPU after the deformation and
//! before the computation of normals.

use std::sync::Arc;

use cagework_pose::parts::BoundParts;
use glam::Vec3;

use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::kernels;
use crate::layout::Work;
use crate::pipelines::Launch;

/// GPU data of the parts of one mesh that stay in place or are rigid.
#[derive(Debug)]
pub(crate) struct Holder {
    parts: Arc<BoundParts>,
    motions: wgpu::Buffer,
    launch: Launch,
    groups: [u32; 2],
}

impl Holder {
    /// Uploads parts. `copies`: source vertices of the duplicates that follow the mesh's vertices. `positions`:
    /// vertex buffer to modify.
    ///
    /// # Errors
    /// As [`Allocator::zeros`] and [`Allocator::settle`].
    pub(crate) async fn new(
        context: &GpuContext,
        parts: Arc<BoundParts>,
        copies: &[u32],
        positions: &wgpu::Buffer,
    ) -> Result<Self, GpuError> {
        let mut allocator = Allocator::new(context, "parts that are held");
        let (mut rest, mut piece_of) = (parts.rest.clone(), parts.piece_of.clone());
        rest.extend(copies.iter().map(|&v| parts.rest[v as usize]));
        piece_of.extend(copies.iter().map(|&v| parts.piece_of[v as usize]));
        let count = rest.len() as u32;
        let rest = allocator.table("vertices at rest", &rest)?;
        let piece_of = allocator.table("pieces of vertices", &piece_of)?;
        let motions = allocator.storage("motions of pieces", 48 * parts.n_pieces() as u64)?;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let work = allocator.zeros("work parameters", size_of::<Work>() as u64, usage)?;
        let buffers = [&rest, &piece_of, &motions, positions];
        let launch = context.pipelines.launch(&context.device, &kernels::HOLD_PARTS, &work, &buffers);
        let (groups, stride) = launch.groups(count);
        let of_work = Work { count, stride, ..Work::default() };
        context.queue.write_buffer(&work, 0, bytemuck::bytes_of(&of_work));
        allocator.settle().await?;
        Ok(Self { parts, motions, launch, groups })
    }

    /// Uploads the motions of the rigid pieces for a pose. `controls`: positions, `[n_controls]`, object units.
    pub(crate) fn pose(&self, context: &GpuContext, controls: &[Vec3]) {
        let motions = self.parts.motions(controls);
        if !motions.is_empty() {
            context.queue.write_buffer(&self.motions, 0, bytemuck::cast_slice(&motions));
        }
    }

    /// Records the kernel that replaces the positions of the parts' vertices.
    pub(crate) fn encode(&self, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_pipeline(&self.launch.pipeline);
        pass.set_bind_group(0, &self.launch.bind_group, &[0]);
        pass.dispatch_workgroups(self.groups[0], self.groups[1], 1);
    }
}
