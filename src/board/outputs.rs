//! The outputs that move the machine: the analog setpoint, the drive enable and the brake; and the lines that
//! tell others of it.

use core::sync::atomic::{AtomicU16, Ordering};

use embassy_stm32::pac;
use embassy_stm32::pac::gpio::regs::Bsrr;

use super::step_pulses;
use crate::drive::Lines;
use crate::servo::DacCode;

/// PB0.
const ENABLE_PIN: usize = 0;
/// PB10: high opens the brake.
const BRAKE_PIN: usize = 10;
/// PB5.
const IN_POSITION_PIN: usize = 5;
/// PB6.
const CHARGE_PUMP_PIN: usize = 6;

/// The lines and their pins of port B.
const PINS: [(Lines, usize); 4] = [
    (Lines::ENABLE, ENABLE_PIN),
    (Lines::BRAKE_OPEN, BRAKE_PIN),
    (Lines::IN_POSITION, IN_POSITION_PIN),
    (Lines::CHARGE_PUMP, CHARGE_PUMP_PIN),
];

/// What to store for a combination of lines: the pins to set below, those to reset 16 bits above. A table,
/// because the tick would take longer to put them together.
#[expect(clippy::indexing_slicing, reason = "evaluated by the compiler")]
static CHANGES: [Bsrr; Lines::COMBINATIONS] = {
    let mut changes = [Bsrr(0); Lines::COMBINATIONS];
    let mut number = 0;
    while number < changes.len() {
        let mut place = 0;
        while place < PINS.len() {
            let (line, pin) = PINS[place];
            let high = Lines::numbered(number).contains(line);
            changes[number].0 |= if high { 1 << pin } else { 1 << (pin + 16) };
            place += 1;
        }
        number += 1;
    }
    changes
};

/// Puts the outputs into their safe state and hands them to the firmware: analog output in the middle, drive
/// disabled. Call once, after the clocks are set up.
pub fn configure() {
    // PA4 analog, the lines of port B push-pull outputs that start low.
    pac::RCC.ahb1enr().modify(|clocks| {
        clocks.set_gpioaen(true);
        clocks.set_gpioben(true);
    });
    pac::RCC.apb1enr().modify(|clocks| clocks.set_dacen(true));
    set_lines(Lines::NONE);
    pac::GPIOA.moder().modify(|modes| modes.set_moder(4, pac::gpio::vals::Moder::ANALOG));
    pac::GPIOB.moder().modify(|modes| {
        for (_, pin) in PINS {
            modes.set_moder(pin, pac::gpio::vals::Moder::OUTPUT);
        }
    });
    set_analog(DacCode::MIDDLE);
    pac::DAC1.cr().modify(|control| control.set_en(0, true));
}

/// DAC trigger 4 is TIM2's update (RM0090, external triggers).
const TICK_TRIGGER: u8 = 4;

/// From now on a code that is written goes out with the next tick's beginning, whenever in the tick it was
/// written: what the tick has to compute does not move it. Call when the tick's timer runs.
pub fn latch_by_tick() {
    pac::DAC1.cr().modify(|control| {
        control.set_tsel(0, TICK_TRIGGER);
        control.set_ten(0, true);
    });
}

/// Writes the analog setpoint. One store.
#[inline]
pub fn set_analog(code: DacCode) {
    pac::DAC1.dhr12r(0).write(|value| value.set_dhr(code.0));
}

/// Puts all lines out: drive, brake, and what others are told. One store, so it is safe in any context.
#[inline]
pub fn set_lines(lines: Lines) {
    // There is a change for each number.
    let change = CHANGES.get(lines.number()).copied().unwrap_or(Bsrr(0));
    pac::GPIOB.bsrr().write_value(change);
}

/// Puts an analog code out without waiting for a tick, and those after it. [`latch_by_tick`] goes back to
/// that.
pub fn show_at_once(code: DacCode) {
    pac::DAC1.cr().modify(|control| control.set_ten(0, false));
    set_analog(code);
}

/// The analog code for standing still, or [`HOLD`].
static STANDSTILL: AtomicU16 = AtomicU16::new(HOLD);
/// Not a code: the output is best left as it is.
const HOLD: u16 = u16::MAX;

/// Says what the analog output has to be when the firmware gives up: zero velocity, or as it is.
pub fn set_standstill(code: Option<DacCode>) {
    STANDSTILL.store(code.map_or(HOLD, |code| code.0), Ordering::Relaxed);
}

/// The state in which nothing moves: drive disabled, brake closed and nobody told anything good first, then
/// steps stopped and the analog output at zero velocity. An analog position stays where it is: the middle
/// would be a jump.
pub fn make_safe() {
    set_lines(Lines::NONE);
    step_pulses::stop();
    let standstill = STANDSTILL.load(Ordering::Relaxed);
    if standstill != HOLD {
        set_analog(DacCode(standstill));
    }
}
