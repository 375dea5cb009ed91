//! Runs work without the interpreter lock, cancellable by Ctrl-C and by a progress function.

use std::convert::Infallible;
use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use cagework_core::{Progress, ProgressEvent};
use pyo3::types::PyAnyMethods as _;
use pyo3::{Bound, Py, PyAny, PyResult, Python};

/// Time between two checks for Ctrl-C, and between two calls of a progress function.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Like [`run_with`], without a progress function.
///
/// # Errors
/// The exception of a signal handler, usually `KeyboardInterrupt`.
pub(crate) fn run<T: Send>(py: Python<'_>, work: impl FnOnce(&dyn Progress) -> T + Send) -> PyResult<T> {
    let Ok(outcome) = run_with(py, None, |progress| Ok::<T, Infallible>(work(progress)))?;
    Ok(outcome)
}

/// Runs `work` in another thread and releases the interpreter lock. The calling thread polls for signals, which Python
/// delivers to its main thread only, and calls `progress` with the completed fraction, and with 1 if the work succeeds. If a
/// signal handler or `progress` raises, the work is cancelled.
///
/// # Errors
/// The exception of a signal handler, usually `KeyboardInterrupt`, or of `progress`.
pub(crate) fn run_with<T: Send, E: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&dyn Progress) -> Result<T, E> + Send,
) -> PyResult<Result<T, E>> {
    let (cancelled, fraction) = (AtomicBool::new(false), AtomicU32::new(0));
    let report = |event: ProgressEvent| {
        fraction.store(event.fraction.to_bits(), Ordering::Relaxed);
        if cancelled.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let function = |given: &Bound<'_, PyAny>| -> PyResult<Py<PyAny>> {
        Ok(py.import("cagework._progress")?.call_method1("function_of", (given,))?.unbind())
    };
    let progress = progress.map(function).transpose()?;
    let poll = |py: Python<'_>| -> PyResult<()> {
        py.check_signals()?;
        let Some(progress) = &progress else { return Ok(()) };
        progress.call1(py, (f32::from_bits(fraction.load(Ordering::Relaxed)),)).map(drop)
    };
    py.detach(|| {
        thread::scope(|scope| {
            let (working, ended) = channel::<()>();
            let worker = scope.spawn(|| {
                // Dropping this value closes the channel, which tells the calling thread that the work has ended or
                // panicked.
                let _working = working;
                work(&report)
            });
            let mut raised = None;
            while matches!(ended.recv_timeout(POLL_INTERVAL), Err(RecvTimeoutError::Timeout)) {
                if raised.is_none() {
                    raised = Python::attach(poll).err();
                    cancelled.store(raised.is_some(), Ordering::Relaxed);
                }
            }
            let outcome = worker.join().unwrap_or_else(|panic| resume_unwind(panic));
            if outcome.is_ok() {
                fraction.store(1.0_f32.to_bits(), Ordering::Relaxed);
            }
            if raised.is_none() && progress.is_some() {
                raised = Python::attach(poll).err();
            }
            raised.map_or(Ok(outcome), Err)
        })
    })
}
