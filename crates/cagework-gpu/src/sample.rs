//! Samples weights at mesh vertices from the field of a batch. Only the sampled weights are read back, not the fields.

use cagework_core::sample::Stencils;
use cagework_core::solve::rows::{LANES, Row};
use cagework_core::stencil::tables::SamplingTable;

use crate::buffers::{Allocator, Readback};
use crate::error::GpuError;
use crate::kernels;
use crate::layout::Work;
use crate::plan::{Plan, QUAD_BYTES};
use crate::stream::Stream;

/// Sampling stencils on the GPU, with buffers for one block of weights.
#[derive(Debug)]
pub struct Sampler {
    starts: wgpu::Buffer,
    nodes: wgpu::Buffer,
    hats: wgpu::Buffer,
    block: wgpu::Buffer,
    readback: Readback,
    n_vertices: u32,
    vertices_per_block: u32,
    n_quads: u32,
}

impl Sampler {
    /// Uploads the stencils.
    ///
    /// # Errors
    /// As [`Allocator::zeros`].
    pub fn new(allocator: &mut Allocator<'_>, stencils: &Stencils, plan: &Plan) -> Result<Self, GpuError> {
        let table = SamplingTable::new(stencils);
        let n_quads = plan.n_quads();
        let bytes = u64::from(plan.vertices_per_block) * u64::from(n_quads) * QUAD_BYTES;
        Ok(Self {
            starts: allocator.table("starts of sampling stencils", &table.starts)?,
            nodes: allocator.table("sampling nodes", &table.nodes)?,
            hats: allocator.table("sampling hats", &table.hats)?,
            block: allocator.storage("block of weights", bytes)?,
            readback: allocator.readback("block of weights, read back", bytes)?,
            n_vertices: stencils.len() as u32,
            vertices_per_block: plan.vertices_per_block,
            n_quads,
        })
    }

    /// Samples `field` of the batch that starts at `first_column` into `blocks`, the CPU's batches of
    /// [`LANES`] columns.
    ///
    /// # Errors
    /// If cancelled, or on errors of the GPU.
    pub async fn sample(
        &self,
        stream: &mut Stream<'_>,
        field: &wgpu::Buffer,
        first_column: u32,
        blocks: &mut [Vec<Row>],
    ) -> Result<(), GpuError> {
        let launch = stream
            .launch(&kernels::SAMPLE_WEIGHTS, &[&self.starts, &self.nodes, &self.hats, field, &self.block]);
        let mut first_vertex = 0;
        while first_vertex < self.n_vertices {
            let n = self.vertices_per_block.min(self.n_vertices - first_vertex);
            let work = Work {
                n_quads: self.n_quads,
                first_row: first_vertex,
                first_quad: first_column / 4,
                ..Work::default()
            };
            stream.run(&launch, work, n * self.n_quads).await?;
            let bytes = u64::from(n) * u64::from(self.n_quads) * QUAD_BYTES;
            let put =
                |bytes: &[u8]| self.scatter(bytes, first_column as usize, first_vertex as usize, blocks);
            stream.read(&self.block, &self.readback, bytes, put).await?;
            first_vertex += n;
        }
        Ok(())
    }

    /// Copies a block, `[vertex][lane]`, into the CPU's batches.
    fn scatter(&self, bytes: &[u8], first_column: usize, first_vertex: usize, blocks: &mut [Vec<Row>]) {
        for (k, row) in bytes.chunks_exact(self.n_quads as usize * QUAD_BYTES as usize).enumerate() {
            for (quad, values) in row.chunks_exact(QUAD_BYTES as usize).enumerate() {
                let column = first_column + 4 * quad;
                // Padding of the last batch can exceed the CPU's columns.
                if let Some(block) = blocks.get_mut(column / LANES) {
                    let values: [f32; 4] = bytemuck::pod_read_unaligned(values);
                    block[first_vertex + k][column % LANES..column % LANES + 4].copy_from_slice(&values);
                }
            }
        }
    }
}
