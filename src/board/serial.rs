//! The serial port: USART1, its interrupt above the tick, the sender's below it, and two rings.
//!
//! A byte takes 10.8 µs and the port keeps one, so an interrupt that waits for the tick loses bytes whenever
//! a tick is longer than that. The port's waits for nothing but the masked sections of the others (some fifty
//! instructions), takes some fifty itself, and does no more than move a byte into a ring. Nobody loses
//! anything where a byte is sent late, so that is not its business: where the port has room, it only says so
//! to the sender's interrupt, which the tick comes before. DMA would take none, but the emulator has no model
//! of it, and then nothing of this could be tested on the image.
//!
//! Bytes that are lost all the same, because the flash stalls the core or nobody empties the ring, are
//! counted, and a [`SUBSTITUTE`] takes their place, so that the line they were missing from is refused.

use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use core::task::Poll;

use cortex_m::peripheral::NVIC;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::gpio::vals::{Moder, Ot, Pupdr};
use embassy_stm32::pac::usart::regs::{Brr, Sr};
use embassy_stm32::{interrupt, pac};

use super::tick_timer;
use crate::real_time::{Asked, RealTimeByte, SUBSTITUTE};

/// PA9 and PA10.
const TRANSMIT_PIN: usize = 9;
const RECEIVE_PIN: usize = 10;
/// The alternate function of both that belongs to USART1.
const USART1_FUNCTION: u8 = 7;

/// Fast enough for 1 kHz of telemetry as text, and a rate that every USB adapter has.
const BAUD: u32 = 921_600;
/// APB2, which feeds the port.
const PORT_CLOCK_HZ: u32 = 84_000_000;

/// Places of either ring, a power of two. Lines wait here while earlier ones wait for their ticks: 22 ms at
/// the full rate of the line.
const PLACES: u32 = 2048;
/// The task is woken when so many are left to send.
const NEARLY_SENT: u32 = 512;

/// Bytes from one party to one other, without a lock.
struct Ring {
    bytes: [AtomicU8; PLACES as usize],
    /// Bytes put in so far; only who puts in writes it.
    put: AtomicU32,
    /// Bytes taken out so far; only who takes out writes it.
    taken: AtomicU32,
}

impl Ring {
    const fn new() -> Self {
        Self {
            bytes: [const { AtomicU8::new(0) }; PLACES as usize],
            put: AtomicU32::new(0),
            taken: AtomicU32::new(0),
        }
    }

    #[inline]
    fn len(&self) -> u32 {
        self.put.load(Ordering::Acquire).wrapping_sub(self.taken.load(Ordering::Acquire))
    }

    /// Whether there was room.
    #[inline]
    fn put(&self, byte: u8) -> bool {
        let put = self.put.load(Ordering::Relaxed);
        if put.wrapping_sub(self.taken.load(Ordering::Acquire)) >= PLACES {
            return false;
        }
        // The index is within the ring by the mask.
        if let Some(place) = self.bytes.get((put % PLACES) as usize) {
            place.store(byte, Ordering::Relaxed);
        }
        self.put.store(put.wrapping_add(1), Ordering::Release);
        true
    }

    #[inline]
    fn take(&self) -> Option<u8> {
        let taken = self.taken.load(Ordering::Relaxed);
        if self.put.load(Ordering::Acquire) == taken {
            return None;
        }
        let byte = self.bytes.get((taken % PLACES) as usize)?.load(Ordering::Relaxed);
        self.taken.store(taken.wrapping_add(1), Ordering::Release);
        Some(byte)
    }
}

static RECEIVED: Ring = Ring::new();
static TO_SEND: Ring = Ring::new();
/// An interrupt line whose peripheral is not used.
const SENDER: interrupt::Interrupt = interrupt::Interrupt::CAN1_SCE;

/// Bytes were lost and no substitute stands for them yet.
static GAP: AtomicBool = AtomicBool::new(false);
/// Overruns and bytes that found the ring full, so far.
static OVERRUNS: AtomicU32 = AtomicU32::new(0);
/// Bytes with a framing error or noise, so far.
static DAMAGED: AtomicU32 = AtomicU32::new(0);
/// What single bytes ask for.
static ASKED: super::Shared<Asked> = super::Shared::new();

/// Opens the port. Call once, after the clocks are set up.
pub fn open(asked: &'static Asked) {
    ASKED.set(asked);
    pac::RCC.ahb1enr().modify(|clocks| clocks.set_gpioaen(true));
    pac::RCC.apb2enr().modify(|clocks| clocks.set_usart1en(true));
    let port = pac::GPIOA;
    for pin in [TRANSMIT_PIN, RECEIVE_PIN] {
        port.afr(pin / 8).modify(|functions| functions.set_afr(pin % 8, USART1_FUNCTION));
        port.otyper().modify(|types| types.set_ot(pin, Ot::PUSH_PULL));
        port.pupdr().modify(|pulls| pulls.set_pupdr(pin, Pupdr::PULL_UP));
        port.moder().modify(|modes| modes.set_moder(pin, Moder::ALTERNATE));
    }
    let usart = pac::USART1;
    // Sixteenths of the clock per bit: the divider, rounded.
    usart.brr().write_value(Brr((PORT_CLOCK_HZ + BAUD / 2) / BAUD));
    usart.cr1().write(|control| {
        control.set_ue(true);
        control.set_te(true);
        control.set_re(true);
        control.set_rxneie(true);
    });
    SENDER.set_priority(Priority::P12);
    interrupt::Interrupt::USART1.set_priority(Priority::P0);
    // SAFETY: both handlers are below and need nothing but what is set up above.
    unsafe {
        SENDER.enable();
        interrupt::Interrupt::USART1.enable();
    }
}

/// The next byte that has come.
pub fn received() -> Option<u8> {
    RECEIVED.take()
}

/// Whether bytes wait.
pub fn has_received() -> bool {
    RECEIVED.len() != 0
}

/// Bytes lost and bytes damaged since the start.
pub fn errors() -> LineErrors {
    LineErrors { overruns: OVERRUNS.load(Ordering::Relaxed), damaged: DAMAGED.load(Ordering::Relaxed) }
}

/// What went wrong on the line since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineErrors {
    /// Times that one or more bytes were lost.
    pub overruns: u32,
    /// Bytes with a framing error or noise.
    pub damaged: u32,
}

/// Sends bytes, however many, waiting for room as often as it takes.
pub async fn send(bytes: &[u8]) {
    for byte in bytes {
        while !TO_SEND.put(*byte) {
            start_sending();
            poll_fn(|context| {
                tick_timer::wake_when_rung(context);
                if TO_SEND.len() < PLACES { Poll::Ready(()) } else { Poll::Pending }
            })
            .await;
        }
    }
    start_sending();
}

/// Waits until everything is on its way, the last bit included.
pub async fn sent() {
    poll_fn(|context| {
        tick_timer::wake_when_rung(context);
        if TO_SEND.len() == 0 { Poll::Ready(()) } else { Poll::Pending }
    })
    .await;
    while !pac::USART1.sr().read().tc() {}
}

/// Lets the sender's interrupt look what there is to send. It is never left off with bytes to send: either
/// the port will say that it has room, or the sender looks once more.
fn start_sending() {
    NVIC::pend(SENDER);
}

#[interrupt]
fn USART1() {
    let status = pac::USART1.sr().read();
    if status.rxne() || status.ore() {
        // Reading the data after the status clears all of its errors.
        take(status, pac::USART1.dr().read().dr() as u8);
    }
    if status.txe() && pac::USART1.cr1().read().txeie() {
        pac::USART1.cr1().modify(|control| control.set_txeie(false));
        NVIC::pend(SENDER);
    }
}

/// The sender. While the port's interrupt waits for room this one leaves the port alone, and while it does
/// not, nobody else writes the register that says so.
#[interrupt]
fn CAN1_SCE() {
    if pac::USART1.cr1().read().txeie() {
        return;
    }
    while pac::USART1.sr().read().txe() {
        let Some(byte) = TO_SEND.take() else { return };
        pac::USART1.dr().write(|data| data.set_dr(u16::from(byte)));
        let left = TO_SEND.len();
        if left == NEARLY_SENT || left == 0 {
            tick_timer::ring();
        }
    }
    if TO_SEND.len() != 0 {
        pac::USART1.cr1().modify(|control| control.set_txeie(true));
    }
}

#[inline]
fn take(status: Sr, byte: u8) {
    let damaged = status.fe() || status.ne();
    if damaged {
        DAMAGED.store(DAMAGED.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    } else if let Some(asked) = ASKED.get()
        && let Some(RealTimeByte::Status | RealTimeByte::Alive) = asked.receive(byte)
    {
        tick_timer::ring();
        return;
    }
    let whole = !GAP.load(Ordering::Relaxed) || RECEIVED.put(SUBSTITUTE);
    let kept = whole && RECEIVED.put(if damaged { SUBSTITUTE } else { byte });
    // An overrun lost the bytes behind this one.
    GAP.store(!kept || status.ore(), Ordering::Relaxed);
    if !kept || status.ore() {
        OVERRUNS.store(OVERRUNS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }
    tick_timer::ring();
}
