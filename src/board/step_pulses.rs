//! Step pulses: TIM1 in one-pulse mode with its repetition counter makes exactly as many periods as a tick asks for.
//!
//! As step and direction, PA8 has a pulse per period, low at rest, and PA11 the direction. As quadrature, PA8 (A) and PA11
//! (B) each toggle once per period, at a quarter and at three quarters of it; which comes first is the direction.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::{Moder, Ospeedr};
use embassy_stm32::pac::timer::vals::{CcmrOutputCcs, Ocm};

use crate::settings::PulseKind;

/// PA8: step, or A.
const STEP_PIN: usize = 8;
/// PA11: direction, or B.
const DIRECTION_PIN: usize = 11;
/// The alternate function of both pins that belongs to TIM1.
const TIM1_FUNCTION: u8 = 1;
/// TIM1's channels on these pins, counted from zero.
const STEP_CHANNEL: usize = 0;
const DIRECTION_CHANNEL: usize = 3;

/// A [`PulseKind`], as a number.
static KIND: AtomicU8 = AtomicU8::new(PulseKind::Off as u8);

/// Sets the output up. The tick asks for no steps meanwhile: what steps mean changes only while the setpoint stands still.
pub fn configure(kind: PulseKind, prescaler: u16) {
    KIND.store(PulseKind::Off as u8, Ordering::Relaxed);
    pac::RCC.apb2enr().modify(|clocks| clocks.set_tim1en(true));
    let timer = pac::TIM1;
    timer.cr1().write(|control| control.set_opm(true));
    timer.psc().write_value(prescaler);
    let mode = if kind == PulseKind::Quadrature { Ocm::TOGGLE } else { Ocm::PWM_MODE2 };
    for channel in [STEP_CHANNEL, DIRECTION_CHANNEL] {
        timer.ccmr_output(channel / 2).modify(|compare| {
            compare.set_ccs(channel % 2, CcmrOutputCcs::OUTPUT);
            compare.set_ocm(channel % 2, mode);
        });
        timer.ccer().modify(|enable| enable.set_cce(channel, true));
    }
    timer.bdtr().modify(|outputs| outputs.set_moe(true));
    connect(kind);
    KIND.store(kind as u8, Ordering::Relaxed);
}

fn connect(kind: PulseKind) {
    let port = pac::GPIOA;
    for (pin, mode) in [
        (STEP_PIN, if kind == PulseKind::Off { Moder::INPUT } else { Moder::ALTERNATE }),
        (
            DIRECTION_PIN,
            match kind {
                PulseKind::Off => Moder::INPUT,
                PulseKind::Step => Moder::OUTPUT,
                PulseKind::Quadrature => Moder::ALTERNATE,
            },
        ),
    ] {
        port.afr(pin / 8).modify(|functions| functions.set_afr(pin % 8, TIM1_FUNCTION));
        port.ospeedr().modify(|speeds| speeds.set_ospeedr(pin, Ospeedr::HIGH_SPEED));
        port.moder().modify(|modes| modes.set_moder(pin, mode));
    }
}

/// Whether the steps of an earlier tick are still being made.
#[inline]
pub fn is_busy() -> bool {
    pac::TIM1.cr1().read().cen()
}

/// Makes `steps` steps, each of `period` counts, which is zero for none; not while the output [`is_busy`].
#[inline]
pub fn make(steps: i16, period: u16) {
    if period == 0 {
        return;
    }
    let kind = KIND.load(Ordering::Relaxed);
    if kind == PulseKind::Off as u8 {
        return;
    }
    let count = steps.unsigned_abs();
    let timer = pac::TIM1;
    let forward = steps > 0;
    if kind == PulseKind::Step as u8 {
        pac::GPIOA.bsrr().write(|change| {
            if forward {
                change.set_bs(DIRECTION_PIN, true);
            } else {
                change.set_br(DIRECTION_PIN, true);
            }
        });
        timer.ccr(STEP_CHANNEL).write(|compare| compare.set_ccr(period / 2));
    } else {
        let (early, late) = (period / 4, period - period / 4);
        let (first, second) = if forward { (early, late) } else { (late, early) };
        timer.ccr(STEP_CHANNEL).write(|compare| compare.set_ccr(first));
        timer.ccr(DIRECTION_CHANNEL).write(|compare| compare.set_ccr(second));
    }
    timer.arr().write(|reload| reload.set_arr(period - 1));
    timer.rcr().write(|repetitions| repetitions.set_rep(count - 1));
    // Loads the repetition counter; the counter is at zero, where no channel changes.
    timer.egr().write(|event| event.set_ug(true));
    timer.cr1().write(|control| {
        control.set_opm(true);
        control.set_cen(true);
    });
}

/// Stops in the middle of a train. The count of steps is lost.
pub fn stop() {
    pac::TIM1.cr1().write(|control| control.set_opm(true));
}
