//! How many instructions an interrupt takes, counted one by one on the unmodified image.
//!
//! A breakpoint at the handler stops the CPU; from there it is stepped until the program status no longer names the
//! exception, or the handler starts anew. The serial interrupt alone may come between; its instructions are not counted. Others could not
//! preempt the handler. An instruction whose condition fails counts like on hardware, where it takes a cycle too.

use std::io::{Read, Write};
use std::time::Duration;

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
    /// [`RspError`] where the link fails, where the handler does not run within `limit` of wall-clock time, or where
    /// it does not return.
    pub fn measure<S: Read + Write>(
        self,
        client: &mut RspClient<S>,
        runs: usize,
        limit: Duration,
    ) -> Result<InterruptCost, RspError> {
        let mut cost = InterruptCost::default();
        for _ in 0..runs {
            client.break_at(self.entry)?;
            client.resume(limit)?;
            client.unbreak(self.entry)?;
            cost.instructions.push(step_through(client, self.entry)?);
        }
        Ok(cost)
    }
}

/// Steps from `entry` to the end of the exception that the CPU is in.
fn step_through<S: Read + Write>(client: &mut RspClient<S>, entry: u32) -> Result<u32, RspError> {
    let exception = client.register(PROGRAM_STATUS)? & EXCEPTION;
    let mut count = 0;
    let mut counted = exception;
    for _ in 1..=LIMIT {
        client.step(STEP_LIMIT)?;
        if counted == exception {
            count += 1;
        }
        // Stepping takes so long that the next tick may be due at the return; it then follows without a pause.
        let again = client.register(PC)? == entry;
        counted = client.register(PROGRAM_STATUS)? & EXCEPTION;
        if again || (counted != exception && counted != SERIAL) {
            return Ok(count);
        }
    }
    Err(RspError::Endless { instructions: LIMIT })
}
