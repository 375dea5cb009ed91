//! Report of a bind, shared by the command line, JSON and the page.

use serde::{Deserialize, Serialize};

use crate::options::{Backend, CellShape, DeltaNorm, Method, Preconditioner, Solver};

/// Report of a bind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct BindReport {
    /// Discretisation of the cage: classic (as published) or embedded.
    pub method: Method,
    /// Solver of Laplace's equation: Jacobi, multigrid, or conjugate gradients.
    pub solver: Solver,
    /// Preconditioner of conjugate gradients.
    #[serde(default)]
    pub preconditioner: Preconditioner,
    /// Processor that computed the bind.
    pub backend: Backend,
    /// Name of the GPU, if it solved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "typescript", ts(optional))]
    pub adapter: Option<String>,
    /// Number of threads that solved.
    pub threads: usize,
    /// Requested number of cells along the longest side.
    pub grid: u32,
    /// Cells of the grid along x, y, z.
    pub dims: [u32; 3],
    /// Edge lengths of a cell, object units.
    pub cell_size: [f32; 3],
    /// Shape of the cells: rectangular (as published) or cubic.
    pub cell_shape: CellShape,
    /// Norm of the change of a cell in Eq. 2 of the paper.
    pub delta_norm: DeltaNorm,
    /// Convergence threshold for delta.
    pub tau: f32,
    /// Cells of the finest grid by kind.
    pub cells: CellCounts,
    /// Unknowns of each level, finest first; one entry for Jacobi.
    pub levels: Vec<u64>,
    /// Jacobi sweeps, V-cycles on the finest level, or steps of conjugate gradients; maximum over batches.
    pub iterations: u32,
    /// Whether delta fell below tau within the limit on iterations.
    pub converged: bool,
    /// Whether f32 precision ended the solve before delta fell below tau.
    pub at_round_off: bool,
    /// Delta after every `delta_interval` iterations. Jacobi: Eq. 2, the mean change of a cell per sweep. Other
    /// solvers: estimated remaining error, RMS over cells. `[iterations / delta_interval]`, rounded up.
    pub delta_history: Vec<f32>,
    /// Iterations per entry of `delta_history`: 1 except for Jacobi on the GPU.
    #[serde(default = "one")]
    pub delta_interval: u32,
    /// RMS residual of the finest level before each iteration; empty for Jacobi. `[iterations]`
    pub residual_history: Vec<f32>,
    /// Wall-clock time of the stages, milliseconds.
    pub timings_ms: Timings,
    /// Bytes of working memory.
    pub memory_bytes: MemoryBytes,
    /// Rest error: distance of `sum_i w_i c_i` from the mesh vertex (Eq. 3), over vertices inside the cage.
    pub rest_error: RestError,
    /// Error of the rows of weights before correction, which is the error of the solver alone.
    #[serde(default)]
    pub raw_error: RawError,
    /// Statistics of the stored weights.
    pub weights: WeightStats,
    /// Number of mesh vertices (rows).
    pub vertices: u64,
    /// Number of cage vertices (the first columns).
    pub cage_vertices: u64,
    /// Number of inner controls (the next columns).
    #[serde(default)]
    pub inner_controls: u64,
    /// Subdivision steps of the smooth surface.
    #[serde(default)]
    pub smooth: u32,
    /// Number of mesh vertices outside the cage.
    pub outside_vertices: u64,
    /// Number of mesh vertices outside the cage that stay in place.
    #[serde(default)]
    pub staying_vertices: u64,
    /// Largest distance from the cage of a mesh vertex outside it, object units.
    #[serde(default)]
    pub outside_distance: f32,
    /// Number of mesh vertices inside balls and tubes.
    #[serde(default)]
    pub held_vertices: u64,
    /// Number of cells that lines along the three axes classify differently.
    pub ambiguous_cells: u64,
    /// Notices in whole sentences, such as flipped faces or unused vertices.
    pub notices: Vec<String>,
}

fn one() -> u32 {
    1
}

/// Numbers of cells by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct CellCounts {
    /// Cells inside the cage, whose weights are the unknowns.
    pub interior: u64,
    /// Cells that the cage's surface intersects.
    pub boundary: u64,
    /// Cells outside the cage.
    pub exterior: u64,
}

/// Stage times in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Timings {
    /// Voxelization, levels and transfer tables.
    pub voxelize: f64,
    /// Solve of all columns.
    pub solve: f64,
    /// Sampling and assembly.
    pub sample: f64,
    /// The whole bind.
    pub total: f64,
}

/// Working memory, bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct MemoryBytes {
    /// Estimate before the bind.
    pub estimated: u64,
    /// Largest sum of buffers alive at the same time.
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
    /// Mean, as a fraction of the diagonal of the cage's bounding box.
    pub mean_rel: f64,
    /// Largest, as a fraction of the diagonal of the cage's bounding box.
    pub max_rel: f64,
}

/// Error of the rows before correction, over vertices inside the cage. Operator and sampling reproduce linear functions
/// exactly, so with the embedded method this error is that of the solver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct RawError {
    /// `|sum_i w_i - 1|`.
    pub sum: MeanMax,
    /// Distance of `sum_i w_i c_i` from the vertex, as a fraction of the diagonal of the cage's bounding box.
    pub point_rel: MeanMax,
    /// Smallest value, before negative values are clamped to 0.
    pub min_weight: f32,
}

/// Mean and maximum.
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
    /// Largest `|sum of a row - 1|`.
    pub max_sum_error: f64,
    /// Number of stored weights.
    pub nonzeros: u64,
}
