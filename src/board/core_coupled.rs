//! The core-coupled memory, which holds one of the two shaper histories and leaves main memory to the rest.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

use crate::machine::History;

/// Nothing initialises this memory, so it may hold anything until [`take_history`].
#[repr(transparent)]
struct Uninitialised(UnsafeCell<MaybeUninit<History>>);

// SAFETY: the content is reached only through `take_history`, which gives it away at most once.
unsafe impl Sync for Uninitialised {}

// SAFETY: memory.x gives the section to the core-coupled memory, and nothing else lies there.
#[unsafe(link_section = ".ccm.history")]
static HISTORY: Uninitialised = Uninitialised(UnsafeCell::new(MaybeUninit::uninit()));

static TAKEN: AtomicBool = AtomicBool::new(false);

/// The history in core-coupled memory, all zero; `None` from the second call on.
pub fn take_history() -> Option<&'static mut History> {
    if TAKEN.swap(true, Ordering::AcqRel) {
        return None;
    }
    let memory = HISTORY.0.get().cast::<History>();
    // SAFETY: all zero is a history, and the flag makes this the only reference there will ever be.
    unsafe {
        memory.write_bytes(0, 1);
        Some(&mut *memory)
    }
}
