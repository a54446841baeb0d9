//! Step pulses: TIM1 in one-pulse mode with its repetition counter makes exactly as many periods as a tick
//! asks for ([`TrainRegisters`]). PA8 is the step or A, PA11 the direction or B.
//!
//! A train is never cut: the output is set up anew only between trains, only for what has changed, and until
//! it is, the tick asks for none ([`is_busy`]).

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::{Moder, Ospeedr};
use embassy_stm32::pac::timer::vals::{CcmrOutputCcs, Ocm};

use crate::servo::train::{PulseConfiguration, TrainRegisters};
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

/// The [`PulseConfiguration`] that the output is set up for.
static CONFIGURED: AtomicU32 = AtomicU32::new(0);

/// Turns the timer's clock on. Call once, with the other clocks.
pub fn prepare() {
    pac::RCC.apb2enr().modify(|clocks| clocks.set_tim1en(true));
}

/// Sets the output up for what the tick's scale asks for, if it is set up for something else.
pub fn configure(wanted: PulseConfiguration) {
    let before = PulseConfiguration(CONFIGURED.load(Ordering::Relaxed));
    if wanted == before {
        return;
    }
    let timer = pac::TIM1;
    // A tick at most: the tick begins no train that this is not the configuration of.
    while timer.cr1().read().cen() {}
    timer.cr1().write(|control| control.set_opm(true));
    timer.psc().write_value(wanted.prescaler());
    // Where only the timing changes A and B stay as they are, which is equal.
    if wanted.kind() != before.kind() || wanted.active_low() != before.active_low() {
        change_kind(wanted);
    }
    CONFIGURED.store(wanted.0, Ordering::Relaxed);
}

fn change_kind(wanted: PulseConfiguration) {
    let timer = pac::TIM1;
    let kind = wanted.kind();
    if kind == PulseKind::Off {
        connect(kind);
        return;
    }
    let mode = if kind == PulseKind::Quadrature { Ocm::TOGGLE } else { Ocm::PWM_MODE2 };
    for channel in [STEP_CHANNEL, DIRECTION_CHANNEL] {
        let compare = timer.ccmr_output(channel / 2);
        compare.modify(|compare| {
            compare.set_ccs(channel % 2, CcmrOutputCcs::OUTPUT);
            // Both low: quadrature begins with A equal to B.
            compare.set_ocm(channel % 2, Ocm::FORCE_INACTIVE);
        });
        compare.modify(|compare| compare.set_ocm(channel % 2, mode));
        timer.ccer().modify(|enable| {
            enable.set_ccp(channel, wanted.active_low());
            enable.set_cce(channel, true);
        });
    }
    timer.bdtr().modify(|outputs| outputs.set_moe(true));
    connect(kind);
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

/// Whether the steps of an earlier tick are still being made, or the output is not yet set up as `wanted`.
#[inline]
pub fn is_busy(wanted: PulseConfiguration) -> bool {
    CONFIGURED.load(Ordering::Relaxed) != wanted.0 || is_making()
}

/// Whether steps are still being made.
#[inline]
pub fn is_making() -> bool {
    pac::TIM1.cr1().read().cen()
}

/// Makes `steps` steps of `period` counts each, which is zero for none, and shows their direction, `up`, or
/// that of the steps to come; not while the output [`is_busy`].
#[inline]
pub fn make(steps: i16, period: u16, up: bool) {
    let kind = PulseConfiguration(CONFIGURED.load(Ordering::Relaxed)).kind();
    if kind == PulseKind::Step {
        pac::GPIOA.bsrr().write(|change| {
            if up {
                change.set_bs(DIRECTION_PIN, true);
            } else {
                change.set_br(DIRECTION_PIN, true);
            }
        });
    }
    if period == 0 || kind == PulseKind::Off {
        return;
    }
    let train = TrainRegisters::new(kind, steps, period);
    let timer = pac::TIM1;
    timer.ccr(STEP_CHANNEL).write(|compare| compare.set_ccr(train.first));
    if kind == PulseKind::Quadrature {
        timer.ccr(DIRECTION_CHANNEL).write(|compare| compare.set_ccr(train.second));
    }
    timer.arr().write(|reload| reload.set_arr(train.reload));
    timer.rcr().write(|repetitions| repetitions.set_rep(u16::from(train.repetitions)));
    // Loads the repetition counter; the counter is at zero, where no channel changes.
    timer.egr().write(|event| event.set_ug(true));
    timer.cr1().write(|control| {
        control.set_opm(true);
        control.set_cen(true);
    });
}

/// Stops in the middle of a train, for good: nothing but a reset sets the output up again.
pub fn stop() {
    pac::TIM1.cr1().write(|control| control.set_opm(true));
}
