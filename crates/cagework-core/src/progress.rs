//! Progress reports and cancellation.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Stages of a bind, in order, and of cage generation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Stage {
    /// Voxelization of the cage.
    Voxelize,
    /// Solving Laplace's equation, one right-hand side per control.
    Solve,
    /// Sampling the weights at the mesh's vertices.
    Sample,
    /// Simplification of a generated cage.
    Simplify,
}

/// Progress of a bind or of cage generation, passed to [`Progress::report`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS), ts(rename = "Progress"))]
pub struct ProgressEvent {
    /// Stage that is in progress.
    pub stage: Stage,
    /// Completed share of the whole work, 0 to 1.
    pub fraction: f32,
    /// Number of iterations of the solver in this stage: sweeps, V-cycles or steps.
    pub iteration: u32,
    /// Latest delta of the solver, which it compares with its tolerance ([`crate::solve::stop`]); `None` if the stage
    /// has none.
    pub delta: Option<f32>,
}

/// Receives progress from any thread, and may cancel.
pub trait Progress: Sync {
    /// Called many times a second. Return `Break` to cancel the work.
    fn report(&self, event: ProgressEvent) -> ControlFlow<()>;

    /// Milliseconds of a monotonic clock. The standard library has no clock in wasm: implementations for wasm override
    /// this, otherwise all times are 0.
    fn now_ms(&self) -> f64 {
        clock_ms()
    }
}

#[cfg(not(target_family = "wasm"))]
fn clock_ms() -> f64 {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64() * 1e3
}

#[cfg(target_family = "wasm")]
fn clock_ms() -> f64 {
    0.0
}

/// Any `Fn(ProgressEvent) -> ControlFlow<()>` is a `Progress`.
impl<F: Fn(ProgressEvent) -> ControlFlow<()> + Sync> Progress for F {
    fn report(&self, event: ProgressEvent) -> ControlFlow<()> {
        self(event)
    }
}

/// A [`Progress`] that ignores reports and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn report(&self, _event: ProgressEvent) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Error of work that was cancelled through [`Progress`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("cancelled")]
pub struct Cancellation;
