//! The board tests itself, with jumpers from PA8 to PC6 and from PA11 to PC7: the step timer's trains are
//! counted by the encoder's, and the analog output is measured at its own pin.
//!
//! With the drive off, from the console's task; ticks go on.

use embassy_stm32::pac;
use embassy_stm32::pac::adc::vals::SampleTime;
use embassy_stm32::pac::adccommon::vals::Adcpre;

use super::{clocks, encoder, outputs, step_pulses, tick_timer};
use crate::self_test::SelfTest;
use crate::servo::{DacCode, PulseConfiguration};
use crate::settings::PulseKind;

/// Steps of a train, and counts of the timer for each: 1 µs between two edges.
const STEPS: i16 = 200;
const PERIOD: u16 = 336;
/// Looks at a peripheral before it is given up, which takes milliseconds.
const LOOKS: u32 = 20_000;
/// PA4's channel.
const CHANNEL: u8 = 4;
/// For the output's buffer, which settles within 6 µs: clocks of the core.
const SETTLING_CLOCKS: u32 = 2000;
/// What converter and output may be wrong by together, in codes of either (datasheet: 10 mV of offset, 0.5 %
/// of gain).
const ANALOG_CODES: i32 = 40;
/// A tick writes the output, too. That long between two of them is seldom missed so often.
const ATTEMPTS: usize = 10;

/// Makes all checks. The step output is to be set up anew afterwards, and the analog output is that of the
/// next tick.
pub fn run(clock: clocks::Source) -> SelfTest {
    let mut test = SelfTest::default();
    test.note("crystal", (1, 1), Some(i32::from(clock == clocks::Source::Crystal)));
    step_pulses::configure(PulseConfiguration::new(PulseKind::Quadrature, 0, false));
    for (name, steps) in [
        ("train_up_counts", STEPS),
        ("train_down_counts", -STEPS),
        ("step_up_counts", 1),
        ("step_down_counts", -1),
    ] {
        // Two edges per step, so two counts.
        let expected = 2 * i32::from(steps);
        test.note(name, (expected, expected), counts_of(steps));
    }
    configure_converter();
    for (name, code) in [
        ("analog_low_codes", DacCode::LOWEST),
        ("analog_middle_codes", DacCode::MIDDLE),
        ("analog_high_codes", DacCode::HIGHEST),
    ] {
        let expected = i32::from(code.0);
        test.note(name, (expected - ANALOG_CODES, expected + ANALOG_CODES), measured(code));
    }
    outputs::latch_by_tick();
    pac::RCC.apb2enr().modify(|clocks| clocks.set_adc1en(false));
    test
}

/// What the encoder counts of a train; `None` where it does not end.
fn counts_of(steps: i16) -> Option<i32> {
    let before = encoder::counter();
    step_pulses::make(steps, PERIOD, steps > 0);
    (0..LOOKS).find(|_| !step_pulses::is_making())?;
    // The difference of two counters that wrap.
    Some(i32::from(encoder::counter().wrapping_sub(before).cast_signed()))
}

fn configure_converter() {
    pac::RCC.apb2enr().modify(|clocks| clocks.set_adc1en(true));
    // 21 MHz of the 36 that it may have.
    pac::ADC123_COMMON.ccr().modify(|common| common.set_adcpre(Adcpre::DIV4));
    let converter = pac::ADC1;
    converter.smpr2().modify(|times| times.set_smp(CHANNEL.into(), SampleTime::CYCLES112));
    converter.sqr3().modify(|sequence| sequence.set_sq(0, CHANNEL));
    converter.cr2().modify(|control| control.set_adon(true));
    cortex_m::asm::delay(SETTLING_CLOCKS);
}

/// Puts a code out and measures it; once more where a tick has put out its own meanwhile.
fn measured(code: DacCode) -> Option<i32> {
    (0..ATTEMPTS).find_map(|_| {
        let tick = tick_timer::ticks();
        outputs::show_at_once(code);
        cortex_m::asm::delay(SETTLING_CLOCKS);
        let found = converted()?;
        (tick_timer::ticks() == tick).then_some(found)
    })
}

/// One conversion.
fn converted() -> Option<i32> {
    let converter = pac::ADC1;
    converter.cr2().modify(|control| control.set_swstart(true));
    (0..LOOKS).find(|_| converter.sr().read().eoc())?;
    // Reading it takes the flag back.
    Some(i32::from(converter.dr().read().data()))
}
