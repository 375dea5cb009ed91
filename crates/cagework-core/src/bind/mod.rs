//! From mesh and cage to weights: the one call that runs every stage.

mod memory;
mod outside;
pub mod pipeline;
mod rebind;
mod solving;
mod voxels;
mod watch;

pub use outside::Misfit;
pub use rebind::{RebindReport, Rebinder};
pub use watch::Watch;

use glam::Vec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::cage::Cage;
use crate::grid::{MAX_GRID, MIN_GRID};
use crate::progress::{Cancelled, Progress};
use crate::report::BindReport;
use crate::weights::Weights;

/// How the cage meets the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// As published: cells that the cage touches hold its values; a vertex takes its cell's weights.
    Classic,
    /// The cage is met where it is (arms), weights are interpolated.
    #[default]
    Embedded,
}

/// How Laplace's equation is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// The paper's Algorithm 3.
    Jacobi,
    /// Full multigrid and V-cycles.
    #[default]
    Multigrid,
}

/// Shape of the classic method's cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CellShape {
    /// g cells along each axis of the cage's box, as published: rectangular cells.
    #[default]
    Box,
    /// Cubic cells, g along the longest axis.
    Cubic,
}

/// How Eq. 2 is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeltaNorm {
    /// Euclidean norm of a cell's change: `sqrt(sum_i (w_i^n - w_i^(n-1))^2)`.
    #[default]
    Euclidean,
    /// The letter of Eq. 2: `sqrt(sum_i |w_i^n - w_i^(n-1)|)`.
    Literal,
}

/// What happens to a mesh vertex outside the cage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutsidePolicy {
    /// Bound to the closest point of the cage, with a rigid offset in that triangle's frame.
    #[default]
    ClosestPoint,
    /// The bind ends in an error.
    Refuse,
}

/// Options of a bind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BindOptions {
    /// Cells along the longest side (each side for classic box cells), 8 to 512. Default 64.
    pub grid: u32,
    /// Default embedded.
    pub method: Method,
    /// Default multigrid.
    pub solver: Solver,
    /// Default box; only the classic method looks at it.
    pub cell_shape: CellShape,
    /// Default Euclidean.
    pub delta_norm: DeltaNorm,
    /// Threads; 0 = all. Default 0.
    pub threads: usize,
    /// Stop when delta falls below it. Default 1e-5.
    pub tau: f32,
    /// Limit on Jacobi sweeps or V-cycles. Default 20,000.
    pub max_iterations: u32,
    /// Weights below it are dropped (then sum and rest pose are restored); 0 = keep all. Default 0.
    pub sparsify: f32,
    /// Refuse to start above this many bytes of working memory. Default 4 GiB.
    pub memory_limit: u64,
    /// Default closest point.
    pub outside: OutsidePolicy,
}

impl Default for BindOptions {
    fn default() -> Self {
        Self {
            grid: 64,
            method: Method::default(),
            solver: Solver::default(),
            cell_shape: CellShape::default(),
            delta_norm: DeltaNorm::default(),
            threads: 0,
            tau: 1e-5,
            max_iterations: 20_000,
            sparsify: 0.0,
            memory_limit: 4 << 30,
            outside: OutsidePolicy::default(),
        }
    }
}

/// The result of a bind.
#[derive(Clone, Debug)]
pub struct Binding {
    /// One row per mesh vertex in the caller's order, one column per cage vertex. A row of a vertex outside the cage
    /// holds the weights of the closest point on the cage.
    pub weights: Weights,
    /// Vertices outside the cage, ascending.
    pub outside: Vec<OutsideVertex>,
    /// What was measured.
    pub report: BindReport,
}

/// A mesh vertex outside the cage: it follows the closest point of the cage, offset rigidly in that triangle's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutsideVertex {
    /// Mesh vertex.
    pub vertex: u32,
    /// Corners of the cage triangle with the closest point: the frame's corners.
    pub corners: [u32; 3],
    /// Offset from the closest point in the frame (edge, in-plane normal to it, triangle normal), object units.
    pub offset: Vec3,
}

/// Why a bind did not come about.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BindError {
    /// An option is out of range.
    #[error("{option} is {value}; it must be {allowed}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// The mesh has no vertices.
    #[error("mesh has no vertices: nothing to bind")]
    EmptyMesh,
    /// A mesh vertex is not a finite number.
    #[error("mesh vertex {vertex} is not a finite number")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
    /// More memory would be needed than allowed.
    #[error(
        "binding needs about {} MiB, more than the limit of {} MiB: use a smaller grid or raise the limit",
        needed >> 20, limit >> 20
    )]
    Memory {
        /// Bytes needed.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// No cell centre lies inside the cage.
    #[error("no cell of the {grid}-cell grid lies inside the cage: use a finer grid")]
    NoInterior {
        /// Cells along the longest side.
        grid: u32,
    },
    /// Vertices are outside and the policy is to refuse.
    #[error("{count} mesh vertices are outside the cage, the first is vertex {first}: enlarge the cage")]
    Outside {
        /// How many.
        count: u32,
        /// The first.
        first: u32,
    },
    /// No vertex is inside the cage.
    #[error("none of the model's {} vertices is inside the cage; {misfit}", outside::grouped(*vertices))]
    NoneInside {
        /// Vertices of the model.
        vertices: usize,
        /// How the two lie to each other.
        misfit: Misfit,
    },
    /// Cancelled by the caller.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Binds mesh vertices to a cage by harmonic coordinates.
///
/// `positions`: `[n_vertices]`, object units, any order, repeats allowed (equal positions are solved once).
///
/// # Errors
/// [`BindError`]: options out of range, empty or not finite mesh, memory above the limit, no vertex inside, cancelled.
pub fn bind(
    positions: &[Vec3],
    cage: &Cage,
    options: &BindOptions,
    progress: &dyn Progress,
) -> Result<Binding, BindError> {
    pipeline::run(positions, cage, options, progress)
}

impl BindOptions {
    /// Bytes of working memory that a bind of `n_points` vertices on the CPU would need, before anything is allocated;
    /// high by 5 to 40 %.
    ///
    /// # Errors
    /// [`BindError::Option`] when an option is out of range.
    pub fn estimate_memory(&self, cage: &Cage, n_points: usize) -> Result<u64, BindError> {
        self.check()?;
        let grid = voxels::Voxels::grid(cage, self);
        Ok(memory::estimate(cage, &grid, n_points, self.threads.max(1), self))
    }

    /// Checks every option's range.
    fn check(&self) -> Result<(), BindError> {
        let check = |ok: bool, option, value: f64, allowed| {
            if ok { Ok(()) } else { Err(BindError::Option { option, value, allowed }) }
        };
        check(
            (MIN_GRID..=MAX_GRID).contains(&self.grid),
            "grid",
            f64::from(self.grid),
            "a whole number from 8 to 512",
        )?;
        check(self.tau.is_finite() && self.tau > 0.0, "tau", f64::from(self.tau), "a number above 0")?;
        check(self.max_iterations > 0, "max_iterations", 0.0, "at least 1")?;
        check(
            (0.0..0.1).contains(&self.sparsify),
            "sparsify",
            f64::from(self.sparsify),
            "0 (keep all weights) or a threshold below 0.1",
        )?;
        Ok(())
    }
}
