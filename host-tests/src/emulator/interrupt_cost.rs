//! How many instructions an interrupt takes, counted one by one on the unmodified image.
//!
//! A breakpoint at the handler stops the CPU; from there it is stepped until the program status no longer
//! names the exception, or the handler starts anew. The serial interrupt alone may come between; its
//! instructions are not counted. Others could not preempt the handler. An instruction whose condition fails
//! counts like on hardware, where it takes a cycle too.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::time::Duration;

use super::cycles::{CycleModel, Executed, base_register, is_wide};
use super::rsp::{RspClient, RspError};

const PC: u8 = 15;
const PROGRAM_STATUS: u8 = 25;
/// The exception number in the program status.
const EXCEPTION: u32 = 0x1ff;
/// USART1, number 37, in the program status.
const SERIAL: u32 = 16 + 37;
/// More than any tick takes; a handler that does not return ends here.
const LIMIT: u32 = 100_000;
/// Wall-clock limit for one instruction.
const STEP_LIMIT: Duration = Duration::from_secs(5);

/// The handler to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Handler {
    /// Its first instruction.
    pub entry: u32,
}

/// Counts of single runs of the handler.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InterruptCost {
    /// Instructions from the entry to the exception return, both included, in order of time.
    pub instructions: Vec<u32>,
    /// What the chip takes for them by [`CycleModel`].
    pub cycles: Vec<u32>,
}

impl InterruptCost {
    /// Smallest, median and largest count; `None` without any.
    pub fn summary(&self) -> Option<(u32, u32, u32)> {
        let mut sorted = self.instructions.clone();
        sorted.sort_unstable();
        Some((*sorted.first()?, *sorted.get(sorted.len() / 2)?, *sorted.last()?))
    }
}

impl Handler {
    /// Counts the instructions of the next `runs` runs. The CPU is stopped before and after.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails, where the handler does not run within `limit` of wall-clock time,
    /// or where it does not return.
    pub fn measure<S: Read + Write>(
        self,
        client: &mut RspClient<S>,
        runs: usize,
        limit: Duration,
    ) -> Result<InterruptCost, RspError> {
        let mut cost = InterruptCost::default();
        let mut code = Code::default();
        for _ in 0..runs {
            client.break_at(self.entry)?;
            client.resume(limit)?;
            client.unbreak(self.entry)?;
            let (instructions, cycles) = step_through(client, self.entry, &mut code)?;
            cost.instructions.push(instructions);
            cost.cycles.push(cycles);
        }
        Ok(cost)
    }
}

/// Halfwords of instructions, by address, as they were met.
#[derive(Debug, Default)]
struct Code(BTreeMap<u32, (u16, u16)>);

impl Code {
    fn at<S: Read + Write>(
        &mut self,
        client: &mut RspClient<S>,
        address: u32,
    ) -> Result<(u16, u16), RspError> {
        if let Some(known) = self.0.get(&address) {
            return Ok(*known);
        }
        let bytes = client.memory(address, 4)?;
        let half = |at: usize| {
            let pair = bytes.get(at..at + 2).and_then(|pair| pair.try_into().ok());
            pair.map_or(0, u16::from_le_bytes)
        };
        let halfwords = (half(0), half(2));
        self.0.insert(address, halfwords);
        Ok(halfwords)
    }
}

/// Steps from `entry` to the end of the exception that the CPU is in; instructions and cycles.
fn step_through<S: Read + Write>(
    client: &mut RspClient<S>,
    entry: u32,
    code: &mut Code,
) -> Result<(u32, u32), RspError> {
    let exception = client.register(PROGRAM_STATUS)? & EXCEPTION;
    let mut count = 0;
    let mut model = CycleModel::default();
    let mut counted = exception;
    let mut address = entry;
    for _ in 1..=LIMIT {
        let (first, second) = code.at(client, address)?;
        let base = match base_register(first, second) {
            Some(register) if counted == exception => Some(client.register(register)?),
            _ => None,
        };
        client.step(STEP_LIMIT)?;
        let next = client.register(PC)?;
        let now = client.register(PROGRAM_STATUS)? & EXCEPTION;
        if counted == exception {
            count += 1;
            // A serial byte between two instructions is no jump of the first.
            let behind = address + if is_wide(first) { 4 } else { 2 };
            let next = if now == SERIAL { behind } else { next };
            model.execute(Executed { address, first, second, base, next });
        }
        // Stepping takes so long that the next tick may be due at the return; it then follows without a
        // pause.
        let again = next == entry;
        counted = now;
        address = next;
        if again || (counted != exception && counted != SERIAL) {
            return Ok((count, model.cycles()));
        }
    }
    Err(RspError::Endless { instructions: LIMIT })
}
