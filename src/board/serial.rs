//! The serial port: USART1 with interrupt-driven buffers.

use core::future::{Future as _, poll_fn};
use core::pin::pin;

use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::usart::{self, BufferedUart, BufferedUartTx, Config, ConfigError};
use embassy_stm32::{Peri, bind_interrupts, interrupt, pac, peripherals};
use embassy_sync::waitqueue::AtomicWaker;
use embedded_io_async::Write as _;
use static_cell::ConstStaticCell;

// In this order.
bind_interrupts!(struct Interrupts {
    USART1 => usart::BufferedInterruptHandler<peripherals::USART1>, KeepReceivedBytes;
});

/// Keeps the driver's handler away from a race that loses received bytes.
///
/// After the last byte of a transmission the driver asks for a "transmission complete" interrupt, and clears that flag
/// by reading the status register and writing it back. "Byte received" is in the same register and is cleared by
/// writing 0 too, so a byte that arrives between the two is lost: a letter in about 300 commands on the emulator,
/// where a host answers at once. Only the driver's `flush` needs that interrupt, and nothing here flushes; so it is
/// switched off again before it can come.
struct KeepReceivedBytes;

impl interrupt::typelevel::Handler<interrupt::typelevel::USART1> for KeepReceivedBytes {
    // SAFETY: called from the interrupt only. Nothing else changes CR1 once the port is open.
    unsafe fn on_interrupt() {
        pac::USART1.cr1().modify(|control| control.set_tcie(false));
        // The driver stops asking for the next byte when it has none.
        if !pac::USART1.cr1().read().txeie() {
            ALL_SENT.wake();
        }
    }
}

static ALL_SENT: AtomicWaker = AtomicWaker::new();

/// Sends bytes, however many, waiting for room as often as it takes.
///
/// The driver refuses a write that is longer than its buffer, and does not wake a writer that has to wait for room; this
/// one is woken when all has been sent.
pub async fn send(port: &mut BufferedUartTx<'static>, bytes: &[u8]) {
    for chunk in bytes.chunks(CHUNK) {
        let mut write = pin!(port.write_all(chunk));
        poll_fn(|context| {
            ALL_SENT.register(context.waker());
            // Only a chunk beyond the buffer's length fails.
            write.as_mut().poll(context).map(|_sent| ())
        })
        .await;
    }
}

/// Bytes that are handed to the driver at once: a part of its buffer, so that it is filled again before it is empty.
const CHUNK: usize = 256;

/// Fast enough for 1 kHz of telemetry as text, and a rate that every USB adapter has.
const BAUD: u32 = 921_600;

static TRANSMIT: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);
/// Lines wait here while earlier ones wait for their ticks: 11 ms at the full rate of the line.
static RECEIVE: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);

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
