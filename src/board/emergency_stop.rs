//! The emergency input: PB1 with a pull-up. Its edge disables the drive at once, by an interrupt of the tick's priority; the
//! tick looks at the level too, and latches.

use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Pupdr;

use super::outputs;
use crate::settings::EmergencyInput;

/// PB1, and the line of the same number.
const PIN: usize = 1;
/// Port B in the line's selector.
const PORT_B: u8 = 1;

/// An [`EmergencyInput`], as a number.
static INPUT: AtomicU8 = AtomicU8::new(EmergencyInput::Off as u8);
/// There was an edge since the last tick.
static EDGE: AtomicBool = AtomicBool::new(false);

/// Prepares the pin, its line still off.
pub fn configure() {
    pac::RCC.apb2enr().modify(|clocks| clocks.set_syscfgen(true));
    pac::GPIOB.pupdr().modify(|pulls| pulls.set_pupdr(PIN, Pupdr::PULL_UP));
    pac::SYSCFG.exticr(PIN / 4).modify(|lines| lines.set_exti(PIN % 4, PORT_B));
    interrupt::Interrupt::EXTI1.set_priority(Priority::P1);
    // SAFETY: the handler is below and needs nothing but what is set up here.
    unsafe { interrupt::Interrupt::EXTI1.enable() };
}

/// Says at which level the input is active.
pub fn set_input(input: EmergencyInput) {
    // An edge that the tick has not seen yet stays.
    if INPUT.load(Ordering::Relaxed) == input as u8 {
        return;
    }
    pac::EXTI.rtsr(0).modify(|rising| rising.set_line(PIN, input == EmergencyInput::High));
    pac::EXTI.ftsr(0).modify(|falling| falling.set_line(PIN, input == EmergencyInput::Low));
    // What was pending under the old setting is forgotten.
    pac::EXTI.pr(0).write(|pending| pending.set_line(PIN, true));
    EDGE.store(false, Ordering::Relaxed);
    INPUT.store(input as u8, Ordering::Relaxed);
    pac::EXTI.imr(0).modify(|mask| mask.set_line(PIN, input != EmergencyInput::Off));
}

/// Whether the input is active, or was since the last call. The tick alone calls it.
#[inline]
pub fn is_active() -> bool {
    let input = INPUT.load(Ordering::Relaxed);
    // Short where nothing is wired, because this is in every tick.
    if input == EmergencyInput::Off as u8 {
        return false;
    }
    let edge = EDGE.load(Ordering::Relaxed);
    EDGE.store(false, Ordering::Relaxed);
    let high = pac::GPIOB.idr().read().idr(PIN).to_bits() != 0;
    edge || high == (input == EmergencyInput::High as u8)
}

#[interrupt]
fn EXTI1() {
    outputs::set_drive_enabled(false);
    EDGE.store(true, Ordering::Relaxed);
    pac::EXTI.pr(0).write(|pending| pending.set_line(PIN, true));
}
