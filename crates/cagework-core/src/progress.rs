//! How long work says where it is, and how it is told to stop.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The stages of a bind, in order, and those of making a cage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub enum Stage {
    /// The cage is laid into the grid.
    Voxelize,
    /// Laplace's equation, one right-hand side per cage vertex.
    Solve,
    /// Weights are taken at the mesh's vertices.
    Sample,
    /// A generated cage is brought to few vertices.
    Simplify,
}

/// One step of progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgressEvent {
    /// The stage under way.
    pub stage: Stage,
    /// How much of the whole work is done, 0 to 1.
    pub fraction: f32,
    /// Sweeps or V-cycles done so far in this stage.
    pub iteration: u32,
    /// Latest delta (Eq. 2), where the stage has one.
    pub delta: Option<f32>,
}

/// Receives progress, from any thread, and may cancel.
pub trait Progress: Sync {
    /// Called often (many times a second); return `Break` to cancel the work.
    fn report(&self, event: ProgressEvent) -> ControlFlow<()>;

    /// Milliseconds on a clock that only runs forward. Where the standard library has none (wasm), whoever watches
    /// lends one; without it all times read 0.
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

/// For callers who neither watch nor cancel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _event: ProgressEvent) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// The work was cancelled through [`Progress`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("cancelled")]
pub struct Cancelled;
