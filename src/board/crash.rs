//! What happens when nothing more can be done: the outputs are made safe, a record is written, and the core
//! stops. The watchdog resets it; the firmware then starts with the drive disabled and shows the record.
//!
//! With the `defmt` feature the message is printed over RTT, once the outputs are safe.

use core::fmt::Write as _;

use cortex_m_rt::exception;

use super::{outputs, tick_timer};
use crate::restart::{CRASH_BYTES, CrashKind, CrashRecord, FaultRegisters, MessageWriter};

unsafe extern "C" {
    /// The first byte of the region CRASH, from memory.x.
    static mut _crash_record: [u8; CRASH_BYTES];
    /// The lowest address of the stack, from memory.x.
    static _stack_end: u32;
    /// The address behind the stack, from memory.x.
    static _stack_start: u32;
}

/// The record of a crash, if there is one.
pub fn read() -> Option<CrashRecord> {
    // SAFETY: the region is this long, and nobody else is there before interrupts and tasks run.
    let bytes = unsafe { (&raw const _crash_record).read_volatile() };
    CrashRecord::decode(&bytes)
}

/// What is shown where the crystal did not start, which is no reason to write: the next start asks again.
pub fn no_crystal() -> CrashRecord {
    let mut message = MessageWriter::default();
    let _fits = message.write_str("the crystal does not start; the internal oscillator is 1 % off");
    CrashRecord { kind: CrashKind::Panic, tick: 0, registers: FaultRegisters::default(), message: message.0 }
}

/// Forgets the record.
pub fn forget() {
    write(&[0; CRASH_BYTES]);
}

/// Leaves a word where a record would be, for the next start.
pub(super) fn leave_mark(mark: u32) {
    let mut bytes = [0; CRASH_BYTES];
    if let Some(first) = bytes.first_chunk_mut() {
        *first = mark.to_le_bytes();
    }
    write(&bytes);
}

/// Whether the last run left this word. It is forgotten.
pub(super) fn take_mark(mark: u32) -> bool {
    // SAFETY: as in `read`.
    let bytes = unsafe { (&raw const _crash_record).read_volatile() };
    let found = bytes.first_chunk() == Some(&mark.to_le_bytes());
    if found {
        forget();
    }
    found
}

fn write(bytes: &[u8; CRASH_BYTES]) {
    // SAFETY: the region is this long. It is written by the console's task or by a handler that does not
    // return.
    unsafe { (&raw mut _crash_record).write_volatile(*bytes) };
}

/// Outputs safe, interrupts off, the record; nothing more until reset.
fn stop(kind: CrashKind, registers: FaultRegisters, message: MessageWriter) -> ! {
    let tick = tick_timer::ticks();
    write(&CrashRecord { kind, tick, registers, message: message.0 }.encode());
    loop {
        cortex_m::asm::wfe();
    }
}

/// Gives up for a reason that is none of the program's.
pub(super) fn give_up(reason: &str) -> ! {
    make_safe();
    let mut message = MessageWriter::default();
    // The writer takes what fits and never fails.
    let _fits = message.write_str(reason);
    stop(CrashKind::Panic, FaultRegisters::default(), message)
}

// SAFETY: as the fault's handler: it does not return. The clock security system raises it when the crystal
// stops; the core then runs from its internal oscillator.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    give_up("the crystal stopped")
}

fn make_safe() {
    outputs::make_safe();
    cortex_m::interrupt::disable();
    // The tick may have written between the two.
    outputs::make_safe();
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    make_safe();
    #[cfg(feature = "defmt")]
    defmt::error!("{}", defmt::Display2Format(info));
    let mut message = MessageWriter::default();
    // The place alone: with the words of every panic, and what formats them, the image would be 35 KB larger.
    if let Some(place) = info.location() {
        // The writer takes what fits and never fails.
        let _fits = write!(message, "{}:{}", place.file(), place.line());
    }
    stop(CrashKind::Panic, FaultRegisters::default(), message)
}

// The processor may come here because the stack is full, and then could not even store its state. The handler
// gets a stack of its own choice: the old one if there is room, or that from its top, whose content nobody
// will return to.
core::arch::global_asm!(
    ".section .HardFault.stillbeam, \"ax\", %progbits",
    ".global HardFault",
    ".type HardFault, %function",
    ".thumb_func",
    "HardFault:",
    "mrs r0, msp",
    "ldr r1, =_stack_end",
    "add r1, r1, #2048",
    "cmp r0, r1",
    "bhs 1f",
    "ldr r1, =_stack_start",
    "msr msp, r1",
    "1:",
    "b {handler}",
    ".pool",
    handler = sym hard_fault,
);

unsafe extern "C" fn hard_fault(stack_pointer: u32) -> ! {
    make_safe();
    let (low, high) = ((&raw const _stack_end) as u32, (&raw const _stack_start) as u32);
    let mut registers = FaultRegisters { sp: stack_pointer, ..FaultRegisters::default() };
    // SAFETY: these registers may be read at any time.
    let scb = unsafe { &*cortex_m::peripheral::SCB::PTR };
    registers.cfsr = scb.cfsr.read();
    registers.hfsr = scb.hfsr.read();
    registers.bfar = scb.bfar.read();
    if (low..=high - 32).contains(&stack_pointer) && stack_pointer.is_multiple_of(4) {
        let frame = stack_pointer as *const [u32; 8];
        // SAFETY: within the stack by the line above, and aligned.
        let [.., lr, pc, xpsr] = unsafe { frame.read_volatile() };
        (registers.lr, registers.pc, registers.xpsr) = (lr, pc, xpsr);
    }
    let mut message = MessageWriter::default();
    if stack_pointer < low + 64 {
        let _fits = message.write_str("the stack is full");
    }
    stop(CrashKind::HardFault, registers, message)
}

// SAFETY: as above; it does not return. No interrupt is enabled without a handler of its own, so this is a
// fault too.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    make_safe();
    let mut message = MessageWriter::default();
    let _fits = write!(message, "interrupt {number}");
    stop(CrashKind::Unhandled, FaultRegisters::default(), message)
}
