//! The independent watchdog. Once started, nothing but a reset stops it.

use embassy_stm32::pac;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};

use crate::watchdog::Patience;

/// Starts it. It stands still while a debugger has stopped the core.
pub fn start() {
    pac::DBGMCU.apb1fzr().modify(|frozen| frozen.set_iwdg(true));
    pac::IWDG.kr().write(|key| key.set_key(Key::START));
    set_patience(Patience::NORMAL);
}

/// Changes how long it waits, from now on.
pub fn set_patience(patience: Patience) {
    pac::IWDG.kr().write(|key| key.set_key(Key::ENABLE));
    pac::IWDG.pr().write(|prescaler| prescaler.set_pr(Pr::from_bits(patience.prescaler_code)));
    pac::IWDG.rlr().write(|reload| reload.set_rl(patience.reload));
    // The registers take over after five periods of the slow oscillator, 0.3 ms. If they never do, it bites.
    while pac::IWDG.sr().read().0 != 0 {}
    feed();
}

/// Starts its wait anew.
pub fn feed() {
    pac::IWDG.kr().write(|key| key.set_key(Key::RESET));
}
