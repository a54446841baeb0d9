//! Cycles of an interrupt on the chip, by a model, from the instructions that ran in the emulator.
//!
//! The emulator counts instructions and knows no pipeline, no flash and no bus. The model adds them, where it
//! has to choose to the slow side:
//!
//! | what | cycles | from |
//! |---|---|---|
//! | exception entry and return | 12 and 10; the vector is read from flash | Cortex-M4 TRM |
//! | data processing, any multiplication | 1 | Cortex-M4 TRM, instruction set summary |
//! | division of integers | 12 (2 to 12) | same |
//! | load | 2; 1 behind another whose word is not its address | same, load and store timings |
//! | load of a constant among the code | 3: the fetch of code may be in its way | same |
//! | store | 1; 2 where a register is the offset, 1 of that behind a load | same |
//! | an address from the result of the instruction before | 1 more | same |
//! | several words: LDM, STM, PUSH, POP, LDRD, STRD | 1 + words | same |
//! | a branch that is taken, any jump | 3 more (1 to 3); by a table 3 + 3 | same |
//! | float: addition, multiplication, conversion; with accumulation; division, root | 1; 3; 14 | same, FPU |
//! | the first float operation | 18 more: 17 words are stacked then | same |
//! | a line of 16 bytes of code: in the cache; the next one; another | 0; what of 6 the line before left over; 5 more | RM0090, 5 wait states |
//! | a line of 16 bytes of constants: in its cache; not | 0; 5 more | same |
//! | a register on APB1, APB2, AHB, in the core: load | 10, 6, 3, 3 more | bridge ratios 4 and 2, assumed |
//! | the same: store | 6, 4, 2, 2 more | same |
//!
//! Both caches are empty when the interrupt begins, as if what ran before had taken all of their places: 64
//! lines of code, 8 of constants, the one used longest ago goes first.

mod cache;
mod kind;
mod registers;

pub use kind::{base_register, is_wide};

use cache::Cache;
use kind::{Kind, kind, literal_address};
use registers::Registers;

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

/// The cycles of one run of an interrupt.
#[derive(Debug, Clone)]
pub struct CycleModel {
    cycles: u32,
    code: Cache,
    constants: Cache,
    /// The line of code that is being executed, and when its execution began.
    line: Option<(u32, u32)>,
    /// Those of the instruction before.
    before: Registers,
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
            before: Registers::default(),
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
        let (kind, registers) = (kind(first, second), Registers::of(first, second));
        self.cycles += match kind {
            Kind::Plain(cycles) => cycles,
            Kind::Float(cycles) => {
                let stacking = if std::mem::replace(&mut self.floats, true) { 0 } else { FLOAT_STACKING };
                cycles + stacking
            }
            Kind::Load => self.behind_load(registers) + self.bus(base, true),
            // Its own register is the whole address, or the offset is a constant.
            Kind::Store if registers.address.count_ones() == 1 => 1 + self.bus(base, false),
            Kind::Store => self.behind_load(registers) + self.bus(base, false),
            Kind::Several { words, load } => 1 + words + self.bus(base, load),
            Kind::Literal => 3 + self.constant(literal_address(address, first, second)),
            Kind::Table => 3 + self.constant(address + length),
        };
        // There is no path from one instruction's result to the next one's address.
        self.cycles += u32::from(self.before.result & registers.address != 0);
        self.before = registers;
        if next != address + length {
            self.cycles += REFILL;
        }
    }

    /// All of them, the return included.
    pub fn cycles(&self) -> u32 {
        self.cycles + RETURN
    }

    /// A load, or a store that takes as long: it overlaps with a load before it.
    fn behind_load(&self, registers: Registers) -> u32 {
        let overlaps = self.before.loaded != 0 && self.before.loaded & registers.address == 0;
        if overlaps { 1 } else { 2 }
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
    fn loads_overlap_unless_one_is_the_others_address() {
        const RAM: Option<u32> = Some(0x2000_0000);
        // ldr r0, [r1]; ldr r2, [r3]; ldr r4, [r0]
        let [one, other, by_it] = [(0x6808, 0), (0x681a, 0), (0x6804, 0)];
        assert_eq!(straight(&[one], RAM), 5 + 2);
        assert_eq!(straight(&[one, other], RAM), 5 + 3);
        assert_eq!(straight(&[one, other, one], RAM), 5 + 4);
        assert_eq!(straight(&[one, by_it], RAM), 5 + 4);
        // str r2, [r3, #20] and str r2, [r3, r4], behind a load and alone.
        let [constant, register] = [(0x615a, 0), (0x511a, 0)];
        assert_eq!(straight(&[constant], RAM), 5 + 1);
        assert_eq!(straight(&[register], RAM), 5 + 2);
        assert_eq!(straight(&[one, constant], RAM), 5 + 3);
        assert_eq!(straight(&[one, register], RAM), 5 + 3);
        assert_eq!(straight(&[register, one], RAM), 5 + 4, "nothing overlaps with a store");
    }

    #[test]
    fn an_address_waits_for_the_result_before_it() {
        // adds r1, #4; ldr r0, [r1], and something between.
        let [add, load] = [(0x3104, 0), (0x6808, 0)];
        assert_eq!(straight(&[add, load], Some(0x2000_0000)), 5 + 1 + 2 + 1);
        assert_eq!(straight(&[add, (NOP, 0), load], Some(0x2000_0000)), 5 + 1 + 1 + 2);
    }

    #[test]
    fn accesses_cost_what_they_reach() {
        // ldr r0, [r1]; str r0, [r1]
        let [load, store] = [(0x6808, 0), (0x6008, 0)];
        for (base, load_more, store_more) in [
            (0x4000_0024, 10, 6),
            (0x4001_0000, 6, 4),
            (0x4002_0410, 3, 2),
            (0xe000_e200, 3, 2),
            (0x1000_0000, 0, 0),
        ] {
            assert_eq!(straight(&[load], Some(base)), 5 + 2 + load_more, "{base:#x}");
            assert_eq!(straight(&[store], Some(base)), 5 + 1 + store_more, "{base:#x}");
        }
        // Constants in flash, the second time from their cache.
        assert_eq!(straight(&[load, load], Some(0x0800_8000)), 5 + 2 + 5 + 1);
        // ldr r0, [pc, #0] reads its own line, which is not in the cache of constants.
        assert_eq!(straight(&[(0x4800, 0)], None), 5 + 3 + 5);
    }

    #[test]
    fn several_words_take_one_cycle_more_than_there_are() {
        // push {r4-r7, lr}; ldrd r2, r3, [r1, #16]; umull; mla; udiv
        for (first, second, cycles) in [
            (0xb5f0, 0, 6),
            (0xe9d1, 0x2304, 3),
            (0xfba6, 0x5403, 1),
            (0xfb01, 0x3002, 1),
            (0xfbb1, 0xf0f2, 12),
        ] {
            assert_eq!(straight(&[(first, second)], Some(0x2000_0000)), 5 + cycles, "{first:04x}");
        }
    }

    #[test]
    fn the_first_float_pays_for_the_registers_that_are_stacked_then() {
        let add = (0xee30, 0x0a20);
        assert_eq!(straight(&[add, add], None), 5 + 1 + 18 + 1);
    }
}
