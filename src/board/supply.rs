//! The supply: below 2.9 V the core is too fast for its flash (168 MHz at five wait states needs 2.7 V), and
//! what it then does nobody knows. So the machine is made safe before.

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac;

use super::crash;

/// The line of the supply's detector.
const LINE: usize = 16;
/// 2.9 V, with 0.1 V of hysteresis: the highest there is (datasheet of the STM32F405, embedded reset and
/// power control).
const LEVEL: u8 = 7;

/// Watches the supply. Call once, after the clocks are set up, with the outputs in their safe state.
pub fn watch() {
    pac::PWR.cr1().modify(|control| {
        control.set_pls(LEVEL);
        control.set_pvde(true);
    });
    // The detector's output rises when the supply falls.
    pac::EXTI.rtsr(0).modify(|rising| rising.set_line(LINE, true));
    pac::EXTI.pr(0).write(|pending| pending.set_line(LINE, true));
    pac::EXTI.imr(0).modify(|mask| mask.set_line(LINE, true));
    interrupt::Interrupt::PVD.set_priority(Priority::P1);
    // SAFETY: the handler is below and needs nothing but what is set up here.
    unsafe { interrupt::Interrupt::PVD.enable() };
}

#[interrupt]
fn PVD() {
    crash::give_up("the supply fell below 2.9 V");
}
