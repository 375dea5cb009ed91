//! Skinning on the GPU while a clip plays, into the vertex buffer of [`crate::Deformer`].

use cagework_core::field::{Field, bend_vertices};
use cagework_core::skin::{Skin, skin_vertices};
use glam::{Mat4, Vec3};

use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::kernels;
use crate::layout::Work;
use crate::pipelines::Launch;

/// Skinning of one model. Runs on the CPU if the device only draws ([`GpuContext::draws_only`]).
#[derive(Debug)]
pub struct Skinner {
    skin: Skin,
    palette: Vec<Mat4>,
    targets: Vec<f32>,
    /// Displacement field that is added after skinning.
    field: Option<Field>,
    kernel: Option<SkinKernels>,
}

#[derive(Debug)]
struct SkinKernels {
    palette: wgpu::Buffer,
    targets: wgpu::Buffer,
    /// Kernels for skinning and then, if there is one, for the displacement field.
    launches: Vec<Launch>,
    groups: [u32; 2],
}

/// A skin in the layout of the kernel `skin_vertices`. In integer tables, floats are stored as their bits.
#[derive(Debug)]
pub struct SkinTables {
    /// Rest positions, with 1 as fourth component. `[n_vertices]`
    pub rest: Vec<[f32; 4]>,
    /// First influence and first delta of each vertex. `[n_vertices + 1]`
    pub starts: Vec<[u32; 2]>,
    /// Joint and weight of each influence. `[n_influences]`
    pub influences: Vec<[u32; 2]>,
    /// Morph target and displacement of each delta. `[n_deltas]`
    pub deltas: Vec<[u32; 4]>,
}

impl SkinTables {
    /// Converts a skin to the layout of the kernel.
    #[must_use]
    pub fn new(skin: &Skin) -> Self {
        let starts = skin.joint_starts.iter().zip(&skin.delta_starts);
        let delta = |&(t, d): &(u32, Vec3)| [t, d.x.to_bits(), d.y.to_bits(), d.z.to_bits()];
        Self {
            rest: skin.positions.iter().map(|p| p.extend(1.0).to_array()).collect(),
            starts: starts.map(|(&joints, &deltas)| [joints, deltas]).collect(),
            influences: skin.joints.iter().map(|&(joint, weight)| [joint, weight.to_bits()]).collect(),
            deltas: skin.deltas.iter().map(delta).collect(),
        }
    }
}

/// A displacement field as a table for kernels: origin and cell of the lattice, number of nodes along each axis, then
/// the value of each node. Floats are stored as bits. `[2 + n_nodes, 4]`
#[must_use]
pub fn field_table(field: &Field) -> Vec<[u32; 4]> {
    let lattice = &field.lattice;
    let origin = lattice.origin.extend(lattice.cell).to_array().map(f32::to_bits);
    let values = field.values.iter().map(|value| value.to_array().map(f32::to_bits));
    [origin, lattice.dims.extend(0).to_array()].into_iter().chain(values).collect()
}

impl Skinner {
    /// Uploads a skin. `positions`: vertex buffer that the kernels write; `None` if the CPU skins.
    ///
    /// # Errors
    /// As [`Allocator::zeros`] and [`Allocator::settle`].
    pub(crate) async fn new(
        context: &GpuContext,
        skin: Skin,
        field: Option<Field>,
        positions: Option<&wgpu::Buffer>,
    ) -> Result<Self, GpuError> {
        let n_palette = skin.joints.iter().map(|(joint, _)| joint + 1).max().unwrap_or(1);
        let n_targets = skin.deltas.iter().map(|(target, _)| target + 1).max().unwrap_or(1);
        let (palette, targets) = (vec![Mat4::IDENTITY; n_palette as usize], vec![0.0; n_targets as usize]);
        let mut skinner = Self { skin, palette, targets, field, kernel: None };
        let Some(positions) = positions else { return Ok(skinner) };
        let skin = &skinner.skin;
        let mut allocator = Allocator::new(context, "the skin");
        let tables = SkinTables::new(skin);
        let rest = allocator.table("vertices to skin", &tables.rest)?;
        let starts = allocator.table("starts of influences", &tables.starts)?;
        let influences = allocator.table("influences", &tables.influences)?;
        let deltas = allocator.table("deltas of morph targets", &tables.deltas)?;
        let palette = allocator.storage("joints", u64::from(n_palette) * size_of::<Mat4>() as u64)?;
        let targets = allocator.storage("weights of morph targets", u64::from(n_targets) * 4)?;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let work = allocator.zeros("work parameters", size_of::<Work>() as u64, usage)?;
        let buffers = [&rest, &starts, &influences, &deltas, &palette, &targets, positions];
        let launch = |kernel, buffers: &[&wgpu::Buffer]| {
            context.pipelines.launch(&context.device, kernel, &work, buffers)
        };
        let mut launches = vec![launch(&kernels::SKIN_VERTICES, &buffers)];
        if let Some(field) = &skinner.field {
            let field = allocator.table("displacements", &field_table(field))?;
            launches.push(launch(&kernels::BEND_VERTICES, &[&field, positions]));
        }
        let count = skin.positions.len() as u32;
        let (groups, stride) = launches[0].groups(count);
        let of_work = Work { count, stride, ..Work::default() };
        context.queue.write_buffer(&work, 0, bytemuck::bytes_of(&of_work));
        allocator.settle().await?;
        skinner.kernel = Some(SkinKernels { palette, targets, launches, groups });
        Ok(skinner)
    }

    /// Sets joint matrices and morph weights. Entries beyond the ends of the given lists stay unchanged.
    pub(crate) fn pose(&mut self, context: &GpuContext, palette: &[Mat4], targets: &[f32]) {
        self.palette.iter_mut().zip(palette).for_each(|(to, from)| *to = *from);
        self.targets.iter_mut().zip(targets).for_each(|(to, from)| *to = *from);
        if let Some(kernel) = &self.kernel {
            let matrices: Vec<[f32; 16]> = self.palette.iter().map(Mat4::to_cols_array).collect();
            context.queue.write_buffer(&kernel.palette, 0, bytemuck::cast_slice(&matrices));
            context.queue.write_buffer(&kernel.targets, 0, bytemuck::cast_slice(&self.targets));
        }
    }

    /// Records the computation of positions, without normals.
    pub(crate) fn encode(&self, pass: &mut wgpu::ComputePass<'_>) {
        let Some(SkinKernels { launches, groups, .. }) = &self.kernel else { return };
        for launch in launches {
            pass.set_pipeline(&launch.pipeline);
            pass.set_bind_group(0, &launch.bind_group, &[0]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
    }

    /// Skinned and bent positions of all vertices, computed on the CPU.
    pub(crate) fn positions(&self) -> Vec<Vec3> {
        let mut positions = skin_vertices(&self.skin, &self.palette, &self.targets);
        if let Some(field) = &self.field {
            bend_vertices(field, &mut positions);
        }
        positions
    }
}
