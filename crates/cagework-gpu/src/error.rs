//! What can go wrong on a GPU. Every one of these leaves the CPU as the way out.

use cagework_core::options::Solver;
use cagework_core::{BindError, Cancelled};
use thiserror::Error;

use crate::plan::PlanError;

/// Why work on the GPU did not come about.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GpuError {
    /// There is no GPU that can be used.
    #[error(
        "no usable GPU was found ({reason}): install a Vulkan driver (mesa-vulkan-drivers has a software one) or use the CPU"
    )]
    NoAdapter {
        /// What the platform said.
        reason: String,
    },
    /// The GPU that was asked for is not there.
    #[error("no GPU is called like {wanted:?}; there are: {found}")]
    UnknownAdapter {
        /// Part of the name that was asked for.
        wanted: String,
        /// Names found, comma-separated.
        found: String,
    },
    /// The GPU offers less than WebGPU's baseline.
    #[error("the GPU {adapter:?} gave no device: {reason}")]
    NoDevice {
        /// Its name.
        adapter: String,
        /// What the platform said.
        reason: String,
    },
    /// The device is gone: unplugged, reset by the driver, or taken away by the browser.
    #[error("the GPU was lost ({reason}): start again, or use the CPU")]
    DeviceLost {
        /// What the platform said.
        reason: String,
    },
    /// An allocation failed although it was planned for.
    #[error("the GPU has no memory for {what} ({bytes} bytes): use a smaller grid, or the CPU")]
    OutOfMemory {
        /// What was to be allocated.
        what: String,
        /// How much.
        bytes: u64,
    },
    /// The GPU refused work: a fault of this program.
    #[error("the GPU refused work: {reason}")]
    Refused {
        /// What the platform said.
        reason: String,
    },
    /// The GPU did not answer.
    #[error(
        "the GPU did not answer within {seconds} s: its driver hangs, or it is far too slow for this grid"
    )]
    Timeout {
        /// How long was waited.
        seconds: u64,
    },
    /// What was handed over does not belong together.
    #[error("cannot be drawn: {reason}")]
    Model {
        /// What does not.
        reason: String,
    },
    /// A GPU made of processor cores would draw for minutes.
    #[error(
        "the model's {triangles} triangles cover {pixels:.1e} pixels, each counted for each triangle; without a graphics card the limit is {limit:e}: use one, or a smaller picture"
    )]
    Layers {
        /// How many there are.
        triangles: usize,
        /// Pixels, counted for each triangle that covers them.
        pixels: f64,
        /// Most that are drawn.
        limit: f64,
    },
    /// Something has to come first.
    #[error("there is no {missing} yet: load one first")]
    NotReady {
        /// What.
        missing: &'static str,
    },
    /// A solver that runs on the CPU only.
    #[error("the solver {0} runs on the CPU only: bind there, or choose multigrid or jacobi")]
    Solver(Solver),
    /// The bind does not fit.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An error that has nothing to do with the GPU, cancelling included.
    #[error(transparent)]
    Bind(#[from] BindError),
}

impl From<Cancelled> for GpuError {
    fn from(cancelled: Cancelled) -> Self {
        Self::Bind(BindError::Cancelled(cancelled))
    }
}
