//! Why the firmware starts: what reset the processor, and the record that a crash has left.
//!
//! The record lies in memory that no start-up code touches, so it may be anything after power came on; its
//! CRC says whether it is a record.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::String;

/// The bytes of a record, CRC included.
pub const CRASH_BYTES: usize = 256;

/// The longest message; what is longer loses its end.
pub const MAX_MESSAGE: usize = 192;

/// The message of a crash.
pub type Message = String<MAX_MESSAGE>;

/// What kind of crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrashKind {
    /// The firmware found itself in the wrong and gave up at `file:line`.
    Panic = 1,
    /// The processor could not go on: see the fault registers.
    HardFault = 2,
    /// An interrupt or exception that nothing handles; the program status names it.
    Unhandled = 3,
}

impl CrashKind {
    const ALL: [Self; 3] = [Self::Panic, Self::HardFault, Self::Unhandled];

    /// The word that `info` prints.
    pub fn name(self) -> &'static str {
        match self {
            Self::Panic => "panic",
            Self::HardFault => "hard_fault",
            Self::Unhandled => "unhandled_exception",
        }
    }
}

/// What the processor knew of a crash. All zero for a panic, which has its message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaultRegisters {
    /// The instruction that faulted; zero where the stack was gone.
    pub pc: u32,
    /// The link register there.
    pub lr: u32,
    /// The program status there; its low nine bits name the exception that ran.
    pub xpsr: u32,
    /// The stack pointer on entry to the handler.
    pub sp: u32,
    /// Configurable fault status (CFSR).
    pub cfsr: u32,
    /// Hard fault status (HFSR).
    pub hfsr: u32,
    /// The address of a bus fault (BFAR), where CFSR says it is valid.
    pub bfar: u32,
}

/// The record of a crash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CrashRecord {
    /// What kind.
    pub kind: CrashKind,
    /// The last tick before it.
    pub tick: u32,
    /// The processor's state.
    pub registers: FaultRegisters,
    /// Where and why, in words.
    pub message: Message,
}

/// "SBCR" as a little-endian word, so that a record of another format is not one.
const MAGIC: u32 = u32::from_le_bytes(*b"SBCR");
const FORMAT: u32 = 1;
/// Magic and format, kind, tick, seven registers, length of the message.
const HEADER_WORDS: usize = 12;

impl CrashRecord {
    /// The record as bytes: words least significant byte first, the message, zeros, and a CRC-32 (ISO-HDLC)
    /// of all before.
    pub fn encode(&self) -> [u8; CRASH_BYTES] {
        let FaultRegisters { pc, lr, xpsr, sp, cfsr, hfsr, bfar } = self.registers;
        let length = self.message.len() as u32;
        let header = [MAGIC, FORMAT, self.kind as u32, self.tick, pc, lr, xpsr, sp, cfsr, hfsr, bfar, length];
        let content = header.into_iter().flat_map(u32::to_le_bytes).chain(self.message.bytes());
        let mut bytes = [0; CRASH_BYTES];
        for (place, byte) in bytes.iter_mut().zip(content) {
            *place = byte;
        }
        if let Some((content, crc)) = bytes.split_last_chunk_mut::<4>() {
            *crc = checksum(content).to_le_bytes();
        }
        bytes
    }

    /// The record in these bytes, if there is one.
    pub fn decode(bytes: &[u8; CRASH_BYTES]) -> Option<Self> {
        let (content, crc) = bytes.split_last_chunk::<4>()?;
        if checksum(content) != u32::from_le_bytes(*crc) {
            return None;
        }
        let mut words =
            content.chunks_exact(4).filter_map(|word| word.try_into().ok()).map(u32::from_le_bytes);
        let mut word = || words.next();
        if (word()?, word()?) != (MAGIC, FORMAT) {
            return None;
        }
        let kind = word()?;
        let kind = CrashKind::ALL.into_iter().find(|known| *known as u32 == kind)?;
        let tick = word()?;
        let registers = FaultRegisters {
            pc: word()?,
            lr: word()?,
            xpsr: word()?,
            sp: word()?,
            cfsr: word()?,
            hfsr: word()?,
            bfar: word()?,
        };
        let length = word()? as usize;
        let text = content.get(4 * HEADER_WORDS..)?.get(..length)?;
        // A message cut in the middle of a character is shown up to there.
        let text = match core::str::from_utf8(text) {
            Ok(text) => text,
            Err(error) => core::str::from_utf8(text.get(..error.valid_up_to())?).ok()?,
        };
        Some(Self { kind, tick, registers, message: Message::try_from(text).ok()? })
    }
}

fn checksum(bytes: &[u8]) -> u32 {
    Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(bytes)
}

/// `KIND tick=N MESSAGE` or, where the processor faulted, its registers.
impl fmt::Display for CrashRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} tick={}", self.kind.name(), self.tick)?;
        if self.registers != FaultRegisters::default() {
            let FaultRegisters { pc, lr, xpsr, sp, cfsr, hfsr, bfar } = self.registers;
            write!(f, " pc=0x{pc:08x} lr=0x{lr:08x} xpsr=0x{xpsr:08x} sp=0x{sp:08x}")?;
            write!(f, " cfsr=0x{cfsr:08x} hfsr=0x{hfsr:08x} bfar=0x{bfar:08x}")?;
        }
        if self.message.is_empty() { Ok(()) } else { write!(f, " {}", self.message) }
    }
}

/// Writes a message into a record, and drops what does not fit.
#[derive(Debug, Default)]
pub struct MessageWriter(pub Message);

impl fmt::Write for MessageWriter {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        // Only ASCII that fits on a line: a record is shown in a reply of lines.
        for character in part.chars() {
            let shown = if character.is_ascii_graphic() || character == ' ' { character } else { ' ' };
            let _full = self.0.push(shown);
        }
        Ok(())
    }
}

/// What reset the processor: bits 24 to 31 of RCC_CSR (RM0090, 7.3.21).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResetCause(pub u8);

impl ResetCause {
    const NAMES: [(u8, &'static str); 7] = [
        (0x80, "low_power"),
        (0x40, "window_watchdog"),
        (0x20, "watchdog"),
        (0x10, "software"),
        (0x08, "power_on"),
        (0x02, "brown_out"),
        // The pin is pulled by every other cause too.
        (0x04, "pin"),
    ];

    /// Whether a watchdog did it.
    pub fn is_watchdog(self) -> bool {
        self.0 & 0x60 != 0
    }

    /// The word that `info` prints: the most telling of the causes.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(bit, _)| self.0 & bit != 0).map_or("unknown", |(_, name)| name)
    }
}

/// What a reset that was asked for starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// This firmware.
    Firmware,
    /// The chip's own bootloader, which takes a new firmware over USB (DFU).
    Bootloader,
}

/// What the board found when it started.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Restart {
    /// What reset the processor.
    pub cause: ResetCause,
    /// The record of a crash, if there is one.
    pub crash: Option<CrashRecord>,
}

impl Restart {
    /// Whether the machine must not move before a person has said so.
    pub fn must_hold(&self) -> bool {
        self.crash.is_some() || self.cause.is_watchdog()
    }
}
