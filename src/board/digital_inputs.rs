//! Three general inputs on PB12, PB13 and PB14: a drive's ready output, limit switches, a trigger. They are
//! sampled in every tick and streamed.

use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Pupdr;

use crate::telemetry::Flags;

/// The first of the pins.
const PIN: usize = 12;
/// How far the pins are above their bits in [`Flags`].
const SHIFT: usize = PIN - Flags::INPUTS[0].0.trailing_zeros() as usize;

/// Pulls the pins down, so that an input with nothing on it is low. They are inputs after reset.
pub fn configure() {
    for pin in PIN..PIN + Flags::INPUTS.len() {
        pac::GPIOB.pupdr().modify(|pulls| pulls.set_pupdr(pin, Pupdr::PULL_DOWN));
    }
}

/// The levels now, all from one read.
#[inline]
pub fn levels() -> Flags {
    Flags((pac::GPIOB.idr().read().0 >> SHIFT) as u8 & Flags::CONTACTS.0)
}
