//! How long interrupts can stay masked: the longest way from every `cpsid i` to the `cpsie i` or `msr
//! primask` that ends the section, in instructions, calls included.
//!
//! A way round a loop, one that leaves the function still masked, and one by a table or a register have no
//! bound here and are named with their function. A panic ends a way: it stops the machine.

use std::collections::BTreeMap;

use super::code::Code;
use super::thumb::{self, Flow};

/// `cpsid i` and `cpsie i`.
const MASK: u16 = 0xb672;
const UNMASK: u16 = 0xb662;
/// `msr primask, rN`, N in the lowest bits of the first half.
const RESTORE: (u16, u16) = (0xf380, 0x8810);

/// Why a section has no bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unbounded {
    /// There is a loop in it, or a recursion.
    Loop,
    /// The function can be left with interrupts masked.
    Leaves,
    /// A jump or call whose target is not in the instruction.
    Unresolved,
}

/// One place that masks interrupts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Where it begins.
    pub start: u32,
    /// The function it begins in.
    pub function: String,
    /// The most instructions, both ends included.
    pub bound: Result<u32, Unbounded>,
}

/// Every place of the image that masks interrupts.
pub fn sections(code: &Code) -> Vec<Section> {
    let mut found = Vec::new();
    for function in &code.functions {
        let places = (function.start..function.end).step_by(2).filter(|at| code.halfword(*at) == Some(MASK));
        for start in places.filter(|start| begins_an_instruction(code, function.start, *start)) {
            let bound = Walk::new(code, true).longest((start, 0));
            found.push(Section { start, function: function.names.join(" = "), bound });
        }
    }
    found
}

/// Whether a halfword is no second half, counted from the start of its function.
fn begins_an_instruction(code: &Code, function: u32, address: u32) -> bool {
    let mut at = function;
    while at < address {
        at += match code.halfword(at) {
            Some(first) if thumb::is_wide(first) => 4,
            _ => 2,
        };
    }
    at == address
}

/// An address, and how many instructions from there on are conditional.
type Place = (u32, u8);

struct Walk<'a> {
    code: &'a Code,
    /// The way here, in this function.
    within: Vec<Place>,
    /// The functions that were called on the way.
    calls: Vec<u32>,
    known: BTreeMap<Place, u32>,
    /// Whether the way ends where interrupts are unmasked, or, in a function that is called, where it
    /// returns.
    unmasking: bool,
}

impl<'a> Walk<'a> {
    fn new(code: &'a Code, unmasking: bool) -> Self {
        Self { code, within: Vec::new(), calls: Vec::new(), known: BTreeMap::new(), unmasking }
    }

    fn longest(&mut self, place: Place) -> Result<u32, Unbounded> {
        if let Some(known) = self.known.get(&place) {
            return Ok(*known);
        }
        if self.within.contains(&place) {
            return Err(Unbounded::Loop);
        }
        self.within.push(place);
        let length = self.from(place)?;
        self.within.pop();
        self.known.insert(place, length);
        Ok(length)
    }

    fn from(&mut self, (address, conditional): Place) -> Result<u32, Unbounded> {
        let first = self.code.halfword(address).ok_or(Unbounded::Unresolved)?;
        let second = match thumb::is_wide(first) {
            true => self.code.halfword(address + 2).ok_or(Unbounded::Unresolved)?,
            false => 0,
        };
        let ends = first == UNMASK || (first & !0xf, second) == RESTORE;
        if self.unmasking && ends {
            return Ok(1);
        }
        let instruction = thumb::decode(address, first, second);
        let behind = address + instruction.length;
        let next = (behind, conditional.saturating_sub(1));
        Ok(1 + match instruction.flow {
            Flow::Next => self.longest(next)?,
            Flow::IfThen(count) => self.longest((behind, count))?,
            // Over a `cpsie i`: only where interrupts were masked before, and then this is no section of its
            // own.
            Flow::Branch(target)
                if self.unmasking && target == behind + 2 && self.code.halfword(behind) == Some(UNMASK) =>
            {
                1
            }
            Flow::Branch(target) => self.longest(next)?.max(self.longest((target, 0))?),
            Flow::Jump(target) if conditional > 0 => self.longest(next)?.max(self.longest((target, 0))?),
            Flow::Jump(target) => self.longest((target, 0))?,
            Flow::Call(target) if self.stops_the_machine(target) => 0,
            Flow::Call(target) => self.through(target)? + self.longest(next)?,
            Flow::Return if self.unmasking => return Err(Unbounded::Leaves),
            Flow::Return if conditional > 0 => self.longest(next)?,
            Flow::Return | Flow::Trap => 0,
            Flow::Table { .. } | Flow::Unresolved => return Err(Unbounded::Unresolved),
        })
    }

    /// From the start of a function to its return.
    fn through(&mut self, function: u32) -> Result<u32, Unbounded> {
        if self.calls.contains(&function) {
            return Err(Unbounded::Loop);
        }
        let mut calls = self.calls.clone();
        calls.push(function);
        let mut walk = Walk { calls, ..Walk::new(self.code, false) };
        walk.longest((function, 0))
    }

    fn stops_the_machine(&self, target: u32) -> bool {
        let names = self.code.around(target).map(|function| function.names.iter());
        names.into_iter().flatten().any(|name| {
            ["core::panicking::", "unwrap_failed", "expect_failed", "rust_begin_unwind"]
                .iter()
                .any(|part| name.contains(part))
        })
    }
}

/// For people.
pub fn describe(sections: &[Section]) -> String {
    let bounded = sections.iter().filter_map(|section| section.bound.ok());
    let mut text = format!(
        "interrupts masked: {} places, {} of them for at most {} instructions on any path\n",
        sections.len(),
        bounded.clone().count(),
        bounded.max().unwrap_or_default()
    );
    for section in sections {
        let why = match section.bound {
            Ok(_) => continue,
            Err(Unbounded::Loop) => "loops",
            Err(Unbounded::Leaves) => "is left masked",
            Err(Unbounded::Unresolved) => "jumps by a table or register",
        };
        text += &format!("  not bounded, {why}: {:#010x} in {}\n", section.start, section.function);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const BASE: u32 = 0x0800_0000;
    const NOP: u16 = 0xbf00;
    const BX_LR: u16 = 0x4770;

    /// Functions one behind the other, by name and halfwords.
    fn bounds(functions: &[(&str, &[u16])]) -> Vec<Result<u32, Unbounded>> {
        let mut code = Code::default();
        let (mut content, mut listed) = (Vec::new(), Vec::new());
        for (name, halfwords) in functions {
            let start = BASE + content.len() as u32;
            content.extend(halfwords.iter().flat_map(|halfword| halfword.to_le_bytes()));
            listed.push((start, halfwords.len() as u32 * 2, (*name).to_owned()));
        }
        code.sections.push((BASE, content));
        code.set_functions(listed);
        sections(&code).into_iter().map(|section| section.bound).collect()
    }

    #[test]
    fn the_longer_branch_counts_and_either_end_ends_it() {
        // cpsid; beq over two; nop; nop; cpsie
        assert_eq!(bounds(&[("f", &[MASK, 0xd001, NOP, NOP, UNMASK, BX_LR])]), [Ok(5)]);
        assert_eq!(bounds(&[("f", &[MASK, NOP, RESTORE.0 | 3, RESTORE.1, BX_LR])]), [Ok(3)]);
        // beq over the cpsie: masked before.
        assert_eq!(bounds(&[("f", &[MASK, NOP, 0xd000, UNMASK, BX_LR])]), [Ok(4)]);
    }

    #[test]
    fn a_called_function_counts_and_one_that_panics_ends_the_way() {
        // bl to the function behind, two halfwords on.
        let f = [MASK, 0xf000, 0xf802, UNMASK, BX_LR];
        assert_eq!(bounds(&[("f", &f), ("g", &[NOP, NOP, BX_LR])]), [Ok(6)]);
        assert_eq!(bounds(&[("f", &f), ("core::panicking::panic", &[0xe7fe])]), [Ok(2)]);
    }

    #[test]
    fn what_has_no_bound_says_why() {
        assert_eq!(bounds(&[("f", &[MASK, NOP, 0xd1fd, UNMASK, BX_LR])]), [Err(Unbounded::Loop)]);
        assert_eq!(bounds(&[("f", &[MASK, NOP, BX_LR])]), [Err(Unbounded::Leaves)]);
        assert_eq!(bounds(&[("f", &[MASK, 0x4798, UNMASK, BX_LR])]), [Err(Unbounded::Unresolved)]);
        // A recursion: bl to its own start.
        let f = [MASK, 0xf000, 0xf802, UNMASK, BX_LR];
        assert_eq!(bounds(&[("f", &f), ("g", &[0xf7ff, 0xfffe, BX_LR])]), [Err(Unbounded::Loop)]);
    }
}
