//! Thread-safe progress of a bind.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::progress::{Cancellation, Progress, ProgressEvent, Stage};

/// Returns the range of the whole bind's progress that a stage covers.
fn span(stage: Stage) -> [f32; 2] {
    match stage {
        Stage::Voxelize => [0.0, 0.1],
        Stage::Solve => [0.1, 0.9],
        Stage::Sample => [0.9, 1.0],
        // Simplification is not part of a bind.
        Stage::Simplify => [0.0, 0.0],
    }
}

/// Wrapper of a [`Progress`] that forwards reports from any thread and remembers cancellation.
pub struct Watch<'a> {
    progress: &'a dyn Progress,
    cancelled: AtomicBool,
    /// Largest fraction reported. The lock serialises reports, so that progress never decreases.
    fraction: Mutex<f32>,
    done: AtomicU32,
}

impl<'a> Watch<'a> {
    /// Creates a watch that reports to `progress`.
    #[must_use]
    pub fn new(progress: &'a dyn Progress) -> Self {
        Self {
            progress,
            cancelled: AtomicBool::new(false),
            fraction: Mutex::new(0.0),
            done: AtomicU32::new(0),
        }
    }

    /// Reports the `fraction` of a stage.
    ///
    /// # Errors
    /// [`Cancellation`], if this or an earlier report was cancelled.
    pub fn report(
        &self,
        stage: Stage,
        fraction: f32,
        iteration: u32,
        delta: Option<f32>,
    ) -> Result<(), Cancellation> {
        let [begin, end] = span(stage);
        let mut latest = self.fraction.lock().unwrap_or_else(PoisonError::into_inner);
        *latest = latest.max(begin + (end - begin) * fraction.clamp(0.0, 1.0));
        let event = ProgressEvent { stage, fraction: *latest, iteration, delta };
        if self.is_cancelled() || self.progress.report(event).is_break() {
            self.cancelled.store(true, Ordering::Relaxed);
            return Err(Cancellation);
        }
        Ok(())
    }

    /// Whether a report was cancelled.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Counts a finished piece of the stage's work, and reports the share of finished pieces of `total`.
    ///
    /// # Errors
    /// [`Cancellation`], if this or an earlier report was cancelled.
    pub fn piece_done(&self, stage: Stage, total: usize) -> Result<(), Cancellation> {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.report(stage, done as f32 / total as f32, 0, None)
    }

    /// Number of finished pieces.
    #[must_use]
    pub fn done(&self) -> u32 {
        self.done.load(Ordering::Relaxed)
    }

    /// Time on the clock of the progress, milliseconds.
    #[must_use]
    pub fn now_ms(&self) -> f64 {
        self.progress.now_ms()
    }
}
