//! Uploads a hierarchy's stencils, transfers and right-hand sides.

use cagework_core::levels::Level;
use cagework_core::solve::hierarchy::Hierarchy;
use cagework_core::stencil::tables::{LevelTable, TransferTable};

use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::plan::QUAD_BYTES;

/// Stencils of a level on the GPU.
#[derive(Debug)]
pub struct GpuLevel {
    pub(crate) neighbours: wgpu::Buffer,
    pub(crate) diagonal: wgpu::Buffer,
    pub(crate) rhs_of_row: wgpu::Buffer,
    pub(crate) n_rows: u32,
    /// First row and number of rows of each colour. The row of zeros that follows each colour is not counted.
    pub(crate) colours: [(u32, u32); 2],
    pub(crate) n_unknowns: u32,
    /// Number of rows of the right-hand side.
    pub(crate) n_rhs: u32,
}

/// Transfer tables between a level and the next coarser one.
#[derive(Debug)]
pub struct GpuTransfer {
    pub(crate) around: wgpu::Buffer,
    pub(crate) faces: wgpu::Buffer,
    pub(crate) corners: wgpu::Buffer,
    pub(crate) n_faces: u32,
    pub(crate) n_corners: u32,
}

impl GpuLevel {
    /// Uploads a level. With `finest`, the right-hand side has one row per cut cell.
    ///
    /// # Errors
    /// As [`Allocator::zeros`].
    pub fn new(allocator: &mut Allocator<'_>, level: &Level, finest: bool) -> Result<Self, GpuError> {
        let table = LevelTable::new(level, finest);
        let colour = |c: usize| (level.first_row(c) as u32, level.colours[c].n_cells);
        Ok(Self {
            neighbours: allocator.table("neighbours", &table.neighbours)?,
            diagonal: allocator.table("diagonal", &table.diagonal)?,
            rhs_of_row: allocator.table("rows of right-hand side", &table.rhs_of_row)?,
            n_rows: level.n_rows() as u32,
            colours: [colour(0), colour(1)],
            n_unknowns: level.n_unknowns() as u32,
            n_rhs: if finest { level.n_cut() } else { level.n_rows() } as u32,
        })
    }

    /// Allocates a field of zeros for `n_quads` quads of columns.
    pub(crate) fn field(
        &self,
        allocator: &mut Allocator<'_>,
        n_quads: u32,
    ) -> Result<wgpu::Buffer, GpuError> {
        allocator.storage("field", u64::from(self.n_rows) * u64::from(n_quads) * QUAD_BYTES)
    }

    /// Allocates a right-hand side of zeros for `n_quads` quads of columns.
    pub(crate) fn rhs(&self, allocator: &mut Allocator<'_>, n_quads: u32) -> Result<wgpu::Buffer, GpuError> {
        allocator.storage("right-hand side", u64::from(self.n_rhs) * u64::from(n_quads) * QUAD_BYTES)
    }
}

impl GpuTransfer {
    /// Uploads the tables between levels k and k + 1.
    ///
    /// # Errors
    /// As [`Allocator::zeros`].
    pub fn new(allocator: &mut Allocator<'_>, hierarchy: &Hierarchy, k: usize) -> Result<Self, GpuError> {
        let (fine, coarse) = (&hierarchy.levels[k], &hierarchy.levels[k + 1]);
        let transfer = &hierarchy.transfers[k];
        let table = TransferTable::new(fine, coarse, transfer);
        Ok(Self {
            around: allocator.table("restriction", &table.around)?,
            faces: allocator.table("prolongation to faces", &table.faces)?,
            corners: allocator.table("prolongation to corners", &table.corners)?,
            n_faces: transfer.faces.len() as u32,
            n_corners: transfer.corners.len() as u32,
        })
    }
}

/// Uploads the boundary values of columns `first_column..first_column + n_lanes` on level k. The finest level has one
/// row per cut cell, coarser levels have one row per row of their fields. `values` is scratch space.
pub(crate) fn upload_rhs(
    context: &GpuContext,
    hierarchy: &Hierarchy,
    k: usize,
    first_column: u32,
    n_lanes: u32,
    rhs: &wgpu::Buffer,
    values: &mut Vec<f32>,
) {
    let level = &hierarchy.levels[k];
    let (first, n_lanes) = (first_column as usize, n_lanes as usize);
    let n_rows = if k == 0 { level.n_cut() } else { level.n_rows() };
    values.clear();
    values.resize(n_rows * n_lanes, 0.0);
    for term in hierarchy.boundary_terms(k, first..first + n_lanes) {
        let number = term.cut_cell as usize;
        let row = if k == 0 { number } else { level.row_of_cut(number) };
        values[row * n_lanes + term.column as usize - first] = term.value;
    }
    if !values.is_empty() {
        context.queue.write_buffer(rhs, 0, bytemuck::cast_slice(values));
    }
}
