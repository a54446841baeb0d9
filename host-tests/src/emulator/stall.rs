//! A core that stands still while time goes on: what the chip's does when it fetches code from a flash that
//! is being erased.
//!
//! The emulator's core cannot be stopped without its time. So it counts down in a loop of its own, interrupts
//! masked, in a corner of the memory that gets back what it held; nothing of the image runs meanwhile.

use std::io::{Read, Write};
use std::time::Duration;

use super::rsp::{RspClient, RspError};

/// The bottom of the main memory.
const CORNER: u32 = 0x2000_0000;
const PC: u8 = 15;
const PROGRAM_STATUS: u8 = 25;
/// `mrs r1, primask; cpsid i; subs r0, #1; bne .-2; msr primask, r1; nop`
const LOOP: [u16; 8] = [0xf3ef, 0x8110, 0xb672, 0x3801, 0xd1fd, 0xf381, 0x8810, 0xbf00];
/// Where the loop is over, from its beginning.
const OVER: u32 = 10;
/// Wall-clock limit for a second of the emulator's time.
const LIMIT: Duration = Duration::from_secs(60);

/// Lets `clocks` ns of the emulator's time pass, of which an instruction takes 2^`shift`.
pub(super) fn stall<S: Read + Write>(
    client: &mut RspClient<S>,
    clocks: u32,
    shift: u8,
) -> Result<(), RspError> {
    let kept = [0, 1, PROGRAM_STATUS, PC];
    let mut registers = [0; 4];
    for (value, number) in registers.iter_mut().zip(kept) {
        *value = client.register(number)?;
    }
    let memory = client.memory(CORNER, 2 * LOOP.len())?;
    let code: Vec<u8> = LOOP.into_iter().flat_map(u16::to_le_bytes).collect();
    client.write_block(CORNER, &code)?;
    // Two instructions per turn.
    client.set_register(0, (clocks >> (shift + 1)).max(1))?;
    client.set_register(PC, CORNER)?;
    client.break_at(CORNER + OVER)?;
    client.resume(LIMIT)?;
    client.unbreak(CORNER + OVER)?;
    // A single step takes no interrupt.
    client.step(LIMIT)?;
    client.write_block(CORNER, &memory)?;
    for (value, number) in registers.into_iter().zip(kept) {
        client.set_register(number, value)?;
    }
    Ok(())
}
