//! Report of a bind, shared by the command line, JSON and the page.

use serde::Serialize;

use crate::options::{Backend, Method, Solver};

/// Options, grid, convergence, times and errors of a bind.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct BindReport {
    /// Discretisation of the cage: classic (K. Smith; `docs/method.md`, sources) or embedded.
    pub method: Method,
    /// Solver of Laplace's equation: Jacobi, multigrid, or conjugate gradients.
    pub solver: Solver,
    /// Processor that computed the bind.
    pub backend: Backend,
    /// Name of the GPU, if it computed the solution.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "typescript", ts(optional))]
    pub adapter: Option<String>,
    /// Number of threads of the solver.
    pub threads: usize,
    /// Number of cells along the longest side, as requested or chosen.
    pub grid: u32,
    /// Explanation of a number that was chosen automatically.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "typescript", ts(optional))]
    pub grid_reason: Option<String>,
    /// Cells of the grid along x, y, z.
    pub dims: [u32; 3],
    /// Edge lengths of a cell, object units.
    pub cell_size: [f32; 3],
    /// Convergence threshold for delta, the last value of `delta_history`.
    pub tau: f32,
    /// Cells of the finest grid by kind.
    pub cells: CellCounts,
    /// Number of unknowns of each level, finest first; one entry for Jacobi.
    pub levels: Vec<u64>,
    /// Jacobi sweeps, V-cycles on the finest level, or steps of conjugate gradients; maximum over batches.
    pub iterations: u32,
    /// Whether delta fell to tau within the limit on iterations, or f32 precision was exhausted.
    pub converged: bool,
    /// Whether f32 precision ended the solve before delta fell to tau.
    pub at_round_off: bool,
    /// Delta after every `delta_interval` iterations. Jacobi: mean change of a cell per sweep (K. Smith, Eq. 2). Other
    /// solvers: estimated remaining error, RMS over cells. `[iterations / delta_interval]`, rounded up.
    pub delta_history: Vec<f32>,
    /// Iterations per entry of `delta_history`: 1 except for Jacobi on the GPU.
    pub delta_interval: u32,
    /// RMS residual of the finest level before each iteration; empty for Jacobi. `[iterations]`
    pub residual_history: Vec<f32>,
    /// Wall-clock time of the stages, milliseconds.
    pub timings_ms: Timings,
    /// Working memory of the bind: estimated and largest actual size, bytes.
    pub memory_bytes: MemoryBytes,
    /// Rest error: distance of `sum_i w_i c_i`, over all columns, from the mesh vertex.
    pub rest_error: RestError,
    /// Error of the rows of weights before they are corrected. With the embedded method, it is the error of the solver
    /// alone. `None` if all rows have offsets, as around inner points and bones: their weights do not reproduce positions.
    pub raw_error: Option<RawError>,
    /// Range, largest sum error, and number of the stored weights.
    pub weights: WeightStats,
    /// Number of mesh vertices (rows).
    pub vertices: u64,
    /// Number of cage vertices (the first columns).
    pub cage_vertices: u64,
    /// Number of inner controls (the next columns).
    pub inner_controls: u64,
    /// Subdivision steps of the smooth surface.
    pub smooth: u32,
    /// Number of mesh vertices outside the cage.
    pub outside_vertices: u64,
    /// Number of mesh vertices outside the cage that stay in place.
    pub staying_vertices: u64,
    /// Largest distance between the cage and a mesh vertex outside it, object units.
    pub outside_distance: f32,
    /// Number of mesh vertices inside the balls and tubes around inner points and bones.
    pub held_vertices: u64,
    /// Number of cells for which lines along x, y and z disagree about inside and outside the cage.
    pub ambiguous_cells: u64,
    /// Notices in whole sentences, for example about flipped faces or unused vertices.
    pub notices: Vec<String>,
}

/// Numbers of cells by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct CellCounts {
    /// Cells inside the cage, without the boundary cells.
    pub interior: u64,
    /// Classic method: cells that the cage's surface intersects. Embedded method: cells whose centre is inside the cage
    /// and less than a cell from its surface along an axis.
    pub boundary: u64,
    /// Cells outside the cage.
    pub exterior: u64,
}

/// Wall-clock time of each stage of a bind, milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
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

/// Working memory of a bind, bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct MemoryBytes {
    /// Estimate that is compared with the memory limit before the bind starts.
    pub estimated: u64,
    /// Largest sum of buffers alive at the same time.
    pub peak: u64,
}

/// Reconstruction error of the rest pose: distance of `sum_i w_i c_i` from the mesh vertex. The mean is Eq. 3 in
/// K. Smith's paper (`docs/method.md`, sources).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct RestError {
    /// Mean over the vertices, object units.
    pub mean: f64,
    /// 99th percentile over the vertices, object units.
    pub p99: f64,
    /// Largest error of a vertex, object units.
    pub max: f64,
    /// Mean over the vertices, as a fraction of the diagonal of the cage's bounding box.
    pub mean_rel: f64,
    /// Largest error of a vertex, as a fraction of the diagonal of the cage's bounding box.
    pub max_rel: f64,
}

/// Error of the rows before correction, over vertices inside the cage. Operator and sampling reproduce linear functions
/// exactly, so with the embedded method this error is that of the solver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct RawError {
    /// Deviation of a row's sum from 1: `|sum_i w_i - 1|`.
    pub sum: MeanMax,
    /// Distance of `sum_i w_i c_i` from the vertex, as a fraction of the diagonal of the cage's bounding box.
    pub point_rel: MeanMax,
    /// Smallest weight, before negative weights are set to 0.
    pub min_weight: f32,
}

/// Mean and maximum of an error over the mesh vertices inside the cage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct MeanMax {
    /// Mean of the error.
    pub mean: f64,
    /// Largest error of a vertex.
    pub max: f64,
}

/// Statistics of the stored weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
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
