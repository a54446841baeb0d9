//! Ctrl-C while a board is talked to: the machine is stopped, and then the program ends as it would have.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use signal_hook::consts::SIGINT;
use signal_hook::flag;

/// What Ctrl-C has to find.
#[derive(Debug, Default)]
struct Flags {
    /// Somebody talks to a board and looks at `asked`.
    nobody_listens: Arc<AtomicBool>,
    asked: Arc<AtomicBool>,
}

static FLAGS: OnceLock<Flags> = OnceLock::new();

/// While it lives, the first Ctrl-C is noted and the second ends the program.
#[derive(Debug)]
pub(super) struct Interrupt(());

impl Interrupt {
    /// Notes Ctrl-C from here on. Where the system does not let it be noted, it ends the program as ever.
    pub(super) fn listen() -> Self {
        let flags = FLAGS.get_or_init(|| {
            let flags = Flags::default();
            let _unlistened = flag::register_conditional_shutdown(SIGINT, 130, Arc::clone(&flags.asked))
                .and_then(|_| flag::register_conditional_default(SIGINT, Arc::clone(&flags.nobody_listens)))
                .and_then(|_| flag::register(SIGINT, Arc::clone(&flags.asked)));
            flags
        });
        flags.nobody_listens.store(false, Ordering::SeqCst);
        Self(())
    }

    /// Whether Ctrl-C was pressed since the last call.
    pub(super) fn take(&self) -> bool {
        FLAGS.get().is_some_and(|flags| flags.asked.swap(false, Ordering::SeqCst))
    }
}

impl Drop for Interrupt {
    fn drop(&mut self) {
        if let Some(flags) = FLAGS.get() {
            flags.nobody_listens.store(true, Ordering::SeqCst);
        }
    }
}
