//! What happens when nothing more can be done: the outputs are made safe, then the core stops.
//!
//! It stops rather than resets, so that a machine in trouble does not start to move again by itself; the reset
//! button brings it back. With the `defmt` feature panic-probe prints the message over RTT first, through the
//! hook below.

use cortex_m_rt::{ExceptionFrame, exception};

use super::outputs;

/// Outputs safe, interrupts off, nothing more until reset.
fn stop() -> ! {
    cortex_m::interrupt::disable();
    outputs::make_safe();
    loop {
        cortex_m::asm::wfe();
    }
}

#[cfg(not(feature = "defmt"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    stop()
}

// panic-probe prints and then executes an undefined instruction, which comes here.
// SAFETY: the handler touches only memory-mapped registers and does not return.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    stop()
}

// SAFETY: as above. No interrupt is enabled without a handler of its own, so this is a fault too.
#[exception]
unsafe fn DefaultHandler(_: i16) {
    stop()
}
