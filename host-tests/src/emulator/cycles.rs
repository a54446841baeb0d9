//! Cycles of an interrupt on the chip, by a model, from the instructions that ran in the emulator.
//!
//! The emulator counts instructions and knows no pipeline, no flash and no bus. The model adds them, where it has to choose
//! to the slow side:
//!
//! | what | cycles | from |
//! |---|---|---|
//! | exception entry and return | 12 and 10; the vector is read from flash | Cortex-M4 TRM |
//! | data processing, multiplication, long multiplication | 1 | Cortex-M4 TRM, table 3-1 |
//! | multiplication with addition of 32 bits | 2 | same |
//! | division of integers | 12 (2 to 12) | same |
//! | load, store | 2; 1 right behind another one | same |
//! | several words: LDM, STM, PUSH, POP, LDRD, STRD | 1 + words | same |
//! | a branch that is taken, any jump | 3 more (1 to 3) | same |
//! | float: addition, multiplication, conversion; with accumulation; division, root | 1; 3; 14 | same, FPU |
//! | the first float operation | 18 more: 17 words are stacked then | same |
//! | a line of 16 bytes of code: in the cache; the next one; another | 0; what of 6 the line before left over; 5 more | RM0090, 5 wait states |
//! | a line of 16 bytes of constants: in its cache; not | 0; 5 more | same |
//! | a register on APB1, APB2, AHB, in the core: load | 10, 6, 3, 3 | bridge ratios 4 and 2, assumed |
//! | the same: store | 6, 4, 2, 2 | same |
//!
//! Both caches are empty when the interrupt begins, as if what ran before had taken all of their places: 64 lines of code, 8 of
//! constants, the one used longest ago goes first.

use std::collections::VecDeque;

/// Wait states of the flash at 168 MHz.
const WAIT_STATES: u32 = 5;
/// Bytes that the flash reads at once.
const LINE_BYTES: u32 = 16;
const CODE_LINES: usize = 64;
const CONSTANT_LINES: usize = 8;
const ENTRY: u32 = 12;
const RETURN: u32 = 10;
const REFILL: u32 = 3;
const FLOAT_STACKING: u32 = 18;

/// An instruction that ran.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Executed {
    /// Where it is.
    pub address: u32,
    /// Its first halfword.
    pub first: u16,
    /// Its second one, or what is behind it.
    pub second: u16,
    /// What its base register held, where it has one ([`base_register`]).
    pub base: Option<u32>,
    /// Where the next one is.
    pub next: u32,
}

/// What an instruction is to the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// So many cycles in the pipeline, and nothing else.
    Plain(u32),
    Float(u32),
    Load,
    Store,
    /// So many words one after the other.
    Several {
        words: u32,
        load: bool,
    },
    /// A word from the constants among the code.
    Literal,
    /// A jump by a table among the code.
    Table,
}

/// The cycles of one run of an interrupt.
#[derive(Debug, Clone)]
pub struct CycleModel {
    cycles: u32,
    code: Cache,
    constants: Cache,
    /// The line of code that is being executed, and when its execution began.
    line: Option<(u32, u32)>,
    /// The instruction before was a single load or store.
    behind_access: bool,
    floats: bool,
}

impl Default for CycleModel {
    fn default() -> Self {
        Self {
            // The vector is a constant in flash.
            cycles: ENTRY + WAIT_STATES,
            code: Cache::new(CODE_LINES),
            constants: Cache::new(CONSTANT_LINES),
            line: None,
            behind_access: false,
            floats: false,
        }
    }
}

impl CycleModel {
    /// Adds an instruction.
    pub fn execute(&mut self, executed: Executed) {
        let Executed { address, first, second, base, next } = executed;
        let length = if is_wide(first) { 4 } else { 2 };
        self.fetch(address / LINE_BYTES);
        self.fetch((address + length - 2) / LINE_BYTES);
        let kind = kind(first, second);
        self.cycles += match kind {
            Kind::Plain(cycles) => cycles,
            Kind::Float(cycles) => {
                let stacking = if std::mem::replace(&mut self.floats, true) { 0 } else { FLOAT_STACKING };
                cycles + stacking
            }
            Kind::Load | Kind::Store => {
                let pipelined = if self.behind_access { 1 } else { 2 };
                pipelined + self.bus(base, kind == Kind::Load)
            }
            Kind::Several { words, load } => 1 + words + self.bus(base, load),
            Kind::Literal => 2 + self.constant(literal_address(address, first, second)),
            Kind::Table => 2 + self.constant(address + length),
        };
        self.behind_access = matches!(kind, Kind::Load | Kind::Store | Kind::Literal);
        if next != address + length {
            self.cycles += REFILL;
        }
    }

    /// All of them, the return included.
    pub fn cycles(&self) -> u32 {
        self.cycles + RETURN
    }

    /// Waits for a line of code.
    fn fetch(&mut self, line: u32) {
        let before = self.line.filter(|(current, _)| *current != line);
        if self.line.is_some() && before.is_none() {
            return;
        }
        if !self.code.touch(line) {
            // The next line is read ahead while this one runs.
            let ahead = before.filter(|(current, _)| current + 1 == line);
            self.cycles += match ahead {
                Some((_, since)) => (WAIT_STATES + 1).saturating_sub(self.cycles - since),
                None => WAIT_STATES,
            };
        }
        self.line = Some((line, self.cycles));
    }

    /// What a constant at this address takes on top.
    fn constant(&mut self, address: u32) -> u32 {
        if self.constants.touch(address / LINE_BYTES) { 0 } else { WAIT_STATES }
    }

    /// What the bus to where the base register points takes on top.
    fn bus(&mut self, base: Option<u32>, load: bool) -> u32 {
        match base.unwrap_or(0) {
            flash @ 0x0800_0000..0x0810_0000 => self.constant(flash),
            0x4000_0000..0x4001_0000 => [6, 10][usize::from(load)],
            0x4001_0000..0x4002_0000 => [4, 6][usize::from(load)],
            0x4002_0000.. => [2, 3][usize::from(load)],
            _ => 0,
        }
    }
}

/// Lines of flash, the one used last in front.
#[derive(Debug, Clone)]
struct Cache {
    lines: VecDeque<u32>,
    places: usize,
}

impl Cache {
    fn new(places: usize) -> Self {
        Self { lines: VecDeque::with_capacity(places + 1), places }
    }

    /// Uses a line; whether it was there.
    fn touch(&mut self, line: u32) -> bool {
        let place = self.lines.iter().position(|known| *known == line);
        if let Some(place) = place {
            self.lines.remove(place);
        }
        self.lines.push_front(line);
        self.lines.truncate(self.places);
        place.is_some()
    }
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

fn literal_address(address: u32, first: u16, second: u16) -> u32 {
    let from = (address + 4) & !3;
    if is_wide(first) {
        let offset = u32::from(second & 0xfff);
        if first & 0x80 != 0 { from + offset } else { from.wrapping_sub(offset) }
    } else {
        from + 4 * u32::from(first & 0xff)
    }
}

fn kind(first: u16, second: u16) -> Kind {
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
        0xfb00..=0xfb7f if second & 0xf000 != 0xf000 => Kind::Plain(2),
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

    const FLASH: u32 = 0x0800_1000;
    const NOP: u16 = 0xbf00;

    /// The cycles of halfwords one after the other, less those of entry and return.
    fn straight(halfwords: &[(u16, u16)], base: Option<u32>) -> u32 {
        let mut model = CycleModel::default();
        let mut address = FLASH;
        for &(first, second) in halfwords {
            let next = address + if is_wide(first) { 4 } else { 2 };
            model.execute(Executed { address, first, second, base, next });
            address = next;
        }
        model.cycles() - CycleModel::default().cycles()
    }

    #[test]
    fn straight_code_waits_for_its_first_line_and_little_after_that() {
        assert_eq!(straight(&[(NOP, 0)], None), 5 + 1);
        // A line holds eight of them, which is longer than the next one takes.
        assert_eq!(straight(&[(NOP, 0); 80], None), 5 + 80);
        // Four wide ones are not: two cycles are missing for each line behind the first.
        assert_eq!(straight(&[(0xf100, 0x0001); 12], None), 5 + 12 + 2 * 2);
    }

    #[test]
    fn a_loop_in_the_cache_waits_once_and_pays_for_its_jumps() {
        let mut model = CycleModel::default();
        for _ in 0..10 {
            model.execute(Executed { address: FLASH, first: NOP, second: 0, base: None, next: FLASH + 2 });
            // b .-2
            model.execute(Executed { address: FLASH + 2, first: 0xe7fd, second: 0, base: None, next: FLASH });
        }
        assert_eq!(model.cycles() - CycleModel::default().cycles(), 5 + 10 * (1 + 1 + 3));
    }

    #[test]
    fn the_cache_forgets_what_was_used_longest_ago() {
        let mut cache = Cache::new(2);
        assert_eq!(
            [1, 2, 1, 3, 1, 2].map(|line| cache.touch(line)),
            [false, false, true, false, true, false]
        );
    }

    #[test]
    fn accesses_cost_what_they_reach() {
        // ldr r0, [r1], one and two of them.
        let load = (0x6808, 0);
        assert_eq!(straight(&[load], Some(0x2000_0000)), 5 + 2);
        assert_eq!(straight(&[load, load], Some(0x2000_0000)), 5 + 3);
        for (base, more) in [(0x4000_0024, 10), (0x4001_0000, 6), (0x4002_0410, 3), (0xe000_e200, 3)] {
            assert_eq!(straight(&[load], Some(base)), 5 + 2 + more, "{base:#x}");
        }
        // str r0, [r1]; constants in flash, the second time from their cache.
        assert_eq!(straight(&[(0x6008, 0)], Some(0x4000_0000)), 5 + 2 + 6);
        assert_eq!(straight(&[load, load], Some(0x0800_8000)), 5 + 2 + 5 + 1);
    }

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
            (0xfb01, 0x3002, Kind::Plain(2), "mla r0, r1, r2, r3"),
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
        for (first, second) in [(0x9801, 0), (0xb500, 0), (0xe92d, 0x4ff0), (0x4a05, 0), (NOP, 0)] {
            assert_eq!(base_register(first, second), None, "{first:04x}");
        }
    }

    #[test]
    fn the_first_float_pays_for_the_registers_that_are_stacked_then() {
        let add = (0xee30, 0x0a20);
        assert_eq!(straight(&[add, add], None), 5 + 1 + 18 + 1);
    }
}
