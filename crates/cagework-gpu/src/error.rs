//! Errors of operations on the GPU. Binding and deformation can then run on the CPU instead.

use cagework_core::options::Solver;
use cagework_core::{BindError, Cancellation};
use thiserror::Error;

use crate::plan::PlanError;

/// Error of an operation on the GPU.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is no usable GPU.
    #[error(
        "no usable GPU was found ({reason}): install a Vulkan driver (mesa-vulkan-drivers has a software one) or use the CPU"
    )]
    NoAdapter {
        /// Reason given by the platform.
        reason: String,
    },
    /// No GPU has a name that contains the requested text.
    #[error("no GPU name contains {wanted:?}; available: {found}")]
    UnknownAdapter {
        /// Requested part of a name.
        wanted: String,
        /// Names of all GPUs, comma-separated.
        found: String,
    },
    /// The GPU does not meet WebGPU's baseline.
    #[error("the GPU {adapter:?} cannot be opened: {reason}. Update its driver, or use the CPU")]
    NoDevice {
        /// Name of the GPU.
        adapter: String,
        /// Reason given by the platform.
        reason: String,
    },
    /// The device was removed, reset by its driver, or revoked by the browser.
    #[error("the GPU was lost ({reason}): start again, or use the CPU")]
    DeviceLost {
        /// Reason given by the platform.
        reason: String,
    },
    /// An allocation failed although it was within the memory plan.
    #[error("the GPU is out of memory for {what} ({bytes} bytes): use a smaller grid, or the CPU")]
    OutOfMemory {
        /// Name of the allocation.
        what: String,
        /// Size of the allocation, bytes.
        bytes: u64,
    },
    /// The GPU rejected a command: a bug in this crate.
    #[error(
        "the GPU rejected a command, which is a bug in Cagework: {reason}. Please report it, and use the CPU"
    )]
    Refused {
        /// Reason given by the platform.
        reason: String,
    },
    /// The GPU did not finish a submission in time.
    #[error(
        "the GPU did not answer within {seconds} s: its driver hangs, or the work is too large for it; use a smaller grid or picture, or the CPU"
    )]
    Timeout {
        /// Time limit, seconds.
        seconds: u64,
    },
    /// Parts of the input contradict each other.
    #[error("cannot be drawn: {reason}")]
    Model {
        /// What is inconsistent.
        reason: String,
    },
    /// The overdraw of the picture exceeds the limit for software rasterisers.
    #[error(
        "the model's {triangles} triangles cover {pixels:.1e} pixels in total, counting overlaps; without a graphics card the limit is {limit:e}: use a smaller picture or a machine with a GPU"
    )]
    Layers {
        /// Number of triangles of the model.
        triangles: usize,
        /// Sum of the pixels covered by each triangle.
        pixels: f64,
        /// Largest allowed value of `pixels`.
        limit: f64,
    },
    /// A required object has not been set.
    #[error("no {missing} has been set: load one first")]
    NotReady {
        /// Name of the missing object, such as `model`.
        missing: &'static str,
    },
    /// The solver is not implemented on the GPU.
    #[error("the solver {0} runs on the CPU only: bind on the CPU, or choose multigrid or jacobi")]
    Solver(Solver),
    /// The bind does not fit into the GPU's memory.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An error unrelated to the GPU, including cancellation.
    #[error(transparent)]
    Bind(#[from] BindError),
}

impl From<Cancellation> for GpuError {
    fn from(cancellation: Cancellation) -> Self {
        Self::Bind(BindError::Cancelled(cancellation))
    }
}
