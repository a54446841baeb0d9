//! The outputs that move the machine: the analog setpoint, the drive enable and the brake.

use core::sync::atomic::{AtomicU16, Ordering};

use embassy_stm32::pac;

use super::step_pulses;
use crate::drive::{Outputs, Signals};
use crate::servo::DacCode;

/// PB0.
const ENABLE_PIN: usize = 0;
/// PB10: high opens the brake.
const BRAKE_PIN: usize = 10;
/// PB5: in position.
const IN_POSITION_PIN: usize = 5;
/// PB6: the charge pump.
const CHARGE_PUMP_PIN: usize = 6;

/// Puts the outputs into their safe state and hands them to the firmware: analog output in the middle, drive
/// disabled. Call once, after the clocks are set up.
pub fn configure() {
    // PA4 analog, PB0, PB5, PB6 and PB10 push-pull outputs that start low.
    pac::RCC.ahb1enr().modify(|clocks| {
        clocks.set_gpioaen(true);
        clocks.set_gpioben(true);
    });
    pac::RCC.apb1enr().modify(|clocks| clocks.set_dacen(true));
    switch_off();
    pac::GPIOA.moder().modify(|modes| modes.set_moder(4, pac::gpio::vals::Moder::ANALOG));
    pac::GPIOB.moder().modify(|modes| {
        for pin in [ENABLE_PIN, IN_POSITION_PIN, CHARGE_PUMP_PIN, BRAKE_PIN] {
            modes.set_moder(pin, pac::gpio::vals::Moder::OUTPUT);
        }
    });
    set_analog(DacCode::MIDDLE);
    pac::DAC1.cr().modify(|control| control.set_en(0, true));
}

/// DAC trigger 4 is TIM2's update (RM0090, external triggers).
const TICK_TRIGGER: u8 = 4;

/// From now on a code that is written goes out with the next tick's beginning, whenever in the tick it was written: what the
/// tick has to compute does not move it. Call once, when the tick's timer runs.
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

/// Enables or disables the drive, opens or closes the brake, and tells others. One store, so it is safe in any context.
#[inline]
pub fn set_lines(outputs: Outputs, signals: Signals) {
    // One word: the pins to set below, those to reset 16 bits above.
    const ALL: u32 = 1 << ENABLE_PIN | 1 << IN_POSITION_PIN | 1 << CHARGE_PUMP_PIN | 1 << BRAKE_PIN;
    let set = u32::from(outputs.enable) << ENABLE_PIN
        | u32::from(signals.in_position) << IN_POSITION_PIN
        | u32::from(signals.charge_pump) << CHARGE_PUMP_PIN
        | u32::from(outputs.brake_open) << BRAKE_PIN;
    pac::GPIOB.bsrr().write(|change| change.0 = set | (set ^ ALL) << 16);
}

/// Drive disabled, brake closed, nobody told anything good. One store, so it is safe in any context.
#[inline]
pub fn switch_off() {
    set_lines(Outputs::default(), Signals::default());
}

/// Puts an analog code out without waiting for a tick. [`latch_by_tick`] goes back to that.
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

/// The state in which nothing moves: drive disabled and brake closed first, then steps stopped and the analog output at zero velocity. An
/// analog position stays where it is: the middle would be a jump.
pub fn make_safe() {
    switch_off();
    step_pulses::stop();
    let standstill = STANDSTILL.load(Ordering::Relaxed);
    if standstill != HOLD {
        set_analog(DacCode(standstill));
    }
}
