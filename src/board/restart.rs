//! What is known at start of how the last run ended.

use embassy_stm32::pac;

use super::crash;
use crate::restart::{ResetCause, Restart};

/// Reads the cause of the reset and the record of a crash. Call once, first: the cause is forgotten, so that the next
/// reset tells its own.
pub fn read() -> Restart {
    let cause = ResetCause((pac::RCC.csr().read().0 >> 24) as u8);
    pac::RCC.csr().modify(|control| control.set_rmvf(true));
    Restart { cause, crash: crash::read() }
}
