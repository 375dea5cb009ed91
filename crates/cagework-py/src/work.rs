//! Runs work without the interpreter lock, cancellable by Ctrl-C.

use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use cagework_core::{Progress, ProgressEvent};
use pyo3::{PyResult, Python};

/// Time between two checks for Ctrl-C.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Runs `work` in another thread and releases the interpreter lock. The calling thread polls for signals, which Python
/// delivers to its main thread only. If a signal handler raises, the work's progress tells it to stop.
///
/// # Errors
/// The exception of a signal handler, usually `KeyboardInterrupt`.
#[expect(clippy::redundant_closure_for_method_calls, reason = "the method itself is of one lifetime only")]
pub(crate) fn run<T: Send>(py: Python<'_>, work: impl FnOnce(&dyn Progress) -> T + Send) -> PyResult<T> {
    let cancelled = AtomicBool::new(false);
    let progress = |_: ProgressEvent| {
        if cancelled.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    py.detach(|| {
        thread::scope(|scope| {
            let (working, ended) = channel::<()>();
            let worker = scope.spawn(|| {
                // Dropping this value closes the channel, which tells the calling thread that the work has ended or
                // panicked.
                let _working = working;
                work(&progress)
            });
            let mut raised = None;
            while matches!(ended.recv_timeout(POLL_INTERVAL), Err(RecvTimeoutError::Timeout)) {
                if raised.is_none() {
                    raised = Python::attach(|py| py.check_signals()).err();
                    cancelled.store(raised.is_some(), Ordering::Relaxed);
                }
            }
            let outcome = worker.join().unwrap_or_else(|panic| resume_unwind(panic));
            raised.map_or(Ok(outcome), Err)
        })
    })
}
