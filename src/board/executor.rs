//! The executor of everything that is not the tick, run from a low-priority interrupt.
//!
//! Below it there is only sleep: the main thread waits for interrupts, and the core's clock stops
//! until one comes. An executor in the main thread would wait for events instead, which emulators spin on.

use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// Starts the executor and returns what spawns tasks on it. Call once.
pub fn start() -> SendSpawner {
    // A line whose peripheral is not used.
    let line = interrupt::Interrupt::CAN2_RX0;
    line.set_priority(Priority::P14);
    EXECUTOR.start(line)
}

/// Sleeps from interrupt to interrupt, for ever.
pub fn sleep() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}

#[interrupt]
fn CAN2_RX0() {
    // SAFETY: called from the handler of the line given to `start`, which is unmasked only there.
    unsafe { EXECUTOR.on_interrupt() }
}
