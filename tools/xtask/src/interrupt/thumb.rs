//! Where a Thumb-2 instruction goes next, and whether the tick may execute it at all.
//!
//! Encodings: ARM DDI 0403E, chapters A5 and A7. Whatever only computes is `Flow::Next`; whatever moves the
//! program counter in a way that is not decoded here is [`Flow::Unresolved`], never silently straight on.

/// One instruction, as far as the check needs it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction {
    /// 2 or 4 bytes.
    pub length: u32,
    /// Where control goes.
    pub flow: Flow,
    /// What the tick has to answer for.
    pub hazard: Option<Hazard>,
}

/// Where control goes after an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// To the instruction behind.
    Next,
    /// To this address.
    Jump(u32),
    /// To this address or on.
    Branch(u32),
    /// To a function at this address, and then on.
    Call(u32),
    /// Back to the caller.
    Return,
    /// By a table of offsets behind the instruction.
    Table {
        /// Bytes per entry, 1 or 2; an entry counts halfwords.
        entry_bytes: u32,
    },
    /// Nowhere: the instruction traps.
    Trap,
    /// To an address in a register or in memory.
    Unresolved,
    /// On, the next 1 to 4 instructions being conditional.
    IfThen(u8),
}

/// An instruction that the tick should not, or only countably, execute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Hazard {
    /// UDIV or SDIV: 2 to 12 cycles, no other harm.
    IntegerDivision,
    /// VDIV or VSQRT: 14 cycles.
    FloatDivision,
    /// CPS or MSR on an interrupt mask: a lock.
    InterruptMask,
    /// UDF, BKPT or SVC.
    Trap,
}

/// Whether an instruction that starts with `first` has a second halfword.
pub fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// Decodes the instruction at `address`; `second` only matters where [`is_wide`].
pub fn decode(address: u32, first: u16, second: u16) -> Instruction {
    // What the program counter reads as.
    let here = address.wrapping_add(4);
    if is_wide(first) {
        Instruction { length: 4, flow: wide_flow(here, first, second), hazard: wide_hazard(first, second) }
    } else {
        Instruction { length: 2, flow: narrow_flow(here, first), hazard: narrow_hazard(first) }
    }
}

fn narrow_flow(here: u32, first: u16) -> Flow {
    let high_destination = (first & 7) | ((first >> 4) & 8);
    match first {
        0xd000..=0xddff => Flow::Branch(offset(here, u32::from(first & 0xff) << 1, 9)),
        // SVC comes back; UDF and BKPT do not.
        0xde00..=0xdeff | 0xbe00..=0xbeff => Flow::Trap,
        0xe000..=0xe7ff => Flow::Jump(offset(here, u32::from(first & 0x7ff) << 1, 12)),
        0xbf00..=0xbfff if first & 0xf != 0 => Flow::IfThen(4 - (first & 0xf).trailing_zeros() as u8),
        // CBZ and CBNZ: i at bit 9, imm5 at 7:3, only forward.
        _ if first & 0xf500 == 0xb100 => {
            Flow::Branch(here.wrapping_add(u32::from(((first >> 3) & 0x40) | ((first >> 2) & 0x3e))))
        }
        // BX: back by lr.
        0x4770 => Flow::Return,
        0x4700..=0x47ff => Flow::Unresolved,
        // MOV and ADD with the program counter as destination.
        0x46f7 => Flow::Return,
        0x4400..=0x44ff | 0x4600..=0x46ff if high_destination == 15 => Flow::Unresolved,
        // POP with the program counter.
        0xbd00..=0xbdff => Flow::Return,
        _ => Flow::Next,
    }
}

fn narrow_hazard(first: u16) -> Option<Hazard> {
    match first {
        0xb660..=0xb67f => Some(Hazard::InterruptMask),
        0xbe00..=0xbeff | 0xde00..=0xdfff => Some(Hazard::Trap),
        _ => None,
    }
}

fn wide_flow(here: u32, first: u16, second: u16) -> Flow {
    let to_pc = second >> 12 == 15;
    match first {
        0xf000..=0xf7ff if second & 0x8000 != 0 => match second & 0xd000 {
            0x9000 => Flow::Jump(far(here, first, second)),
            0xd000 => Flow::Call(far(here, first, second)),
            0x8000 if first & 0x0380 != 0x0380 => Flow::Branch(conditional(here, first, second)),
            // UDF.W
            0x8000 if first & 0xfff0 == 0xf7f0 && second & 0xf000 == 0xa000 => Flow::Trap,
            // MSR, MRS, hints and barriers.
            0x8000 if (0xf380..=0xf3bf).contains(&first) || (0xf3e0..=0xf3ff).contains(&first) => Flow::Next,
            _ => Flow::Unresolved,
        },
        0xe8df if second & 0xffe0 == 0xf000 => {
            Flow::Table { entry_bytes: if second & 0x10 == 0 { 1 } else { 2 } }
        }
        // TBB with a base in a register.
        0xe8d0..=0xe8df if second & 0xffe0 == 0xf000 => Flow::Unresolved,
        // LDMIA and LDMDB with the program counter; from the stack it is a POP.
        0xe8bd if second & 0x8000 != 0 => Flow::Return,
        _ if matches!(first & 0xffd0, 0xe890 | 0xe910) && second & 0x8000 != 0 => Flow::Unresolved,
        // ldr pc, [sp], #4
        0xf85d if second == 0xfb04 => Flow::Return,
        0xf850..=0xf85f | 0xf8d0..=0xf8df if to_pc => Flow::Unresolved,
        _ => Flow::Next,
    }
}

fn wide_hazard(first: u16, second: u16) -> Option<Hazard> {
    match first {
        // PRIMASK, BASEPRI, BASEPRI_MAX and FAULTMASK.
        0xf380..=0xf39f if second & 0xff00 == 0x8800 && matches!(second & 0xff, 16..=19) => {
            Some(Hazard::InterruptMask)
        }
        0xf7f0..=0xf7ff if second & 0xf000 == 0xa000 => Some(Hazard::Trap),
        _ if matches!(first & 0xfff0, 0xfb90 | 0xfbb0) && second & 0x00f0 == 0x00f0 => {
            Some(Hazard::IntegerDivision)
        }
        _ if first & 0xffb0 == 0xee80 && second & 0x0e50 == 0x0a00 => Some(Hazard::FloatDivision),
        _ if first & 0xffbf == 0xeeb1 && second & 0x0ed0 == 0x0ac0 => Some(Hazard::FloatDivision),
        _ => None,
    }
}

/// S:I1:I2:imm10:imm11:0 of B (T4) and BL.
fn far(here: u32, first: u16, second: u16) -> u32 {
    let (first, second) = (u32::from(first), u32::from(second));
    let sign = (first >> 10) & 1;
    let i1 = !((second >> 13) ^ sign) & 1;
    let i2 = !((second >> 11) ^ sign) & 1;
    let bits = (sign << 24) | (i1 << 23) | (i2 << 22) | ((first & 0x3ff) << 12) | ((second & 0x7ff) << 1);
    offset(here, bits, 25)
}

/// S:J2:J1:imm6:imm11:0 of B (T3).
fn conditional(here: u32, first: u16, second: u16) -> u32 {
    let (first, second) = (u32::from(first), u32::from(second));
    let sign = (first >> 10) & 1;
    let (j1, j2) = ((second >> 13) & 1, (second >> 11) & 1);
    let bits = (sign << 20) | (j2 << 19) | (j1 << 18) | ((first & 0x3f) << 12) | ((second & 0x7ff) << 1);
    offset(here, bits, 21)
}

/// `here` plus a two's complement number of `width` bits.
fn offset(here: u32, bits: u32, width: u32) -> u32 {
    let unused = 32 - width;
    here.wrapping_add_signed(((bits << unused) as i32) >> unused)
}

#[cfg(test)]
#[path = "thumb_tests.rs"]
mod tests;
