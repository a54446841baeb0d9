//! The pulses of another controller: TIM3 counts them at PA6 and PA7, and the tick reads its counter.
//!
//! A and B are decoded as an encoder's are. A step with a direction is made into the same two signals by the
//! timer's own inputs: its second is the step (PA7), its first is the exclusive or of its three pins (RM0090,
//! timer input XOR function), which are the direction (PA6), the step again and PC8, held low. The first
//! input's filter is the longer one, so each edge of the step is seen at the second first, when the first
//! still says what the direction was *before* the edge:
//!
//! ```text
//! direction (PA6)   ____________‾‾‾‾‾‾‾‾‾‾
//! step (PA7) = B    _‾‾‾_‾‾‾________‾‾‾___
//! first input = A   ___‾‾‾_‾‾‾____‾‾‾___‾‾   a little later than B
//! ```
//!
//! That is quadrature, a turn of four edges for each step, the way round by the direction; it is decoded
//! whichever of its edges come when, so nothing is lost or made up by a direction that changes close to a
//! step. A pulse that is shorter than the first input's filter goes one edge there and back, and counts
//! nothing. A change of the direction alone is one edge and back again: [`crate::source`] counts whole steps.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::pac;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, FilterValue, Sms, Ti1s};

use crate::source::SourceKind;

/// PA6 and PA7.
const PINS: [usize; 2] = [6, 7];
/// PC8: the third input, which nothing may be wired to.
const THIRD_PIN: usize = 8;
/// The alternate function of all of them that belongs to TIM3.
const TIM3_FUNCTION: u8 = 2;

/// The [`SourceKind`] that the counter is set up for.
static CONFIGURED: AtomicU8 = AtomicU8::new(SourceKind::Moves as u8);

/// Sets the counter up for a source, if it is set up for another one.
pub fn configure(kind: SourceKind) {
    if CONFIGURED.swap(kind as u8, Ordering::Relaxed) == kind as u8 || kind == SourceKind::Moves {
        return;
    }
    pac::RCC.ahb1enr().modify(|clocks| clocks.set_gpiocen(true));
    pac::RCC.apb1enr().modify(|clocks| clocks.set_tim3en(true));
    let timer = pac::TIM3;
    timer.cr1().write(|control| control.set_cen(false));
    PINS.into_iter().for_each(|pin| connect(pac::GPIOA, pin, Pupdr::PULL_UP));
    connect(pac::GPIOC, THIRD_PIN, Pupdr::PULL_DOWN);
    let steps = kind == SourceKind::StepDir;
    timer.cr2().write(|control| control.set_ti1s(if steps { Ti1s::XOR } else { Ti1s::NORMAL }));
    // Of 84 MHz. Quadrature: eight equal samples, so shorter pulses than 95 ns are noise. Steps: four
    // samples, 48 ns, at the second input, and eight of every other clock, 190 ns, at the first.
    let filters = if steps {
        [FilterValue::FDTS_DIV2_N8, FilterValue::FCK_INT_N4]
    } else {
        [FilterValue::FCK_INT_N8; 2]
    };
    timer.ccmr_input(0).write(|capture| {
        for (channel, filter) in filters.into_iter().enumerate() {
            capture.set_ccs(channel, CcmrInputCcs::TI4);
            capture.set_icf(channel, filter);
        }
    });
    timer.arr().write(|reload| reload.set_arr(u16::MAX));
    timer.smcr().write(|slave| slave.set_sms(Sms::ENCODER_MODE_3));
    timer.cr1().write(|control| control.set_cen(true));
}

fn connect(port: Gpio, pin: usize, pull: Pupdr) {
    port.afr(pin / 8).modify(|functions| functions.set_afr(pin % 8, TIM3_FUNCTION));
    port.pupdr().modify(|pulls| pulls.set_pupdr(pin, pull));
    port.moder().modify(|modes| modes.set_moder(pin, Moder::ALTERNATE));
}

/// The counter; it wraps at 2¹⁶. Zero before it is set up.
#[inline]
pub fn counter() -> u16 {
    pac::TIM3.cnt().read().cnt()
}
