//! Everything that can run between the entry of a function and its return.

use std::collections::{BTreeMap, BTreeSet};

use super::code::{Code, Function};
use super::stack::{Frames, StackUse, stack_use};
use super::thumb::{self, Flow, Hazard};

/// What was found at an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Finding {
    /// An instruction that needs an answer.
    Hazard(Hazard),
    /// A jump or call whose target is not in the instruction.
    Unresolved,
    /// No code there, or a table without a mark: the path cannot be followed.
    Lost,
    /// Control leaves the function over its last instruction.
    RunsOut,
}

/// All that one function can reach.
#[derive(Debug, Default)]
pub struct Reach {
    /// Start of every function, and that of the one it was first reached from (its own for the first).
    pub functions: BTreeMap<u32, u32>,
    /// What was found, by address.
    pub findings: BTreeSet<(u32, Finding)>,
    /// Number of different instructions.
    pub instructions: usize,
    /// What all of it takes of the stack.
    pub frames: Frames,
}

/// Follows all paths from the function `entry`.
pub fn follow(code: &Code, entry: &Function) -> Reach {
    let mut reach = Reach::default();
    reach.functions.insert(entry.start, entry.start);
    let mut waiting = vec![entry.start];
    while let Some(start) = waiting.pop() {
        let Some(function) = code.around(start).filter(|function| function.start == start) else {
            reach.findings.insert((start, Finding::Lost));
            continue;
        };
        let mut walk = Walk { code, function, seen: BTreeSet::new(), open: vec![(start, 0)] };
        while let Some((address, conditional)) = walk.open.pop() {
            if !walk.seen.insert((address, conditional)) {
                continue;
            }
            if let Err(finding) = walk.step(address, conditional, &mut reach, &mut waiting) {
                reach.findings.insert((address, finding));
            }
        }
        let addresses: BTreeSet<_> = walk.seen.iter().map(|(address, _)| *address).collect();
        reach.instructions += addresses.len();
        for address in addresses {
            let second = code.halfword(address + 2).unwrap_or_default();
            let taken = code.halfword(address).map_or(StackUse::None, |first| stack_use(first, second));
            reach.frames.count(start, taken);
        }
    }
    reach
}

/// The paths inside one function.
struct Walk<'a> {
    code: &'a Code,
    function: &'a Function,
    /// Addresses, each with how many instructions from there on are conditional.
    seen: BTreeSet<(u32, u8)>,
    open: Vec<(u32, u8)>,
}

impl Walk<'_> {
    fn step(
        &mut self,
        address: u32,
        conditional: u8,
        reach: &mut Reach,
        waiting: &mut Vec<u32>,
    ) -> Result<(), Finding> {
        if !self.holds(address) {
            return Err(Finding::RunsOut);
        }
        let first = self.code.halfword(address).ok_or(Finding::Lost)?;
        let second =
            if thumb::is_wide(first) { self.code.halfword(address + 2).ok_or(Finding::Lost)? } else { 0 };
        let instruction = thumb::decode(address, first, second);
        if let Some(hazard) = instruction.hazard {
            reach.findings.insert((address, Finding::Hazard(hazard)));
        }
        let behind = address + instruction.length;
        let left = conditional.saturating_sub(1);
        let goes_on = match instruction.flow {
            Flow::IfThen(count) => {
                self.open.push((behind, count));
                return Ok(());
            }
            Flow::Next => true,
            Flow::Call(target) => {
                self.enter(target, reach, waiting);
                true
            }
            Flow::Branch(target) => {
                self.go(target, reach, waiting);
                true
            }
            Flow::Jump(target) => {
                self.go(target, reach, waiting);
                false
            }
            Flow::Table { entry_bytes } => {
                for target in self.table(behind, entry_bytes)? {
                    self.go(target, reach, waiting);
                }
                false
            }
            Flow::Return | Flow::Trap => false,
            Flow::Unresolved => return Err(Finding::Unresolved),
        };
        // A conditional jump or return may not happen.
        if goes_on || conditional > 0 {
            self.open.push((behind, left));
        }
        Ok(())
    }

    /// Goes on at `target`: inside of the function, or in another one, which then returns in its place.
    fn go(&mut self, target: u32, reach: &mut Reach, waiting: &mut Vec<u32>) {
        if self.holds(target) {
            self.open.push((target, 0));
        } else {
            self.enter(target, reach, waiting);
        }
    }

    fn enter(&self, target: u32, reach: &mut Reach, waiting: &mut Vec<u32>) {
        reach.frames.call(self.function.start, target);
        reach.functions.entry(target).or_insert_with(|| {
            waiting.push(target);
            self.function.start
        });
    }

    fn holds(&self, address: u32) -> bool {
        (self.function.start..self.function.end).contains(&address)
    }

    /// The targets of the branch table at `start`: its entries up to the first that does not lead to code of
    /// this function. What fills the table up is zero, which leads to the table itself; constants may follow,
    /// and where they look like entries the check follows more than there is, never less.
    fn table(&self, start: u32, entry_bytes: u32) -> Result<Vec<u32>, Finding> {
        let entries = self.code.table_entries(start, entry_bytes).ok_or(Finding::Lost)?;
        let targets = entries.into_iter().map(|entry| start.wrapping_add(2 * entry));
        let targets: Vec<_> = targets
            .take_while(|target| self.holds(*target) && self.code.halfword(*target).is_some())
            .collect();
        if targets.is_empty() { Err(Finding::Lost) } else { Ok(targets) }
    }
}

#[cfg(test)]
#[path = "reach_tests.rs"]
mod tests;
