//! What a bind reports, always: the one struct behind the command line, the JSON report and the page.

use serde::{Deserialize, Serialize};

use crate::options::{Backend, CellShape, DeltaNorm, Method, Preconditioner, Solver};

/// Everything worth knowing about one bind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct BindReport {
    /// Classic (as published) or embedded.
    pub method: Method,
    /// Jacobi, multigrid, or conjugate gradients.
    pub solver: Solver,
    /// What conjugate gradients were preconditioned by.
    #[serde(default)]
    pub preconditioner: Preconditioner,
    /// Where it was computed.
    pub backend: Backend,
    /// Name of the GPU that solved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "typescript", ts(optional))]
    pub adapter: Option<String>,
    /// Threads that solved.
    pub threads: usize,
    /// Cells along the longest side, as asked for.
    pub grid: u32,
    /// Cells along x, y, z of the grid that was built.
    pub dims: [u32; 3],
    /// Edge lengths of a cell, object units.
    pub cell_size: [f32; 3],
    /// Rectangular (as published) or cubic cells.
    pub cell_shape: CellShape,
    /// How Eq. 2 is read.
    pub delta_norm: DeltaNorm,
    /// Stop threshold for delta.
    pub tau: f32,
    /// Cells of each kind on the finest grid.
    pub cells: CellCounts,
    /// Cells to be solved for on each level, finest first; one entry for Jacobi.
    pub levels: Vec<u64>,
    /// Jacobi sweeps, V-cycles on the finest level, or steps of conjugate gradients (the largest number over the batches).
    pub iterations: u32,
    /// Whether delta fell below tau before the limit on iterations.
    pub converged: bool,
    /// Whether f32 ended the solve, having no more digits to give, before delta met tau.
    pub at_round_off: bool,
    /// Delta after every `delta_interval` iterations. Jacobi: Eq. 2, the sweep's average change of a cell. The others:
    /// the error that is expected to remain, root mean square over cells.
    /// `[iterations / delta_interval]`, rounded up.
    pub delta_history: Vec<f32>,
    /// Iterations between two entries of `delta_history`: 1, but for the GPU's Jacobi sweeps, which are checked now
    /// and then.
    #[serde(default = "one")]
    pub delta_interval: u32,
    /// Root mean square residual of the finest level before each iteration; empty for Jacobi. `[iterations]`
    pub residual_history: Vec<f32>,
    /// Wall-clock time of the stages, milliseconds.
    pub timings_ms: Timings,
    /// Bytes of working memory.
    pub memory_bytes: MemoryBytes,
    /// Distance between `sum_i w_i c_i` and the mesh vertex (Eq. 3), over vertices inside the cage.
    pub rest_error: RestError,
    /// The same and the rows' sums before rows were restored: the solver's doing alone.
    #[serde(default)]
    pub raw_error: RawError,
    /// Statistics of the stored weights.
    pub weights: WeightStats,
    /// Mesh vertices (rows).
    pub vertices: u64,
    /// Cage vertices (the first columns).
    pub cage_vertices: u64,
    /// Controls inside the cage (the columns after them).
    #[serde(default)]
    pub inner_controls: u64,
    /// Steps of subdivision between the cage and its smooth surface.
    #[serde(default)]
    pub smooth: u32,
    /// Mesh vertices outside the cage.
    pub outside_vertices: u64,
    /// Those of them that stay where they are.
    #[serde(default)]
    pub staying_vertices: u64,
    /// How far the furthest of them is from the cage, object units.
    #[serde(default)]
    pub outside_distance: f32,
    /// Mesh vertices inside of controls.
    #[serde(default)]
    pub held_vertices: u64,
    /// Cells about which the three axes disagreed whether they are inside.
    pub ambiguous_cells: u64,
    /// Remarks in whole sentences (cage was inside out, unused vertices, ...).
    pub notices: Vec<String>,
}

fn one() -> u32 {
    1
}

/// Cells per kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct CellCounts {
    /// Cells that are solved for.
    pub interior: u64,
    /// Cells that the cage's surface passes through.
    pub boundary: u64,
    /// Cells outside the cage.
    pub exterior: u64,
}

/// Stage times in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Timings {
    /// Cage into grid, levels, transfer tables.
    pub voxelize: f64,
    /// Laplace's equation for all columns.
    pub solve: f64,
    /// Weights at the vertices, sparsification.
    pub sample: f64,
    /// Whole bind.
    pub total: f64,
}

/// Working memory, bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct MemoryBytes {
    /// Estimated before anything was allocated.
    pub estimated: u64,
    /// Sum of the buffers that were alive together at the worst moment.
    pub peak: u64,
}

/// Reconstruction error of the rest pose (Eq. 3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct RestError {
    /// Mean, object units.
    pub mean: f64,
    /// 99th percentile, object units.
    pub p99: f64,
    /// Largest, object units.
    pub max: f64,
    /// Mean over the diagonal of the cage's bounding box.
    pub mean_rel: f64,
    /// Largest over the diagonal of the cage's bounding box.
    pub max_rel: f64,
}

/// What was off before rows were restored, over vertices inside the cage. The operator and the sampling reproduce linear
/// functions exactly, so with the embedded method this is what the solver left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct RawError {
    /// `|sum_i w_i - 1|`.
    pub sum: MeanMax,
    /// Distance of `sum_i w_i c_i` from the vertex over the diagonal of the cage's bounding box.
    pub point_rel: MeanMax,
    /// Smallest value, before negative ones were taken for 0.
    pub min_weight: f32,
}

/// Mean and largest of some numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct MeanMax {
    /// Mean.
    pub mean: f64,
    /// Largest.
    pub max: f64,
}

/// Statistics of the stored weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct WeightStats {
    /// Smallest weight.
    pub min: f32,
    /// Largest weight.
    pub max: f32,
    /// Largest |sum of a row - 1|.
    pub max_sum_error: f64,
    /// Stored weights.
    pub nonzeros: u64,
}
