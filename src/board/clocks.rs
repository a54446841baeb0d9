//! Clocks: 8 MHz crystal, PLL to 168 MHz, APB1 at 42 MHz (its timers at 84), APB2 at 84 MHz.
//!
//! A crystal that does not start must not be a board that says nothing: then the internal oscillator, 1 %
//! off, runs the console, and the machine is held as after a crash. One that stops later ends in the crash
//! handler.

use embassy_stm32::Config;
use embassy_stm32::pac;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;

/// What the clocks come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The crystal.
    Crystal,
    /// The chip's own oscillator of 16 MHz.
    Internal,
}

/// Looks at the ready bit: a tenth of a second at 16 MHz, where a crystal takes some milliseconds.
const LOOKS: u32 = 200_000;

/// Starts the crystal. Call first, before [`config`].
pub fn start_crystal() -> Source {
    pac::RCC.cr().modify(|control| control.set_hseon(true));
    for _ in 0..LOOKS {
        if pac::RCC.cr().read().hserdy() {
            return Source::Crystal;
        }
    }
    pac::RCC.cr().modify(|control| control.set_hseon(false));
    Source::Internal
}

/// The configuration for [`embassy_stm32::init`].
pub fn config(source: Source) -> Config {
    let mut config = Config::default();
    let (pll_source, divider) = match source {
        Source::Crystal => {
            config.rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Oscillator });
            (PllSource::HSE, PllPreDiv::DIV4)
        }
        Source::Internal => (PllSource::HSI, PllPreDiv::DIV8),
    };
    config.rcc.pll_src = pll_source;
    config.rcc.pll = Some(Pll {
        prediv: divider,
        mul: PllMul::MUL168,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.sys = Sysclk::PLL1_P;
    config
}

/// Lets the clock security system watch the crystal. Call once, with the outputs in their safe state.
pub fn watch_crystal(source: Source) {
    if source == Source::Crystal {
        pac::RCC.cr().modify(|control| control.set_csson(true));
    }
}
