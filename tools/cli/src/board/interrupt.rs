//! Ctrl-C, or a flag in its place, while a board is talked to: the machine is stopped, and then the program
//! ends as it would have.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
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

/// A stop that anybody may ask for at any time, from any thread, without waiting and without ending the
/// conversation. Every pull counts.
#[derive(Clone, Debug, Default)]
pub struct StopLine(Arc<AtomicU32>);

impl StopLine {
    /// Asks for a stop.
    pub fn pull(&self) {
        self.0.fetch_add(1, Ordering::SeqCst);
    }

    /// How often it was asked for, modulo 2³².
    pub fn pulls(&self) -> u32 {
        self.0.load(Ordering::SeqCst)
    }
}

/// Who may ask, while a board is talked to, that its machine is stopped.
#[derive(Debug)]
pub(super) enum Interrupt {
    /// A person, by Ctrl-C.
    CtrlC(Listening),
    /// A program, by this flag.
    Flag(Arc<AtomicBool>),
    /// A program that goes on talking after the stop, with the pulls that were served.
    Line(StopLine, u32),
}

/// What a session does when it was asked for a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// Nobody asked.
    Nothing,
    /// Stop the machine and end the conversation.
    StopAndEnd,
    /// Stop the machine and go on.
    Stop,
}

impl Interrupt {
    /// What was asked since the last call.
    pub(super) fn take(&mut self) -> Asked {
        let ends = match self {
            Self::CtrlC(_) => FLAGS.get().is_some_and(|flags| flags.asked.swap(false, Ordering::SeqCst)),
            Self::Flag(asked) => asked.swap(false, Ordering::SeqCst),
            Self::Line(line, served) => {
                let pulls = line.pulls();
                let is_new = std::mem::replace(served, pulls) != pulls;
                return if is_new { Asked::Stop } else { Asked::Nothing };
            }
        };
        if ends { Asked::StopAndEnd } else { Asked::Nothing }
    }
}

/// While it lives, the first Ctrl-C is noted and the second ends the program.
#[derive(Debug)]
pub(super) struct Listening(());

impl Listening {
    /// Notes Ctrl-C from here on. Where the system does not let it be noted, it ends the program as ever.
    pub(super) fn start() -> Self {
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
}

impl Drop for Listening {
    fn drop(&mut self) {
        if let Some(flags) = FLAGS.get() {
            flags.nobody_listens.store(true, Ordering::SeqCst);
        }
    }
}
