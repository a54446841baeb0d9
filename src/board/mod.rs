//! The STM32F405RG board: everything that touches hardware, and all `unsafe` of the project.
//!
//! | what | where |
//! |---|---|
//! | console and telemetry | USART1, PA9 (TX), PA10 (RX), 921 600 baud 8N1 |
//! | analog command | DAC1 channel 1, PA4 |
//! | drive enable | PB0, high enables |
//! | brake | PB10, high opens |
//! | in position | PB5, high while the setpoint of an enabled drive stands still for good |
//! | charge pump | PB6, changes with every tick while no fault holds the machine |
//! | emergency input | PB1, EXTI1 interrupt, priority 1 |
//! | step pulses | TIM1: PA8 step or A, PA11 direction or B |
//! | encoder | TIM8: PC6 A, PC7 B |
//! | another controller's pulses | TIM3: PA6 direction or A, PA7 step or B; PC8, open |
//! | tick | TIM2 update interrupt, priority 1: only a byte that comes and masked sections go before it |
//! | ticks counted in hardware | TIM9, by TIM2's updates |
//! | watchdog | IWDG |
//! | bytes that come | USART1 interrupt, priority 0: a byte waits for nobody |
//! | bytes that go | sender's interrupt (line of CAN1_SCE), priority 12 |
//! | console and telemetry task | executor interrupt (line of CAN2_RX0), priority 14 |
//! | "samples wait", watchdog | doorbell interrupt (line of CAN2_SCE), priority 13 |
//! | settings | the last two flash sectors, 10 and 11 |
//! | external clock | 8 MHz crystal, PLL to 168 MHz; its failure and a falling supply end in the crash handler |

#![expect(unsafe_code, reason = "the only module that may; every use carries its SAFETY argument")]

use core::sync::atomic::{AtomicPtr, Ordering};

use crate::settings::DriveSettings;
use crate::source::SourceKind;
use crate::units::TickRate;

pub mod brown_out;
pub mod clocks;
pub mod core_coupled;
pub mod crash;
pub mod digital_inputs;
pub mod emergency_stop;
pub mod encoder;
pub mod executor;
pub mod flash;
pub mod flash_accelerator;
pub mod image;
pub mod outputs;
pub mod pulse_input;
pub mod restart;
pub mod self_test;
pub mod serial;
pub mod step_pulses;
pub mod supply;
pub mod tick_timer;
pub mod watchdog;

/// Sets up what depends on the settings and is not the tick's.
pub fn follow(settings: &DriveSettings, source: SourceKind, tick_rate: TickRate) {
    pulse_input::configure(source);
    outputs::set_standstill(settings.analog(tick_rate).standstill());
    step_pulses::configure(settings.pulse_configuration(tick_rate));
    emergency_stop::set_input(settings.emergency_input());
}

/// A reference that is handed to an interrupt once.
struct Shared<T: 'static>(AtomicPtr<T>);

impl<T> Shared<T> {
    const fn new() -> Self {
        Self(AtomicPtr::new(core::ptr::null_mut()))
    }

    fn set(&self, shared: &'static T) {
        self.0.store(core::ptr::from_ref(shared).cast_mut(), Ordering::Relaxed);
    }

    /// `None` before it was handed over.
    #[inline]
    fn get(&self) -> Option<&'static T> {
        // SAFETY: null, or a reference that `set` was given for good.
        unsafe { self.0.load(Ordering::Relaxed).cast_const().as_ref() }
    }
}

/// Called once, when clocks and peripherals are configured and before the first tick. It does nothing: it is
/// the place where a debugger or an emulator's harness knows that start-up is over.
// SAFETY: the symbol's name is unique to this project, so it shadows nothing.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn stillbeam_boot_complete() {
    cortex_m::asm::nop();
}
