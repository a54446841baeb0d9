//! Decoder of the Thumb word loads and stores with which firmware touches peripheral registers.
//!
//! A range watchpoint reports the base of the range, so the address of an access has to come from
//! the instruction. Only word accesses are decoded: peripheral registers are words, and an access
//! of another shape is better refused than served wrongly. Encodings: Armv7-M Architecture
//! Reference Manual (DDI 0403E), A7.7.43-45 (LDR) and A7.7.161-162 (STR).

use thiserror::Error;

/// Direction of an access.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Register from memory.
    Load,
    /// Memory from register.
    Store,
}

/// What is added to (or taken from) the base register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offset {
    /// A constant in bytes, negative for a subtracted one.
    Immediate(i32),
    /// Another register, shifted left.
    Register {
        /// Number of the index register, 0 to 15.
        index: u8,
        /// Left shift in bits, 0 to 3.
        shift: u8,
    },
}

/// When the offset applies and whether the base register keeps the sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Indexing {
    /// `[Rn, offset]`: the base register is left alone.
    Offset,
    /// `[Rn, offset]!`: the base register becomes the address.
    PreIndexed,
    /// `[Rn], offset`: the address is the base, which is moved afterwards.
    PostIndexed,
}

/// One decoded word access.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WordAccess {
    /// Load or store.
    pub direction: Direction,
    /// Number of the register loaded or stored, 0 to 14.
    pub transfer: u8,
    /// Number of the base register, 0 to 14.
    pub base: u8,
    /// What is added to the base.
    pub offset: Offset,
    /// When the offset applies.
    pub indexing: Indexing,
    /// Length of the instruction in bytes, 2 or 4.
    pub length: u32,
}

/// An instruction the decoder does not serve.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{what} (encoding {first:04x} {second:04x}) is not a plain word load or store")]
pub struct UnsupportedInstruction {
    /// The kind of instruction, as far as it was recognised.
    pub what: &'static str,
    /// First halfword.
    pub first: u16,
    /// Second halfword (the next instruction where the first halfword is a whole one).
    pub second: u16,
}

impl WordAccess {
    /// Address in bytes, given the values of the base register and of the index register
    /// (0 where the offset is a constant), and the value that the base register must take.
    pub fn resolve(&self, base_value: u32, index_value: u32) -> (u32, Option<u32>) {
        let moved = match self.offset {
            Offset::Immediate(bytes) => base_value.wrapping_add_signed(bytes),
            Offset::Register { shift, .. } => base_value.wrapping_add(index_value << shift),
        };
        match self.indexing {
            Indexing::Offset => (moved, None),
            Indexing::PreIndexed => (moved, Some(moved)),
            Indexing::PostIndexed => (base_value, Some(moved)),
        }
    }
}

/// Decodes the instruction whose halfwords, in address order, are `first` and `second`.
///
/// # Errors
///
/// [`UnsupportedInstruction`] for everything but a word load or store through registers: byte,
/// halfword, double and multiple transfers, exclusives, unprivileged and pc-relative accesses.
pub fn decode(first: u16, second: u16) -> Result<WordAccess, UnsupportedInstruction> {
    let refuse = |what| UnsupportedInstruction { what, first, second };
    if first >> 11 >= 0b11101 { decode_wide(first, second, refuse) } else { decode_narrow(first, refuse) }
}

fn decode_narrow(
    first: u16,
    refuse: impl Fn(&'static str) -> UnsupportedInstruction,
) -> Result<WordAccess, UnsupportedInstruction> {
    let access = |direction, transfer, base, offset| WordAccess {
        direction,
        transfer,
        base,
        offset,
        indexing: Indexing::Offset,
        length: 2,
    };
    let low = field(first, 0, 3);
    let middle = field(first, 3, 3);
    let high = field(first, 6, 3);
    match first >> 12 {
        // LDR/STR (immediate) T1: 0110 L imm5 Rn Rt, in words.
        0b0110 => Ok(access(
            direction(first, 11),
            low,
            middle,
            Offset::Immediate(i32::from(field(first, 6, 5)) * 4),
        )),
        // LDR/STR (immediate) T2: 1001 L Rt imm8, relative to the stack pointer.
        0b1001 => Ok(access(
            direction(first, 11),
            field(first, 8, 3),
            13,
            Offset::Immediate(i32::from(first & 0xff) * 4),
        )),
        // Register offset: 0101 op Rm Rn Rt.
        0b0101 => {
            let offset = Offset::Register { index: high, shift: 0 };
            match field(first, 9, 3) {
                0b000 => Ok(access(Direction::Store, low, middle, offset)),
                0b100 => Ok(access(Direction::Load, low, middle, offset)),
                0b001 => Err(refuse("STRH")),
                0b010 => Err(refuse("STRB")),
                0b011 => Err(refuse("LDRSB")),
                0b101 => Err(refuse("LDRH")),
                0b110 => Err(refuse("LDRB")),
                _ => Err(refuse("LDRSH")),
            }
        }
        0b0111 => Err(refuse("LDRB or STRB")),
        0b1000 => Err(refuse("LDRH or STRH")),
        0b1100 => Err(refuse("LDM or STM")),
        0b0100 if field(first, 11, 1) == 1 => Err(refuse("LDR (literal)")),
        0b1011 if matches!(first & 0xfe00, 0xb400 | 0xbc00) => Err(refuse("PUSH or POP")),
        _ => Err(refuse("this narrow instruction")),
    }
}

fn decode_wide(
    first: u16,
    second: u16,
    refuse: impl Fn(&'static str) -> UnsupportedInstruction,
) -> Result<WordAccess, UnsupportedInstruction> {
    // Load/store multiple: 1110 100 xx 0 W L; dual, exclusive and table branch: 1110 100 P U 1 W L.
    match first & 0xfe40 {
        0xe800 => return Err(refuse("LDM or STM")),
        0xe840 if first & 0x0120 != 0 => return Err(refuse("LDRD or STRD")),
        0xe840 => return Err(refuse("an exclusive access or table branch")),
        _ => {}
    }
    // Load/store single: 1111 100 S x size L.
    if first & 0xfe00 != 0xf800 {
        return Err(refuse("this wide instruction"));
    }
    match first & 0xff60 {
        0xf840 => {}
        0xf800 | 0xf820 | 0xf900 | 0xf920 => return Err(refuse("a byte or halfword access")),
        _ => return Err(refuse("this wide instruction")),
    }
    let base = field(first, 0, 4);
    let transfer = field(second, 12, 4);
    if base == 15 {
        return Err(refuse("LDR (literal)"));
    }
    if transfer == 15 {
        return Err(refuse("LDR to the pc"));
    }
    let access = |offset, indexing| WordAccess {
        direction: direction(first, 4),
        transfer,
        base,
        offset,
        indexing,
        length: 4,
    };
    if field(first, 7, 1) == 1 {
        // T3: imm12, always added.
        let bytes = i32::from(second & 0x0fff);
        return Ok(access(Offset::Immediate(bytes), Indexing::Offset));
    }
    if second & 0x0fc0 == 0 {
        // T2 register: 000000 imm2 Rm.
        let offset = Offset::Register { index: field(second, 0, 4), shift: field(second, 4, 2) };
        return Ok(access(offset, Indexing::Offset));
    }
    if field(second, 11, 1) == 0 {
        return Err(refuse("this wide instruction"));
    }
    // T4: 1 P U W imm8.
    let magnitude = i32::from(second & 0xff);
    let bytes = if field(second, 9, 1) == 1 { magnitude } else { -magnitude };
    let indexing = match (field(second, 10, 1), field(second, 8, 1)) {
        (1, 0) if field(second, 9, 1) == 1 => return Err(refuse("LDRT or STRT")),
        (1, 0) => Indexing::Offset,
        (1, _) => Indexing::PreIndexed,
        (_, 1) => Indexing::PostIndexed,
        _ => return Err(refuse("an undefined instruction")),
    };
    if indexing != Indexing::Offset && base == transfer {
        return Err(refuse("a write-back into the transferred register"));
    }
    Ok(access(Offset::Immediate(bytes), indexing))
}

/// `width` bits (at most 8) of a halfword, from `lowest` up.
fn field(halfword: u16, lowest: u32, width: u32) -> u8 {
    ((halfword >> lowest) & ((1 << width) - 1)) as u8
}

fn direction(halfword: u16, load_bit: u32) -> Direction {
    if field(halfword, load_bit, 1) == 1 { Direction::Load } else { Direction::Store }
}

/// Program status with the IT block's state moved on by one instruction.
///
/// The driver steps over an access by moving the pc, so it also has to do what the core does for
/// every instruction inside an IT block (ITAdvance, DDI 0403E A7.3.3), or the condition of the
/// served instruction would be applied to the one after it. ITSTATE sits in bits 26:25 and 15:10.
pub fn advance_it_block(program_status: u32) -> u32 {
    let state = ((program_status >> 25) & 0b11) | ((program_status >> 8) & 0xfc);
    let next = if state & 0b111 == 0 { 0 } else { (state & 0xe0) | ((state << 1) & 0x1f) };
    (program_status & !0x0600_fc00) | ((next & 0b11) << 25) | ((next & 0xfc) << 8)
}

#[cfg(test)]
#[path = "thumb_tests.rs"]
mod tests;
