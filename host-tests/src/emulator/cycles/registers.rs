//! Which registers an instruction needs for an address, and which it has made: what may keep the pipeline
//! waiting.
//!
//! Encodings: Armv7-M Architecture Reference Manual (DDI 0403E), A5.

use super::kind::{Kind, is_wide, kind};

/// Sets of registers, a bit for each.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Registers {
    /// Of which the address of a load or store is made.
    pub address: u16,
    /// What a load of one word fills.
    pub loaded: u16,
    /// What data processing results in.
    pub result: u16,
}

impl Registers {
    /// Those of an instruction.
    pub fn of(first: u16, second: u16) -> Self {
        let wide = is_wide(first);
        match kind(first, second) {
            Kind::Plain(_) if wide => Self { result: wide_result(first, second), ..Self::default() },
            Kind::Plain(_) => Self { result: narrow_result(first), ..Self::default() },
            Kind::Float(_) => Self::default(),
            Kind::Load | Kind::Store | Kind::Several { .. } | Kind::Literal | Kind::Table if wide => {
                wide_access(first, second)
            }
            Kind::Load | Kind::Store | Kind::Several { .. } | Kind::Literal | Kind::Table => {
                narrow_access(first)
            }
        }
    }
}

fn bit(register: u16) -> u16 {
    1 << (register & 15)
}

fn narrow_access(first: u16) -> Registers {
    let (low, middle, high) = (first & 7, (first >> 3) & 7, (first >> 6) & 7);
    let byte = (first >> 8) & 7;
    let (address, loaded) = match first >> 12 {
        0b0100 => (0, bit(byte)),
        0b0101 => (bit(middle) | bit(high), bit(low)),
        0b0110..=0b1000 => (bit(middle), bit(low)),
        0b1001 => (bit(13), bit(byte)),
        0b1100 => (bit(byte), 0),
        // PUSH and POP.
        _ => (bit(13), 0),
    };
    let loads = matches!(kind(first, 0), Kind::Load | Kind::Literal);
    Registers { address, loaded: if loads { loaded } else { 0 }, result: 0 }
}

fn wide_access(first: u16, second: u16) -> Registers {
    let kind = kind(first, second);
    let indexed = first & 0xfe80 == 0xf800 && second & 0x0fc0 == 0;
    let index = if indexed || kind == Kind::Table { bit(second) } else { 0 };
    let address = if kind == Kind::Literal { 0 } else { bit(first) | index };
    let loads = matches!(kind, Kind::Load | Kind::Literal);
    Registers { address, loaded: if loads { bit(second >> 12) } else { 0 }, result: 0 }
}

fn narrow_result(first: u16) -> u16 {
    match first >> 10 {
        // Shifts, additions and subtractions of three operands.
        0b000000..=0b000111 => bit(first & 7),
        // MOV, ADD and SUB of a byte; CMP has no result.
        0b001000..=0b001111 if first & 0x1800 != 0x0800 => bit((first >> 8) & 7),
        // TST, CMP and CMN have none.
        0b010000 if !matches!((first >> 6) & 15, 8 | 10 | 11) => bit(first & 7),
        // ADD and MOV of any register.
        0b010001 if matches!((first >> 8) & 3, 0 | 2) => bit((first & 7) | ((first >> 4) & 8)),
        // ADD to PC or SP.
        0b101000..=0b101011 => bit((first >> 8) & 7),
        // ADD and SUB of SP itself.
        0b101100 if first & 0xff00 == 0xb000 => bit(13),
        // Extension, and reversal of bytes.
        0b101100 if first & 0xff00 == 0xb200 => bit(first & 7),
        0b101110 if first & 0xff00 == 0xba00 => bit(first & 7),
        _ => 0,
    }
}

fn wide_result(first: u16, second: u16) -> u16 {
    // Branches and what belongs to the system; the register 15 stands for none.
    let branches = first & 0xf800 == 0xf000 && second & 0x8000 != 0;
    let result = bit(second >> 8);
    let long = if first & 0xff80 == 0xfb80 { bit(second >> 12) } else { 0 };
    if branches { 0 } else { (result | long) & !bit(15) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Encodings as an assembler makes them.
    #[test]
    fn what_needs_a_register_and_what_makes_it_is_found() {
        for (first, second, address, loaded, result, what) in [
            (0x6808, 0, 1 << 1, 1 << 0, 0, "ldr r0, [r1]"),
            (0x6008, 0, 1 << 1, 0, 0, "str r0, [r1]"),
            (0x5888, 0, 1 << 1 | 1 << 2, 1 << 0, 0, "ldr r0, [r1, r2]"),
            (0x9a03, 0, 1 << 13, 1 << 2, 0, "ldr r2, [sp, #12]"),
            (0x4a05, 0, 0, 1 << 2, 0, "ldr r2, [pc, #20]"),
            (0xb5f0, 0, 1 << 13, 0, 0, "push {r4-r7, lr}"),
            (0xc806, 0, 1 << 0, 0, 0, "ldm r0!, {r1, r2}"),
            (0xf8da, 0x2000, 1 << 10, 1 << 2, 0, "ldr.w r2, [r10]"),
            (0xf85a, 0x2003, 1 << 10 | 1 << 3, 1 << 2, 0, "ldr.w r2, [r10, r3]"),
            (0xf840, 0x2b04, 1 << 0, 0, 0, "str r2, [r0], #4"),
            (0xe9d1, 0x2304, 1 << 1, 0, 0, "ldrd r2, r3, [r1, #16]"),
            (0xe8df, 0xf001, 1 << 15 | 1 << 1, 0, 0, "tbb [pc, r1]"),
            (0x1c48, 0, 0, 0, 1 << 0, "adds r0, r1, #1"),
            (0x3204, 0, 0, 0, 1 << 2, "adds r2, #4"),
            (0x2a04, 0, 0, 0, 0, "cmp r2, #4"),
            (0x4008, 0, 0, 0, 1 << 0, "ands r0, r1"),
            (0x4208, 0, 0, 0, 0, "tst r0, r1"),
            (0x46a9, 0, 0, 0, 1 << 9, "mov r9, r5"),
            (0xb08d, 0, 0, 0, 1 << 13, "sub sp, #52"),
            (0xb289, 0, 0, 0, 1 << 1, "uxth r1, r1"),
            (0xd1fe, 0, 0, 0, 0, "bne"),
            (0xf242, 0x0a10, 0, 0, 1 << 10, "movw r10, #8208"),
            (0xf2c2, 0x0a01, 0, 0, 1 << 10, "movt r10, #8193"),
            (0xea4f, 0x2101, 0, 0, 1 << 1, "lsl.w r1, r1, #8"),
            (0xf1b1, 0x0f04, 0, 0, 0, "cmp.w r1, #4"),
            (0xfb01, 0x3002, 0, 0, 1 << 0, "mla r0, r1, r2, r3"),
            (0xfba6, 0x5403, 0, 0, 1 << 5 | 1 << 4, "umull r5, r4, r6, r3"),
            (0xf000, 0xf800, 0, 0, 0, "bl"),
        ] {
            assert_eq!(Registers::of(first, second), Registers { address, loaded, result }, "{what}");
        }
    }
}
