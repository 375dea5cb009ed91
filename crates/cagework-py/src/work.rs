//! Work that does not keep the interpreter, and ends on Ctrl-C.

use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use cagework_core::{Progress, ProgressEvent};
use pyo3::{PyResult, Python};

/// How often signals are looked for: Ctrl-C is answered about as fast as a hand can be taken off the key.
const LISTEN: Duration = Duration::from_millis(50);

/// Runs `work` in a thread of its own, without the interpreter's lock. Meanwhile this thread looks for signals, which Python
/// only shows to its main thread, and cancels the work through the progress that it reports to.
///
/// # Errors
/// What a signal's handler raised: `KeyboardInterrupt`, as a rule.
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
                // Dropped at the end, also by a panic.
                let _working = working;
                work(&progress)
            });
            let mut raised = None;
            while matches!(ended.recv_timeout(LISTEN), Err(RecvTimeoutError::Timeout)) {
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
