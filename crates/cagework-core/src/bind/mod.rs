//! Binding: computes weights from a mesh and a cage, through every stage.

pub mod fineness;
mod many;
mod memory;
mod offsets;
mod outside;
pub mod pipeline;
mod points;
mod solving;
mod voxels;
mod watch;

pub use fineness::GridChoice;
pub use many::SolvedCage;
pub(crate) use memory::updates;
pub use memory::weights_bytes;
pub use outside::Misfit;
pub use watch::Watch;

use glam::Vec3;
use thiserror::Error;

use crate::controls::Controls;
use crate::deform::OutsideVertex;
use crate::frames::Frames;
use crate::narrow::NarrowPlaces;
use crate::options::{BindOptions, RangeError};
use crate::progress::{Cancellation, Progress};
use crate::report::BindReport;
use crate::weights::Weights;
use crate::words::{counted, grouped, size_rounded_down, size_rounded_up};

/// The result of a bind.
#[derive(Clone, Debug)]
pub struct Binding {
    /// One row per mesh vertex in the caller's order. One column per control, then the columns of `frames` if offsets
    /// are needed.
    pub weights: Weights,
    /// Local frames that define the weights' columns after those of the controls. They carry the offsets of vertices
    /// outside the cage and near inner controls, whose positions the weights do not reproduce.
    pub frames: Frames,
    /// Vertices outside the cage, ascending.
    pub outside: Vec<OutsideVertex>,
    /// Measurements and settings of the bind.
    pub report: BindReport,
}

/// Why a bind failed.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum BindError {
    /// An option is out of range.
    #[error(transparent)]
    Option(#[from] RangeError),
    /// The mesh has no vertices.
    #[error("mesh has no vertices: nothing to bind")]
    EmptyMesh,
    /// A coordinate of a mesh vertex is not a finite number.
    #[error("mesh vertex {vertex} is not a finite number")]
    NotFinite {
        /// Index of the vertex that is not finite.
        vertex: u32,
    },
    /// The bind exceeds the memory limit.
    #[error(
        "binding needs about {}, more than the limit of {}: use a smaller grid or raise the limit",
        size_rounded_up(*needed), size_rounded_down(*limit)
    )]
    Memory {
        /// Memory needed, bytes.
        needed: u64,
        /// Memory limit, bytes.
        limit: u64,
    },
    /// The bind exceeds the memory limit, mostly by the weights, which do not depend on the grid.
    #[error(
        "binding needs about {}, more than the limit of {}, most of it for the weights of {} points, one for each of \
         {columns} cage vertices: use a cage with fewer vertices or raise the limit",
        size_rounded_up(*needed), size_rounded_down(*limit), grouped(*points)
    )]
    WeightsMemory {
        /// Memory needed, bytes.
        needed: u64,
        /// Memory limit, bytes.
        limit: u64,
        /// Number of distinct positions.
        points: usize,
        /// Number of controls.
        columns: usize,
    },
    /// No cell centre lies inside the cage.
    #[error("no cell of the {grid}-cell grid lies inside the cage: use a finer grid")]
    NoInterior {
        /// Number of cells along the cage's longest side.
        grid: u32,
    },
    /// Too many parts of the cage overlap at the same places.
    #[error(
        "the cage overlaps itself too often: lines through it cross {walls:.0} walls inside other parts for each \
         wall outside, more than the limit of {limit}: join its parts into one, for example by a Boolean union"
    )]
    Overlaps {
        /// Number of walls inside other parts divided by the number of walls of the union of all parts.
        walls: f64,
        /// Limit on `walls`.
        limit: f64,
    },
    /// Vertices are outside the cage, and the policy is to fail.
    #[error("{} outside the cage, the first is vertex {first}: enlarge the cage", counted(*count as usize, "mesh vertex is", "mesh vertices are"))]
    Outside {
        /// Number of vertices outside.
        count: u32,
        /// Index of the first vertex outside.
        first: u32,
    },
    /// All vertices are outside the cage.
    #[error("none of the model's {} vertices is inside the cage; {misfit}", grouped(*vertices))]
    NoneInside {
        /// Number of vertices of the model.
        vertices: usize,
        /// Relative position and size of cage and model.
        misfit: Misfit,
    },
    /// Cancelled by the caller.
    #[error(transparent)]
    Cancelled(#[from] Cancellation),
}

/// Binds mesh vertices to a cage, or other controls, by harmonic coordinates.
///
/// `positions`: `[n_vertices]`, object units, in any order. Vertices at equal positions are sampled once.
///
/// # Errors
/// [`BindError`]: an option is out of range, the mesh is empty or not finite, the memory exceeds the limit, too many
/// parts of the cage overlap, no vertex is inside, or the bind is cancelled.
pub fn bind<'a>(
    positions: &[Vec3],
    controls: impl Into<Controls<'a>>,
    options: &BindOptions,
    progress: &dyn Progress,
) -> Result<Binding, BindError> {
    pipeline::run(positions, controls.into(), options, progress)
}

/// Estimates the working memory of a bind of `n_points` vertices on the CPU, bytes. Allocates nothing. It is within
/// 15 % of the size of all arrays, unless [`BindOptions::sparsify`] drops most of the weights.
///
/// # Errors
/// [`BindError::Option`] if an option is out of range.
pub fn estimate_memory<'a>(
    controls: impl Into<Controls<'a>>,
    n_points: usize,
    options: &BindOptions,
) -> Result<u64, BindError> {
    options.check()?;
    let controls = controls.into();
    let vertices = points::VertexCounts { rows: n_points, points: n_points };
    let estimate = |options: &BindOptions| {
        let grid = voxels::Voxelization::grid(controls.surface(), options);
        memory::estimate(controls, &grid, vertices, options.threads.max(1), options).bytes
    };
    let fits = |options: &BindOptions| estimate(options) <= options.memory_limit;
    let work = |options: &BindOptions| updates(controls, options);
    let grid = fineness::choose(options, &NarrowPlaces::new(controls), fits, work).cells;
    Ok(estimate(&BindOptions { grid, ..*options }))
}

/// Chooses the grid of a bind, as [`bind`] does if memory suffices: the number of the options, or with
/// [`AUTO_GRID`](crate::options::AUTO_GRID) the number of [`fineness::wanted_cells`], unless the solve would take long.
///
/// # Errors
/// [`BindError::Option`] if an option is out of range.
pub fn choose_grid<'a>(
    controls: impl Into<Controls<'a>>,
    options: &BindOptions,
) -> Result<GridChoice, BindError> {
    options.check()?;
    let controls = controls.into();
    let work = |options: &BindOptions| updates(controls, options);
    Ok(fineness::choose(options, &NarrowPlaces::new(controls), |_| true, work))
}

/// Estimates the work of a solve: the number of updates of single values, which is unknowns times columns times sweeps.
/// A thread does about 10^9 per second. Allocates nothing.
///
/// # Errors
/// [`BindError::Option`] if an option is out of range.
pub fn estimate_updates<'a>(
    controls: impl Into<Controls<'a>>,
    options: &BindOptions,
) -> Result<f64, BindError> {
    let controls = controls.into();
    let options = BindOptions { grid: choose_grid(controls, options)?.cells, ..*options };
    Ok(updates(controls, &options))
}
