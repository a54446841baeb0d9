//! How deep the stack can get below the tick's handler: every instruction that lowers the stack pointer
//! counted once in its function, along the deepest chain of calls.
//!
//! That is a bound, not the depth: a function that takes its frame on two separate paths counts both. A stack
//! pointer that is set from a register, or a recursion, has no bound here and is said to have none.

use std::collections::{BTreeMap, BTreeSet};

/// What the processor stores on entry to an exception: eight words, the eighteen of the floating-point
/// registers, and one to align them (ARM DDI 0403E, B1.5.6 and B1.5.7).
const ENTRY_BYTES: u32 = 4 * (8 + 18 + 1);

/// What an instruction does to the stack pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StackUse {
    /// Nothing, or it raises it.
    None,
    /// Lowers it by so many bytes.
    Bytes(u32),
    /// Sets it to something that only registers know.
    Unknown,
}

/// Decodes what an instruction takes; `second` only matters for wide ones.
pub fn stack_use(first: u16, second: u16) -> StackUse {
    let words = |count: u32| StackUse::Bytes(4 * count);
    let to_stack_pointer = second & 0x0f00 == 0x0d00;
    match first {
        // PUSH; SUB SP, SP, #imm7
        0xb400..=0xb5ff => words((first & 0x1ff).count_ones()),
        0xb080..=0xb0ff => words(u32::from(first & 0x7f)),
        // MOV SP, Rm; ADD SP, Rm
        _ if matches!(first & 0xff87, 0x4685 | 0x4485) => StackUse::Unknown,
        // STMDB SP!; STR Rt, [SP, #-imm8]!; STRD [SP, #-imm8]!; VPUSH
        0xe92d => words(second.count_ones()),
        0xf84d if second & 0x0f00 == 0x0d00 => StackUse::Bytes(u32::from(second & 0xff)),
        0xe96d => words(u32::from(second & 0xff)),
        0xed2d => words(u32::from(second & 0xff)),
        // SUBW SP, SP, #imm12; SUB.W SP, SP, #const
        0xf2ad | 0xf6ad if to_stack_pointer => StackUse::Bytes(plain_constant(first, second)),
        0xf1ad | 0xf5ad if to_stack_pointer => StackUse::Bytes(modified_constant(first, second)),
        // ADDW and ADD.W of a constant raise it.
        0xf20d | 0xf60d | 0xf10d | 0xf50d if to_stack_pointer => StackUse::None,
        // Any other data processing with the stack pointer as destination.
        0xea00..=0xebff | 0xf000..=0xf7ff if to_stack_pointer && second & 0x8000 == 0 && writes(first) => {
            StackUse::Unknown
        }
        _ => StackUse::None,
    }
}

/// Data processing that has a destination: not the comparisons, whose destination field is 15 anyway.
fn writes(first: u16) -> bool {
    // MSR and MRS are in the same range and have no such field.
    first & 0xff80 != 0xf380 || first & 0x0040 == 0
}

/// i:imm3:imm8.
fn plain_constant(first: u16, second: u16) -> u32 {
    let (first, second) = (u32::from(first), u32::from(second));
    (first & 0x400) << 1 | (second & 0x7000) >> 4 | second & 0xff
}

/// ThumbExpandImm (ARM DDI 0403E, A5.3.2).
fn modified_constant(first: u16, second: u16) -> u32 {
    let encoded = plain_constant(first, second);
    let byte = encoded & 0xff;
    match encoded >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (0x80 | encoded & 0x7f).rotate_right(encoded >> 7),
    }
}

/// What every function takes, and whom it calls.
#[derive(Debug, Default)]
pub struct Frames {
    /// Bytes by the function's start; `None` where the stack pointer is set from a register.
    bytes: BTreeMap<u32, Option<u32>>,
    calls: BTreeMap<u32, BTreeSet<u32>>,
}

impl Frames {
    /// Counts an instruction of the function that starts at `function`. Each is to be told once.
    pub fn count(&mut self, function: u32, taken: StackUse) {
        let bytes = self.bytes.entry(function).or_insert(Some(0));
        *bytes = match taken {
            StackUse::None => *bytes,
            StackUse::Bytes(more) => bytes.map(|bytes| bytes + more),
            StackUse::Unknown => None,
        };
    }

    /// One function calls another, or goes on in it.
    pub fn call(&mut self, caller: u32, callee: u32) {
        self.calls.entry(caller).or_default().insert(callee);
    }

    /// The most that an exception handled by `entry` takes, with what the processor stores; `None` without a
    /// bound.
    pub fn deepest(&self, entry: u32) -> Option<u32> {
        Some(ENTRY_BYTES + self.below(entry, &mut Vec::new())?)
    }

    fn below(&self, function: u32, callers: &mut Vec<u32>) -> Option<u32> {
        if callers.contains(&function) {
            return None;
        }
        callers.push(function);
        let mut most = 0;
        for callee in self.calls.get(&function).into_iter().flatten() {
            most = most.max(self.below(*callee, callers)?);
        }
        callers.pop();
        // A function without any instruction that was seen takes nothing.
        let own = self.bytes.get(&function).copied().unwrap_or(Some(0))?;
        Some(own + most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_take_what_the_manual_says() {
        for (first, second, bytes) in [
            (0xb5f0, 0, 20),         // push {r4-r7, lr}
            (0xe92d, 0x0f00, 16),    // push.w {r8-r11}
            (0xb0d9, 0, 356),        // sub sp, #356
            (0xf5ad, 0x7d40, 768),   // sub.w sp, sp, #768
            (0xf6ad, 0x5d2c, 0xd2c), // subw sp, sp, #3372
            (0xf84d, 0xbd04, 4),     // str r11, [sp, #-4]!
            (0xed2d, 0x8b04, 16),    // vpush {d8, d9}
        ] {
            assert_eq!(stack_use(first, second), StackUse::Bytes(bytes), "{first:#06x} {second:#06x}");
        }
        for (first, second) in [(0x46bd, 0), (0x44ad, 0), (0xebad, 0x0d04)] {
            assert_eq!(stack_use(first, second), StackUse::Unknown, "{first:#06x} {second:#06x}");
        }
        // add sp, #356; add r7, sp, #12; pop {..}; cmp.w r1, #256
        for (first, second) in [(0xb059, 0), (0xaf03, 0), (0xbdf0, 0), (0xf5b1, 0x7f80), (0xf50d, 0x7d40)] {
            assert_eq!(stack_use(first, second), StackUse::None, "{first:#06x} {second:#06x}");
        }
    }

    #[test]
    fn the_deepest_chain_counts_and_a_recursion_has_no_bound() {
        let mut frames = Frames::default();
        for (function, bytes) in [(1, 100), (2, 40), (3, 8), (4, 60)] {
            frames.count(function, StackUse::Bytes(bytes));
        }
        for (caller, callee) in [(1, 2), (2, 3), (1, 4), (3, 5)] {
            frames.call(caller, callee);
        }
        assert_eq!(frames.deepest(1), Some(108 + 160));
        frames.count(3, StackUse::Bytes(20));
        assert_eq!(frames.deepest(1), Some(108 + 168));
        frames.call(3, 2);
        assert_eq!(frames.deepest(1), None, "a recursion");
        let mut unknown = Frames::default();
        unknown.count(1, StackUse::Unknown);
        unknown.count(1, StackUse::Bytes(4));
        assert_eq!(unknown.deepest(1), None);
    }
}
