//! The encoder: TIM8 counts all four edges of the quadrature signal at PC6 (A) and PC7 (B).

use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, FilterValue, Sms};

/// PC6 and PC7.
const PINS: [usize; 2] = [6, 7];
/// The alternate function of both that belongs to TIM8.
const TIM8_FUNCTION: u8 = 3;

/// Sets the counter up. It counts from here on, whether an encoder is wired or not; the pull-ups keep open
/// inputs quiet.
pub fn configure() {
    pac::RCC.ahb1enr().modify(|clocks| clocks.set_gpiocen(true));
    pac::RCC.apb2enr().modify(|clocks| clocks.set_tim8en(true));
    for pin in PINS {
        pac::GPIOC.afr(pin / 8).modify(|functions| functions.set_afr(pin % 8, TIM8_FUNCTION));
        pac::GPIOC.pupdr().modify(|pulls| pulls.set_pupdr(pin, Pupdr::PULL_UP));
        pac::GPIOC.moder().modify(|modes| modes.set_moder(pin, Moder::ALTERNATE));
    }
    let timer = pac::TIM8;
    timer.arr().write(|reload| reload.set_arr(u16::MAX));
    for channel in 0..PINS.len() {
        timer.ccmr_input(0).modify(|capture| {
            capture.set_ccs(channel, CcmrInputCcs::TI4);
            // Eight equal samples at 168 MHz: shorter pulses than 48 ns are noise.
            capture.set_icf(channel, FilterValue::FCK_INT_N8);
        });
    }
    timer.smcr().modify(|slave| slave.set_sms(Sms::ENCODER_MODE_3));
    timer.cr1().modify(|control| control.set_cen(true));
}

/// The counter; it wraps at 2¹⁶.
#[inline]
pub fn counter() -> u16 {
    pac::TIM8.cnt().read().cnt()
}
