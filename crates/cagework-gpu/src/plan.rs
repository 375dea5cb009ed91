//! Memory is planned before any of it is allocated: how many columns go in a batch, and what that takes.

use cagework_core::options::Solver;
use cagework_core::sample::Stencils;
use cagework_core::solve::hierarchy::Hierarchy;
use cagework_core::stencil::REDUCE_VALUES;
use thiserror::Error;

/// Bytes of four columns of a row.
const QUAD_BYTES: u64 = 16;

/// Most columns of a batch: more would gain nothing, and the sampled block is read back at once.
pub const MAX_LANES: u64 = 128;

/// Sizes of a bind on the GPU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Columns of a batch, a multiple of 4.
    pub n_lanes: u32,
    /// Batches.
    pub n_batches: u32,
    /// Vertices that are sampled and read back at a time.
    pub vertices_per_block: u32,
    /// Bytes of stencils, transfers and sampling tables.
    pub table_bytes: u64,
    /// Bytes of fields, right-hand sides, and blocks.
    pub field_bytes: u64,
}

/// Why a bind does not fit on the GPU.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlanError {
    /// One array alone is larger than the GPU can bind.
    #[error(
        "{what} needs {needed} bytes in one piece, the GPU binds at most {limit}: use a smaller grid, or the CPU"
    )]
    Binding {
        /// Which one.
        what: &'static str,
        /// Bytes.
        needed: u64,
        /// Bytes.
        limit: u64,
    },
    /// All together is larger than allowed.
    #[error(
        "the GPU would need {} MiB for this bind, more than the limit of {} MiB: use a smaller grid or raise the limit",
        needed >> 20, limit >> 20
    )]
    Memory {
        /// Bytes for the smallest batches.
        needed: u64,
        /// Bytes.
        limit: u64,
    },
}

/// What the sizes depend on.
struct Sizes {
    /// Largest tables, each with its name and bytes.
    tables: Vec<(&'static str, u64)>,
    /// Rows of all arrays of a batch; Jacobi keeps all batches, multigrid one.
    rows: u64,
    /// Rows of the largest one.
    largest_rows: u64,
    /// Bytes that do not depend on the number of columns.
    other_bytes: u64,
    all_batches: bool,
}

impl Plan {
    /// The plan of a bind: the largest batches for which no array exceeds `max_binding_bytes` and all together stay
    /// below `memory_limit`.
    ///
    /// # Errors
    /// [`PlanError`] when not even batches of four columns do.
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
            // Evened out: 7 quads in batches of at most 6 are 4 and 3.
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

    /// Bytes of all buffers.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.table_bytes + self.field_bytes
    }

    /// Quads of four columns in a batch.
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
            // The field, red residuals, right-hand side; two fields on each coarse level. A single level keeps its old
            // values as well.
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
