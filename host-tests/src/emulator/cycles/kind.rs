//! Which instruction is which, as far as its cycles go. Encodings: Armv7-M Architecture Reference Manual (DDI
//! 0403E), A5 and A6.

/// What an instruction is to the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// So many cycles in the pipeline, and nothing else.
    Plain(u32),
    /// The same of the floating-point unit.
    Float(u32),
    /// One word, half of it or a byte, from memory.
    Load,
    /// The same to memory.
    Store,
    /// So many words one after the other.
    Several {
        /// How many.
        words: u32,
        /// From memory.
        load: bool,
    },
    /// A word from the constants among the code.
    Literal,
    /// A jump by a table among the code.
    Table,
}

/// Whether an instruction has two halfwords.
pub fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// The register that says where an instruction's data are; `None` for the stack, constants and what has none.
pub fn base_register(first: u16, second: u16) -> Option<u8> {
    let base = match (is_wide(first), kind(first, second)) {
        (_, Kind::Plain(_) | Kind::Float(_) | Kind::Literal | Kind::Table) => return None,
        (false, _) => match first >> 12 {
            0b0101..=0b1000 => (first >> 3) & 7,
            0b1100 => (first >> 8) & 7,
            _ => return None,
        },
        (true, _) => first & 15,
    };
    (base < 13).then_some(base as u8)
}

/// Where the constant of a [`Kind::Literal`] at `address` is.
pub fn literal_address(address: u32, first: u16, second: u16) -> u32 {
    let from = (address + 4) & !3;
    if is_wide(first) {
        let offset = u32::from(second & 0xfff);
        if first & 0x80 != 0 { from + offset } else { from.wrapping_sub(offset) }
    } else {
        from + 4 * u32::from(first & 0xff)
    }
}

/// The kind of an instruction; `second` is what follows where it has one halfword.
pub fn kind(first: u16, second: u16) -> Kind {
    if is_wide(first) { wide_kind(first, second) } else { narrow_kind(first) }
}

fn narrow_kind(first: u16) -> Kind {
    let access = |load: bool| if load { Kind::Load } else { Kind::Store };
    match first >> 12 {
        0b0100 if first & 0x0800 != 0 => Kind::Literal,
        0b0101 => access((first >> 9) & 7 >= 3),
        0b0110..=0b1001 => access(first & 0x0800 != 0),
        0b1011 if matches!(first & 0xfe00, 0xb400 | 0xbc00) => {
            Kind::Several { words: (first & 0x1ff).count_ones(), load: first & 0x0800 != 0 }
        }
        0b1100 => Kind::Several { words: (first & 0xff).count_ones(), load: first & 0x0800 != 0 },
        _ => Kind::Plain(1),
    }
}

fn wide_kind(first: u16, second: u16) -> Kind {
    let load = first & 0x10 != 0;
    match first {
        0xe8d0..=0xe8df if second & 0xffe0 == 0xf000 => Kind::Table,
        0xe800..=0xe9ff if first & 0x40 == 0 => Kind::Several { words: second.count_ones(), load },
        0xe800..=0xe9ff => Kind::Several { words: 2, load },
        0xec00..=0xefff | 0xfc00..=0xffff => float_kind(first, second),
        // Barriers and special registers.
        0xf380..=0xf3ff if second & 0x8000 != 0 && second & 0x5000 == 0 => Kind::Plain(4),
        0xf800..=0xf9ff if first & 0x1f == 0x1f => Kind::Literal,
        0xf800..=0xf9ff => {
            if load {
                Kind::Load
            } else {
                Kind::Store
            }
        }
        0xfb90..=0xfb9f | 0xfbb0..=0xfbbf => Kind::Plain(12),
        _ => Kind::Plain(1),
    }
}

fn float_kind(first: u16, second: u16) -> Kind {
    let load = first & 0x10 != 0;
    if first & 0xff00 == 0xec00 || first & 0xff00 == 0xed00 {
        return match (first & 0x01e0, first & 0x0120) {
            // Two core registers at once.
            (0x0040, _) => Kind::Float(2),
            (_, 0x0100) => Kind::Several { words: 1, load },
            _ => Kind::Several { words: u32::from(second & 0xff), load },
        };
    }
    if second & 0x10 != 0 {
        return Kind::Float(1);
    }
    // The operation: bits 23, 21 and 20, and whether it has one operand.
    match (first & 0x00b0, second & 0x40 != 0) {
        (0x0080, _) => Kind::Float(14),
        (0x00b0, true) if first & 0xf == 1 && second & 0x80 != 0 => Kind::Float(14),
        (0x0000 | 0x0010 | 0x0090 | 0x00a0, _) => Kind::Float(3),
        _ => Kind::Float(1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Encodings as an assembler makes them.
    #[test]
    fn instructions_are_of_the_kind_that_the_manual_says() {
        for (first, second, expected, what) in [
            (0xb5f0, 0, Kind::Several { words: 5, load: false }, "push {r4-r7, lr}"),
            (0xe92d, 0x4ff0, Kind::Several { words: 9, load: false }, "push.w {r4-r11, lr}"),
            (0xe8bd, 0x8ff0, Kind::Several { words: 9, load: true }, "pop.w {r4-r11, pc}"),
            (0xe9d1, 0x2304, Kind::Several { words: 2, load: true }, "ldrd r2, r3, [r1, #16]"),
            (0xe8df, 0xf001, Kind::Table, "tbb [pc, r1]"),
            (0x4a05, 0, Kind::Literal, "ldr r2, [pc, #20]"),
            (0xf8df, 0x1014, Kind::Literal, "ldr.w r1, [pc, #20]"),
            (0xf8d1, 0x20a0, Kind::Load, "ldr.w r2, [r1, #160]"),
            (0xf8c1, 0x20a0, Kind::Store, "str.w r2, [r1, #160]"),
            (0xf89a, 0x0000, Kind::Load, "ldrb.w r0, [r10]"),
            (0x5641, 0, Kind::Load, "ldrsb r1, [r0, r1]"),
            (0x5241, 0, Kind::Store, "strh r1, [r0, r1]"),
            (0xfb91, 0xf0f2, Kind::Plain(12), "sdiv r0, r1, r2"),
            (0xfbb1, 0xf0f2, Kind::Plain(12), "udiv r0, r1, r2"),
            (0xfb01, 0x3002, Kind::Plain(1), "mla r0, r1, r2, r3"),
            (0xfb01, 0xf002, Kind::Plain(1), "mul r0, r1, r2"),
            (0xfbc2, 0x0103, Kind::Plain(1), "smlal r0, r1, r2, r3"),
            (0xf3bf, 0x8f4f, Kind::Plain(4), "dsb"),
            (0xf000, 0xf800, Kind::Plain(1), "bl"),
            (0xee30, 0x0a20, Kind::Float(1), "vadd.f32 s0, s0, s1"),
            (0xee20, 0x0a20, Kind::Float(1), "vmul.f32 s0, s0, s1"),
            (0xee00, 0x0a20, Kind::Float(3), "vmla.f32 s0, s0, s1"),
            (0xeea0, 0x0a20, Kind::Float(3), "vfma.f32 s0, s0, s1"),
            (0xee80, 0x0a20, Kind::Float(14), "vdiv.f32 s0, s0, s1"),
            (0xeeb1, 0x0ac0, Kind::Float(14), "vsqrt.f32 s0, s0"),
            (0xeeb8, 0x0ac0, Kind::Float(1), "vcvt.f32.s32 s0, s0"),
            (0xeeb0, 0x0ac0, Kind::Float(1), "vabs.f32 s0, s0"),
            (0xed90, 0x0a01, Kind::Several { words: 1, load: true }, "vldr s0, [r0, #4]"),
            (0xed2d, 0x8b04, Kind::Several { words: 4, load: false }, "vpush {d8-d9}"),
            (0xee00, 0x0a10, Kind::Float(1), "vmov s0, r0"),
        ] {
            assert_eq!(kind(first, second), expected, "{what}");
        }
    }

    #[test]
    fn base_registers_are_found_and_the_stack_is_none() {
        assert_eq!(base_register(0x6808, 0), Some(1), "ldr r0, [r1]");
        assert_eq!(base_register(0xf8da, 0x2000), Some(10), "ldr.w r2, [r10]");
        assert_eq!(base_register(0xc806, 0), Some(0), "ldm r0!, {{r1, r2}}");
        for (first, second) in [(0x9801, 0), (0xb500, 0), (0xe92d, 0x4ff0), (0x4a05, 0), (0xbf00, 0)] {
            assert_eq!(base_register(first, second), None, "{first:04x}");
        }
    }
}
