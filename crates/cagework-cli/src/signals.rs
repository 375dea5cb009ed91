//! Ctrl-C, SIGTERM, SIGHUP and other ends, and the file-size limit: work is cancelled, and no file is left half written.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Set by Ctrl-C or SIGTERM.
static CANCELLED: AtomicBool = AtomicBool::new(false);

/// How many pieces of work are under way that ask whether they are cancelled.
static ASKING: AtomicUsize = AtomicUsize::new(0);

/// Whether Ctrl-C or SIGTERM came while work was under way.
pub(crate) fn cancelled() -> bool {
    CANCELLED.load(Ordering::SeqCst)
}

/// Work that asks whether it is [`cancelled`]; it is over when this is dropped.
pub(crate) struct Asking(());

impl Asking {
    pub(crate) fn start() -> Self {
        ASKING.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for Asking {
    fn drop(&mut self) {
        ASKING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Starts to listen: the first Ctrl-C, SIGTERM or SIGHUP ends work in good order, if there is some that asks; any other of these
/// signals, SIGQUIT, SIGXCPU or SIGUSR1 end the process through `abandon`, without the file that is being written.
#[cfg(unix)]
pub(crate) fn listen(abandon: fn(&mut dyn FnMut())) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGXCPU, SIGXFSZ};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    // Without a handler a signal ends the program, which is what it is for.
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU, SIGUSR1, SIGXFSZ]) else {
        return;
    };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            // That somebody listens is enough: the write ends with an error, and not the process.
            if signal == SIGXFSZ {
                continue;
            }
            let cancels = matches!(signal, SIGINT | SIGTERM | SIGHUP);
            let first = cancels && !CANCELLED.swap(true, Ordering::SeqCst);
            if !first || ASKING.load(Ordering::SeqCst) == 0 {
                abandon(&mut || drop(emulate_default_handler(signal)));
            }
        }
    });
}

/// Elsewhere a signal ends the program at once.
#[cfg(not(unix))]
pub(crate) fn listen(_abandon: fn(&mut dyn FnMut())) {}
