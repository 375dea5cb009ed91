//! Deforms the mesh. The weights are uploaded once; a frame uploads only the cage's pose, and kernels write positions
//! and normals to the vertex buffers for drawing.

use bytemuck::Pod;
use cagework_core::stencil::tables::{BUNDLE, NormalTable, SLICE, SlicedWeights};
use cagework_core::{Frames, Weights};
use futures_channel::oneshot;
use glam::{Vec3, Vec4};

use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::hold::Holder;
use crate::kernels;
use crate::layout::{WORK_STRIDE, Work};
use crate::pipelines::Launch;
use crate::skin::Skinner;

/// Maximum number of weights per upload, before the rows are rounded up to whole slices of [`SlicedWeights`]. Such an
/// upload blocks a page's main thread for 10 ms.
const WEIGHTS_PER_UPLOAD: u32 = 1 << 19;

/// Weights of a bind on the GPU.
#[derive(Debug)]
pub struct GpuWeights {
    /// The weights in chunks, each of which consists of whole slices.
    chunks: Vec<WeightChunk>,
    frames: Frames,
    n_vertices: u32,
    n_columns: u32,
    bytes: u64,
}

#[derive(Debug)]
struct WeightChunk {
    first_vertex: u32,
    n_vertices: u32,
    slices: wgpu::Buffer,
    columns: wgpu::Buffer,
    weights: wgpu::Buffer,
}

impl GpuWeights {
    /// Uploads weights. Their first columns belong to the controls, the remaining ones to `frames`.
    ///
    /// # Errors
    /// As [`Allocator::zeros`] and [`Allocator::settle`].
    pub async fn new(context: &GpuContext, weights: &Weights, frames: &Frames) -> Result<Self, GpuError> {
        let n_vertices = weights.n_rows();
        let mut allocator = Allocator::new(context, "the weights");
        // In the worst case each weight lengthens all bundles of its slice by an entry.
        let most = WEIGHTS_PER_UPLOAD
            .min((context.max_binding_bytes / (SLICE * size_of::<[f32; BUNDLE]>()) as u64) as u32);
        let (mut chunks, mut bytes, mut begin) = (Vec::new(), 0, 0);
        while begin < n_vertices {
            let start = weights.indptr()[begin];
            let more = weights.indptr()[begin..].partition_point(|&end| end - start <= most);
            let end = (begin + more.next_multiple_of(SLICE * BUNDLE)).min(n_vertices);
            let sliced = SlicedWeights::of_rows(weights, begin..end);
            chunks.push(WeightChunk {
                first_vertex: begin as u32,
                n_vertices: (end - begin) as u32,
                slices: allocator.table("slices of weights", &sliced.slices)?,
                columns: allocator.table("columns of weights", &sliced.columns)?,
                weights: allocator.table("weights", &sliced.weights)?,
            });
            begin = end;
            if begin < n_vertices {
                // Settling yields to other tasks, such as events and frames of a browser.
                bytes += allocator.settle().await?;
                allocator = Allocator::new(context, "the weights");
            }
        }
        Ok(Self {
            chunks,
            frames: frames.clone(),
            n_vertices: n_vertices as u32,
            n_columns: weights.n_columns() as u32,
            bytes: bytes + allocator.settle().await?,
        })
    }

    /// Allocated GPU memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// A kernel, the offset of its parameters in bytes, and its numbers of workgroups along x and y.
type Step = (Launch, u32, [u32; 2]);

/// Kernels and buffers that deform one mesh, once per pose.
#[derive(Debug)]
pub struct Deformer {
    cage: wgpu::Buffer,
    positions: wgpu::Buffer,
    normals: wgpu::Buffer,
    /// Kernels with their dispatch sizes, in order of execution. The last kernel computes the normals.
    steps: Vec<Step>,
    /// Replaces the deformed positions of fixed and rigid parts before the normals are computed; `None` if there are no
    /// such parts.
    holder: Option<Holder>,
    frames: Frames,
    n_vertices: u32,
    n_columns: u32,
}

impl Deformer {
    /// Creates vertex buffers for `weights` and tables for the normals of `triangles`.
    ///
    /// # Errors
    /// As [`Allocator::zeros`] and [`Allocator::settle`].
    pub async fn new(
        context: &GpuContext,
        weights: &GpuWeights,
        triangles: &[[u32; 3]],
    ) -> Result<Self, GpuError> {
        let mut allocator = Allocator::new(context, "the deformed mesh");
        let (n_vertices, n_columns) = (weights.n_vertices, weights.n_columns);
        let vertex_usage = wgpu::BufferUsages::VERTEX
            | wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let vertex_bytes = u64::from(n_vertices) * size_of::<Vec4>() as u64;
        let cage = allocator.storage("cage vertices", u64::from(n_columns) * size_of::<Vec4>() as u64)?;
        let positions = allocator.zeros("positions", vertex_bytes, vertex_usage)?;
        let normals = allocator.zeros("normals", vertex_bytes, vertex_usage)?;
        // Settling yields to other tasks, such as events and frames of a browser, before and after the table is made.
        allocator.settle().await?;
        let table = NormalTable::new(n_vertices as usize, triangles);
        Allocator::new(context, "the deformed mesh").settle().await?;
        let mut allocator = Allocator::new(context, "the deformed mesh");
        let starts = allocator.table("starts of triangle lists", &table.starts)?;
        let others = allocator.table("triangle lists", &table.others)?;
        let n_steps = weights.chunks.len() as u64 + 1;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let works = allocator.zeros("work parameters", n_steps * WORK_STRIDE, usage)?;

        let launch = |kernel, buffers: &[&wgpu::Buffer]| {
            context.pipelines.launch(&context.device, kernel, &works, buffers)
        };
        let mut deformer = Self {
            cage,
            positions,
            normals,
            steps: Vec::new(),
            holder: None,
            frames: weights.frames.clone(),
            n_vertices,
            n_columns,
        };
        let (cage, positions) = (deformer.cage.clone(), deformer.positions.clone());
        for chunk in &weights.chunks {
            let buffers = [&chunk.slices, &chunk.columns, &chunk.weights, &cage, &positions];
            let launch = launch(&kernels::DEFORM_VERTICES, &buffers);
            let n_bundles = chunk.n_vertices.div_ceil(BUNDLE as u32);
            deformer.add(context, &works, launch, chunk.first_vertex, n_bundles);
        }
        let launch = launch(&kernels::VERTEX_NORMALS, &[&starts, &others, &positions, &deformer.normals]);
        deformer.add(context, &works, launch, 0, n_vertices);
        allocator.settle().await?;
        Ok(deformer)
    }

    fn add(
        &mut self,
        context: &GpuContext,
        works: &wgpu::Buffer,
        launch: Launch,
        first_row: u32,
        count: u32,
    ) {
        let (groups, stride) = launch.groups(count);
        let work = Work { count, stride, first_row, ..Work::default() };
        let offset = self.steps.len() as u64 * WORK_STRIDE;
        context.queue.write_buffer(works, offset, bytemuck::bytes_of(&work));
        self.steps.push((launch, offset as u32, groups));
    }

    /// Uploads the positions of the controls, `[n_controls]`, object units, for subsequent calls of [`Self::encode`].
    ///
    /// # Panics
    /// If the number of positions differs from the number of controls.
    pub fn pose(&self, context: &GpuContext, cage_positions: &[Vec3]) {
        let columns = self.frames.columns(cage_positions);
        assert_eq!(columns.len(), self.n_columns as usize, "one position per cage vertex");
        let padded: Vec<Vec4> = columns.iter().map(|p| p.extend(1.0)).collect();
        context.queue.write_buffer(&self.cage, 0, bytemuck::cast_slice(&padded));
        if let Some(holder) = &self.holder {
            holder.pose(context, cage_positions);
        }
    }

    /// Sets the parts that stay in place or are rigid. They take effect with the next pose.
    pub(crate) fn hold(&mut self, holder: Option<Holder>) {
        self.holder = holder;
    }

    /// Records the computation of positions and normals.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
        let (_, moving) = self.steps.split_last().expect("normals are the last step");
        self.encode_steps(encoder, moving, |pass| {
            if let Some(holder) = &self.holder {
                holder.encode(pass);
            }
        });
    }

    /// Like [`Self::encode`], but the positions come from skinning.
    pub(crate) fn encode_skinned(&self, encoder: &mut wgpu::CommandEncoder, skinner: &Skinner) {
        self.encode_steps(encoder, &[], |pass| skinner.encode(pass));
    }

    /// Records the steps `moving`, then the commands of `then`, then the computation of normals.
    fn encode_steps(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        moving: &[Step],
        then: impl FnOnce(&mut wgpu::ComputePass<'_>),
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("deform"),
            ..wgpu::ComputePassDescriptor::default()
        });
        let record = |pass: &mut wgpu::ComputePass<'_>, (launch, offset, groups): &Step| {
            pass.set_pipeline(&launch.pipeline);
            pass.set_bind_group(0, &launch.bind_group, &[*offset]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        };
        moving.iter().for_each(|step| record(&mut pass, step));
        then(&mut pass);
        self.steps.last().into_iter().for_each(|normals| record(&mut pass, normals));
    }

    /// Vertex buffer of positions: x, y, z, 1 as f32, stride 16 bytes, object units.
    #[must_use]
    pub fn positions(&self) -> &wgpu::Buffer {
        &self.positions
    }

    /// Vertex buffer of unit normals: x, y, z, 0 as f32, stride 16 bytes.
    #[must_use]
    pub fn normals(&self) -> &wgpu::Buffer {
        &self.normals
    }

    /// Number of mesh vertices.
    #[must_use]
    pub fn n_vertices(&self) -> u32 {
        self.n_vertices
    }

    /// Deforms for the latest pose and waits until the GPU is done.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`], [`GpuError::Refused`], [`GpuError::Timeout`].
    pub async fn run(&self, context: &GpuContext) -> Result<(), GpuError> {
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.encode(&mut encoder);
        let submission = context.queue.submit([encoder.finish()]);
        let (sender, done) = oneshot::channel();
        context.queue.on_submitted_work_done(move || {
            // Sending cannot fail, because the receiver exists until the wait below returns.
            let _ = sender.send(());
        });
        context.wait(&submission, done).await
    }

    /// Reads the positions back. `[n_vertices]`, object units.
    ///
    /// # Errors
    /// As [`Self::run`], and [`GpuError::OutOfMemory`].
    pub async fn read_positions(&self, context: &GpuContext) -> Result<Vec<Vec3>, GpuError> {
        let rows: Vec<Vec4> = read_all(context, &self.positions, self.n_vertices as usize).await?;
        Ok(rows.into_iter().map(Vec4::truncate).collect())
    }

    /// Reads the normals back. `[n_vertices]`
    ///
    /// # Errors
    /// As [`Self::read_positions`].
    pub async fn read_normals(&self, context: &GpuContext) -> Result<Vec<Vec3>, GpuError> {
        let rows: Vec<Vec4> = read_all(context, &self.normals, self.n_vertices as usize).await?;
        Ok(rows.into_iter().map(Vec4::truncate).collect())
    }
}

/// Reads back the first `count` elements of a buffer.
pub(crate) async fn read_all<T: Pod>(
    context: &GpuContext,
    buffer: &wgpu::Buffer,
    count: usize,
) -> Result<Vec<T>, GpuError> {
    let bytes = (count * size_of::<T>()) as u64;
    if bytes == 0 {
        return Ok(Vec::new());
    }
    let mut allocator = Allocator::new(context, "results, read back");
    let readback = allocator.readback("results, read back", bytes)?;
    allocator.settle().await?;
    let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &readback.buffer, 0, bytes);
    let submission = context.queue.submit([encoder.finish()]);
    readback.read(context, &submission, bytes, |bytes| bytemuck::pod_collect_to_vec(bytes)).await
}
