//! The emergency input: PB1 with a pull-up. With a stop of category 0 its edge disables the drive at once, by
//! an interrupt of the tick's priority; the tick looks at the level too, latches, and brakes with one of
//! category 1.

use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Pupdr;

use super::outputs;
use crate::drive::Lines;
use crate::settings::EmergencyInput;

/// PB1, and the line of the same number.
const PIN: usize = 1;
/// Port B in the line's selector.
const PORT_B: u8 = 1;

/// An [`EmergencyInput`], as a number.
static INPUT: AtomicU8 = AtomicU8::new(NOT_WIRED);
/// The number of an input that is not looked at.
const NOT_WIRED: u8 = EmergencyInput::Unset as u8;
/// The edge itself disables the drive: a stop of category 0.
static AT_ONCE: AtomicBool = AtomicBool::new(true);
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
    INPUT.store(if is_wired(input) { input as u8 } else { NOT_WIRED }, Ordering::Relaxed);
    pac::EXTI.imr(0).modify(|mask| mask.set_line(PIN, is_wired(input)));
}

/// Says whether the edge disables the drive at once, or the tick brakes it.
pub fn set_at_once(at_once: bool) {
    AT_ONCE.store(at_once, Ordering::Relaxed);
}

fn is_wired(input: EmergencyInput) -> bool {
    matches!(input, EmergencyInput::High | EmergencyInput::Low)
}

/// Whether the input is active, or was since the last call. The tick alone calls it.
#[inline]
pub fn is_active() -> bool {
    let input = INPUT.load(Ordering::Relaxed);
    // Short where nothing is wired, because this is in every tick.
    if input == NOT_WIRED {
        return false;
    }
    let edge = EDGE.load(Ordering::Relaxed);
    EDGE.store(false, Ordering::Relaxed);
    let high = pac::GPIOB.idr().read().idr(PIN).to_bits() != 0;
    edge || high == (input == EmergencyInput::High as u8)
}

#[interrupt]
fn EXTI1() {
    if AT_ONCE.load(Ordering::Relaxed) {
        outputs::set_lines(Lines::NONE);
    }
    EDGE.store(true, Ordering::Relaxed);
    pac::EXTI.pr(0).write(|pending| pending.set_line(PIN, true));
}
