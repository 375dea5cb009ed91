//! The progress bar of long operations.

use std::io::IsTerminal as _;
use std::ops::ControlFlow;

use cagework_core::progress::{Progress, ProgressEvent, Stage};
use indicatif::{ProgressBar, ProgressStyle};

use crate::files::is_quiet;
use crate::signals::{self, CancelGuard};

/// Number of positions of the bar, more than a terminal has columns.
const STEPS: u64 = 1000;

/// A progress bar on stderr, hidden with `--quiet` and unless stderr is a terminal. Reports a signal such as Ctrl-C or SIGTERM as
/// cancellation of the work.
pub(crate) struct Bar {
    bar: ProgressBar,
    _guard: CancelGuard,
}

impl Bar {
    /// Shows the bar, and makes the first signal cancel the work.
    pub(crate) fn start() -> Self {
        let is_shown = std::io::stderr().is_terminal() && !is_quiet();
        let bar = if is_shown { ProgressBar::new(STEPS) } else { ProgressBar::hidden() };
        let style = ProgressStyle::with_template("{prefix:10} [{bar:30}] {percent:>3}%  ETA {eta:<4} {msg}")
            .expect("the template is a constant")
            .progress_chars("=> ");
        bar.set_style(style);
        Self { bar, _guard: CancelGuard::start() }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl Progress for Bar {
    fn report(&self, event: ProgressEvent) -> ControlFlow<()> {
        if signals::cancelled() {
            return ControlFlow::Break(());
        }
        if !self.bar.is_hidden() {
            self.bar.set_prefix(stage_name(event.stage));
            // Keep the bar from moving backwards: threads report their progress out of order.
            let position = (f64::from(event.fraction.clamp(0.0, 1.0)) * STEPS as f64) as u64;
            self.bar.set_position(position.max(self.bar.position()));
            if let Some(delta) = event.delta {
                self.bar.set_message(format!("delta {delta:.1e} after {}", event.iteration));
            }
        }
        ControlFlow::Continue(())
    }
}

fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Voxelize => "voxelizing",
        Stage::Solve => "solving",
        Stage::Sample => "sampling",
        Stage::Simplify => "simplifying",
    }
}
