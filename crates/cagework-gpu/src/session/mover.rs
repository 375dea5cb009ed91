//! Deforms the mesh by kernels, or on the CPU if the device only draws.
//!
//! The variant is chosen when the device is opened ([`GpuContext::draws_only`]); both variants have the same interface.

use std::sync::Arc;

use cagework_core::deform::vertex_normals;
use cagework_core::field::Field;
use cagework_core::skin::Skin;
use cagework_core::{Frames, Weights};
use cagework_pose::parts::BoundParts;
use glam::{Vec3, Vec4};

use crate::buffers::Allocator;
use crate::deform::{Deformer, GpuWeights};
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::hold::Holder;
use crate::render::DrawModel;
use crate::skin::Skinner;
use crate::table::{Entry, Table};

/// Deformation of one mesh, by kernels or on the CPU. `tables`: positions and normals that are drawn.
#[derive(Debug)]
pub(super) enum Mover {
    /// Deforms on the GPU and uploads only the cage.
    Kernels { deformer: Box<Deformer>, tables: [Table; 2] },
    /// Deforms on the CPU and uploads all vertices.
    Processor { model: Arc<DrawModel>, triangles: Vec<[u32; 3]>, tables: [Table; 2] },
}

impl Mover {
    /// Prepares a bound model for deformation. `on_gpu`: the same `weights`, if they are on the GPU already.
    pub(super) async fn new(
        context: &GpuContext,
        model: &Arc<DrawModel>,
        weights: &Weights,
        frames: &Frames,
        on_gpu: Option<GpuWeights>,
    ) -> Result<Self, GpuError> {
        if context.draws_only() {
            let triangles = model.shading_triangles();
            let n = model.positions.len() + model.copies.len();
            let mut allocator = Allocator::new(context, "the deformed mesh");
            let positions = Table::new(context, &mut allocator, "positions", Entry::Point, n)?;
            let normals = Table::new(context, &mut allocator, "normals", Entry::Point, n)?;
            allocator.settle().await?;
            return Ok(Self::Processor { model: Arc::clone(model), triangles, tables: [positions, normals] });
        }
        let on_gpu = match (model.rows_with_copies(weights), on_gpu) {
            (Some(weights), _) => GpuWeights::new(context, &weights, frames).await?,
            (None, Some(on_gpu)) => on_gpu,
            (None, None) => GpuWeights::new(context, weights, frames).await?,
        };
        let deformer = Deformer::new(context, &on_gpu, &model.shading_triangles()).await?;
        let tables = [deformer.positions(), deformer.normals()].map(|b| Table::Buffer(b.clone()));
        Ok(Self::Kernels { deformer: Box::new(deformer), tables })
    }

    /// Sets or removes fixed and rigid parts, which take effect with the next pose. Does nothing on the CPU, where the
    /// caller computes the positions of the parts, too.
    pub(super) async fn hold(
        &mut self,
        context: &GpuContext,
        model: &DrawModel,
        parts: Option<Arc<BoundParts>>,
    ) -> Result<(), GpuError> {
        let Self::Kernels { deformer, .. } = self else { return Ok(()) };
        let holder = match parts {
            Some(parts) => Some(Holder::new(context, parts, &model.copies, deformer.positions()).await?),
            None => None,
        };
        deformer.hold(holder);
        Ok(())
    }

    pub(super) fn tables(&self) -> [&Table; 2] {
        let (Self::Kernels { tables, .. } | Self::Processor { tables, .. }) = self;
        tables.each_ref()
    }

    /// Sets the cage's pose.
    pub(super) fn pose(&self, context: &GpuContext, cage_positions: &[Vec3]) {
        match self {
            Self::Kernels { deformer, .. } => deformer.pose(context, cage_positions),
            // The CPU deforms in `encode`, only for poses that are drawn.
            Self::Processor { .. } => {}
        }
    }

    /// Deforms the mesh for the commands recorded next. `positions`: computes the deformed positions on the CPU.
    pub(super) fn encode(
        &self,
        context: &GpuContext,
        encoder: &mut wgpu::CommandEncoder,
        positions: impl FnOnce() -> Vec<Vec3>,
    ) {
        match self {
            Self::Kernels { deformer, .. } => deformer.encode(encoder),
            // `draws_only` is always true here; the condition removes this code from the page's WebGPU build.
            Self::Processor { model, .. } if context.draws_only() => {
                self.show(context, model.with_copies(&positions()));
            }
            Self::Processor { .. } => {}
        }
    }

    /// Like [`Self::encode`], with positions from `skinner`.
    pub(super) fn encode_skinned(
        &self,
        context: &GpuContext,
        encoder: &mut wgpu::CommandEncoder,
        skinner: &Skinner,
    ) {
        match self {
            Self::Kernels { deformer, .. } => deformer.encode_skinned(encoder, skinner),
            Self::Processor { .. } if context.draws_only() => self.show(context, skinner.positions()),
            Self::Processor { .. } => {}
        }
    }

    /// Prepares the playback of a clip. `skin` has the model's vertices, without their copies.
    pub(super) async fn skinner(
        &self,
        context: &GpuContext,
        model: &DrawModel,
        skin: &Skin,
        field: Option<Field>,
    ) -> Result<Skinner, GpuError> {
        let skin = skin.with_copies(&model.copies);
        let positions =
            if let Self::Kernels { deformer, .. } = self { Some(deformer.positions()) } else { None };
        Skinner::new(context, skin, field, positions).await
    }

    /// Uploads positions and computes and uploads normals.
    fn show(&self, context: &GpuContext, at: Vec<Vec3>) {
        let Self::Processor { triangles, tables: [positions, normals], .. } = self else { return };
        let shading = vertex_normals(&at, triangles);
        for (table, points) in [(positions, at), (normals, shading)] {
            let padded: Vec<Vec4> = points.into_iter().map(|p| p.extend(1.0)).collect();
            table.write(context, bytemuck::cast_slice(&padded));
        }
    }

    /// Current positions, object units: `[n_vertices]`. On the GPU, the copies of vertices follow.
    pub(super) async fn read_positions(
        &self,
        context: &GpuContext,
        positions: impl FnOnce() -> Vec<Vec3>,
    ) -> Result<Vec<Vec3>, GpuError> {
        match self {
            Self::Kernels { deformer, .. } => {
                // Deform first, which takes 1 ms: the current pose may not have been drawn yet.
                deformer.run(context).await?;
                deformer.read_positions(context).await
            }
            Self::Processor { .. } => {
                context.check()?;
                Ok(positions())
            }
        }
    }
}
