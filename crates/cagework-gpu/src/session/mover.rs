//! What moves the mesh when the cage moves: kernels, or the processor where the device only draws.
//!
//! Which one is decided when the device is opened ([`GpuContext::draws_only`]); to the session both are the same.

use std::sync::Arc;

use cagework_core::deform::vertex_normals;
use cagework_core::dynamic::DisplacementField;
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

/// Deforms one mesh, frame after frame; `[positions, normals]` are what is drawn.
#[derive(Debug)]
pub(super) enum Mover {
    /// By kernels: a moved cage is all that is uploaded.
    Kernels { deformer: Box<Deformer>, tables: [Table; 2] },
    /// By the processor: every vertex is uploaded.
    Processor { model: Arc<DrawModel>, triangles: Vec<[u32; 3]>, tables: [Table; 2] },
}

impl Mover {
    /// `on_gpu`: the same weights, if they are there already.
    pub(super) async fn new(
        context: &GpuContext,
        model: &Arc<DrawModel>,
        weights: &Weights,
        frames: &Frames,
        on_gpu: Option<GpuWeights>,
    ) -> Result<Self, GpuError> {
        let triangles = model.shading_triangles();
        if context.draws_only() {
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
        let deformer = Deformer::new(context, &on_gpu, &triangles).await?;
        let tables = [deformer.positions(), deformer.normals()].map(|b| Table::Buffer(b.clone()));
        Ok(Self::Kernels { deformer: Box::new(deformer), tables })
    }

    /// Holds parts that the cage does not bend from the next pose on; none: everything follows. The processor is told with each
    /// frame.
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

    /// Takes where the cage is.
    pub(super) fn pose(&self, context: &GpuContext, cage_positions: &[Vec3]) {
        match self {
            Self::Kernels { deformer, .. } => deformer.pose(context, cage_positions),
            // It looks when it deforms: a pose that no frame shows costs nothing.
            Self::Processor { .. } => {}
        }
    }

    /// Sees to it that what is recorded next finds the mesh where the cage has it: `positions`, by the processor.
    pub(super) fn encode(
        &self,
        context: &GpuContext,
        encoder: &mut wgpu::CommandEncoder,
        positions: impl FnOnce() -> Vec<Vec3>,
    ) {
        match self {
            Self::Kernels { deformer, .. } => deformer.encode(encoder),
            // There is none elsewhere; the condition leaves this out of the page's main artifact.
            Self::Processor { model, .. } if context.draws_only() => {
                self.show(context, model.with_copies(&positions()));
            }
            Self::Processor { .. } => {}
        }
    }

    /// The same where a clip has it.
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

    /// What skins in its place while a clip plays. `skin` of the model's vertices.
    pub(super) async fn skinner(
        &self,
        context: &GpuContext,
        model: &DrawModel,
        skin: &Skin,
        field: Option<DisplacementField>,
    ) -> Result<Skinner, GpuError> {
        let skin = skin.with_copies(&model.copies);
        let positions =
            if let Self::Kernels { deformer, .. } = self { Some(deformer.positions()) } else { None };
        Skinner::new(context, skin, field, positions).await
    }

    /// Uploads vertices and their normals.
    fn show(&self, context: &GpuContext, at: Vec<Vec3>) {
        let Self::Processor { triangles, tables: [positions, normals], .. } = self else { return };
        let shading = vertex_normals(&at, triangles);
        for (table, points) in [(positions, at), (normals, shading)] {
            let padded: Vec<Vec4> = points.into_iter().map(|p| p.extend(1.0)).collect();
            table.write(context, bytemuck::cast_slice(&padded));
        }
    }

    /// Where the mesh is, object units: `[n_vertices]`, and copies after them or not.
    pub(super) async fn read_positions(
        &self,
        context: &GpuContext,
        positions: impl FnOnce() -> Vec<Vec3>,
    ) -> Result<Vec<Vec3>, GpuError> {
        match self {
            Self::Kernels { deformer, .. } => {
                // Again even if nothing moved: it costs a millisecond, and a frame may not have been drawn yet.
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
