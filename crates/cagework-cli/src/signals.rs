//! Signal handlers, which cancel the work or end the process without leaving a partial file.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Whether a first Ctrl-C, SIGTERM or SIGHUP has arrived.
static IS_CANCELLED: AtomicBool = AtomicBool::new(false);

/// Number of running operations that poll [`cancelled`].
static N_POLLS: AtomicUsize = AtomicUsize::new(0);

/// Whether a signal has requested to cancel the work.
pub(crate) fn cancelled() -> bool {
    IS_CANCELLED.load(Ordering::SeqCst)
}

/// Guard of an operation that polls [`cancelled`]. While a guard exists, the first signal cancels the operation instead
/// of ending the process.
pub(crate) struct CancelGuard(());

impl CancelGuard {
    pub(crate) fn start() -> Self {
        N_POLLS.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for CancelGuard {
    fn drop(&mut self) {
        N_POLLS.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Installs the signal handlers. The first Ctrl-C, SIGTERM or SIGHUP cancels the work if an operation polls for it.
/// Otherwise, these signals end the process through `abandon`, which deletes the partial file. A second such signal,
/// as well as SIGQUIT, SIGXCPU and SIGUSR1, always ends the process in this way. SIGXFSZ (`ulimit -f`) is ignored, so
/// that the write fails with an error.
#[cfg(unix)]
pub(crate) fn listen(abandon: fn(&mut dyn FnMut())) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGXCPU, SIGXFSZ};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    // If the handlers cannot be installed, signals keep their default action and end the process.
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU, SIGUSR1, SIGXFSZ]) else {
        return;
    };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            if signal == SIGXFSZ {
                continue;
            }
            let cancels = matches!(signal, SIGINT | SIGTERM | SIGHUP);
            let first = cancels && !IS_CANCELLED.swap(true, Ordering::SeqCst);
            if !first || N_POLLS.load(Ordering::SeqCst) == 0 {
                abandon(&mut || drop(emulate_default_handler(signal)));
            }
        }
    });
}

/// Does nothing on other systems, where signals keep their default action.
#[cfg(not(unix))]
pub(crate) fn listen(_abandon: fn(&mut dyn FnMut())) {}
