//! Memory plan of a bind on the GPU, made before allocating: batch size and total memory.

use cagework_core::options::Solver;
use cagework_core::sample::Stencils;
use cagework_core::solve::hierarchy::Hierarchy;
use cagework_core::stencil::REDUCE_VALUES;
use cagework_core::words::{size_rounded_down, size_rounded_up};
use thiserror::Error;

/// Bytes of a quad: the values of a row in four columns.
pub(crate) const QUAD_BYTES: u64 = 16;

/// Maximum number of columns of a batch. Larger batches are not faster, but enlarge the block that is read back.
pub const MAX_LANES: u64 = 128;

/// Batch size and memory of a bind on the GPU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Number of columns per batch, a multiple of 4.
    pub n_lanes: u32,
    /// Number of batches.
    pub n_batches: u32,
    /// Number of vertices that are sampled and read back at a time.
    pub vertices_per_block: u32,
    /// Memory of stencils, transfers and sampling tables, bytes.
    pub table_bytes: u64,
    /// Memory of fields, right-hand sides and blocks, bytes.
    pub field_bytes: u64,
}

/// Reason why a bind does not fit into the GPU's memory.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PlanError {
    /// An array exceeds the binding limit.
    #[error(
        "{what} needs {needed} bytes in one buffer, more than the GPU's limit of {limit}: use a smaller grid, or the CPU"
    )]
    Binding {
        /// Name of the array.
        what: &'static str,
        /// Size of the array, bytes.
        needed: u64,
        /// Largest size of a buffer that the GPU can bind, bytes.
        limit: u64,
    },
    /// The total exceeds the memory limit.
    #[error(
        "the GPU would need {} for this bind, more than the limit of {}: use a smaller grid or raise the limit",
        size_rounded_up(*needed), size_rounded_down(*limit)
    )]
    Memory {
        /// Memory that a bind with the smallest batches needs, bytes.
        needed: u64,
        /// Limit on the GPU memory of a bind, bytes.
        limit: u64,
    },
}

/// Sizes of tables and arrays, from which the plan is computed.
struct Sizes {
    /// Names and bytes of the largest tables.
    tables: Vec<(&'static str, u64)>,
    /// Total number of rows of all arrays of a batch. Jacobi keeps the arrays of all batches, multigrid those of one
    /// batch.
    rows: u64,
    /// Number of rows of the largest array.
    largest_rows: u64,
    /// Memory independent of the number of columns, bytes.
    other_bytes: u64,
    all_batches: bool,
}

impl Plan {
    /// Chooses the largest batches for which every array fits `max_binding_bytes` and the total fits `memory_limit`.
    ///
    /// # Errors
    /// [`PlanError`] if batches of four columns do not fit.
    pub fn new(
        hierarchy: &Hierarchy,
        stencils: &Stencils,
        solver: Solver,
        max_binding_bytes: u64,
        memory_limit: u64,
    ) -> Result<Self, PlanError> {
        let sizes = Sizes::of(hierarchy, stencils, solver);
        let bindable = |what, needed| {
            let limit = max_binding_bytes;
            if needed <= limit { Ok(()) } else { Err(PlanError::Binding { what, needed, limit }) }
        };
        for &(what, needed) in &sizes.tables {
            bindable(what, needed)?;
        }
        bindable("a field of four columns", sizes.largest_rows * QUAD_BYTES)?;
        let table_bytes = sizes.tables.iter().map(|(_, bytes)| bytes).sum::<u64>() + sizes.other_bytes;
        let n_columns = hierarchy.n_columns as u64;
        let all_quads = n_columns.div_ceil(4);
        let most_quads =
            (max_binding_bytes / (sizes.largest_rows * QUAD_BYTES)).min(MAX_LANES / 4).min(all_quads);
        let plan = |n_quads: u64| {
            let n_batches = all_quads.div_ceil(n_quads);
            // Balance the batches: 7 quads with a limit of 6 become 4 and 3.
            let n_quads = all_quads.div_ceil(n_batches);
            let vertices_per_block =
                (stencils.len() as u64).min(max_binding_bytes / (n_quads * QUAD_BYTES)).max(1);
            let fields = sizes.rows * if sizes.all_batches { all_quads } else { n_quads };
            let block = 2 * vertices_per_block * n_quads;
            Self {
                n_lanes: 4 * n_quads as u32,
                n_batches: n_batches as u32,
                vertices_per_block: vertices_per_block as u32,
                table_bytes,
                field_bytes: (fields + block) * QUAD_BYTES,
            }
        };
        (1..=most_quads)
            .rev()
            .map(plan)
            .find(|p| p.bytes() <= memory_limit)
            .ok_or_else(|| PlanError::Memory { needed: plan(1).bytes(), limit: memory_limit })
    }

    /// Total memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.table_bytes + self.field_bytes
    }

    /// Number of quads (of four columns) per batch.
    #[must_use]
    pub fn n_quads(&self) -> u32 {
        self.n_lanes / 4
    }
}

impl Sizes {
    fn of(hierarchy: &Hierarchy, stencils: &Stencils, solver: Solver) -> Self {
        let finest = &hierarchy.levels[0];
        let (n_rows, n_cut) = (finest.n_rows() as u64, finest.n_cut() as u64);
        let coarse_rows: u64 = hierarchy.levels[1..].iter().map(|l| l.n_rows() as u64).sum();
        let red_rows = finest.first_row(1) as u64;
        let (nodes, hats) = stencils.n_entries();
        let transfers: u64 = hierarchy
            .transfers
            .iter()
            .zip(&hierarchy.levels[1..])
            .map(|(t, l)| 52 * l.n_rows() as u64 + 16 * t.faces.len() as u64 + 40 * t.corners.len() as u64)
            .sum();
        let rows = match solver {
            Solver::Jacobi => 2 * n_rows + n_cut,
            // With a single level: the field, the previous field, and the right-hand side. With more levels: the field,
            // the red residuals and the right-hand side of the finest level, and two fields per coarse level.
            _ if coarse_rows == 0 => 2 * n_rows + n_cut,
            _ => n_rows + red_rows + n_cut + 2 * coarse_rows,
        };
        let partials = 4 * (n_rows * MAX_LANES / 4).div_ceil(REDUCE_VALUES as u64);
        Self {
            tables: vec![
                ("the neighbour table", 24 * n_rows),
                ("the sampling table", 8 * nodes),
                ("the sampling table of the cage's values", 8 * hats),
                ("the table of vertices", 8 * (stencils.len() as u64 + 1)),
            ],
            rows,
            largest_rows: n_rows.max(1),
            other_bytes: 12 * n_rows + 32 * coarse_rows + transfers + partials,
            all_batches: solver == Solver::Jacobi,
        }
    }
}
