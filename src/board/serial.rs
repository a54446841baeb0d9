//! The serial port: USART1 with interrupt-driven buffers.

use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::usart::{self, BufferedUart, Config, ConfigError};
use embassy_stm32::{Peri, bind_interrupts, interrupt, peripherals};
use static_cell::ConstStaticCell;

bind_interrupts!(struct Interrupts {
    USART1 => usart::BufferedInterruptHandler<peripherals::USART1>;
});

/// Fast enough for 1 kHz of telemetry as text, and a rate that every USB adapter has.
const BAUD: u32 = 921_600;

static TRANSMIT: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);
static RECEIVE: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);

/// Opens the port. Call once.
///
/// # Errors
/// Passes on what the driver says of the baud rate, which is constant and valid.
pub fn open(
    usart: Peri<'static, peripherals::USART1>,
    receive: Peri<'static, peripherals::PA10>,
    transmit: Peri<'static, peripherals::PA9>,
) -> Result<BufferedUart<'static>, ConfigError> {
    interrupt::Interrupt::USART1.set_priority(Priority::P6);
    let mut config = Config::default();
    config.baudrate = BAUD;
    // Deliver each byte as it comes: people type, and emulators have no idle interrupt.
    config.eager_reads = Some(1);
    BufferedUart::new(usart, receive, transmit, TRANSMIT.take(), RECEIVE.take(), Interrupts, config)
}
